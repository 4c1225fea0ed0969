"""The benchmark of cables with a past: what differs between the two recordings of a rig, and how they are counted."""

import numpy as np
import pytest

from benchmarks.past import left_by_past, rates, without_past
from proof.cases import draw
from virtualrig.campaign import prepare, recording_generator


def test_the_same_rig_is_recorded_with_a_past_and_without():
    case = draw(5, "single", "relaxation")
    fresh = without_past(case)
    plan = case.recordings[0]
    aged, new = (
        prepare(one.campaign, plan, recording_generator(case.seed, case.name, plan.id)) for one in (case, fresh)
    )
    assert fresh.campaign.rig.cable == case.campaign.rig.cable
    lost = [sum(b.share for b in one.campaign.rig.effects.relaxation) for one in (case, fresh)]
    assert lost[1] == pytest.approx(left_by_past(case) * lost[0])
    branches, longest_s = case.campaign.rig.effects.relaxation, case.campaign.repeatability.tensioned_before_s[1]
    left = sum(b.share * b.time_constant_s * -np.expm1(-longest_s / b.time_constant_s) for b in branches) / longest_s
    assert left_by_past(case) == pytest.approx(left / lost[0], rel=1e-3)
    assert aged.tensioned_before_s > 0 == new.tensioned_before_s


@pytest.mark.parametrize("law, left", [("", (1 - np.exp(-2)) / 2), ("hyperbolic", np.log(3) / 2)])
def test_what_a_past_leaves_of_running_in_depends_on_its_law(law, left):
    cases = (draw(seed, "single", "running-in") for seed in range(20))
    assert left_by_past(next(case for case in cases if case.truth[0].law == law)) == pytest.approx(left, rel=1e-3)


def row(**other):
    first = {
        "effect": "relaxation",
        "state": "past",
        "mean_square": 1.3,
        "right": True,
        "located": True,
        "wrong": False,
    }
    return first | {"right": True, "listed": True, "located": True, "interval": [0.1, 0.12, 0.2]} | other


def test_only_effects_that_show_count_and_every_interval_does():
    rows = [row(), row(right=False, interval=None), row(mean_square=1.05, right=False, interval=[0.1, 0.3, 0.2])]
    by_name = {one["what"]: (one["k"], one["n"]) for one in rates(rows)}
    assert by_name["relaxation, past, shows: named first"] == (1, 2)
    assert by_name["relaxation, past, shows: located"] == (2, 2)
    assert by_name["relaxation, past: size within its interval"] == (1, 2)
    assert by_name["relaxation, past: confidently wrong"] == (0, 3)
    assert by_name["running-in, fresh, shows: named first"] == (0, 0)
