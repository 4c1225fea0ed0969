from dataclasses import replace

import numpy as np
import pytest

from builders import recording
from ccmodel.diagnose.location import PARTS, parts_of
from ccmodel.diagnose.whitening import LOOKS, weigh, weighed_about
from ccmodel.inference.problem import Observations
from ccmodel.model.general import Active
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import ModelInput, simulate

PARAMETERS = Parameters(9000.0, 1.2, 0.15, 0.006, 0.006, 0.05)


@pytest.fixture(scope="module")
def weighed():
    drive = recording(theta_in_rad=lambda t: 0.6 * np.sin(2 * np.pi * np.clip(t - 0.3, 0, None)))
    said = simulate(ModelInput.of(drive), PARAMETERS)
    measured = replace(
        said,
        origin="virtual-rig",
        derived_from=dict.fromkeys(said.channels, "made by hand"),
        accuracy={"tau_in_Nm": 1e-4, "tau_out_Nm": 1e-4, "F_drive_N": 0.1, "F_load_N": 0.1, "theta_out_rad": 1e-3},
        rest_s=0.3,
    )
    return weigh(Observations.of(measured, PARAMETERS), PARAMETERS)


def test_what_differs_from_run_to_run_is_shrunk_to_one_deviation(weighed):
    """The covariance is I + N N'; along a direction of N with singular value s whitening divides by sqrt(1 + s^2)."""
    s = np.sqrt(1 / (1 - weighed.shrink) ** 2 - 1)
    for k in range(s.size):
        likely = s[k] * weighed.directions[:, k]
        assert np.linalg.norm(weighed.whitened(likely)) == pytest.approx(s[k] / np.hypot(1, s[k]), rel=1e-9)
        assert np.linalg.norm(weighed.whitened(likely)) < 1


def test_what_no_run_to_run_difference_makes_is_left_as_it_is(weighed):
    random = np.random.default_rng(0).standard_normal(weighed.directions.shape[0])
    across = random - weighed.directions @ (weighed.directions.T @ random)
    assert weighed.whitened(across) == pytest.approx(across, abs=1e-12)


def test_a_per_cent_of_friction_is_no_evidence_and_ten_are(weighed):
    e = weighed.observations
    errors = {
        share: np.sum(weighed.whitened(e.errors({"friction_coefficient": 0.15 * (1 + share)}).ravel()) ** 2)
        for share in (0.01, 0.1)
    }
    assert errors[0.01] < 1.5
    assert errors[0.1] > 50


def test_where_in_its_gap_the_load_rests_is_no_evidence_where_no_torque_holds_it(weighed):
    gap = Active("backlash", "load-pulley", {"half_gap": 0.02})
    with_gap = replace(PARAMETERS, mechanisms=(gap,))
    by_gap = weigh(weighed.observations, with_gap)
    moved = by_gap.acting(with_gap).observations.errors({"load_gap_position": 0.5}) - by_gap.acting(
        with_gap
    ).observations.errors({})
    assert np.sum(weighed.whitened(moved.ravel()) ** 2) > 50
    assert np.sum(by_gap.whitened(moved.ravel()) ** 2) < 3


@pytest.mark.parametrize("place", [-1.0, 0.0, 1.0])
def test_a_load_is_found_where_in_its_gap_it_rested(weighed, place):
    gap = Active("backlash", "load-pulley", {"half_gap": 0.02})
    there = replace(PARAMETERS, mechanisms=(gap,), load_gap_position=place)
    e = weighed.observations
    recorded = replace(weighed, observations=replace(e, measured=replace(e, parameters=there).modelled({})))
    found = weighed_about(recorded, replace(there, load_gap_position=0.0))
    assert found.observations.parameters == replace(PARAMETERS, load_gap_position=place)


def test_parts_of_a_motion(weighed):
    given = weighed.observations.given
    part, t = parts_of(given), given.recording.time_s
    assert (part[t < 0.28] == PARTS.index("at rest")).all()
    top = np.argmin(np.abs(t - 0.55))
    assert part[top + 3] == PARTS.index("after a reversal")
    assert part[top + 22] == PARTS.index("under way")


def test_what_differs_more_than_runs_do_is_counted_as_a_look_of_its_own(weighed):
    """Lost among the samples: friction a tenth higher, or a zero off by three accuracies, are one number each."""
    e = weighed.observations
    rows_a_look = e.measured.shape[1] / LOOKS
    for values, row, size in (
        ({"friction_coefficient": 0.15 * 1.1}, 0, 10.0),
        ({"F_load_zero_N": 0.3}, 4, 3.0),
        ({}, 0, 0.0),
    ):
        errors = e.errors(values).ravel()
        counted = weighed.counted(errors)
        assert counted[: errors.size] == pytest.approx(weighed.whitened(errors))
        found = counted[errors.size :] / np.sqrt(rows_a_look)
        assert found[row] == pytest.approx(size, rel=0.15, abs=0.1)
        assert np.abs(np.delete(found, row)).max() < 0.15 * size + 0.1
