"""Recordings and simulations of a study -> its figure."""

from collections.abc import Iterable
from pathlib import Path

from ccmodel.config import Study
from ccmodel.report.figures import FIGURES, save_figure
from ccmodel.stages.files import read_pairs


def draw_study(study: Study, files: Iterable[tuple[Path, Path]], figure_files: Iterable[Path]) -> None:
    """Draw a study from (recordings, simulated) files; the same figure to each of `figure_files`."""
    pairs = [pair for recorded, simulated in files for pair in read_pairs(recorded, simulated)]
    figure = FIGURES[study.figure](pairs, study)
    for file in figure_files:
        save_figure(figure, file)
