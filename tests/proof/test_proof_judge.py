"""From a seed to a result, with a stand-in of a few lines for the diagnosis."""

import json

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from proof import conceal
from proof import judge as judging
from proof.build import record
from proof.cases import draw
from proof.cli import _is_of, app
from proof.measured import REST_S
from proof.outcome import outcome

# Its verdict is `agrees`. Its prediction is constant but for the load angle, which follows the drive.
STAND_IN = """
import json, pathlib, sys
import numpy as np, pandas as pd

COUNT, AMPERE = 2 * np.pi / 2000, 0.0234

def main():
    what, batch, out = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[sys.argv.index("--out") + 1])
    out.mkdir(exist_ok=True)
    if what == "diagnose":
        diagnosis = {"verdict": "agrees", "location": None, "mechanisms": [], "alternatives": []}
        (out / "diagnosis.json").write_text(json.dumps(diagnosis))
        for name in ("calibrated", "model"):
            (out / f"{name}.json").write_text("{}")
        return
    for file in batch.glob("*.csv.gz"):
        log = pd.read_csv(file)
        predicted = {"time_s": log["time_s"], "theta_out_rad": log["drive_encoder_counts"] * COUNT}
        for side, end in (("drive", "in"), ("load", "out")):
            predicted[f"tau_{end}_Nm"] = log[f"{side}_current_A"] * AMPERE
            predicted[f"F_{side}_N"] = (log[f"{side}_load_cell_V"] - 0.25) / 0.1
        pd.DataFrame(predicted).to_csv(out / file.name.replace(".csv.gz", ".csv"), index=False)
"""


@pytest.fixture(scope="module")
def case():
    return next(c for c in (draw(s, "poor", "load-cell-offset") for s in range(50)) if c.protocol == "one")


@pytest.fixture(scope="module")
def stand_in(tmp_path_factory):
    package = tmp_path_factory.mktemp("stand-in") / "ccmodel"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "cli.py").write_text(STAND_IN)
    return package


@pytest.fixture(scope="module")
def result(case, stand_in, tmp_path_factory):
    return judging.judge(case, tmp_path_factory.mktemp("judged"), stand_in, report=lambda line: None)


def test_results_of_other_sources_are_not_kept(result, stand_in, tmp_path):
    (tmp_path / "result.json").write_text(json.dumps(result))
    made_by = {"sources": conceal.digest_of(stand_in), "builder": conceal.builder_digest()}
    assert _is_of(made_by, tmp_path / "result.json")
    for other in ({"sources": conceal.digest_of()}, {"builder": "another"}):
        assert not _is_of(made_by | other, tmp_path / "result.json")


def test_a_run_is_refused_if_the_diagnosis_has_changed(tmp_path):
    ran = CliRunner().invoke(app, ["full", "--index", "1", "--out", str(tmp_path), "--digest", "0" * 16])
    assert ran.exit_code == 2
    assert "has changed since this run began" in " ".join(ran.output.split())


def test_a_result_holds_the_diagnosis_and_no_answer(case, result):
    assert result["diagnosis"]["verdict"] == "agrees"
    assert result["tampering"] == []
    assert "load-cell-offset" not in json.dumps({k: v for k, v in result.items() if k != "asked"})
    assert result["key"] == case.digest


def test_errors_are_those_of_a_load_that_follows_the_drive(result):
    errors = result["errors"]
    # The true load lags by much more than the noise floor, and the true torque is not constant.
    assert errors["theta_out_rad"]["before"] > 2 * errors["theta_out_rad"]["floor"]
    assert errors["tau_in_Nm"]["before"] > 0.01
    assert errors["tau_in_Nm"]["after"] == errors["tau_in_Nm"]["before"]
    assert 5e-5 < errors["tau_in_Nm"]["floor"] < 2e-3


def test_the_scorer_makes_the_same_answer(case, result):
    o = outcome(result)
    assert o.key == case.key
    assert o.verdict == "agrees"


@pytest.mark.parametrize("change", [{"seed": 1}, {"key": "0" * 64}, {"tampering": ["imported virtualrig"]}])
def test_a_result_that_was_tampered_with_is_refused(result, change):
    o = outcome(result | change)
    assert o.diagnosis is None
    assert "refused" in o.failure
    assert o.errors == {}


def test_a_diagnosis_that_fails_is_a_result_too(case, tmp_path):
    package = tmp_path / "ccmodel"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "cli.py").write_text("def main():\n    raise SystemExit('no idea')\n")
    result = judging.judge(case, tmp_path / "out", package, report=lambda line: None)
    assert result["diagnosis"] is None
    assert "no idea" in result["why"]


def test_a_blinded_copy_hides_the_measurements(case, tmp_path):
    record(case, case.kept_back, tmp_path / "kept")
    judging.blind(tmp_path / "kept", tmp_path / "blinded")
    name = f"{case.kept_back[0].id}.csv.gz"
    whole, blinded = (pd.read_csv(tmp_path / folder / name) for folder in ("kept", "blinded"))
    rest = whole["time_s"] < REST_S
    later = whole["time_s"] > 2
    for column in ("drive_current_A", "load_current_A", "load_encoder_counts", "drive_load_cell_V", "load_load_cell_V"):
        np.testing.assert_allclose(blinded[column][rest], whole[column][rest], rtol=1e-6)
        assert whole[column][later].std() > 0
        assert blinded[column][later].nunique() == 1
    pd.testing.assert_series_equal(blinded["drive_encoder_counts"], whole["drive_encoder_counts"])
