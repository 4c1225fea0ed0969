"""Everything that a run made -> the page, and what was left out."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import pandas as pd

from ccmodel.config import Config, Study
from ccmodel.report.page import write_page
from ccmodel.rig.findings import Finding
from ccmodel.stages.files import read_json, write_json
from ccmodel.typed import InputError

LEFT_OUT = "left-out.json"


@dataclass(frozen=True)
class LeftOut:
    """What a run could not use, and what it used although something was wrong; a line each."""

    left_out: list[str]
    warnings: list[str]


def write_report(
    config: Config, studies: dict[str, Study], errors_file: Path, fit_files: Sequence[Path],
    summary_files: Sequence[Path], simulation_files: Sequence[Path], diagnosis_files: Sequence[Path],
    unusable: Sequence[str], judgement_files: Sequence[Path], page_file: Path,
) -> None:  # fmt: skip
    """Write the page that shows everything, and beside it what was left out.

    `unusable` are lines on folders that cannot be a batch at all, `judgement_files` what was asked for of claims.json
    and accuracy.json.
    """
    batches = [read_json(f) for f in summary_files]
    fits = [read_json(f) for f in fit_files]
    findings = [Finding(**f) for batch in batches for f in batch["findings"]]
    imported = Path(config.raw) / "findings.json"  # what an importer passed over
    if imported.exists():
        findings = [Finding(**f) for f in read_json(imported)] + findings
    failures = [line for file in simulation_files for line in read_json(file)["failures"]]
    said = LeftOut(
        left_out=[
            *unusable,
            *(str(f) for f in findings if f.severity == "refused"),
            *(f"fit {f['fit']}: {f['message']}" for f in fits if not f["succeeded"]),
            # A recording that the model cannot run on fails with every parameter set, and is said once.
            *dict.fromkeys(f"not simulated: {line}" for line in failures),
        ],
        warnings=[str(f) for f in findings if f.severity == "warning"],
    )
    write_json(page_file.parent / LEFT_OUT, asdict(said))
    judged = {file.stem: read_json(file) for file in judgement_files}
    errors, diagnoses = pd.read_parquet(errors_file), [read_json(f) for f in diagnosis_files]
    write_page(page_file, config, studies, batches, errors, fits, diagnoses, said.left_out, said.warnings, judged)


def left_out_of(results: Path) -> LeftOut:
    """What the last run into a results folder left out.

    Raises
    ------
    InputError
        If no run has come to its end there.
    """
    file = results / LEFT_OUT
    if not file.exists():
        raise InputError(f"{file}: not there, so no run came to its end; its own messages say why")
    return LeftOut(**read_json(file))
