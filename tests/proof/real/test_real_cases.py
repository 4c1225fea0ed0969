"""From a plan to results and their page, with a diagnosis of a few lines in place of the real one."""

import json

import numpy as np
import pandas as pd
import pytest
import yaml

from proof import conceal
from proof.real import run
from proof.real.cases import cases_of
from proof.real.page import BY_HAND, real_page
from proof.real.plan import PLAN, RealPlan, read_real_plan
from proof.real.put_in import KINDS
from proof.real.run import find_model, judge_real
from proof.real.score import outcome_of, read_real_outcomes

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

    def run(commands, folder, sources):
        (words,), out = commands, folder / "out"
        out.mkdir()
        allowance = float(words[words.index("--allowance") + 1])
        beside = json.loads((folder / words[words.index("--beside") + 1]).read_text()) if "--beside" in words else None
        said = {
            "verdict": "agrees" if beside and allowance >= 0.06 else "unexplained",
            "location": {"place": "drive-pulley"},
            "mechanisms": [],
            "alternatives": [],
            "nearest": None if beside else {"mechanisms": [], "mean_square": 1.5},
            "fit": {"mean_square": {"calibrated": 0.3, "extended": 0.2}},
            "words": words,
            "beside": beside,
        }
        (out / "diagnosis.json").write_text(json.dumps(said))
        for name in ("calibrated", "model", "nearest"):
            (out / f"{name}.json").write_text(json.dumps(beside or MODEL))
        return conceal.Ran(0, "", ())

    monkeypatch.setattr(conceal, "run", run)


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
    find_model(plan, batch, tmp_path / "results" / "model", lambda line: None)
    return tmp_path / "results" / "model"


def test_sizes_are_the_seed_s_within_their_bounds_and_their_own():
    plan = read_real_plan()
    assert set(plan.put_in) == set(KINDS)
    cases = [c for c in cases_of(plan, MODEL) if c.kind]
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
    assert {c.size for c in cases}.isdisjoint(c.size for c in cases_of(other, MODEL) if c.kind)


def test_names_say_nothing_and_every_case_has_its_own():
    cases = cases_of(read_real_plan(), MODEL)
    names = [c.name for c in cases]
    assert len(set(names)) == len(cases)
    assert not any(word in name for name in names for kind in KINDS for word in kind.split("-") if len(word) > 2)


def test_allowed_is_the_first_that_agrees_on_known_recordings(in_use):
    allowed = json.loads((in_use / run.ALLOWED).read_text())
    assert allowed["allowance"] == 0.06
    assert [t["verdict"] for t in allowed["tried"].values()] == ["unexplained", "agrees"]
    assert json.loads((in_use / run.MODEL).read_text()) == MODEL
    first = json.loads((in_use / "first" / "diagnosis.json").read_text())
    assert "pulley-friction at drive-pulley, presliding at conduit" in first["words"]
    assert "--hold" not in first["words"]
    assert "--hold" in json.loads((in_use / "allowing-0.06" / "diagnosis.json").read_text())["words"]


def test_that_nothing_agrees_is_said(plan, batch, tmp_path):
    few = plan.model_copy(update={"allowances": (0.02, 0.04)})
    with pytest.raises(ValueError, match="none of the allowances"):
        find_model(few, batch, tmp_path / "model", lambda line: None)


def test_every_case_is_held_beside_the_model_that_it_should_be(plan, batch, in_use, tmp_path):
    heard = {}
    for case in cases_of(plan, MODEL):
        out = tmp_path / "results" / "cases" / case.name
        result = judge_real(case, plan, batch, in_use, out, tell=lambda line: None)
        assert result["tampering"] == []
        assert result["why"] is None
        said = json.loads((out / "diagnosis.json").read_text())
        assert "--hold" in said["words"]
        heard[case.kind, case.left_out, case.without] = said["words"], said["beside"]
    assert heard[None, None, ()][1] == heard["drag", None, ()][1] == MODEL
    words, beside = heard[None, "presliding at conduit", ("presliding",)]
    assert [m["name"] for m in beside["mechanisms"]] == ["pulley-friction"]
    assert words[words.index("--without") + 1] == "presliding"

    outcomes = read_real_outcomes(plan, tmp_path / "results")
    assert len(outcomes) == len(heard) == 7
    # A key that is not the seed's, or a diagnosis that looked elsewhere, is none.
    one = outcomes[1]
    result = json.loads((tmp_path / "results" / "cases" / one.case.name / "result.json").read_text())
    for spoilt in ({"key": "0"}, {"tampering": ["read the plan"]}):
        assert outcome_of(one.case, one.truth, result | spoilt).said is None
    page = real_page(outcomes, plan, in_use, f"# old\n\n{BY_HAND}\n\nKept.\n")
    assert page.endswith(f"{BY_HAND}\n\nKept.\n")
    assert "drag with load" not in page
    assert page.count("| gain of load torque |") == 1
    assert "1 of 7 are right; 0 are\nconfidently wrong" in page


def test_a_plan_that_cannot_be_put_in_is_refused():
    stated = yaml.safe_load(PLAN.read_text())
    with pytest.raises(ValueError, match="there is no gian"):
        RealPlan.model_validate(stated | {"put_in": {"gian": {"size": [1, 2], "unit": "1"}}})
    with pytest.raises(ValueError, match="share trial-00"):
        RealPlan.model_validate(stated | {"known": stated["watched"]})
