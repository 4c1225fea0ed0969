"""The simulated example -> the paper's Figs. 5 to 7."""

from collections.abc import Iterable
from pathlib import Path

from ccmodel.config import PhaseExample
from ccmodel.geometry import ConduitPath
from ccmodel.model.load import SpringLoad
from ccmodel.model.phases import PhaseStudy, simulate_phases
from ccmodel.model.transmission import Transmission
from ccmodel.report.figures import save_figure
from ccmodel.report.phases import DRAW


def draw_phases(example: PhaseExample, figure_files: Iterable[Path]) -> None:
    """Draw figures, each named as in `PHASE_FIGURES`, as PNG or SVG by the files' endings."""
    study = study_of(example)
    for file in figure_files:
        save_figure(DRAW[file.stem](study), file)


def study_of(example: PhaseExample) -> PhaseStudy:
    """The example's motion, simulated."""
    path = ConduitPath([example.conduit_length_m], [example.conduit_bend_rad])
    rigidity = example.cable_stiffness_N_per_m * example.conduit_length_m
    radius = example.pulley_radius_m
    return simulate_phases(
        Transmission(path, rigidity, example.friction_coefficient, radius, radius),
        SpringLoad(example.load_stiffness_Nm_per_rad),
        example.pretension_N,
        example.amplitude_rad,
        example.frequency_Hz,
        example.samples_per_cycle,
    )
