"""What measured recordings of an instrument need: a jaw whose torque is measured, no rest, no load cells."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from builders import recording
from ccmodel.api.options import diagnosis_options
from ccmodel.cli.options import tolerance_of
from ccmodel.config import Config, load_config
from ccmodel.diagnosis import candidate
from ccmodel.diagnosis.calibration import calibration
from ccmodel.diagnosis.candidate import best_start, fit, starting_points
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.observations import first_cycles
from ccmodel.diagnosis.repeatability import estimated_tolerance
from ccmodel.diagnosis.selection import Selection
from ccmodel.diagnosis.verdict import judge
from ccmodel.diagnosis.whitening import Whitened
from ccmodel.failure import ModelError
from ccmodel.inference.least_squares import Solution
from ccmodel.inference.observations import Observations
from ccmodel.inference.problem import Free, Problem
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import ModelInput, simulate
from ccmodel.typed import InputError

TRUE = Parameters(20000.0, 1.2, 0.15, 0.006, 0.006, spring_beside_load_Nm_per_rad=0.02, pretension_share=0.2)
CHANNELS = ("theta_out_rad", "tau_in_Nm")


def jaw(load_Nm, id="r", pretension_N=7.0, **extra):
    """A recording of `TRUE` against a torque that stays nearly the same, without noise."""
    drive = recording(
        id=id, pretension_N=pretension_N, tau_out_Nm=lambda t: load_Nm + 0.002 * np.sin(2 * np.pi * t), settled_s=1.0
    )
    said = simulate(ModelInput.of(drive), TRUE)
    measured = {c: said[c] for c in CHANNELS} | {c: drive[c] for c in ("theta_in_rad", "tau_out_Nm")}
    made = drive.with_channels(measured, dict.fromkeys(measured, "made by hand"), "rig")
    return replace(made, **extra)


def whitened(recorded, sigma=(1e-3, 1e-4)):
    e = Observations.of(recorded, replace(TRUE, spring_beside_load_Nm_per_rad=0.0), CHANNELS, step_s=0.02)
    e = replace(e, sigma=np.repeat(np.array(sigma)[:, None], e.measured.shape[1], axis=1))
    rows = e.measured.size
    floor = dict(zip(e.channels, sigma, strict=True))
    none = np.zeros((rows, 1))
    friction = (("friction_coefficient", TRUE.friction_coefficient, 0.01 * TRUE.friction_coefficient),)
    return Whitened(e, none, np.zeros(1), np.zeros((1, rows)), np.zeros(1), floor, friction, none)


def test_a_fit_finds_pretension_friction_and_spring_without_a_rest():
    """From ten times the pretension, where no cable ever goes slack; two recordings were aimed at two pretensions."""
    batch = [whitened(jaw(load, str(k), T)) for k, (load, T) in enumerate(((-0.005, 7.0), (-0.04, 9.0)))]
    free = {
        "pretension_share": Free(2.0, 0.01, 100.0),
        "friction_coefficient": Free(0.15, 0.01, 1.0),
        "spring_beside_load_Nm_per_rad": Free(0.01, 0.0, 1.0),
    }
    found = fit(batch, Hypothesis(), free, {name: f.start for name, f in free.items()})
    assert found.values["pretension_share"] == pytest.approx(0.2, rel=0.02)
    assert found.values["friction_coefficient"] == pytest.approx(0.15, rel=0.02)
    assert found.values["spring_beside_load_Nm_per_rad"] == pytest.approx(0.02, rel=0.05)


def test_the_spring_beside_the_load_is_asked_for_only_where_the_load_was_measured():
    e = whitened(jaw(-0.01)).observations
    assert "spring_beside_load_Nm_per_rad" in calibration(e.parameters, [e])
    assert "spring_beside_load_Nm_per_rad" not in calibration(replace(e.parameters, load_stiffness_Nm_per_rad=0.1), [e])


def test_a_rest_before_the_start_up_transient_says_nothing_of_the_jaws_zero():
    """The model's angle goes to the mean of what is judged, as without any rest."""
    shifted = jaw(-0.01, rest_s=0.05)
    shifted = replace(shifted, channels=dict(shifted.channels, theta_out_rad=shifted["theta_out_rad"] + 0.3))
    said = simulate(ModelInput.of(shifted), TRUE)
    judged = shifted.time_s >= shifted.settled_s
    assert said["theta_out_rad"][judged] == pytest.approx(shifted["theta_out_rad"][judged], abs=1e-3)


def test_so_many_cycles_of_a_sine_are_compared_and_all_of_anything_else():
    r = jaw(-0.01, excitation={"wave": "sine", "frequency_Hz": 2.0})
    assert first_cycles(r, 3).time_s[-1] == pytest.approx(1.0 + 3 / 2.0)
    assert first_cycles(r, None) is r
    steps = jaw(-0.01, excitation={"wave": "steps", "frequency_Hz": 2.0})
    assert first_cycles(steps, 3) is steps


def test_a_forced_candidate_is_fitted_whatever_its_screening_score():
    batch = [whitened(jaw(load, str(k))) for k, load in enumerate((-0.004, -0.008))]
    free = {"friction_coefficient": Free(0.15, 0.01, 1.0), "spring_beside_load_Nm_per_rad": Free(0.02, 0.0, 1.0)}
    base = fit(batch, Hypothesis(), free, {name: f.start for name, f in free.items()})
    forced = Hypothesis((("pulley-friction", "drive-pulley"),))
    found = judge(*Selection(free, [], [forced]).run(batch, base))
    assert [c.hypothesis for c in found.candidates] == [forced]
    assert found.nearest is found.candidates[0]
    assert judge(*Selection(free, []).run(batch, base)).nearest is None


@pytest.mark.parametrize(
    "forced_candidates, said",
    [
        ([["friction"]], "there is no mechanism 'friction'"),
        ([["presliding at load"]], "'presliding at load' is at none of its places; state 'presliding at conduit'"),
        ([[]], "one to 4 mechanisms"),
    ],
)
def test_a_forced_candidate_that_is_not_known_is_refused(forced_candidates, said):
    with pytest.raises(ValueError, match=said):
        Config(diagnosing={"forced_candidates": forced_candidates})


def test_a_channel_has_one_tolerance():
    with pytest.raises(InputError, match="one share for a channel"):
        tolerance_of(["tau_in_Nm=0.02", "tau_in_Nm=0.3"])


def test_a_tolerance_may_differ_by_channel():
    recorded = jaw(-0.01)
    plain, allowing = (
        Observations.of(recorded, TRUE, CHANNELS, step_s=0.02, tolerance=a) for a in (0.0, {"tau_in_Nm": 0.1})
    )
    angle, torque = (allowing.channels.index(c) for c in CHANNELS)
    allowed = 0.1 * np.ptp(plain.measured[torque])
    assert allowing.sigma[angle] == pytest.approx(plain.sigma[angle])
    assert allowing.sigma[torque] == pytest.approx(np.hypot(plain.sigma[torque], allowed))
    assert allowing.tolerance_share == pytest.approx(np.mean((allowed / allowing.sigma[torque]) ** 2) / 2)
    assert allowing.without("tau_in_Nm").tolerance_share == 0
    every = Observations.of(recorded, TRUE, CHANNELS, step_s=0.02, tolerance=0.1)
    assert every.sigma[torque] == pytest.approx(allowing.sigma[torque])


def test_a_tolerance_may_be_replaced_in_some_channels():
    recorded = jaw(-0.01)
    stated, wanted = (
        Observations.of(recorded, TRUE, CHANNELS, step_s=0.02, tolerance={"theta_out_rad": 0.02, "tau_in_Nm": torque})
        for torque in (0.1, 0.04)
    )
    found = stated.with_tolerance({"tau_in_Nm": 0.04})
    assert found.sigma == pytest.approx(wanted.sigma)
    assert found.tolerance.tolist() == wanted.tolerance.tolist()
    assert found.tolerance_shares == pytest.approx(wanted.tolerance_shares)


def test_a_tolerance_is_estimated_from_what_a_model_leaves_and_never_rises():
    o = Observations.of(jaw(-0.01), TRUE, CHANNELS, step_s=0.02, tolerance={"tau_in_Nm": 0.1})
    whitened = [SimpleNamespace(observations=o)] * 3
    (share,) = o.tolerance_shares[[c == "tau_in_Nm" for c in o.channels]]
    # The variance of the noise is 1 - share of the whole; the model leaves this and half of the rest.
    left = {"theta_out_rad": 0.5, "tau_in_Nm": 1 - share + 0.5 * share}
    assert estimated_tolerance(whitened, left) == pytest.approx({"tau_in_Nm": 0.1 * np.sqrt(0.5)})
    for more, expected in ((1.7, 0.1), (0.5 * (1 - share), 0.0)):
        assert estimated_tolerance(whitened, left | {"tau_in_Nm": more}) == pytest.approx({"tau_in_Nm": expected})


@pytest.mark.parametrize(
    "stated, said",
    [
        (["0.9"], "less than 0.5"),
        (["much"], "a share is a number"),
        (["tau=0.1"], "a channel is one of .* got 'tau'"),
        (["0.1", "tau_in_Nm=0.1"], "a share without a channel"),
        (["tau_in_Nm=0.9"], "less than 0.5"),
    ],
)
def test_a_tolerance_that_cannot_be_used_is_refused(stated, said):
    with pytest.raises(InputError, match=f"tolerance: .*{said}"):
        diagnosis_options(tolerance_of(stated))


def test_the_configuration_for_the_public_recordings_says_how_they_would_be_diagnosed():
    config = load_config(Path(__file__).parents[2] / "config" / "real.yaml")
    assert all(0 < share < 0.05 for share in config.diagnosing.tolerance.values())
    assert not config.diagnosing.forced_candidates


def test_a_fit_starts_from_a_slack_cable_too_where_the_initial_tension_is_not_observed():
    free = {"friction_coefficient": Free(2.0, 0.0, 5.0), "pretension_share": Free(10.0, 3.0, 50.0)}
    taut, slack = starting_points(Problem([], free))
    assert taut == pytest.approx([2.0, 10.0])
    assert slack == pytest.approx([2.0, 2.0])
    assert len(starting_points(Problem([], {"friction_coefficient": Free(2.0)}))) == 1


def test_a_fit_that_goes_on_starts_from_another_calibration_in_place_of_a_slack_cable():
    free = {"friction_coefficient": Free(2.0, 0.0, 5.0), "pretension_share": Free(10.0, 3.0, 50.0)}
    own, other = starting_points(Problem([], free), {"pretension_share": 4.0, "stiffness_N_per_m": 1e4})
    assert own == pytest.approx([2.0, 10.0])
    assert other == pytest.approx([2.0, 4.0])
    for same in ({}, {"pretension_share": 10.0}):
        assert len(starting_points(Problem([], free), same)) == 1
    assert len(starting_points(Problem([], {"friction_coefficient": Free(2.0)}), {"friction_coefficient": 3.0})) == 1


def test_the_better_start_is_taken_and_one_that_cannot_be_run_only_if_none_can(monkeypatch):
    def minimise(problem, x, how):
        if x < 0:
            raise ModelError("cannot be run")
        return Solution(x, abs(x - 3.0), [], None, "", 1)

    monkeypatch.setattr(candidate, "minimise", minimise)
    assert best_start(None, [-1.0, 7.0, 2.0]).x == 2.0
    with pytest.raises(ModelError):
        best_start(None, [-1.0])
