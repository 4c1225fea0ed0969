"""The experiment that separates candidate models."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ccmodel import mechanisms as registry
from ccmodel.diagnosis import experiment as experiment_module
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.drive import speed
from ccmodel.diagnosis.experiment import (
    experiments,
    load_as_recorded,
    motions,
    planned_observations,
    proposed,
    recordings_wanted,
    separation,
)
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.settings import EXPERIMENT_RATE_HZ
from ccmodel.diagnosis.verdict import Judgement
from ccmodel.inference.problem import Free
from made_observations import PARAMETERS, batch

VALUES = {"stiffness_N_per_m": 9000.0, "friction_coefficient": 0.15, "load_stiffness_Nm_per_rad": 0.05}
FREE = {name: Free(value, value / 10, value * 10) for name, value in VALUES.items()}
KNOWN_TO = 0.01  # of itself, each value


def fitted(recordings, *acting, known_to=KNOWN_TO, **numbers):
    values = VALUES | numbers
    covariance = np.diag([(known_to * value) ** 2 for value in values.values()])
    residuals = [np.ones(w.observations.measured.size) for w in recordings]
    return CandidateFit(Hypothesis(acting), [], FREE, values, [], [], covariance, np.ones(len(values)), [], residuals)


def judged(recordings, *rivals, of_base=0.0):
    shares = [(1 - of_base) / len(rivals)] * len(rivals)
    found = SimpleNamespace(whitened=recordings, base=fitted(recordings), probability_of_base=of_base)
    return Judgement("undecided", rivals[0], found, list(rivals), shares, [])


def test_it_is_within_what_the_rig_has_done():
    recordings = batch()
    largest = max(np.ptp(w.observations.given.theta_in) / 2 for w in recordings)
    bends = {w.observations.given.recording.path.bend_rad for w in recordings}
    for experiment in experiments(recordings):
        assert np.abs(experiment.theta_in).max() <= largest * (1 + 1e-9)
        assert 0 < experiment.pretension_share <= 1
        assert experiment.like.path.bend_rad in bends
        assert experiment.like.pretension_N == max(w.observations.given.recording.pretension_N for w in recordings)


@pytest.mark.parametrize("fastest", [0.5, 3.0])
def test_no_motion_is_faster_than_the_rig(fastest):
    for text, _, theta in motions(0.6, fastest):
        assert np.abs(np.diff(theta)).max() * EXPERIMENT_RATE_HZ < fastest * 1.05, text
        assert theta[0] == 0.0


def test_slow_and_fast_friction_are_told_apart_by_speed():
    """Viscous friction that looks like a bearing at the one speed recorded: at another speed they part."""
    recordings = batch()
    numbers = {"friction_torque": 2e-3, "presliding": 2e-3, "share": 0.0}
    bearing = {f"pulley-friction/drive-pulley/{name}": value for name, value in numbers.items()}
    viscous = {"viscous-friction/conduit/c": 30.0, "viscous-friction/conduit/power": 1.0}
    rivals = [
        fitted(recordings, ("viscous-friction", "conduit"), **viscous),
        fitted(recordings, ("pulley-friction", "drive-pulley"), **bearing),
    ]
    found = proposed(judged(recordings, *rivals), PARAMETERS)
    assert found["separates"] == ["viscous-friction", "pulley-friction"]
    assert "Hz" in found["text"]
    asked = found["recording"]
    assert asked["excitation"]["wave"] in found["text"] or "nested" in found["text"]
    assert asked["recordings"] >= 1
    assert asked["bend_rad"] in {w.observations.given.recording.path.bend_rad for w in recordings}
    highest_N = max(w.observations.given.recording.pretension_N for w in recordings)
    assert asked["pretension_N"] / highest_N == pytest.approx(1.0) or asked["pretension_N"] / highest_N < 0.5


@pytest.mark.parametrize("of_base", [0.0, 0.45])
def test_candidates_are_told_from_the_calibrated_model_if_that_may_be_all(monkeypatch, of_base):
    recordings, planned = batch(), []
    rivals = [fitted(recordings, one) for one in (("kink", "conduit"), ("stribeck", "conduit"))]
    monkeypatch.setattr(
        experiment_module, "planned_observations", lambda e, c, *rest: planned.append(c.hypothesis.names)
    )
    monkeypatch.setattr(experiment_module, "separation", lambda *given: 0.0)
    assert proposed(judged(recordings, *rivals, of_base=of_base), PARAMETERS) is None
    assert set(planned) == {("kink",), ("stribeck",), *([()] if of_base else [])}


def test_a_learned_law_is_told_from_the_same_law_of_another_argument(monkeypatch):
    """Not from one of another slot, nor from the same argument with more knots."""
    recordings, planned = batch(), []
    names = (
        "learned-sliding-friction-by-direction",
        "learned-sliding-friction-by-tension",
        "learned-sliding-friction-by-tension-fine",
        "learned-cable-stretch-by-tension",
    )
    rivals = [fitted(recordings, (name, registry.get(name).places[0])) for name in names]
    found = replace(judged(recordings, *rivals), verdict="learned")
    found.comparison.log_weight = lambda candidate: np.log(1 / len(rivals))
    monkeypatch.setattr(
        experiment_module, "planned_observations", lambda e, c, *rest: planned.append(c.hypothesis.names)
    )
    monkeypatch.setattr(experiment_module, "separation", lambda *given: 1.0)
    said = proposed(found, PARAMETERS)
    assert said["separates"] == ["sliding-friction by direction", "sliding-friction by tension"]
    assert set(planned) == {(names[0],), (names[1],)}


@pytest.mark.parametrize(("apart", "is_said"), [(1.0, False), (0.02, True)])
def test_a_lab_is_told_where_a_few_recordings_are_unlikely_to_decide(monkeypatch, apart, is_said):
    recordings = batch()
    rivals = [fitted(recordings, one) for one in (("kink", "conduit"), ("stribeck", "conduit"))]
    monkeypatch.setattr(experiment_module, "planned_observations", lambda *given: None)
    monkeypatch.setattr(experiment_module, "separation", lambda *given: apart)
    text = proposed(judged(recordings, *rivals), PARAMETERS)["text"]
    assert ("a few recordings are unlikely to decide" in text) == is_said


def test_a_load_that_was_measured_is_taken_as_in_the_recordings():
    """A torque that follows the drive's angle and direction does so in another motion, and the models can be run."""
    recordings = batch()
    made = []
    for w in recordings:
        g = w.observations.given
        tau = 0.02 * g.theta_in + 0.003 * np.tanh(speed(g) / 0.05) + 0.001
        made.append(replace(g, tau_out=tau))
    theta = 0.3 * np.sin(np.linspace(0, 6, 1250))
    load = load_as_recorded(made)(theta)
    rate = np.gradient(theta) * EXPERIMENT_RATE_HZ
    moving = np.abs(rate) > 0.2
    assert load["tau_out"][moving] == pytest.approx((0.02 * theta + 0.003 * np.sign(rate) + 0.001)[moving], abs=5e-4)
    experiment = replace(experiments(recordings)[0], load=load_as_recorded(made)(experiments(recordings)[0].theta_in))
    free_load = replace(PARAMETERS, load_stiffness_Nm_per_rad=None)
    base = fitted(recordings)
    values = {k: v for k, v in base.values.items() if not k.startswith("load_stiffness")}
    base = replace(base, values=values)
    planned = planned_observations(experiment, base, recordings[0].observations, free_load)
    assert np.isfinite(planned.errors({})).all()


def test_recordings_are_asked_for_until_one_rival_leads():
    """The odds of a comparison: exp(n d^2 / 2) with 20 effective samples a channel and recording."""
    assert recordings_wanted(1.0, 5) == 1
    for apart in (0.05, 0.1):
        n = recordings_wanted(apart, 5)
        assert np.exp(0.5 * 20 * 5 * n * apart**2) >= 20 > np.exp(0.5 * 20 * 5 * (n - 1) * apart**2)


@pytest.mark.parametrize("known_to, apart", [(0.5, False), (1e-5, True)])
def test_a_difference_that_a_refit_takes_up_tells_nothing_separation(known_to, apart):
    """Two rivals that are one, but for a stiffness that the recordings do not tell."""
    recordings = batch()
    drag = {"constant-drag/conduit/f0": 0.5, "constant-drag/conduit/local": 0.0, "constant-drag/conduit/s": 0.5}
    rivals = [
        fitted(recordings, ("constant-drag", "conduit"), known_to=known_to, **drag | {"stiffness_N_per_m": k})
        for k in (8500.0, 9500.0)
    ]
    template = recordings[0].observations
    experiment = experiments(recordings)[0]
    planned = [planned_observations(experiment, rival, template, PARAMETERS) for rival in rivals]
    as_fitted, refitted = separation(planned), separation(planned, rivals)
    assert as_fitted > 0.5
    assert (refitted > 0.5 * as_fitted) == apart
