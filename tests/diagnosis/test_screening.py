"""Screening: sets of mechanisms from the products of their directions alone."""

from dataclasses import replace

import numpy as np
import pytest

from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.screening import Screening, Trial, leading, screen, trials_of
from ccmodel.diagnosis.settings import LEADING_TRIALS
from ccmodel.model.general.run import Active
from made_observations import PARAMETERS, calibrated, whitened

GAIN, DRAG, KINK = ("torque-scale", "drive-sensor"), ("constant-drag", "conduit"), ("kink", "conduit")
VISCOUS, SKEW = ("viscous-friction", "conduit"), ("time-skew", "load-sensor")
EVERY = (GAIN, DRAG, KINK, VISCOUS, SKEW)


def screening(true: dict, imitation: float = 0.0, second: bool = False, seed: int = 3) -> Screening:
    """Of random directions; the residuals are those of mechanisms at these strengths, plus a little noise.

    With `imitation` the last mechanism has the direction of the first, but for this share. With `second` each mechanism
    is tried at a further value, in another direction.
    """
    random = np.random.default_rng(seed)
    trials, rows = [], []
    for acting in EVERY:
        hypothesis = Hypothesis((acting,))
        values = list(hypothesis.screening_values())
        for k in range(2 if second else 1):
            trials.append(Trial(hypothesis, values[k % len(values)]))
            rows.append(random.standard_normal(400))
    directions = np.array(rows)
    if imitation:
        directions[-1] = directions[0] + imitation * directions[-1]
    residuals = 0.01 * random.standard_normal(400)
    for acting, strength in true.items():
        residuals -= strength * directions[(2 if second else 1) * EVERY.index(acting)]
    product = -directions @ residuals
    mechanisms = [Hypothesis((acting,)) for acting in EVERY]
    return Screening(trials, directions @ directions.T, product, residuals @ residuals, mechanisms)


def members(score) -> set:
    return set(score.hypothesis.acting)


@pytest.mark.parametrize("true", [{GAIN: -0.4}, {GAIN: 0.5, DRAG: 1.0}, {GAIN: 0.5, DRAG: 1.0, SKEW: 0.7}])
@pytest.mark.parametrize("second", [False, True])
def test_the_leading_set_is_the_true_one(true, second):
    found = screening(true, second=second)
    leading = found.sets(len(true))[0]
    assert members(leading) == set(true)
    assert leading.gain == pytest.approx(1.0, abs=0.01)


def test_a_set_is_extrapolated_to_the_strengths_with_the_largest_gain():
    leading = screening({GAIN: 0.5, DRAG: 1.5}).sets(2)[0]
    key = "constant-drag/conduit/f0"
    tried = next(Hypothesis((DRAG,)).screening_values())[key]
    assert leading.values[key] == pytest.approx(1.5 * tried, rel=0.01)


def test_the_strongest_stands_first():
    assert screening({GAIN: 0.3, DRAG: 1.0, SKEW: 0.6}).sets(3)[0].hypothesis.acting == (DRAG, SKEW, GAIN)


def test_no_set_has_a_mechanism_twice_or_at_a_strength_that_it_cannot_have():
    found = screening({GAIN: 0.5, DRAG: -1.0}, second=True)
    for size in (1, 2, 3, 4):
        for score in found.sets(size):
            assert len(members(score)) == size
            assert all(value > 0 for key, value in score.values.items() if key.startswith("constant-drag"))


def test_a_mechanism_that_another_imitates_adds_nothing():
    found = screening({GAIN: 0.5}, imitation=0.01)
    pairs = {frozenset(members(s)): s.gain for s in found.sets(2)}
    alone = found.singles()[0].gain
    assert pairs.get(frozenset({GAIN, SKEW}), alone) - alone < 1e-4


def test_singles_and_sets_of_one_agree():
    found = screening({GAIN: 0.5, DRAG: 1.0}, second=True)
    of_one = {members(s).pop(): s.gain for s in found.sets(1)}
    for score in found.singles():
        if score.hypothesis.acting[0] in of_one:
            assert score.gain == pytest.approx(of_one[score.hypothesis.acting[0]])


def test_nothing_that_can_be_run_gives_no_sets():
    none = Screening([], np.empty((0, 0)), np.empty(0), 1.0, [Hypothesis((GAIN,))])
    assert none.sets(2) == [] and none.singles()[0].values == {}


def test_of_many_trials_those_that_explain_most_in_a_few_recordings_are_kept():
    """A load with inertia rings on its cables: of 35 inertias those next to its own."""
    truth = replace(PARAMETERS, mechanisms=(Active("load-inertia", "load", {"J": 3e-4, "zeta": 0.1}),))
    conditions = ((0.6, 1.0, 7.0), (0.4, 0.7, 7.0), (0.6, 1.0, 5.0), (0.5, 1.3, 6.0))
    recordings = [whitened(*c, seed=k, truth=truth) for k, c in enumerate(conditions)]
    base = calibrated(recordings)
    every = list(trials_of(base, Hypothesis((("load-inertia", "load"),))))
    kept = leading(base, every)
    assert (len(every), len(kept)) == (35, LEADING_TRIALS)
    tried = [trial.values["load-inertia/load/J"] for trial in every]
    assert min(abs(np.log(trial.values["load-inertia/load/J"] / 3e-4)) for trial in kept) < np.log(tried[1] / tried[0])
    few = every[:2]
    assert leading(base, few) is few


def test_a_larger_strength_is_not_tried_where_a_smaller_one_changes_more_than_there_is():
    """Not of what fits but for noise; where much is left, both strengths are tried."""
    truth = replace(PARAMETERS, mechanisms=(Active(*GAIN, {"gain": 0.3}),))
    conditions = ((0.6, 1.0, 7.0), (0.4, 0.7, 7.0))
    tried = {}
    for name, true in (("noise", PARAMETERS), ("much", truth)):
        base = calibrated([whitened(*c, seed=k, truth=true) for k, c in enumerate(conditions)])
        tried[name] = [
            trial.values[f"{GAIN[0]}/{GAIN[1]}/gain"] for trial in screen(base, [Hypothesis((GAIN,))]).trials
        ]
    assert len(tried["much"]) == 2
    assert tried["noise"] == [min(tried["much"])]


def test_nothing_is_screened_beyond_what_recordings_show():
    inertia = Hypothesis((("load-inertia", "load"),))
    base = calibrated([whitened(0.6, 1.0, 7.0, seed=1)])
    limits = {"load-inertia/load/J": 2e-5}
    tried = [trial.values["load-inertia/load/J"] for trial in screen(base, [inertia], limits=limits).trials]
    assert tried and max(tried) <= 2e-5
    none = screen(base, [inertia], limits={"load-inertia/load/J": 1e-6})
    assert none.trials == [] and [score.gain for score in none.singles()] == [0.0]
