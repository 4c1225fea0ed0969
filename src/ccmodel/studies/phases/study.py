"""The simulated example: phases I to IV of one motion, as in the paper's Figs. 5 to 7."""

from collections.abc import Sequence

from ccmodel.geometry import ConduitPath
from ccmodel.model.load import SpringLoad
from ccmodel.model.phases import PhaseStudy, simulate_phases
from ccmodel.model.transmission import Transmission
from ccmodel.studies.loops.settings import Measuring
from ccmodel.studies.phases.figure import DRAW
from ccmodel.studies.phases.settings import PhaseExample
from ccmodel.studies.run import Outcome, Run

SETTINGS = PhaseExample


def judge(example: PhaseExample, runs: Sequence[Run] = (), measuring: Measuring | None = None) -> Outcome:
    """Simulate the example and draw its figures; it needs no recording."""
    study = study_of(example)
    return Outcome([draw(study) for draw in DRAW.values()])


def study_of(example: PhaseExample) -> PhaseStudy:
    """Simulation of the example's motion with the exact solver."""
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
