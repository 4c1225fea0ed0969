"""Families: every effect in turn; a law that the list lacks is a table in the answer."""

import json
from collections import Counter

import numpy as np
import pytest
from typer.testing import CliRunner

from proof.cases import draw
from proof.cli import app
from proof.families import family, members_of
from proof.plan import read_plan
from virtualrig.effects import TWINS

PLAN = read_plan()
# As the diagnosis format names them, and the radius of a pulley.
SLOTS = {
    *("sliding-friction", "cable-stretch", "end-stretch", "bearing-torque", "drive-train", "load", "sensor-map"),
    "pulley-radius",
}
ARGUMENTS = {
    *("tension", "speed", "direction", "distance-since-reversal", "dwell", "time", "travel"),
    *("position-along-conduit", "drive-angle", "load-angle", "reading", "cable", "torque", "acceleration"),
}


@pytest.mark.parametrize("name", ["removed", "unlisted", "doubtful"])
def test_a_family_has_every_effect_at_every_strength(name):
    cases = list(family(name, 7000))
    effects = list(PLAN.unlisted if name == "unlisted" else PLAN.effects)
    plan = PLAN.families[name]
    found = Counter(case.truth[0].name.removeprefix("unlisted-") for case in cases)
    assert set(found) == {effect.removeprefix("unlisted-") for effect in effects}
    assert max(found.values()) - min(found.values()) <= 1
    assert len(cases) == len({case.name for case in cases}) == plan.cases
    strengths = [case.truth[0].strength for case in cases]
    assert set(strengths[: len(effects)]) == {plan.strengths[0]}
    assert set(strengths) == set(plan.strengths)
    assert len(members_of(name, PLAN)) == len(effects) * len(plan.strengths)
    assert list(family(name, 7000, 3, first=2)) == cases[2:5]
    assert list(family(name, 7000, first=2)) == cases[2:]


def test_the_laws_that_the_list_never_had_are_of_many_slots_and_arguments():
    laws = [draw(1, "unlisted", name).truth[0] for name in PLAN.unlisted]
    assert len(laws) >= 12
    assert {law.slot for law in laws} >= SLOTS - {"end-stretch", "drive-train", "pulley-radius"}
    assert len({law.argument for law in laws}) >= 9


# Laws whose table depends on the conduits, or on the tension: the answer has their slot and argument.
WITHOUT_TABLE = {"constant-drag", "kink", "viscous-friction", "presliding"}
# What no slot can hold is scored on its place.
WITHOUT_SLOT = {
    *("conduit-compliance", "relaxation", "friction-drift", "stiffness-drift", "zero-drift"),
    # A constant is a law of any argument.
    *("time-skew", "load-cell-offset"),
}


def test_every_removed_effect_has_a_slot_unless_none_can_hold_it():
    for name in PLAN.effects:
        truth = draw(2, "removed", name, 0.9).truth[0]
        assert (not truth.slot) == (name in WITHOUT_SLOT), name
        assert (not truth.curve) == (name in WITHOUT_SLOT | WITHOUT_TABLE), name


@pytest.mark.parametrize("name", sorted({n for n, twin in TWINS.items() if twin.law} - WITHOUT_TABLE))
def test_the_law_of_each_effect_is_recorded_as_a_table(name):
    kind = "unlisted" if name in PLAN.unlisted else "removed"
    for seed in range(3):
        case = draw(seed, kind, name, 0.9)
        (truth,) = json.loads(json.dumps(case.key))["truth"]
        assert truth["slot"] in SLOTS
        assert truth["argument"] in ARGUMENTS
        x, y = np.array(truth["curve"]).T
        assert np.isfinite(y).all()
        assert (np.diff(x) > 0).all()
        neutral = 1.0 if truth["slot"] in ("sliding-friction", "cable-stretch", "pulley-radius") else 0.0
        larger, smaller = (np.array(draw(seed, kind, name, s).truth[0].curve)[:, 1] for s in (0.9, 0.3))
        assert np.abs(larger - neutral).max() > np.abs(smaller - neutral).max() > 0


def test_every_unlisted_effect_has_a_law():
    assert all(twin.law is not None for twin in PLAN.unlisted.values())


def test_a_removed_effect_is_no_candidate_and_its_answer_has_the_law():
    case = next(iter(family("removed", 5)))
    assert case.without == (case.truth[0].name.removeprefix("unlisted-"),)
    case = draw(5, "removed", "stribeck", 0.9)
    assert (case.truth[0].slot, case.truth[0].argument) == ("sliding-friction", "speed")
    factor = np.array(case.truth[0].curve)[:, 1]
    assert factor[0] == pytest.approx(1 + case.truth[0].size, rel=0.2)
    assert factor[0] > factor[-1]


def test_a_strength_that_is_stated_leaves_other_cases_as_they_are():
    stated, drawn = draw(3, "removed", "kink", 0.5), draw(3, "removed", "kink")
    assert stated.truth[0].strength == 0.5
    assert stated.campaign.rig.cable == drawn.campaign.rig.cable
    assert stated.name != drawn.name
    assert draw(stated.seed, **stated.requested) == stated


def test_a_family_that_there_is_not_is_refused(tmp_path):
    done = CliRunner().invoke(app, ["family", "strange", "--out", str(tmp_path)], env={"COLUMNS": "200"})
    assert done.exit_code == 2
    assert "there is no family 'strange'; there are removed, unlisted, doubtful" in done.output


@pytest.mark.parametrize(("found", "exit_code"), [("learned", 0), ("unexplained", 1), (None, 1)])
def test_the_fixed_cases_must_have_the_verdicts_that_the_plan_states(tmp_path, monkeypatch, found, exit_code):
    """Also where the diagnosis was refused and there is no verdict."""

    def judged(cases, out, *_):
        for case in cases:
            (out / case.name).mkdir(parents=True)
            diagnosis = None if found is None else {"verdict": found}
            (out / case.name / "result.json").write_text(json.dumps({"diagnosis": diagnosis}))

    monkeypatch.setattr("proof.cli._judge_each", judged)
    stated = [fixed.kind for fixed in PLAN.quick if fixed.verdict]
    done = CliRunner().invoke(app, ["quick", "--out", str(tmp_path)])
    assert sorted(stated) == ["removed", "unlisted"]
    assert done.exit_code == exit_code
    assert done.output.count("learned was expected") == (0 if found == "learned" else len(stated))
