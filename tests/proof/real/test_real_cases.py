"""From a plan to results and their page, with a stand-in of a few lines for the diagnosis."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml

from proof import conceal
from proof.cli import real
from proof.real import run
from proof.real.cases import cases_of
from proof.real.faults import FAULTS
from proof.real.page import BY_HAND, real_page
from proof.real.plan import PLAN, RealPlan, read_real_plan
from proof.real.run import find_baseline, judge_real
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
    """Agrees with a baseline at a sufficient tolerance, and reports the arguments and the baseline that it was given.

    The isolated process has tests of its own (test_conceal.py).
    """

    def run(commands, folder, sources):
        (arguments,), out = commands, folder / "out"
        out.mkdir()
        channel, _, share = arguments[arguments.index("--tolerance") + 1].partition("=")
        factor = float(share) / read_real_plan().tolerance[channel]
        baseline = None
        if "--baseline" in arguments:
            baseline = json.loads((folder / arguments[arguments.index("--baseline") + 1]).read_text())
        diagnosis = {
            "verdict": "agrees" if baseline and factor >= 3.0 else "unexplained",
            "location": {"place": "drive-pulley"},
            "mechanisms": [],
            "alternatives": [],
            "laws": [],
            "nearest": None if baseline else {"mechanisms": [], "mean_square": 1.5},
            "fit": {"mean_square": {"calibrated": 0.3, "extended": 0.2}},
            "arguments": arguments,
            "baseline": baseline,
        }
        (out / "diagnosis.json").write_text(json.dumps(diagnosis))
        for name in ("calibrated", "model", "nearest"):
            (out / f"{name}.json").write_text(json.dumps(baseline or MODEL))
        return conceal.Completed(0, "", ())

    monkeypatch.setattr(conceal, "run", run)


@pytest.fixture
def plan():
    faults = {k: v for k, v in read_real_plan().faults.items() if k in ("drag", "gain-of-load-torque")}
    changed = {"training": ("a", "b"), "test": ("c", "d"), "tolerance_factors": (2.0, 3.0, 5.0), "faults": faults}
    return read_real_plan().model_copy(update=changed | {"repeats": 1, "controls": (("c",),)})


@pytest.fixture
def batch(tmp_path):
    folder = tmp_path / "measured"
    folder.mkdir()
    time_s = np.arange(0, 1, 0.01)
    counts = np.rint(500 * np.sin(2 * np.pi * time_s)).astype(int)
    columns = ("drive_encoder_counts", "load_encoder_counts", "drive_torque_counts", "load_torque_counts")
    for name in "abcd":
        pd.DataFrame({"time_s": time_s} | dict.fromkeys(columns, counts)).to_csv(folder / f"{name}.csv.gz", index=False)
    side = {"encoder_counts_per_rev": 4000, "torque_sensor": {"Nm_per_count": 4e-5}}
    recordings = [{"id": name, "file": f"{name}.csv.gz"} for name in "abcd"]
    stated = {"batch": "measured", "rig": {"drive": side, "load": side}, "recordings": recordings}
    (folder / "batch.yaml").write_text(yaml.safe_dump(stated))
    return folder


@pytest.fixture
def baseline(plan, batch, tmp_path):
    find_baseline(plan, batch, tmp_path / "results" / "baseline", lambda line: None)
    return tmp_path / "results" / "baseline"


def test_sizes_follow_from_the_seed_within_their_bounds():
    plan = read_real_plan()
    assert set(plan.faults) == set(FAULTS)
    cases = [c for c in cases_of(plan, MODEL) if c.fault]
    assert len(cases) == plan.repeats * len(FAULTS)
    for case in cases:
        low, high = plan.faults[case.fault].size
        assert low <= abs(case.size) <= high
        assert case.size > 0 or plan.faults[case.fault].signed
    assert len({c.size for c in cases}) == len(cases)
    fewer = plan.model_copy(update={"faults": {"drag": plan.faults["drag"]}})
    sizes = [c.size for c in cases_of(fewer, MODEL) if c.fault == "drag"]
    assert sizes == [c.size for c in cases if c.fault == "drag"]
    other = plan.model_copy(update={"seed": plan.seed + 1})
    assert {c.size for c in cases}.isdisjoint(c.size for c in cases_of(other, MODEL) if c.fault)


def test_names_are_unique_and_reveal_nothing():
    cases = cases_of(read_real_plan(), MODEL)
    names = [c.name for c in cases]
    assert len(set(names)) == len(cases)
    assert not any(word in name for name in names for fault in FAULTS for word in fault.split("-") if len(word) > 2)


def test_the_tolerance_is_the_first_that_agrees_on_the_training_recordings(baseline):
    found = json.loads((baseline / run.TOLERANCE).read_text())
    assert found["tolerance_factor"] == 3.0
    assert [t["verdict"] for t in found["tried"].values()] == ["unexplained", "agrees"]
    assert json.loads((baseline / run.BASELINE).read_text()) == MODEL
    first = json.loads((baseline / "first" / "diagnosis.json").read_text())
    assert "--time-limit" in first["arguments"]
    assert "--candidate" not in first["arguments"]
    assert "--freeze" not in first["arguments"]
    assert "--freeze" in json.loads((baseline / "tolerance-3" / "diagnosis.json").read_text())["arguments"]


def test_a_baseline_that_never_agrees_is_refused(plan, batch, tmp_path):
    few = plan.model_copy(update={"tolerance_factors": (1.0, 2.0)})
    with pytest.raises(ValueError, match="none of the tolerances"):
        find_baseline(few, batch, tmp_path / "model", lambda line: None)


def test_every_case_gets_its_frozen_baseline(plan, batch, baseline, tmp_path):
    received = {}
    for case in cases_of(plan, MODEL):
        out = tmp_path / "results" / "cases" / case.name
        result = judge_real(case, plan, batch, baseline, out, report=lambda line: None)
        assert result["tampering"] == []
        assert result["failure"] is None
        diagnosis = json.loads((out / "diagnosis.json").read_text())
        assert "--freeze" in diagnosis["arguments"]
        which = case.fault, case.removed, case.without, *case.recordings
        received[which] = diagnosis["arguments"], diagnosis["baseline"]
    assert received[None, None, ()][1] == received[None, None, (), "c"][1] == received["drag", None, ()][1] == MODEL
    arguments, known = received[None, "presliding at conduit", ("presliding",)]
    assert [m["name"] for m in known["mechanisms"]] == ["pulley-friction"]
    assert arguments[arguments.index("--without") + 1] == "presliding"

    outcomes = read_real_outcomes(plan, tmp_path / "results")
    assert len(outcomes) == len(received) == 8
    # A result with another answer's digest, or with tampering, counts as none.
    one = outcomes[1]
    result = json.loads((tmp_path / "results" / "cases" / one.case.name / "result.json").read_text())
    for spoilt in ({"key": "0"}, {"tampering": ["read the plan"]}):
        assert outcome_of(one.case, one.truth, result | spoilt).diagnosis is None
    outcomes = [replace(o, sources="0123456789abcdef") for o in outcomes]
    page = real_page(outcomes, plan, baseline, f"# old\n\n{BY_HAND}\n\nKept.\n")
    assert page.endswith(f"{BY_HAND}\n\nKept.\n")
    assert "drag with load" not in page
    assert page.count("| gain of load torque |") == 1
    assert "- Right diagnoses: 2 of 8.\n- Confident misidentifications (wrong mechanisms or laws" in page
    assert "the diagnosis's sources\nhave the digest 0123456789abcdef.\n" in page


def test_results_of_another_plan_code_or_baseline_are_made_again(plan, batch, tmp_path, monkeypatch):
    results, lines = tmp_path / "results", []
    monkeypatch.setattr("typer.echo", lines.append)

    def made(changed):
        """Whether the baseline is made, and how many cases."""
        lines.clear()
        monkeypatch.setattr("proof.real.plan.read_real_plan", lambda: changed)
        real(batch, results)
        of_baseline = any(line.startswith("baseline: ") for line in lines)
        return of_baseline, sum(line.startswith("case-") for line in lines)

    plan = plan.model_copy(update={"batch": "measured"})
    assert made(plan) == (True, 8)
    assert made(plan) == (False, 0)
    plan = plan.model_copy(update={"tolerance": {"theta_out_rad": 0.0071, "tau_in_Nm": 0.02}})
    assert made(plan) == (True, 8)
    (results / "baseline" / run.BASELINE).write_text(json.dumps(MODEL | {"provenance": {"by": "hand"}}))
    assert made(plan) == (False, 8)
    monkeypatch.setattr(run, "BUILDER", (*run.BUILDER, "page.py"))
    assert made(plan) == (True, 8)
    assert made(plan) == (False, 0)


def test_a_baseline_that_was_interrupted_goes_on_only_with_the_same_plan(plan, batch, tmp_path):
    few, out = plan.model_copy(update={"tolerance_factors": (1.0,)}), tmp_path / "baseline"
    for tolerance, again in ((0.007, True), (0.007, False), (0.008, True)):
        tried = few.model_copy(update={"tolerance": {"theta_out_rad": tolerance, "tau_in_Nm": 0.02}})
        before = (out / "first" / "diagnosis.json").stat().st_mtime_ns if out.exists() else None
        with pytest.raises(ValueError, match="none of the tolerances"):
            find_baseline(tried, batch, out, lambda line: None)
        assert ((out / "first" / "diagnosis.json").stat().st_mtime_ns != before) == again


def test_an_inconsistent_plan_is_refused():
    stated = yaml.safe_load(PLAN.read_text())
    with pytest.raises(ValueError, match="there is no gian"):
        RealPlan.model_validate(stated | {"faults": {"gian": {"size": [1, 2], "unit": "1"}}})
    with pytest.raises(ValueError, match="trial-11 is no test recording"):
        RealPlan.model_validate(stated | {"controls": [["trial-11"]]})
    with pytest.raises(ValueError, match="share trial-01"):
        RealPlan.model_validate(stated | {"training": stated["test"]})
