"""The benchmark of cables with a past: what differs between the two recordings of a rig, and how they are counted."""

from benchmarks.past import rates, without_past
from proof.cases import draw
from virtualrig.campaign import prepare, recording_generator


def test_the_same_rig_is_recorded_with_a_past_and_without():
    case = draw(5, "single", "relaxation")
    fresh = without_past(case)
    plan = case.recordings[0]
    aged, new = (
        prepare(one.campaign, plan, recording_generator(case.seed, case.name, plan.id)) for one in (case, fresh)
    )
    assert fresh.campaign.rig == case.campaign.rig
    assert aged.tensioned_before_s > 0 == new.tensioned_before_s


def row(**other):
    first = {"effect": "relaxation", "state": "past", "visible": True, "right": True, "located": True, "wrong": False}
    return first | {"interval": [0.1, 0.12, 0.2]} | other


def test_only_visible_effects_count_and_every_interval_does():
    rows = [row(), row(right=False, interval=None), row(visible=False, right=False, interval=[0.1, 0.3, 0.2])]
    by_name = {one["what"]: (one["k"], one["n"]) for one in rates(rows)}
    assert by_name["relaxation, past, visible: named first"] == (1, 2)
    assert by_name["relaxation, past, visible: located"] == (2, 2)
    assert by_name["relaxation, past: size within its interval"] == (1, 2)
    assert by_name["relaxation, past: confidently wrong"] == (0, 3)
    assert by_name["running-in, fresh, visible: named first"] == (0, 0)
