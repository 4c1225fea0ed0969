"""The pipeline's steps, from files to files. Snakemake's scripts and the command line call these and nothing else."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path

import pandas as pd

from ccmodel import provenance
from ccmodel.compare.errors import COLUMNS, error_table
from ccmodel.config import Config, Study
from ccmodel.identify.fit import fit
from ccmodel.model.paper import ModelError
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import simulate_recording
from ccmodel.recording import Recording, read_recordings, write_recordings
from ccmodel.report.page import write_page
from ccmodel.rig.batch import Batch
from ccmodel.rig.findings import Finding
from ccmodel.rig.ingest import ingest_batch


def ingest(folder: Path, recordings_file: Path, summary_file: Path) -> None:
    """Read a batch folder; write its usable recordings (netCDF) and what was found in it (JSON)."""
    ingested = ingest_batch(folder)
    write_recordings(recordings_file, ingested.recordings, provenance.of_inputs(sorted(folder.iterdir())))
    summary = {
        "folder": str(folder),
        "batch": ingested.batch.model_dump(mode="json") if ingested.batch else None,
        "recordings": [r.id for r in ingested.recordings],
        "findings": [asdict(f) for f in ingested.findings],
    }
    _write_json(summary_file, summary)


def fit_parameters(name: str, config: Config, recordings_files: Sequence[Path], result_file: Path) -> None:
    """Fit a parameter set to the recordings of its batches; a fit that fails is a result that says so."""
    pairs = [
        (recording, estimates)
        for file in recordings_files
        if (estimates := _estimates(file)) is not None
        for recording in read_recordings(file)
    ]
    result = fit(pairs, config.fits[name], config.sections)
    _write_json(result_file, {"fit": name, **result.as_dict(), "provenance": provenance.of_inputs(recordings_files)})


def simulate(
    recordings_file: Path, fit_file: Path | None, sections: int, simulated_file: Path, summary_file: Path
) -> None:
    """Run the model beside every recording of a batch; with the batch's own estimates, or with those fitted."""
    estimates = _estimates(recordings_file)
    values = {} if fit_file is None else _read_json(fit_file)["values"]
    simulated, failures = [], []
    usable = estimates is not None and (fit_file is None or _read_json(fit_file)["succeeded"])
    for recording in read_recordings(recordings_file) if usable else []:
        try:
            simulated.append(simulate_recording(recording, estimates.with_values(values), sections))
        except (ModelError, ValueError) as error:
            failures.append({"batch": recording.batch, "recording": recording.id, "text": str(error)})
    inputs = [recordings_file] + ([] if fit_file is None else [fit_file])
    write_recordings(simulated_file, simulated, provenance.of_inputs(inputs))
    _write_json(summary_file, {"failures": failures})


def tabulate_errors(runs: Iterable[tuple[str, Path, Path]], csv_file: Path, parquet_file: Path) -> None:
    """One error table for all runs (name of the parameter set, recordings, simulated), as CSV and Parquet."""
    tables = [error_table(_pairs(recorded, simulated), name) for name, recorded, simulated in runs]
    table = pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=list(COLUMNS))
    table.to_csv(csv_file, index=False, float_format="%.6g")
    table.to_parquet(parquet_file, index=False)


def draw_study(study: Study, files: Iterable[tuple[Path, Path]], figure_files: Iterable[Path]) -> None:
    """Draw a study from (recordings, simulated) files; the same figure to each of `figure_files`."""
    from ccmodel.report.figures import FIGURES  # the other steps need no matplotlib, and start sooner without

    pairs = [pair for recorded, simulated in files for pair in _pairs(recorded, simulated)]
    figure = FIGURES[study.figure](pairs, study)
    for file in figure_files:
        # Without a date inside, the same input gives the same file.
        figure.savefig(file, dpi=150, metadata={"Date": None} if Path(file).suffix == ".svg" else None)


def report(
    config: Config, studies: dict[str, Study], errors_file: Path, fit_files: Sequence[Path],
    summary_files: Sequence[Path], simulation_files: Sequence[Path], page_file: Path,
) -> None:  # fmt: skip
    """Write the page that shows everything, and beside it what was left out."""
    left_out, warnings = [], []
    batches = []
    for file in summary_files:
        summary = _read_json(file)
        batches.append(summary)
        for finding in (Finding(**f) for f in summary["findings"]):
            (left_out if finding.severity == "refused" else warnings).append(str(finding))
    fits = [_read_json(f) for f in fit_files]
    left_out += [f"fit {f['fit']}: {f['message']}" for f in fits if not f["succeeded"]]
    failures = [f for file in simulation_files for f in _read_json(file)["failures"]]
    left_out += [f"{f['batch']}/{f['recording']}, not simulated: {f['text']}" for f in failures]
    _write_json(page_file.parent / "left-out.json", {"left_out": left_out, "warnings": warnings})
    errors = pd.read_parquet(errors_file)
    write_page(page_file, config, studies, batches, errors, fits, left_out, warnings)


def left_out(results: Path) -> tuple[list[str], list[str]]:
    """What the last run left out, and what it warned of; a line each."""
    said = _read_json(results / "left-out.json")
    return said["left_out"], said["warnings"]


def _pairs(recordings_file: Path, simulated_file: Path) -> list[tuple[Recording, Recording]]:
    simulated = {s.id: s for s in read_recordings(simulated_file)}
    return [(r, simulated[r.id]) for r in read_recordings(recordings_file) if r.id in simulated]


def _estimates(recordings_file: Path) -> Parameters | None:
    """The batch's beforehand estimates, from the summary beside its recordings; None where the batch was refused."""
    batch = _read_json(recordings_file.with_suffix(".json"))["batch"]
    return None if batch is None else Parameters.estimated(Batch.model_validate(batch, strict=False).rig)


def _read_json(file: Path) -> dict:
    return json.loads(Path(file).read_text())


def _write_json(file: Path, data: dict) -> None:
    Path(file).write_text(json.dumps(data, indent=1) + "\n")
