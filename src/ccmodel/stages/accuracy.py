"""Recordings, simulations and fits -> bias, scatter and comparison errors, as tables and a figure."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import pandas as pd

from ccmodel import provenance
from ccmodel.compare.accuracy import Case, comparison_table, summary
from ccmodel.config import Accuracy, Measuring
from ccmodel.report.accuracy import ratio_figure, scatter_figure
from ccmodel.report.figures import save_figure
from ccmodel.stages.files import fitted, read_pairs, write_json


def judge_accuracy(
    settings: Accuracy, how: Measuring, runs: Iterable[tuple[Path, Path, Path | None]], csv_file: Path,
    by_recording_file: Path, summary_file: Path, scatter_files: Sequence[Path], ratio_files: Sequence[Path],
) -> None:  # fmt: skip
    """Judge runs of (recordings, simulated, fit) files; without a fit the model ran with the batch's estimates."""
    runs = list(runs)
    table = comparison_table([case for run in runs for case in _cases(*run)], settings, how)
    lines = summary(table, settings)
    table.to_csv(by_recording_file, index=False, float_format="%.6g")
    flat = [line | {"inputs_left_out": " ".join(line["inputs_left_out"])} for line in lines]
    pd.DataFrame(flat).to_csv(csv_file, index=False, float_format="%.6g")
    inputs = provenance.of_inputs({file for run in runs for file in run if file is not None})
    write_json(summary_file, {"settings": settings.model_dump(), "quantities": lines, "provenance": inputs})
    for draw, files in ((scatter_figure, scatter_files), (ratio_figure, ratio_files)):
        figure = draw(table, lines)
        for file in files:
            save_figure(figure, file)


def _cases(recordings_file: Path, simulated_file: Path, fit_file: Path | None) -> list[Case]:
    fit = fitted(recordings_file, fit_file)
    if fit.parameters is None:
        return []
    return [
        Case(recorded, said, fit.parameters, fit.sds, f"{recorded.batch}/{recorded.id}" in fit.recordings)
        for recorded, said in read_pairs(recordings_file, simulated_file)
        if said is not None
    ]
