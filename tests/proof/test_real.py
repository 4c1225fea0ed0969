"""From a plan to results and their score, with a diagnosis of a few lines in place of the real one."""

import json

import numpy as np
import pandas as pd
import pytest
import yaml

from proof import conceal, real
from proof.put_in import KINDS
from proof.real import as_it_stands, cases_of, find_model, judge_real, read_real_plan
from proof.real_page import BY_HAND, real_page
from proof.real_score import found_size, is_right, made_of, moved, outcome_of, read_real_outcomes, truth_of

MODEL = {
    "format": 1,
    "parameters": {"stiffness_N_per_m": 2e4},
    "mechanisms": [
        {"name": "pulley-friction", "place": "drive-pulley", "values": {"friction_torque": 0.03}},
        {"name": "presliding", "place": "conduit", "values": {"z0": 1e-4}},
    ],
    "provenance": {},
}


@pytest.fixture(autouse=True)
def stand_in(monkeypatch):
    """Agrees beside a model once enough is allowed, and says which words and which model it was given.

    The process that the real one runs in has tests of its own (test_conceal.py).
    """

    def run(words, folder, sources):
        out = folder / "out"
        out.mkdir()
        if words[0] == "predict":
            return _predicted(folder / words[1], out)
        allowance = float(words[words.index("--allowance") + 1])
        beside = json.loads((folder / words[words.index("--beside") + 1]).read_text()) if "--beside" in words else None
        said = {
            "verdict": "agrees" if beside and allowance >= 0.06 else "unexplained",
            "location": {"place": "drive-pulley"},
            "mechanisms": [],
            "alternatives": [],
            "nearest": None if beside else {"mechanisms": [], "mean_square": 1.5},
            "fit": {"mean_square": {"calibrated": 0.3, "extended": 0.2}, "calibrated": {"stiffness_N_per_m": 2e4}},
            "words": words,
            "beside": beside,
        }
        (out / "diagnosis.json").write_text(json.dumps(said))
        for name in ("calibrated", "model", "nearest"):
            (out / f"{name}.json").write_text(json.dumps(beside or MODEL))
        return conceal.Ran(0, "", ())

    monkeypatch.setattr(conceal, "run", run)


def _predicted(batch, out):
    """A load that follows the drive, and a torque that is off by an alternating 2 mN m."""
    for file in batch.glob("*.csv.gz"):
        log = pd.read_csv(file)
        said = {
            "time_s": log["time_s"],
            "theta_out_rad": log["drive_encoder_counts"] * 2 * np.pi / 4000,
            "tau_in_Nm": log["drive_encoder_counts"] * 4e-5 + 2e-3 * (-1.0) ** np.arange(len(log)),
        }
        pd.DataFrame(said).to_csv(out / file.name.replace(".csv.gz", ".csv"), index=False)
    return conceal.Ran(0, "", ())


@pytest.fixture
def plan():
    put_in = {k: v for k, v in read_real_plan().put_in.items() if k in ("drag", "gain-of-load-torque")}
    changed = {"known": ("a", "b"), "watched": ("c", "d"), "allowances": (0.04, 0.06, 0.1), "put_in": put_in}
    return read_real_plan().model_copy(update=changed | {"repeats": 1})


@pytest.fixture
def batch(tmp_path):
    folder = tmp_path / "measured"
    folder.mkdir()
    time_s = np.arange(0, 1, 0.01)
    turn = np.rint(500 * np.sin(2 * np.pi * time_s)).astype(int)
    columns = ("drive_encoder_counts", "load_encoder_counts", "drive_torque_counts", "load_torque_counts")
    for name in "abcd":
        pd.DataFrame({"time_s": time_s} | dict.fromkeys(columns, turn)).to_csv(folder / f"{name}.csv.gz", index=False)
    side = {"encoder_counts_per_rev": 4000, "torque_sensor": {"Nm_per_count": 4e-5}}
    recordings = [{"id": name, "file": f"{name}.csv.gz"} for name in "abcd"]
    stated = {"batch": "measured", "rig": {"drive": side, "load": side}, "recordings": recordings}
    (folder / "batch.yaml").write_text(yaml.safe_dump(stated))
    return folder


@pytest.fixture
def in_use(plan, batch, tmp_path):
    find_model(plan, batch, tmp_path / "results" / "model", lambda line: None, conceal.SOURCES)
    return tmp_path / "results" / "model"


def test_sizes_are_the_seed_s_within_their_bounds_and_their_own():
    plan = read_real_plan()
    assert set(plan.put_in) == set(KINDS)
    cases = [c for c in cases_of(plan, MODEL) if c.group == "put in"]
    assert len(cases) == plan.repeats * len(KINDS)
    for case in cases:
        low, high = plan.put_in[case.kind].size
        assert low <= abs(case.size) <= high
        assert case.size > 0 or plan.put_in[case.kind].signed
    assert len({c.size for c in cases}) == len(cases)
    fewer = plan.model_copy(update={"put_in": {"drag": plan.put_in["drag"]}})
    sizes = [c.size for c in cases_of(fewer, MODEL) if c.kind == "drag"]
    assert sizes == [c.size for c in cases if c.kind == "drag"]
    other = plan.model_copy(update={"seed": plan.seed + 1})
    assert {c.size for c in cases}.isdisjoint(c.size for c in cases_of(other, MODEL) if c.group == "put in")


def test_names_say_nothing_and_every_case_has_its_own():
    cases = cases_of(read_real_plan(), MODEL)
    names = [c.name for c in cases]
    assert len(set(names)) == len(cases)
    assert not any(word in name for name in names for kind in KINDS for word in kind.split("-") if len(word) > 2)


def test_allowed_is_the_first_that_agrees_on_known_recordings(in_use):
    allowed = json.loads((in_use / real.ALLOWED).read_text())
    assert allowed["allowance"] == 0.06
    assert [t["verdict"] for t in allowed["tried"].values()] == ["unexplained", "agrees"]
    assert json.loads((in_use / real.MODEL).read_text()) == MODEL
    first = json.loads((in_use / "first" / "diagnosis.json").read_text())
    assert "pulley-friction at drive-pulley, presliding at conduit" in first["words"]


def test_that_nothing_agrees_is_said(plan, batch, tmp_path):
    few = plan.model_copy(update={"allowances": (0.02, 0.04)})
    with pytest.raises(ValueError, match="none of the allowances"):
        find_model(few, batch, tmp_path / "model", lambda line: None, conceal.SOURCES)


def test_each_group_is_asked_what_it_should(plan, batch, in_use, tmp_path):
    heard = {}
    for case in cases_of(plan, MODEL):
        out = tmp_path / "results" / "cases" / case.name
        result = judge_real(case, plan, batch, in_use, out, tell=lambda line: None)
        assert result["tampering"] == []
        assert result["why"] is None
        words = json.loads((out / "diagnosis.json").read_text())
        heard[case.group, case.left_out, case.without] = words["words"], words["beside"]
    assert heard["untouched", None, ()][1] == MODEL
    words, beside = heard["taken out", "presliding at conduit", ("presliding",)]
    assert [m["name"] for m in beside["mechanisms"]] == ["pulley-friction"]
    assert words[words.index("--without") + 1] == "presliding"
    words, beside = heard["paper", None, ("presliding",)]
    assert beside is None
    assert [w for w in words if " at " in w] == ["pulley-friction at drive-pulley"]

    outcomes = read_real_outcomes(plan, tmp_path / "results")
    assert len(outcomes) == len(heard) + 1  # two kinds are put in
    # A key that is not the seed's, or a diagnosis that looked elsewhere, is none.
    one = outcomes[1]
    result = json.loads((tmp_path / "results" / "cases" / one.case.name / "result.json").read_text())
    for spoilt in ({"key": "0"}, {"tampering": ["read the plan"]}):
        assert outcome_of(one.case, one.truth, result | spoilt).said is None
    page = real_page(outcomes, plan, in_use, f"# old\n\n{BY_HAND}\n\nKept.\n")
    assert page.endswith(f"{BY_HAND}\n\nKept.\n")
    assert "drag with load" not in page
    assert page.count("| gain of load torque |") == 1


def test_the_model_as_it_stands_is_held_to_what_was_recorded(plan, batch, in_use, tmp_path):
    untouched, drag, gained = (c for c in cases_of(plan, MODEL) if c.group in ("untouched", "put in"))
    drag, gained = (drag, gained) if drag.kind == "drag" else (gained, drag)
    errors = {}
    for case in (untouched, drag, gained):
        as_it_stands(case, plan, batch, in_use, tmp_path)
        errors[case.kind] = json.loads((tmp_path / real.STANDING).read_text())
    assert errors[None]["tau_in_Nm"] == pytest.approx(2e-3)
    assert errors[None]["theta_out_rad"] == pytest.approx(0.0, abs=1e-12)
    # The load's torque is given to the model, not predicted; a drag of one size stands beside what was there.
    assert errors["gain-of-load-torque"]["tau_in_Nm"] == pytest.approx(2e-3)
    assert errors["drag"]["tau_in_Nm"] == pytest.approx(np.hypot(2e-3, drag.size), rel=0.1)


def said(verdict="agrees", mechanisms=(), alternatives=(), place=None, calibrated=None):
    return {
        "verdict": verdict,
        "place": place,
        "mechanisms": [_claim(*m) for m in mechanisms],
        "alternatives": [_claim(*m) for m in alternatives],
        "nearest": None,
        "left": {"calibrated": 1.0, "extended": 1.0},
        "calibrated": calibrated or {},
    }


def _claim(name, place, **values):
    parameters = [{"name": n, "value": v, "low": v, "high": v, "unit": "1"} for n, v in values.items()]
    return {"name": name, "place": place, "confidence": 0.9, "parameters": parameters}


def case_of(group, kind=None, left_out=None, without=()):
    plan = read_real_plan()
    cases = cases_of(plan, MODEL)
    return next(c for c in cases if (c.group, c.kind, c.left_out, c.without) == (group, kind, left_out, without))


def judged(case, said_of_it):
    truth = truth_of(case, read_real_plan(), MODEL)
    result = {"said": said_of_it, "why": None, "tampering": [], "key": case.digest, "changed": {}, "took_s": 1.0}
    return outcome_of(case, truth, result)


UNTOUCHED = judged(
    case_of("untouched"), said(calibrated={"pulley-friction/drive-pulley/friction_torque": 0.034, "k": 2.0})
)
PULLEY, SCALE = "pulley-friction at drive-pulley", "gain-of-drive-torque"


@pytest.mark.parametrize(
    ("case", "said_of_it", "made", "right"),
    [
        (case_of("untouched"), said(), "let be", True),
        (case_of("untouched"), said("explained", [("backlash", "load-pulley")]), "another name", False),
        (case_of("put in", SCALE), said("explained", [("torque-scale", "drive-sensor")]), "named", True),
        (case_of("put in", SCALE), said("explained", [("torque-scale", "load-sensor")]), "named elsewhere", False),
        (case_of("put in", SCALE), said("explained", [("presliding", "conduit")]), "another name", False),
        (case_of("put in", SCALE), said(), "not noticed", False),
        (
            case_of("put in", SCALE),
            said("undecided", [("relaxation", "cable")], [("torque-scale", "drive-sensor")]),
            "undecided with it",
            True,
        ),
        (case_of("put in", SCALE), said("unexplained", place="drive-pulley"), "unexplained, elsewhere", False),
        (
            case_of("put in", "gain-of-load-torque"),
            said("explained", [("torque-scale", "drive-sensor")]),
            "named as its equal",
            True,
        ),
        (
            case_of("put in", "drift-of-drive-torque"),
            said("unexplained", place="drive-sensor"),
            "unexplained, in place",
            True,
        ),
        (
            case_of("put in", "drift-of-drive-torque"),
            said("explained", [("relaxation", "cable")]),
            "another name",
            False,
        ),
        (case_of("put in", "drift-of-drive-torque"), said(), "not noticed", False),
        (
            case_of("taken out", left_out=PULLEY),
            said("explained", [("pulley-friction", "drive-pulley")]),
            "named",
            True,
        ),
        (
            case_of("taken out", left_out=PULLEY, without=("pulley-friction",)),
            said("unexplained", place="drive-pulley"),
            "unexplained, in place",
            True,
        ),
        (
            case_of("taken out", left_out=PULLEY, without=("pulley-friction",)),
            said("undecided", [("constant-drag", "conduit")]),
            "undecided without it",
            False,
        ),
    ],
)
def test_what_is_right(case, said_of_it, made, right):
    o = judged(case, said_of_it)
    assert made_of(o) == made
    assert is_right(o, UNTOUCHED) is right


def test_drag_is_right_where_the_model_in_use_takes_it_up():
    case = case_of("put in", "drag")
    key = "pulley-friction/drive-pulley/friction_torque"
    for share, right in ((1.0, True), (0.8, True), (0.5, False), (0.0, False)):
        o = judged(case, said(calibrated={key: 0.034 + share * case.size, "k": 2.04}))
        assert found_size(o, UNTOUCHED) == pytest.approx(share * case.size)
        assert is_right(o, UNTOUCHED) is right
    assert list(moved(judged(case, said(calibrated={key: 0.051, "k": 2.04})), UNTOUCHED)) == [key]
    assert moved(judged(case, said(calibrated={key: 0.051})), UNTOUCHED)[key] == pytest.approx(0.5)


def test_a_gain_at_the_other_end_is_the_inverse():
    case = case_of("put in", "gain-of-load-torque")
    seen = 1 / (1 + case.size) - 1
    o = judged(case, said("explained", [("torque-scale", "drive-sensor")]) | {
        "mechanisms": [_claim("torque-scale", "drive-sensor", gain=seen)]
    })  # fmt: skip
    assert found_size(o, UNTOUCHED) == pytest.approx(case.size)


def test_a_plan_that_cannot_be_put_in_is_refused():
    stated = yaml.safe_load(real.PLAN.read_text())
    with pytest.raises(ValueError, match="there is no gian"):
        real.RealPlan.model_validate(stated | {"put_in": {"gian": {"size": [1, 2], "unit": "1"}}})
    with pytest.raises(ValueError, match="share trial-00"):
        real.RealPlan.model_validate(stated | {"known": stated["watched"]})
