"""A further experiment of an open case: what is recorded, and how its outcome counts."""

import json

import numpy as np
import pytest

from proof import follow_up
from proof.build import folder_digest, record
from proof.cases import draw
from proof.follow_up import PROPOSED, RANDOM, follow_ups, plans_of, random_experiment
from proof.outcome import Outcome, after
from proof.score import rates

SINE = {"wave": "sine", "amplitude_rad": 0.4, "frequency_Hz": 0.4}
STEPS = {"wave": "step-and-hold", "angles_rad": [0.4, 0.0, -0.4, 0.0], "move_s": 0.5, "hold_s": 1.0}
NESTED = {"wave": "growing-sine", "first_amplitude_rad": 0.4, "amplitude_rad": 0.0, "frequency_Hz": 0.5}


@pytest.fixture(scope="module")
def case():
    return next(c for c in (draw(seed, "single", "torque-scale") for seed in range(20)) if c.protocol == "rich")


@pytest.mark.parametrize("motion", [SINE, STEPS, NESTED])
def test_what_is_asked_for_is_recorded(case, motion):
    asked = {"excitation": motion, "pretension_N": 3.3, "bend_rad": 4.1, "recordings": 7}
    plans = plans_of(case, asked)
    assert [plan.id for plan in plans] == ["experiment-1", "experiment-2", "experiment-3"]
    plan = plans[0]
    assert plan.pretension_N == 3.3
    assert sum(p.bend_rad for p in plan.conduit) == 4.1
    assert sum(p.length_m for p in plan.conduit) == case.campaign.rig.cable.length_m
    angle, rate = plan.excitation.angle_and_rate(np.arange(0, plan.excitation.duration_s, 0.004))
    assert np.abs(angle).max() == pytest.approx(0.4, rel=0.12)
    assert 5 < plan.excitation.duration_s <= 10.5
    assert np.isfinite(rate).all()


def test_a_random_experiment_is_within_the_batch(case):
    highest = max(plan.pretension_N for plan in case.recordings)
    bends = {sum(p.bend_rad for p in plan.conduit) for plan in case.recordings}
    drawn = [random_experiment(case, 2, np.random.default_rng(seed)) for seed in range(30)]
    assert {one["excitation"]["wave"] for one in drawn} == {"sine", "step-and-hold", "growing-sine"}
    for one in drawn:
        assert one["pretension_N"] <= highest
        assert one["bend_rad"] in bends
        assert len(plans_of(case, one)) == 2


def test_an_open_case_is_diagnosed_again_with_either_experiment(case, tmp_path, monkeypatch):
    recorded = {}
    monkeypatch.setattr(follow_up, "record", lambda case, plans, folder, before: recorded.update({folder: plans}))
    asked = {"excitation": SINE, "pretension_N": 3.3, "bend_rad": 4.1, "recordings": 1}
    said = {"verdict": "undecided", "next_experiment": {"text": "", "separates": [], "recording": asked}}
    (tmp_path / "open.json").write_text(json.dumps(said))
    found = follow_ups(
        case, tmp_path / "open.json", tmp_path, tmp_path, lambda batch, out: {"batch": batch.parent.name}
    )
    assert {which: one["diagnosis"]["batch"] for which, one in found.items()} == {PROPOSED: PROPOSED, RANDOM: RANDOM}
    assert [len(plans) for plans in recorded.values()] == [len(case.recordings) + 1] * 2
    for other in ({"verdict": "explained"}, {"next_experiment": None}):
        (tmp_path / "closed.json").write_text(json.dumps(said | other))
        assert follow_ups(case, tmp_path / "closed.json", tmp_path, tmp_path, lambda batch, out: None) == {}


def test_recordings_of_the_batch_are_not_made_again(case, tmp_path):
    first, second = case.kept_back[:2]
    record(case, [first], tmp_path / "before" / case.name)
    made = record(case, [first, second], tmp_path / "after" / case.name, tmp_path / "before" / case.name)
    assert list(made) == [second.id]
    alone = record(case, [first, second], tmp_path / "alone" / case.name)
    assert list(alone) == [first.id, second.id]
    assert folder_digest(tmp_path / "after" / case.name) == folder_digest(tmp_path / "alone" / case.name)


def test_a_drift_goes_on_after_the_session(case):
    """The diagnosis takes recordings to follow at even steps."""
    asked = {"excitation": SINE, "pretension_N": 3.3, "bend_rad": 4.1, "recordings": 3}
    positions = np.array([plan.position for plan in [*case.recordings, *plans_of(case, asked)]])
    np.testing.assert_allclose(np.diff(positions), 1 / (len(case.recordings) - 1))


def test_an_experiment_decides_rightly_if_it_names_all_and_no_more(case):
    place = case.truth[0].place

    def said(verdict, *names):
        named = [{"name": n, "place": place, "confidence": 0.9, "parameters": []} for n in names]
        return {"verdict": verdict, "place": None, "mechanisms": named, "alternatives": []}

    further = {PROPOSED: said("explained", "torque-scale"), RANDOM: said("explained", "kink")}
    cases = [
        Outcome(case.key, said("undecided"), follow_ups=further),
        Outcome(case.key, said("undecided"), follow_ups=further | {RANDOM: None}),
        # Nothing was proposed.
        Outcome(case.key, said("undecided")),
        Outcome(case.key, said("explained", "torque-scale")),
    ]
    assert after(cases[1], RANDOM).verdict == "none"
    counted = {r["what"]: (r["k"], r["n"]) for r in rates(cases)}
    assert counted["undecided: after the proposed experiment: decided"] == (2, 3)
    assert counted["undecided: after the proposed experiment: decided rightly"] == (2, 3)
    assert counted["undecided: after the random experiment: decided"] == (1, 3)
    assert counted["undecided: after the random experiment: decided rightly"] == (0, 3)


def test_a_clean_case_is_decided_by_agrees_and_one_without_a_candidate_by_its_law():
    """None of them has a mechanism that could explain it."""
    clean = {"kind": "clean", "truth": [{"name": "none", "place": None}]}
    effect = {"name": "unlisted-cogging-motor", "place": "drive-pulley", "slot": "pulley-bearing"}
    unlisted = {"kind": "unlisted", "truth": [effect]}
    law = {"place": "drive-pulley", "slot": "pulley-bearing", "arguments": ["drive-angle"], "confidence": 0.9}

    def said(verdict, **laws):
        return {
            "verdict": verdict,
            "place": "drive-pulley",
            "mechanisms": [],
            "alternatives": [],
            "laws": [laws] if laws else [],
        }

    def decided(key, found):
        case = Outcome(key, said("undecided"), follow_ups={PROPOSED: found})
        (counted,) = [r["k"] for r in rates([case]) if r["what"].endswith("proposed experiment: decided rightly")][:1]
        return bool(counted)

    assert decided(clean, said("agrees"))
    assert not decided(clean, said("learned", **law))
    assert decided(unlisted, said("learned", **law))
    assert not decided(unlisted, said("learned", **law | {"slot": "load"}))
    assert not decided(unlisted, said("agrees"))
