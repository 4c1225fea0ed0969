"""The model's accuracy: comparison errors, bias and scatter over all batches, as tables and figures."""

from collections.abc import Sequence

import pandas as pd

from ccmodel.studies.accuracy.comparison import Case, comparison_table, summary
from ccmodel.studies.accuracy.figure import ratio_figure, scatter_figure
from ccmodel.studies.accuracy.settings import Accuracy
from ccmodel.studies.loops.settings import Measuring
from ccmodel.studies.run import Outcome, Run

SETTINGS = Accuracy


def judge(settings: Accuracy, runs: Sequence[Run], measuring: Measuring) -> Outcome:
    """Compare all recordings of the runs with their simulations."""
    table = comparison_table([case for run in runs for case in _cases(run)], settings, measuring)
    lines = summary(table, settings)
    flat = pd.DataFrame([line | {"inputs_left_out": " ".join(line["inputs_left_out"])} for line in lines])
    figures = [draw(table, lines) for draw in (scatter_figure, ratio_figure)]
    return Outcome(figures, [flat, table], {"settings": settings.model_dump(), "quantities": lines})


def _cases(run: Run) -> list[Case]:
    fit = run.fitted
    if fit.parameters is None:
        return []
    return [
        Case(recorded, simulated, fit.parameters, fit.sds, f"{recorded.batch}/{recorded.id}" in fit.recordings)
        for recorded, simulated in run.pairs
        if simulated is not None
    ]
