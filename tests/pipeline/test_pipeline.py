"""The whole pipeline on a tiny batch: what it makes, that it stops when nothing changed, what bad input does to it."""

import gzip
import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pandas as pd
import pytest
import yaml

from builders import write_batch
from ccmodel.config import load_config
from ccmodel.recording import read_recordings
from ccmodel.studies.phases.settings import FIGURES as PHASE_FIGURES

ROOT = Path(__file__).parents[2]


def snakemake(folder: Path, *options: str) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "snakemake", "--cores", "2", "--directory", str(folder), "--nolock"]
    command += ["--snakefile", str(ROOT / "Snakefile"), "--configfile", str(folder / "config.yaml"), *options]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def ccmodel(*arguments: str) -> subprocess.CompletedProcess:
    code = "from ccmodel.cli import main; main()"
    return subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=False)


def write_config(folder: Path, **studies: dict) -> None:
    config = {
        "fits": {
            "fitted": {
                "batches": ["tiny"],
                "free": {
                    "stiffness_N_per_m": {"bounds": [1e3, 1e5]},
                    "friction_coefficient": {"bounds": [0.01, 0.6]},
                },
                "channels": ["theta_out_rad", "tau_in_Nm"],
            }
        },
        "phases": load_config(ROOT / "config/config.yaml").phases.model_dump(),
        "studies": {
            "pretension": {"batches": ["tiny"], "variable": "pretension", "title": "pretension"},
            **EXTENDED,
            # The claims' other two studies; a drawing of each comes with them.
            "bend": {"batches": ["tiny"], "variable": "bend"},
            "radius": {"batches": ["tiny"], "variable": "radius"},
            **studies,
        },
        "claims": {
            "bend": "bend",
            "pretension": "pretension",
            "radius": "radius",
            "small_percent": 5,
            "model": {
                "pretension_N": 7.0,
                "amplitude_rad": 0.6,
                "conduit_length_m": 1.2,
                "bend_rad": 3.1416,
                "loop_radius_m": 0.06,
                "load_stiffness_Nm_per_rad": [0.02, 0.05],
                "sections": [8, 16],
                "sections_bend_rad": [3.1416],
                "sections_error_percent": 1,
            },
        },
        "accuracy": {"parameters": "calibrated"},
        "diagnose": "each",
    }
    (folder / "config.yaml").write_text(yaml.safe_dump(config))


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A finished run of a tiny batch, with a diagnosis."""
    folder = tmp_path_factory.mktemp("run")
    write_batch(folder / "data/raw/tiny")
    write_config(folder)
    run = snakemake(folder)
    assert run.returncode == 0, run.stdout + run.stderr
    return folder


@pytest.fixture
def copy(finished, tmp_path):
    """The finished run, free to be changed."""
    folder = tmp_path / "run"
    shutil.copytree(finished, folder, copy_function=shutil.copy2)
    return folder


# A study whose parameters are those of a diagnosis.
EXTENDED = {"one-run": {"batches": ["tiny"], "figure": "transmission", "parameters": "extended"}}


def keep_one_study(folder: Path, **changes) -> None:
    """Leave in a configuration, for a further run, one study and the fit: a test looks at nothing else."""
    config = yaml.safe_load((folder / "config.yaml").read_text())
    config = {"fits": config["fits"], "studies": {"pretension": config["studies"]["pretension"]}}
    (folder / "config.yaml").write_text(yaml.safe_dump(config | changes))


def read_gz(file: Path) -> str:
    return gzip.decompress(file.read_bytes()).decode()


def write_gz(file: Path, text: str) -> None:
    file.write_bytes(gzip.compress(text.encode()))


def test_it_makes_figures_tables_and_the_page(finished):
    results = finished / "results"
    for name in ("pretension", "one-run"):
        assert (results / f"figures/{name}.png").stat().st_size > 10_000
        assert "<svg" in (results / f"figures/{name}.svg").read_text()
        assert (results / f"figures/{name}.pdf").read_bytes().startswith(b"%PDF")
        assert f"figures/{name}.png" in (results / "index.html").read_text()
    for name in ("claims", "claims-model", "accuracy", "accuracy-ratio"):
        assert f"figures/{name}.png" in (results / "index.html").read_text()
        assert (results / f"figures/{name}.png").stat().st_size > 10_000
    csv, parquet = pd.read_csv(results / "tables/errors.csv"), pd.read_parquet(results / "tables/errors.parquet")
    assert csv["rmse"].to_numpy() == pytest.approx(parquet["rmse"].to_numpy(), rel=1e-4)
    assert json.loads((results / "left-out.json").read_text())["diagnosed"] == ["tiny"]
    said = ccmodel("report", str(results))
    assert said.returncode == 0
    assert said.stderr.startswith("warning: "), "a warning is no failure"


def test_every_link_of_the_page_leads_somewhere(finished):
    results = finished / "results"
    text = (results / "index.html").read_text()
    ids = set(re.findall(r'\bid="([^"]+)"', text))
    links = re.findall(r'<a [^>]*?href="([^"]+)"', text)
    assert {f"figures/{name}.{ending}" for name in ("pretension", "claims") for ending in ("svg", "pdf")} <= set(links)
    for link in links:
        name, _, anchor = link.partition("#")
        assert (results / name).exists(), link
        assert not anchor or anchor in ids, link
    assert not re.search(r'<img [^>]*?src="(?!data:)', text)


def test_the_page_holds_the_report_of_each_diagnosis(finished):
    page = (finished / "results/index.html").read_text()
    (section,) = re.findall(r'<details class="diagnosis" id="diagnosis-tiny">(.*?)</details>', page, re.DOTALL)
    report = (finished / "results/diagnoses/tiny/report.html").read_text()
    headings = re.findall(r"<h2[^>]*>(.*?)</h2>", report)
    assert len(headings) > 2
    assert all(heading in section for heading in headings)
    assert section.count("<img") == report.count("<img") > 0


def test_what_a_diagnosis_found_is_one_more_set_of_parameters(finished):
    results = finished / "results"
    assert json.loads((results / "diagnoses/tiny/diagnosis.json").read_text())["verdict"] == "agrees"
    nearest = json.loads((results / "diagnoses/tiny/nearest.json").read_text())
    assert nearest == {"succeeded": False, "message": "verdict 'agrees': the diagnosis has no nearest model"}
    errors = pd.read_parquet(results / "tables/errors.parquet")
    assert set(errors["parameters"]) == {"estimated", "fitted", "calibrated", "extended"}
    by_set = errors[errors["channel"] == "tau_in_Nm"].groupby("parameters", observed=True)["rmse"].mean()
    assert by_set["extended"] == by_set["calibrated"] < 0.2 * by_set["estimated"]
    assert read_recordings(results / "simulated/nearest/tiny.nc") == []
    by_recording = pd.read_csv(results / "tables/accuracy-by-recording.csv")
    calibrated = "stiffness_N_per_m friction_coefficient load_stiffness_Nm_per_rad"
    assert set(by_recording["inputs_left_out"]) == {calibrated}, "a diagnosis states no standard deviations"
    assert json.loads((results / "simulated/nearest/tiny.json").read_text()) == {"failures": []}


@pytest.mark.long
def test_inputs_that_contradict_one_another_are_named_and_get_no_model(copy):
    """Unless the batch's settings say that they are trusted."""
    log = copy / "data/raw/tiny/t-7N.csv.gz"
    write_gz(log, pd.read_csv(log).assign(drive_current_A=0.0).to_csv(index=False))
    shutil.copytree(copy / "data/raw/tiny", copy / "data/raw/trusted")
    batch = copy / "data/raw/trusted/batch.yaml"
    batch.write_text(batch.read_text().replace("batch: tiny", "batch: trusted"))
    trusted = {"trust_inputs": True, "time_limit_s": 5}
    keep_one_study(copy, diagnose="each", diagnosing_by_batch={"trusted": trusted}, fits={}, studies=EXTENDED)
    run = snakemake(copy)
    assert run.returncode == 0, run.stdout + run.stderr
    results = copy / "results"
    assert json.loads((results / "diagnoses/tiny/diagnosis.json").read_text())["verdict"] == "inputs-inconsistent"
    for name in ("calibrated", "extended", "nearest"):
        assert read_recordings(results / f"simulated/{name}/tiny.nc") == []
    dead = "t-7N.csv.gz, drive_current_A: is 0 throughout"
    page = (results / "index.html").read_text()
    assert page.index('id="contradictory"') < page.index(dead) < page.index('<article class="card inputs-inconsistent"')
    said = ccmodel("report", str(results))
    assert said.returncode == 1
    lines = [line for line in said.stderr.splitlines() if dead in line]
    assert {line.partition("t-7N")[0] for line in lines} == {
        "inconsistent: data/raw/tiny/",
        "warning: data/raw/trusted/",
    }
    # Whatever the verdict.
    trusted = json.loads((results / "diagnoses/trusted/diagnosis.json").read_text())
    assert "t-7N.csv.gz, drive_current_A" in [n["what"] for n in trusted["not_judged"]]
    assert trusted["verdict"] != "inputs-inconsistent"


def planned(folder: Path) -> set[str]:
    """Messages of the jobs that would run for a batch."""
    lines = [line.strip() for line in snakemake(folder, "--dry-run").stdout.splitlines()]
    return {line.split(": ", 1)[1] for line in lines if line.startswith("Job ") and " batch " in line}


@pytest.mark.long
def test_a_rig_has_its_own_fits_and_a_batch_its_own_settings(copy):
    write_batch(copy / "data/raw/other", pretensions=(5.0,))
    keep_one_study(copy)
    config = yaml.safe_load((copy / "config.yaml").read_text())
    config |= {"rigs": {"one": ["tiny"], "two": ["other"]}, "diagnose": "each"}
    config["diagnosing_by_batch"] = {"other": {"tolerance": 0.02, "step_s": 0.1}}
    (copy / "config.yaml").write_text(yaml.safe_dump(config))
    sets = ("estimated", "calibrated", "extended", "nearest")
    simulated = {f"Running the model on batch other with parameters '{name}'" for name in sets}
    of_other = {message for message in planned(copy) if "batch other" in message}
    assert of_other == {"Reading batch other", "Diagnosing batch other"} | simulated, "and no fit of the other rig"
    assert snakemake(copy).returncode == 0
    config["diagnosing_by_batch"]["other"]["step_s"] = 0.2
    (copy / "config.yaml").write_text(yaml.safe_dump(config))
    again = planned(copy)
    assert "Diagnosing batch other" in again
    assert not [message for message in again if "batch tiny" in message]
    errors = pd.read_parquet(copy / "results/tables/errors.parquet")
    assert {b: set(t["parameters"]) - {"nearest"} for b, t in errors.groupby("batch")} == {
        "tiny": {"estimated", "fitted", "calibrated", "extended"},
        "other": {"estimated", "calibrated", "extended"},
    }


@pytest.mark.long
def test_snakemakes_report_has_page_diagnoses_tables_and_figures_with_their_captions(finished):
    run = snakemake(finished, "--report", str(finished / "report.zip"))
    assert run.returncode == 0, run.stdout + run.stderr
    with zipfile.ZipFile(finished / "report.zip") as archive:
        text = archive.read("report/report.html").decode()
        entries, _ = json.JSONDecoder().raw_decode(text, text.index('{"results/index.html"'))
        # They are the files of the run, not drawn again.
        for file, entry in entries.items():
            assert archive.read(f"report/{entry['data_uri']}") == (finished / file).read_bytes(), file
    results = finished / "results"
    wanted = {results / "index.html", *results.glob("diagnoses/*/report.html"), *results.glob("tables/*.csv")}
    wanted |= set(results.glob("figures/**/*.png"))
    assert set(entries) == {str(file.relative_to(finished)) for file in wanted}
    caption = {file: entry["caption"] for file, entry in entries.items()}
    assert all(text.startswith("<p>") for text in caption.values())
    assert "pretension: tiny. Loops of the last whole cycle" in caption["results/figures/pretension.png"]
    assert "not recordings" in caption["results/figures/phases/response.png"]
    assert "Diagnosis of batch tiny" in caption["results/diagnoses/tiny/report.html"]
    labels = [tuple(entry["labels"].items()) for entry in entries.values()]
    assert len(set(labels)) == len(labels), "every entry can be told from the others"


@pytest.mark.long
def test_batches_of_a_rig_are_diagnosed_together(copy):
    write_batch(copy / "data/raw/other", pretensions=(7.0, 5.0))
    keep_one_study(copy, studies=EXTENDED)
    config = yaml.safe_load((copy / "config.yaml").read_text())
    config |= {"rigs": {"bench": ["tiny", "other"]}, "diagnose": ["tiny"], "diagnose_rigs": "each"}
    config["diagnosing_by_batch"] = {"bench": {"step_s": 0.01}}
    (copy / "config.yaml").write_text(yaml.safe_dump(config))
    run = snakemake(copy)
    assert run.returncode == 0, run.stdout + run.stderr
    assert "Diagnosing rig bench" in run.stdout + run.stderr
    results = copy / "results"
    said = json.loads((results / "diagnoses/bench/diagnosis.json").read_text())
    assert (said["batch"], said["batches"], said["verdict"]) == ("bench", ["tiny", "other"], "agrees")
    assert not (results / "diagnoses/other").exists()
    page = (results / "index.html").read_text()
    card = page[page.index('id="card-bench"') :].partition("</article>")[0]
    assert "The batches tiny, other together" in card and "4 recordings" in card
    assert 'id="diagnosis-bench"' in page
    assert "Rig bench, its 2 batches together: agrees." in page
    summary = ccmodel("report", str(results))
    assert summary.returncode == 0 and "bench: agrees." in summary.stdout


def test_the_papers_simulated_figures_stand_under_a_heading_of_their_own(finished):
    page = (finished / "results/index.html").read_text()
    section = page[page.index('<h2 id="phases">Simulated') : page.index('<h2 id="fits">')]
    for name in PHASE_FIGURES:
        assert "simulated (no recording)" in (finished / f"results/figures/phases/{name}.svg").read_text()
        assert (finished / f"results/figures/phases/{name}.png").stat().st_size > 10_000
        assert f"figures/phases/{name}.png" in section
    assert "figures/phases" not in page.replace(section, "")


def test_it_recovers_the_truth_that_the_logs_were_made_with(finished):
    fit = json.loads((finished / "results/fits/fitted/shared.json").read_text())
    assert fit["succeeded"]
    assert fit["values"]["stiffness_N_per_m"] == pytest.approx(7750, rel=0.01)
    assert fit["values"]["friction_coefficient"] == pytest.approx(0.156, rel=0.01)
    errors = pd.read_parquet(finished / "results/tables/errors.parquet")
    means = errors.groupby("parameters")["nrmse_percent"].mean()
    assert means["fitted"] < 0.5 < means["estimated"]


def test_claims_and_accuracy_have_numbers_or_say_why_not(finished):
    tables = finished / "results/tables"
    claims = pd.read_csv(tables / "claims.csv")
    assert (claims[["value", "model", "gap"]].notna().any(axis=1)).all()
    # One recording a pretension; over bend and radius both are one condition.
    told = claims[claims["claim"].str.contains("pretension") & (claims["recordings"] > 0)]
    assert len(told) and told["gap"].eq("no repeats: no interval").all()
    assert not claims["source"].str.contains("measured").any()
    accuracy, each = pd.read_csv(tables / "accuracy.csv"), pd.read_csv(tables / "accuracy-by-recording.csv")
    assert accuracy["gap"].eq("2 pairs, fewer than the 3 that a scatter takes").all()
    assert each["u_val"].gt(0).all()
    assert each.groupby("quantity")["recording"].count().eq(2).all()


def test_simulated_data_are_never_called_measured(finished):
    page = (finished / "results/index.html").read_text()
    assert "virtual rig, simulated" in page
    assert 'class="badge simulated"' in page
    shown = re.sub(r"<(style|script)\b.*?</\1>", "", page, flags=re.DOTALL)
    for of_the_paper in ("the paper's Table I (measured)", "the paper measured", "not in an experiment"):
        shown = shown.replace(of_the_paper, "")
    assert "measured" not in shown
    assert "experiment" not in shown


def test_recordings_carry_their_provenance(finished):
    import netCDF4

    with netCDF4.Dataset(finished / "results/recordings/tiny.nc") as root:
        provenance = json.loads(root.provenance)
    assert provenance["ccmodel_version"]
    assert set(provenance["sha256"]) == {"batch.yaml", "t-7N.csv.gz", "t-3.5N.csv.gz"}
    assert len(provenance["sha256"]["batch.yaml"]) == 64
    recordings = read_recordings(finished / "results/recordings/tiny.nc")
    assert [r.id for r in recordings] == ["t-7N", "t-3.5N"]
    assert "tau_in_Nm" in recordings[0].derived_from["T1_N"]


def test_tables_carry_their_provenance(finished):
    attrs = pd.read_parquet(finished / "results/tables/errors.parquet").attrs
    assert "results/recordings/tiny.nc" in attrs["sha256"]


def test_a_second_run_does_nothing(copy):
    before = (copy / "results/index.html").stat().st_mtime_ns
    run = snakemake(copy)
    assert "Nothing to be done" in run.stdout + run.stderr
    assert (copy / "results/index.html").stat().st_mtime_ns == before


def test_a_log_is_read_again_if_an_older_one_takes_its_place(copy):
    """As mv, cp -p, rsync -a and tar leave its date."""
    log = copy / "data/raw/tiny/t-7N.csv.gz"
    write_gz(log, read_gz(log).replace("100,", "101,", 1))
    os.utime(log, (0, 0))
    assert "Reading batch tiny" in planned(copy)


@pytest.mark.long
def test_a_page_is_written_again_if_an_older_file_takes_the_place_of_what_it_reads(copy):
    """As `mv` does with what an import has left out, and with what was concealed."""
    (findings, concealed), older = (copy / "data/raw/findings.json", copy / "concealed.json"), "older"
    findings.write_text("[]")
    concealed.write_text(json.dumps({"format": 1, "rigs": []}))
    keep_one_study(copy, studies={}, concealed="concealed.json")
    assert snakemake(copy).returncode == 0
    assert "Nothing to be done" in snakemake(copy, "--dry-run").stdout
    left_out = {"batch": "b", "file": older, "row": None, "column": None, "text": "empty", "severity": "refused"}
    rig = {"batches": ["tiny"], "effects": [{"text": older}]}
    for file, content in ((findings, [left_out]), (concealed, {"format": 1, "rigs": [rig]})):
        before = file.read_text()
        file.write_text(json.dumps(content))
        os.utime(file, (0, 0))
        assert "Writing the page" in snakemake(copy, "--dry-run").stdout
        file.write_text(before)
        os.utime(file, (0, 0))
        assert "Nothing to be done" in snakemake(copy, "--dry-run").stdout


@pytest.mark.long
def test_a_new_batch_appears_with_three_lines_of_config(copy):
    write_batch(copy / "data/raw/added", pretensions=(5.0,))
    keep_one_study(copy, accuracy={})
    config = yaml.safe_load((copy / "config.yaml").read_text())
    config["studies"]["added"] = {"batches": ["added"], "variable": "pretension"}
    (copy / "config.yaml").write_text(yaml.safe_dump(config))
    results = copy / "results"
    old = ["simulated/fitted/tiny.nc", "fits/fitted/shared.json", "recordings/tiny.nc", "figures/pretension.png"]
    before = [(results / f).stat().st_mtime_ns for f in old]
    assert snakemake(copy).returncode == 0
    assert [(results / f).stat().st_mtime_ns for f in old] == before, "only what depends on the new batch is made"
    assert (copy / "results/figures/added.png").exists()
    assert "added" in set(pd.read_parquet(copy / "results/tables/errors.parquet")["batch"])
    # By default the accuracy is that of the fit.
    assert pd.read_csv(results / "tables/accuracy-by-recording.csv")["inputs_left_out"].isna().all()


@pytest.mark.long
def test_bad_input_is_a_line_each_and_nothing_else_is_lost(copy):
    raw = copy / "data/raw"
    write_batch(raw / "misspelt")
    write_batch(raw / "damaged", pretensions=(7.0, 5.0, 3.5, 2.0))
    batch = raw / "misspelt/batch.yaml"
    batch.write_text(batch.read_text().replace("pretension_N", "pretensoin_N", 1))
    no_column, empty, cut = (raw / f"damaged/t-{name}.csv.gz" for name in ("7N", "5N", "3.5N"))
    rows = read_gz(no_column).splitlines()
    write_gz(no_column, "\n".join(row.rsplit(",", 1)[0] for row in rows) + "\n")
    write_gz(empty, "")
    text = read_gz(cut)
    write_gz(cut, text[: len(text) // 2])
    keep_one_study(copy)

    run = snakemake(copy)
    assert run.returncode == 0, run.stdout + run.stderr
    said = ccmodel("report", str(copy / "results"))
    assert said.returncode == 1
    lines = [line for line in said.stderr.splitlines() if line.startswith("refused")]
    assert len(lines) == 4, said.stderr
    for place, what in (
        ("misspelt/batch.yaml", "did you mean 'pretension_N'"),
        ("damaged/t-7N.csv.gz", "load_load_cell_V"),
        ("damaged/t-5N.csv.gz", "empty"),
        ("damaged/t-3.5N.csv.gz", "cut"),
    ):
        (line,) = [line for line in lines if place in line]
        assert what in line
    errors = pd.read_parquet(copy / "results/tables/errors.parquet")
    assert set(errors["batch"]) == {"tiny", "damaged"}
    assert set(errors.loc[errors["batch"] == "damaged", "recording"]) == {"t-2N"}


@pytest.mark.long
def test_a_refused_batch_takes_only_its_own_with_it(copy):
    """The batch that everything was fitted on is refused: the recordings of the others are still drawn and scored."""
    write_batch(copy / "data/raw/other", pretensions=(5.0,))
    batch = copy / "data/raw/tiny/batch.yaml"
    batch.write_text(batch.read_text().replace("format: 1", "fromat: 1"))
    (copy / "data/raw/not a batch").mkdir()
    (copy / "data/raw/empty").mkdir()
    (copy / "data/raw/other/.ipynb_checkpoints").mkdir()
    write_config(copy, added={"batches": ["other"], "variable": "pretension"})
    run = snakemake(copy)
    assert run.returncode == 0, run.stdout + run.stderr
    lines = ccmodel("report", str(copy / "results")).stderr
    every = "did you mean 'format'", "not a batch: a name is letters", "empty/batch.yaml", "fit fitted: no usable"
    for said in every:
        assert said in lines
    assert "not simulated" in (copy / "results/figures/added.svg").read_text()
    assert set(pd.read_parquet(copy / "results/tables/errors.parquet")["batch"]) == {"other"}


def test_left_out_of_a_run_that_did_not_end_says_so(tmp_path):
    said = ccmodel("report", str(tmp_path))
    assert said.returncode == 2
    assert "holds no results of a run that came to its end" in said.stderr
    assert "Traceback" not in said.stderr


def test_a_misspelt_key_of_the_configuration_is_one_line(copy):
    config = copy / "config.yaml"
    config.write_text(config.read_text().replace("variable:", "varable:", 1))
    run = snakemake(copy)
    assert run.returncode != 0
    assert "did you mean 'variable'" in run.stderr
    assert "Traceback" not in run.stderr


@pytest.mark.long
def test_a_fit_with_a_name_of_a_diagnosis_and_a_missing_file_are_one_line(copy):
    config = copy / "config.yaml"
    text = config.read_text()
    for edited, said in (
        (
            text.replace("fitted:", "calibrated:", 1),
            "'calibrated' names models of the diagnoses; call the fit",
        ),
        (text + "concealed: nowhere.json\n", "concealed: there is no file nowhere.json"),
    ):
        config.write_text(edited)
        run = snakemake(copy)
        assert run.returncode != 0
        assert len([line for line in run.stderr.splitlines() if said in line]) == 1
        assert "Traceback" not in run.stderr
