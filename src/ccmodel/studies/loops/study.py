"""A figure of loops: recordings and simulations of the batches of a study."""

from collections.abc import Sequence

from ccmodel.studies.loops.figure import draw
from ccmodel.studies.loops.settings import Measuring, Study
from ccmodel.studies.run import Outcome, Run

SETTINGS = Study


def judge(study: Study, runs: Sequence[Run], measuring: Measuring | None = None) -> Outcome:
    """Draw the study's figure."""
    return Outcome([draw([pair for run in runs for pair in run.pairs], study)])
