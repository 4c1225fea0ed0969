"""The command on small batches: what it writes, and what it does with bad ones."""

import gzip
import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import yaml
from threadpoolctl import threadpool_limits
from typer.testing import CliRunner

from builders import spoil, write_batch
from ccmodel import cli
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.result import alternatives_of, interval, likeliest_of, mechanism_of
from ccmodel.diagnosis.verdict import identified
from ccmodel.failure import ModelError
from ccmodel.inference import pool
from ccmodel.model.files import read_model_file
from ccmodel.report.verdict import claim, headline
from ccmodel.steps.ingest import ingest
from ccmodel.studies.diagnosis import run as stage
from ccmodel.typed import InputError

RUBBING_NM = 4e-3


def rubbing(table):
    """A bearing at the drive: a torque against the motion, built up over 2 mrad, that the cables know nothing of."""
    theta = 0.6 * np.sin(2 * np.pi * np.maximum(table["time_s"].to_numpy() - 0.5, 0))
    share = np.zeros_like(theta)
    for k, turn in enumerate(np.diff(theta), start=1):
        way = np.sign(turn)
        share[k] = way + (share[k - 1] - way) * np.exp(-abs(turn) / 2e-3)
    table["drive_current_A"] += share * RUBBING_NM / 0.0234
    return table


def run(*arguments):
    return CliRunner().invoke(cli.app, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    folder = tmp_path_factory.mktemp("raw")
    batch = spoil(write_batch(folder / "clean", pretensions=(7.0, 6.0, 5.0)))
    assert run("diagnose", batch, "--out", folder / "out").exit_code == 0
    return batch, folder / "out"


def test_recordings_of_the_model_itself_agree_with_it(clean):
    said = json.loads((clean[1] / "diagnosis.json").read_text())
    assert said["verdict"] == "agrees"
    assert said["mechanisms"] == []
    found = read_model_file(clean[1] / "calibrated.json").parameters
    assert found.stiffness_N_per_m == pytest.approx(7750, rel=0.01)
    assert found.friction_coefficient == pytest.approx(0.156, rel=0.01)
    assert "agrees" in (clean[1] / "report.html").read_text()


@pytest.mark.parametrize("cores", [1, 2])
def test_the_same_input_gives_the_same_json(clean, tmp_path, monkeypatch, cores):
    monkeypatch.setattr(pool, "_threads", cores)
    with threadpool_limits(limits=cores, user_api="blas"):
        assert run("diagnose", clean[0], "--out", tmp_path).exit_code == 0
    assert (tmp_path / "diagnosis.json").read_bytes() == (clean[1] / "diagnosis.json").read_bytes()


def test_the_model_predicts_recordings(clean, tmp_path):
    told = run("predict", clean[0], "--model", clean[1] / "model.json", "--out", tmp_path)
    assert told.exit_code == 0
    heading, channels, *rows = (line.split() for line in told.stdout.splitlines())
    assert "%" in heading
    column = channels.index("tau_in_Nm")
    assert {row[0]: float(row[column]) < 1.0 for row in rows if row[0].startswith("t-")} == dict.fromkeys(
        [file.name.removesuffix(".csv.gz") for file in clean[0].glob("*.csv.gz")], True
    )
    said, log = pd.read_csv(tmp_path / "t-7N.csv"), pd.read_csv(clean[0] / "t-7N.csv.gz")
    assert list(said.columns) == [
        "time_s", "theta_in_rad", "theta_out_rad", "tau_in_Nm", "tau_out_Nm", "F_drive_N", "F_load_N",
        "T1_N", "T2_N", "T3_N", "T4_N",
    ]  # fmt: skip
    error = said["tau_in_Nm"] - 0.0234 * log["drive_current_A"]
    assert np.sqrt(np.mean(error**2)) < 0.01 * np.ptp(said["tau_in_Nm"])


def test_a_bearing_that_rubs_is_named(rubbed):
    said = json.loads((rubbed[1] / "diagnosis.json").read_text())
    assert said["verdict"] == "explained"
    (named,) = said["mechanisms"]
    assert (named["name"], named["place"]) == ("pulley-friction", "drive-pulley")
    assert named["parameters"][0]["value"] == pytest.approx(RUBBING_NM, rel=0.1)
    assert said["location"]["place"] == "drive-pulley"
    assert said["fit"]["error"]["tau_in"]["after"] < 0.3 * said["fit"]["error"]["tau_in"]["before"]


@pytest.fixture(scope="module")
def rubbed(tmp_path_factory):
    """A batch whose bearing rubs, with its diagnosis."""
    folder = tmp_path_factory.mktemp("rubbed")
    batch = spoil(write_batch(folder / "rubbing", pretensions=(7.0, 6.0, 5.0)), rubbing)
    assert run("diagnose", batch, "--out", folder / "out").exit_code == 0
    return batch, folder / "out"


def test_beside_a_model_that_has_it_nothing_else_is_missing(rubbed, tmp_path):
    batch, known = rubbed
    for hold in ([], ["--freeze"]):
        assert run("diagnose", batch, "--out", tmp_path, "--baseline", known / "model.json", *hold).exit_code == 0
        said = json.loads((tmp_path / "diagnosis.json").read_text())
        assert said["verdict"] == "agrees"
        assert {"pulley-friction"} == {m.name for m in read_model_file(tmp_path / "model.json").parameters.mechanisms}
    assert any("frozen" in n["why"] for n in said["not_judged"])
    held, given = read_model_file(tmp_path / "model.json").parameters, read_model_file(known / "model.json").parameters
    assert held.stiffness_N_per_m == given.stiffness_N_per_m
    assert held.mechanisms == given.mechanisms


def test_what_has_changed_since_a_model_was_fitted_is_named(rubbed, tmp_path):
    """The bearing is half as bad again: no new mechanism, and a new number of one that the model has."""
    worn = spoil(write_batch(tmp_path / "worn", pretensions=(7.0, 6.0, 5.0)), lambda t: _more(rubbing, t, 1.5), seed=1)
    found = run("diagnose", worn, "--out", tmp_path / "out", "--baseline", rubbed[1] / "model.json", "--freeze")
    assert found.exit_code == 0
    said = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert said["verdict"] == "explained"
    (named,) = said["mechanisms"]
    assert (named["name"], named["place"]) == ("pulley-friction", "drive-pulley")
    assert named["parameters"][0]["value"] == pytest.approx(1.5 * RUBBING_NM, rel=0.1)
    assert "has changed" in said["headline"]


def _more(change, table, share):
    """A log changed by so many times as much."""
    before = table["drive_current_A"].copy()
    changed = change(table)
    changed["drive_current_A"] = before + share * (changed["drive_current_A"] - before)
    return changed


@pytest.mark.parametrize(("former", "present"), cli.FormerOptions.renamed.items())
def test_an_option_under_its_former_name_is_taken_and_the_present_one_is_said(former, present):
    value = [] if former == "--hold" else ["x"]
    found = run("diagnose", "no-such-batch", "--out", "nowhere", former, *value)
    assert f"{former} is now called {present}" in found.stderr
    assert "No such option" not in found.stderr


def test_freezing_needs_a_baseline(clean, tmp_path):
    found = run("diagnose", clean[0], "--out", tmp_path / "out", "--freeze")
    assert isinstance(found.exception, InputError)
    assert "--baseline" in str(found.exception)


def test_a_single_recording_without_load_cells_gets_a_verdict_that_says_what_it_cannot(tmp_path):
    folder = write_batch(tmp_path / "poor", pretensions=(7.0,))
    spoil(folder, lambda table: table.drop(columns=["drive_load_cell_V", "load_load_cell_V"]))
    stated = yaml.safe_load((folder / "batch.yaml").read_text())
    for end in ("drive", "load"):
        del stated["rig"][end]["load_cell"]
    (folder / "batch.yaml").write_text(yaml.safe_dump(stated))
    assert run("diagnose", folder, "--out", tmp_path / "out").exit_code == 0
    said = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert {"F_drive_N", "F_load_N", "held-out error"} <= {n["what"] for n in said["not_judged"]}
    assert not any(m["confidence"] > 0.8 for m in said["mechanisms"])


def test_without_load_cells_each_recording_has_the_pretension_that_it_was_aimed_at(tmp_path):
    """They were at three tensions, and one value for all would leave an excess that anything might be taken for."""
    folder = write_batch(tmp_path / "blind", pretensions=(7.0, 5.0, 3.0))
    spoil(folder, lambda table: table.drop(columns=["drive_load_cell_V", "load_load_cell_V"]))
    assert run("diagnose", folder, "--out", tmp_path / "out").exit_code == 0
    said = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert said["verdict"] == "agrees"
    assert said["fit"]["calibrated"]["pretension_share"] == pytest.approx(1.0, abs=0.1)


def test_a_recording_whose_load_cell_failed_takes_nothing_from_the_others(tmp_path):
    folder = spoil(write_batch(tmp_path / "one", pretensions=(7.0, 6.0, 5.0)))
    file = folder / "t-5N.csv.gz"
    table = pd.read_csv(file).assign(load_load_cell_V=0.25)  # A cell that reads nothing at all is no cell.
    with gzip.open(file, "wt") as f:
        table.to_csv(f, index=False)
    assert run("diagnose", folder, "--out", tmp_path / "out", "--trust-inputs").exit_code == 0
    said = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert said["verdict"] == "agrees"
    assert "t-5N" in {n["what"] for n in said["not_judged"]}
    assert "pretension_share" not in said["fit"]["calibrated"]


def test_an_estimate_beyond_what_a_fit_is_used_to_is_taken_all_the_same(tmp_path):
    folder = spoil(write_batch(tmp_path / "stiff", pretensions=(7.0, 6.0)))
    stated = yaml.safe_load((folder / "batch.yaml").read_text())
    stated["rig"]["cable"] |= {"stiffness_N_per_m": 50.0, "friction_coefficient": 0.0}
    (folder / "batch.yaml").write_text(yaml.safe_dump(stated))
    assert run("diagnose", folder, "--out", tmp_path / "out").exit_code == 0


def test_alternatives_are_others_than_what_is_named_each_once():
    scale, drag = ("torque-scale", "drive-sensor"), ("constant-drag", "conduit")
    there, elsewhere = ("pulley-friction", "drive-pulley"), ("pulley-friction", "load-pulley")
    shares = {(scale,): 0.5, (drag,): 0.2, (there,): 0.1, (elsewhere,): 0.15}
    confidence = {Hypothesis(acting): share for acting, share in shares.items()}

    def confidence_in(name):
        return sum(p for hypothesis, p in confidence.items() if name in hypothesis.names)

    judgement = SimpleNamespace(verdict="undecided", confidence=confidence, confidence_in=confidence_in)
    found = alternatives_of(judgement, {})
    assert [(a["name"], a["place"], a["confidence"]) for a in found] == [
        (*scale, 0.5),
        (*elsewhere, 0.25),
        (*drag, 0.2),
    ]
    # Of what is named, the other place is an alternative.
    judgement.verdict, judgement.best = "explained", SimpleNamespace(hypothesis=Hypothesis((there,)))
    found = alternatives_of(judgement, dict([there]))
    assert [(a["name"], a["place"], a["confidence"]) for a in found] == [
        (*scale, 0.5),
        (*drag, 0.2),
        (*elsewhere, 0.15),
    ]


@pytest.mark.parametrize(
    ("alternatives", "likeliest", "sentence"),
    [
        ([], ["kink"], "these recordings do not tell what."),
        (["kink"], ["kink"], "it may be kink at the conduit (0.50), but"),
        (
            ["kink", "stribeck"],
            ["kink"],
            "cannot tell kink at the conduit (0.50) or stribeck at the conduit (0.50) apart",
        ),
        (
            ["kink", "stribeck"],
            ["kink", "stribeck"],
            "it may be kink at the conduit and stribeck at the conduit together, but",
        ),
    ],
)
def test_the_headline_separates_a_pair_from_alternatives(alternatives, likeliest, sentence):
    claims = [
        [{"name": name, "place": "conduit", "confidence": 0.5} for name in names] for names in (alternatives, likeliest)
    ]
    error = {"tau_in": {"before": 2.0, "after": 1.0, "noise": 1.0}}
    said = {"batch": "b", "verdict": "undecided", "is_held": False, "mechanisms": [], "fit": {"error": error}}
    assert sentence in headline(said | {"alternatives": claims[0], "likeliest": claims[1]})


def test_the_headline_says_what_is_sure_and_what_is_open():
    gap = {"name": "half_gap", "value": 0.02, "low": 0.019, "high": 0.021, "unit": "rad"}
    sure = {"name": "backlash", "place": "load-pulley", "confidence": 0.95, "parameters": [gap]}
    open_ = {"name": "stribeck", "place": "conduit", "confidence": 0.4}
    said = {"batch": "b", "verdict": "undecided", "is_held": False, "mechanisms": [sure], "likeliest": [sure, open_]}
    assert headline(said | {"alternatives": [open_]}) == (
        f"b: Part of what is missing: {claim(sure)}, confidence 0.95. These recordings do not tell what else is"
        " missing, if anything: perhaps stribeck at the conduit (0.40)."
    )


@pytest.mark.parametrize(
    ("verdict", "named"), [("explained", [1, 0]), ("learned", [1, 0]), ("undecided", [1]), ("unexplained", [])]
)
def test_an_undecided_verdict_names_the_mechanisms_that_are_certain(verdict, named):
    law = ("learned-sliding-friction-by-speed", "conduit")
    hypothesis = Hypothesis((("kink", "conduit"), ("stribeck", "conduit"), law))
    assert identified(verdict, hypothesis, [0.6, 0.8, 0.99]) == named


@pytest.mark.parametrize("is_there", [True, False])
def test_what_is_no_batch_is_one_line(tmp_path, is_there):
    if is_there:
        (tmp_path / "empty").mkdir()
    found = run("diagnose", tmp_path / "empty", "--out", tmp_path / "out")
    assert isinstance(found.exception, InputError)
    assert len(str(found.exception).splitlines()) == 1
    (tmp_path / "m.json").write_text("{}")
    found = run("predict", tmp_path / "empty", "--model", tmp_path / "m.json", "--out", tmp_path / "out")
    assert isinstance(found.exception, InputError)
    assert len(str(found.exception).splitlines()) == 1


@pytest.fixture
def motion(tmp_path):
    """Call with angles: a file of a motion of 0.01 s a sample."""

    def made(theta_in, time_s=None):
        time_s = 0.01 * np.arange(len(theta_in)) if time_s is None else time_s
        pd.DataFrame({"time_s": time_s, "theta_in_rad": theta_in}).to_csv(tmp_path / "motion.csv", index=False)
        return tmp_path / "motion.csv"

    return made


def test_the_model_says_what_a_motion_would_do_that_nobody_recorded(clean, motion, tmp_path):
    batch, found = clean
    log = pd.read_csv(batch / "t-7N.csv.gz")
    theta = 0.6 * np.sin(2 * np.pi * np.maximum(log["time_s"] - 0.5, 0))
    asked = [motion(theta, log["time_s"]), "--model", found / "model.json", "--batch", batch]
    assert run("simulate", *asked, "--recording", "t-7N", "--out", tmp_path / "said.csv").exit_code == 0
    said = pd.read_csv(tmp_path / "said.csv")
    assert said["tau_in_Nm"].to_numpy() == pytest.approx(0.0234 * log["drive_current_A"].to_numpy(), abs=2e-3)
    assert run("simulate", *asked, "--pretension", 14, "--out", tmp_path / "tense.csv").exit_code == 0
    assert pd.read_csv(tmp_path / "tense.csv")["F_drive_N"][0] == pytest.approx(28.0, rel=1e-6)


@pytest.mark.parametrize(
    ("theta", "time", "options", "told"),
    [
        ([0.0, np.nan, 0.1], None, [], "row 3: theta_in_rad is empty"),
        ([0.0, 0.1, 0.2], [0.0, 0.1, 0.1], [], "row 4: time_s does not increase"),
        ([], None, [], "no samples"),
        ([0.0, 0.1], None, ["--recording", "none"], "no recording none that can be used; there is t-7N"),
    ],
)
def test_a_motion_that_cannot_be_simulated_is_refused_in_a_line(clean, motion, tmp_path, theta, time, options, told):
    asked = ["simulate", motion(theta, time), "--model", clean[1] / "model.json", "--batch", clean[0], *options]
    with pytest.raises(InputError, match=told):
        raise run(*asked, "--out", tmp_path / "said.csv").exception


def test_a_motion_without_its_columns_is_refused(clean, tmp_path):
    (tmp_path / "motion.csv").write_text("time,angle\n0,0\n")
    asked = [tmp_path / "motion.csv", "--model", clean[1] / "model.json", "--batch", clean[0]]
    with pytest.raises(InputError, match="no column time_s and no theta_in_rad"):
        raise run("simulate", *asked, "--out", tmp_path / "said.csv").exception


def test_the_model_of_an_undecided_verdict_is_stated_with_its_values():
    hypothesis = Hypothesis((("load-cell-offset", "load-sensor"),))
    values = {"load-cell-offset/load-sensor/offset": 0.5}
    best = CandidateFit(hypothesis, [], {}, values, [], [], np.array([[0.04**2]]), np.inf, [], [])
    judgement = SimpleNamespace(verdict="undecided", best=best, confidences=[0.6])
    (stated,) = likeliest_of(judgement)
    assert (stated["name"], stated["place"], stated["confidence"]) == ("load-cell-offset", "load-sensor", 0.6)
    (offset,) = stated["parameters"]
    assert (offset["value"], offset["high"]) == (0.5, pytest.approx(0.5 + 1.645 * 0.04, rel=1e-3))
    judgement.verdict = "explained"
    assert likeliest_of(judgement) == []


def test_a_number_stands_where_a_finer_solver_would_have_it():
    key, found = "load-cell-offset/load-sensor/offset", {}
    for moved in (0.0, 0.03):
        candidate = CandidateFit(
            Hypothesis((("load-cell-offset", "load-sensor"),)),
            [],
            {},
            {key: 0.5},
            [],
            [],
            np.array([[0.04**2]]),
            np.inf,
            [],
            [],
        )
        found[moved] = mechanism_of(replace(candidate, shift=np.array([moved])), 0, 0.9)["parameters"][0]
    plain, corrected = found[0.0], found[0.03]
    assert (plain["value"], corrected["value"]) == (0.5, pytest.approx(0.53))
    reach = plain["high"] - plain["value"]
    assert reach == pytest.approx(1.645 * 0.04, rel=1e-3)
    # It knows of the move, and does not take it for certain.
    assert corrected["high"] - corrected["value"] == pytest.approx(reach * 0.05 / 0.04, rel=1e-3)
    assert corrected["low"] == pytest.approx(2 * corrected["value"] - corrected["high"])


def test_the_interval_of_a_relative_strength_is_symmetric_in_its_logarithm():
    assert interval(0.5, 0.2, is_relative=False) == pytest.approx([0.3, 0.7])
    low, high = interval(-0.1, 0.15, is_relative=True)
    assert (low / -0.1, -0.1 / high) == pytest.approx([np.exp(1.5)] * 2)
    # Small errors are small in either.
    assert interval(0.1, 1e-4, is_relative=True) == pytest.approx(interval(0.1, 1e-4, is_relative=False), rel=1e-5)
    assert np.all(np.isfinite(interval(1e-9, 1.0, is_relative=True)))


def test_the_pipeline_says_which_recordings_it_had_to_do_without(tmp_path, monkeypatch):
    batch = write_batch(tmp_path / "cut", pretensions=(7.0, 5.0))
    with gzip.open(batch / "t-5N.csv.gz", "wt") as f:
        f.write("time_s,drive_encoder_counts\n0.004,0\n")
    ingest(batch, tmp_path / "cut.nc", tmp_path / "cut.json")
    told = []

    def run(recordings, estimates, options, baseline, not_judged, progress):
        told.extend(not_judged)
        raise ModelError("what comes after is not asked here")

    monkeypatch.setattr(stage, "run", run)
    stage.diagnose_recordings([tmp_path / "cut.nc"], tmp_path / "out")
    assert [one["what"] for one in told] == ["t-5N.csv.gz"]
