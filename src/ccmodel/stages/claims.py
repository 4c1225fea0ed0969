"""Recordings and simulations of three studies, and runs of the model alone -> the paper's words in numbers."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path

import pandas as pd

from ccmodel import provenance
from ccmodel.compare.claims import Claim, Row, claims_of, loop_placements
from ccmodel.config import Claims, Measuring
from ccmodel.failure import ModelError
from ccmodel.model.parameters import Parameters
from ccmodel.report.claims import model_figure, recordings_figure
from ccmodel.report.figures import save_figure
from ccmodel.stages.files import fitted, read_pairs, write_json

_STATED = ("name", "section", "says", "borne_out")


def judge_claims(
    claims: Claims, how: Measuring, runs: Iterable[tuple[str, Path, Path]], fit_file: Path | None, csv_file: Path,
    json_file: Path, recordings_files: Sequence[Path], model_files: Sequence[Path],
) -> None:  # fmt: skip
    """Judge all claims.

    Parameters
    ----------
    claims : Claims
    how : Measuring
    runs : iterable of (str, Path, Path)
        What varies, recordings and simulated: a line a batch of each study.
    fit_file : Path or None
        What the model alone runs with, besides the estimates of the first batch; None: with these only.
    csv_file, json_file : Path
        The numbers, a row each; the claims with their sentences.
    recordings_files, model_files : sequence of Path
        The two figures.
    """
    runs = list(runs)
    pairs = {variable: [] for variable in claims.studies}
    for variable, recorded, simulated in runs:
        pairs[variable] += read_pairs(recorded, simulated)
    parameters = _parameters([recorded for _, recorded, _ in runs], fit_file)
    found = claims_of(pairs, parameters, claims, how)
    table = pd.DataFrame([_line(claim, row) for claim in found for row in claim.rows])
    table.to_csv(csv_file, index=False, float_format="%.6g")
    inputs = {file for _, *files in runs for file in files} | ({fit_file} if fit_file else set())
    write_json(
        json_file,
        {
            "coverage": claims.coverage,
            "claims": [{name: getattr(c, name) for name in (*_STATED, "sentence")} for c in found],
            "provenance": provenance.of_inputs(sorted(inputs)),
        },
    )
    for figure, files in (
        (recordings_figure(found), recordings_files),
        (model_figure(found, _loops(parameters, claims)), model_files),
    ):
        for file in files:
            save_figure(figure, file)


def _line(claim: Claim, row: Row) -> dict:
    stated = {name: getattr(claim, name) for name in _STATED}
    return {"claim": stated.pop("name"), **stated, **asdict(row)}


def _parameters(recordings_files: Sequence[Path], fit_file: Path | None) -> Parameters | None:
    found = (fitted(file, fit_file).parameters for file in recordings_files)
    return next((parameters for parameters in found if parameters is not None), None)


def _loops(parameters: Parameters | None, claims: Claims) -> dict:
    if parameters is None or parameters.load_stiffness_Nm_per_rad is None:
        return {}
    try:
        return loop_placements(parameters, claims.model)
    except ModelError:
        return {}
