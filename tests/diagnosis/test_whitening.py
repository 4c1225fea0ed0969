"""The covariance of a recording's errors, and the nuisances in it."""

from dataclasses import replace

import numpy as np
import pytest

from builders import recording
from ccmodel.diagnosis.location import PHASES, phases_of
from ccmodel.diagnosis.whitening import relinearised, whiten
from ccmodel.inference.effective_samples import IN_DIAGNOSIS
from ccmodel.inference.observations import Observations
from ccmodel.model.general import Active
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import ModelInput, simulate

PARAMETERS = Parameters(9000.0, 1.2, 0.15, 0.006, 0.006, 0.05)


@pytest.fixture(scope="module")
def whitened():
    drive = recording(theta_in_rad=lambda t: 0.6 * np.sin(2 * np.pi * np.clip(t - 0.3, 0, None)))
    simulated = simulate(ModelInput.of(drive), PARAMETERS)
    measured = replace(
        simulated,
        origin="virtual-rig",
        derived_from=dict.fromkeys(simulated.channels, "made by hand"),
        accuracy={"tau_in_Nm": 1e-4, "tau_out_Nm": 1e-4, "F_drive_N": 0.1, "F_load_N": 0.1, "theta_out_rad": 1e-3},
        rest_s=0.3,
    )
    o = Observations.of(measured, PARAMETERS)
    # The recording has no noise; these are its sensors' standard deviations.
    sd = {"theta_out_rad": 1e-3, "tau_in_Nm": 1e-4, "tau_out_Nm": 1e-4, "F_drive_N": 0.05, "F_load_N": 0.05}
    sigma = np.repeat([[sd[c]] for c in o.channels], o.measured.shape[1], axis=1)
    return whiten(replace(o, sigma=sigma), PARAMETERS)


def test_nuisances_are_shrunk_to_one_standard_deviation(whitened):
    """The covariance is I + N N'; along a direction of N with singular value s whitening divides by sqrt(1 + s^2)."""
    s = np.sqrt(1 / (1 - whitened.shrinkage) ** 2 - 1)
    for k in range(s.size):
        likely = s[k] * whitened.directions[:, k]
        assert np.linalg.norm(whitened.whiten(likely)) == pytest.approx(s[k] / np.hypot(1, s[k]), rel=1e-9)
        assert np.linalg.norm(whitened.whiten(likely)) < 1


def test_errors_across_the_nuisances_stay_unchanged(whitened):
    random = np.random.default_rng(0).standard_normal(whitened.directions.shape[0])
    across = random - whitened.directions @ (whitened.directions.T @ random)
    assert whitened.whiten(across) == pytest.approx(across, abs=1e-12)


def test_one_per_cent_of_friction_is_a_nuisance_and_ten_are_not(whitened):
    e = whitened.observations
    errors = {
        share: np.sum(whitened.whiten(e.errors({"friction_coefficient": 0.15 * (1 + share)}).ravel()) ** 2)
        for share in (0.01, 0.1)
    }
    assert errors[0.01] < 1.5
    assert errors[0.1] > 50


def test_friction_that_builds_up_within_a_micrometre_is_a_nuisance_and_presliding_is_not(whitened):
    def with_presliding(z0):
        return replace(PARAMETERS, mechanisms=(Active("presliding", "conduit", {"z0": z0, "spread": 4.0}),))

    def left(z0, by=whitened):
        errors = whitened.observations.with_parameters(with_presliding(z0)).errors({}).ravel()
        return np.sum(by.whiten(errors) ** 2)

    rigid = whiten(whitened.observations, with_presliding(1e-8))
    assert left(5e-7, rigid) > 20
    assert left(5e-7) < 3
    # A longer one has another effect: after whitening, the shortest presliding of the list is still significant.
    assert left(5e-6) > 50


def test_the_loads_position_in_its_gap_is_a_nuisance(whitened):
    gap = Active("backlash", "load-pulley", {"half_gap": 0.02})
    with_gap = replace(PARAMETERS, mechanisms=(gap,))
    by_gap = whiten(whitened.observations, with_gap)
    moved = by_gap.with_parameters(with_gap).observations.errors({"load_gap_position": 0.5}) - by_gap.with_parameters(
        with_gap
    ).observations.errors({})
    assert np.sum(whitened.whiten(moved.ravel()) ** 2) > 50
    assert np.sum(by_gap.whiten(moved.ravel()) ** 2) < 3


@pytest.mark.parametrize("place", [-1.0, 0.0, 1.0])
def test_the_loads_position_in_its_gap_is_found(whitened, place):
    gap = Active("backlash", "load-pulley", {"half_gap": 0.02})
    there = replace(PARAMETERS, mechanisms=(gap,), load_gap_position=place)
    e = whitened.observations
    recorded = replace(whitened, observations=replace(e, measured=replace(e, parameters=there).modelled({})))
    found = relinearised(recorded, replace(there, load_gap_position=0.0))
    assert found.observations.parameters == replace(PARAMETERS, load_gap_position=place)


def test_phases_of_a_motion(whitened):
    given = whitened.observations.given
    part, t = phases_of(given), given.recording.time_s
    assert (part[t < 0.28] == PHASES.index("at rest")).all()
    top = np.argmin(np.abs(t - 0.55))
    assert part[top + 3] == PHASES.index("after a reversal")
    assert part[top + 22] == PHASES.index("under way")


def test_a_nuisance_beyond_its_prior_counts_as_one_effective_sample(whitened):
    """Lost among the samples: friction a tenth higher, or a zero off by three accuracies, are one number each."""
    e = whitened.observations
    rows_per_sample = e.measured.shape[1] / IN_DIAGNOSIS
    for values, row, size in (
        ({"friction_coefficient": 0.15 * 1.1}, 0, 10.0),
        ({"F_load_zero_N": 0.3}, 4, 3.0),
        ({}, 0, 0.0),
    ):
        errors = e.errors(values).ravel()
        counted = whitened.with_nuisances(errors)
        assert counted[: errors.size] == pytest.approx(whitened.whiten(errors))
        found = counted[errors.size :] / np.sqrt(rows_per_sample)
        assert found[row] == pytest.approx(size, rel=0.15, abs=0.1)
        assert np.abs(np.delete(found, row)).max() < 0.15 * size + 0.1


def test_a_recording_is_linearised_about_its_own_initial_tensions(whitened):
    """With much friction the instant at which a cable slips depends on them, and is far from linear."""
    strong = replace(PARAMETERS, friction_coefficient=0.5)
    o = whitened.observations.with_parameters(strong)
    curved = replace(strong, tension_curvature_A=0.25, tension_curvature_B=-0.2)
    once = whiten(replace(o, measured=o.with_parameters(curved).modelled({})), strong)
    again = relinearised(once, strong)
    before, after = (np.mean(w.whiten(w.linearised_errors({})) ** 2) for w in (once, again))
    assert after < 0.1 * before
    found = again.own_values({})
    assert found["tension_curvature_A"] == pytest.approx(0.25, abs=0.02)
    assert found["tension_curvature_B"] == pytest.approx(-0.2, abs=0.02)


def test_its_own_initial_tensions_do_not_move_their_prior(whitened):
    """A curvature of two standard deviations costs as much wherever the errors are linearised."""
    curved = replace(PARAMETERS, tension_curvature_A=0.3)
    o = whitened.observations
    once = replace(whitened, observations=replace(o, measured=o.with_parameters(curved).modelled({})))
    again = relinearised(once, PARAMETERS)
    assert again.own["tension_curvature_A"] > 0.2
    assert again.scalar_nuisances == once.scalar_nuisances
    deviations = [np.abs(w.errors({})[o.measured.size :]).max() for w in (once, again)]
    assert deviations[1] == pytest.approx(deviations[0], rel=0.1)
