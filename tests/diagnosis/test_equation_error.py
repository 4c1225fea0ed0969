"""Values of the load that a regression of its torque on its motion shows."""

from types import SimpleNamespace

import numpy as np
import pytest

from builders import recording
from ccmodel.deadline import OutOfTimeError
from ccmodel.diagnosis import selection
from ccmodel.diagnosis.equation_error import largest_inertia, load_values, other_start
from ccmodel.diagnosis.hypothesis import PAPER, Hypothesis
from ccmodel.diagnosis.screening import Score
from ccmodel.failure import ModelError

J, ZETA, K_E = "load-inertia/load/J", "load-inertia/load/zeta", "load_stiffness_Nm_per_rad"
SPRING, DAMPING = 0.056, 0.0005
COUNT_RAD, NOISE_NM = 0.0008, 1e-4
RATES, SIZES = np.array([[2.0], [7.0], [24.0]]), np.array([[0.3], [0.1], [0.02]])


def ringing(mass, seed=0, spring=SPRING, cubic=0.0, friction=0.0, faster=1.0):
    """A load that moves with three frequencies, read by an encoder with counts and a torque sensor with noise."""
    rates = faster * RATES

    def angle(t):
        exact = (SIZES * np.sin(rates * t)).sum(axis=0)
        return COUNT_RAD * np.round(exact / COUNT_RAD)

    def torque(t):
        wave, slope = SIZES * np.sin(rates * t), SIZES * rates * np.cos(rates * t)
        exact = (spring * wave + DAMPING * slope - mass * rates**2 * wave).sum(axis=0)
        exact += cubic * wave.sum(axis=0) ** 3 + friction * np.sign(slope.sum(axis=0))
        return exact + NOISE_NM * np.random.default_rng(seed).normal(size=t.size)

    return recording(10.0, theta_out_rad=angle, tau_out_Nm=torque)


@pytest.mark.parametrize("mass", [2e-4, 2e-3, 1e-2])
def test_spring_inertia_and_damping_are_found(mass):
    found = load_values([ringing(mass, 1), ringing(mass, 2)])
    zeta = DAMPING / (2 * np.sqrt(mass * SPRING))
    assert found == pytest.approx({K_E: SPRING, J: mass, ZETA: zeta}, rel=0.05)


@pytest.mark.parametrize("mass", [0.0, 1e-6, 0.1])
def test_an_inertia_outside_of_the_plausible_range_is_none(mass):
    assert load_values([ringing(mass)]) == {}


@pytest.mark.parametrize("mass", [0.0, 2e-5, 2e-4, 2e-3])
@pytest.mark.parametrize("beyond", [{}, {"cubic": 0.2}, {"cubic": -0.2}, {"friction": 4e-3}])
def test_the_upper_limit_of_the_inertia_holds_the_true_one(mass, beyond):
    """Also beside a spring that stiffens or softens, and beside dry friction; the limit is still of some use."""
    motions = (0.5, 0.7, 0.9, 1.1, 1.4, 1.8)
    limit = largest_inertia([ringing(mass, k, faster=f, **beyond) for k, f in enumerate(motions)])[J]
    assert mass < limit < 1.1 * mass + 5e-5


def test_an_inertia_that_recordings_do_not_agree_on_has_a_high_limit():
    recordings = [ringing(mass, k) for k, mass in enumerate((1e-4, 2e-4, 3e-4, 4e-4, 5e-4, 6e-4))]
    assert largest_inertia(recordings)[J] > 6e-4


def test_too_few_recordings_limit_no_inertia():
    assert largest_inertia([ringing(0.0, seed) for seed in range(4)]) == {}
    assert largest_inertia([]) == {}


def test_a_torque_with_the_wrong_sign_shows_no_load():
    assert load_values([ringing(2e-3, spring=-SPRING)]) == {}


def test_without_the_torque_or_with_too_few_samples_there_is_nothing_to_see():
    assert load_values([recording(10.0, theta_out_rad=np.sin)]) == {}
    whole = ringing(2e-3)
    assert load_values([whole[:60]]) == {}
    assert load_values([whole[:60], whole]) == load_values([whole])


def test_a_fit_with_the_inertia_also_starts_from_the_known_values():
    known = {K_E: 0.05, J: 2e-3, ZETA: 0.01}
    start = {"friction_coefficient": 0.1, K_E: 0.04, J: 1e-3, ZETA: 0.3}
    assert other_start(start, known) == {"friction_coefficient": 0.1, **known}
    assert other_start(start | {J: 1.95e-3}, known) is None
    assert other_start({K_E: 0.04}, known) is None
    assert other_start(start, {}) is None


@pytest.mark.parametrize(
    ("ends", "kept"),
    [
        ((2.0, 3.0), 2.0),
        ((3.0, 2.0), 2.0),
        ((2.0, OutOfTimeError()), 2.0),
        ((ModelError("no solution"), 3.0), 3.0),
        ((2.0, ModelError("no solution")), 2.0),
        ((OutOfTimeError(), 3.0), None),
    ],
)
def test_of_both_starts_the_better_fit_that_can_be_made_is_kept(monkeypatch, ends, kept):
    inertia, left = Hypothesis((("load-inertia", "load"),)), list(ends)

    def fit(whitened, hypothesis, free, start, deadline, search, calibration):
        end = left.pop(0)
        if isinstance(end, Exception):
            raise end
        return SimpleNamespace(hypothesis=hypothesis, mean_square=end, is_plausible=True)

    monkeypatch.setattr(selection, "fit", fit)
    chosen = selection.Selection({}, [], known={K_E: 0.05, J: 2e-3, ZETA: 0.01})
    fitted = chosen.fit_all([], SimpleNamespace(hypothesis=PAPER, values={}), [Score(inertia, 0.0, inertia.start)])
    assert [c.mean_square for c in fitted] == ([] if kept is None else [kept])
