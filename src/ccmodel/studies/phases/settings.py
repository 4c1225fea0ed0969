"""Settings of the simulated example of the paper's Figs. 5 to 7."""

from typing import ClassVar

from pydantic import Field

from ccmodel.studies.settings import StudySettings
from ccmodel.typed import Positive

FIGURES = ("response", "torque-loop", "profiles")


class PhaseExample(StudySettings):
    """The simulated example of the paper's Figs. 5 to 7: two cables, a spring load, a sine that starts from rest."""

    kind: ClassVar = "phases"
    heading: ClassVar = "Simulated phases"
    shows: ClassVar = (
        "Simulations with the exact solver, not recordings: response to a sine, torque loop with phases I to IV, and"
        " tension along the cables, as in the paper's Figs. 5 to 7."
    )
    figures: ClassVar = tuple(f"{{name}}/{figure}" for figure in FIGURES)

    conduit_length_m: Positive = Field(description="arc length of the conduits, m")
    conduit_bend_rad: Positive = Field(description="bend angle of the conduits, of constant curvature, rad")
    cable_stiffness_N_per_m: Positive = Field(description="stiffness of one cable with its conduit, N/m")
    friction_coefficient: Positive = Field(description="friction coefficient mu between cable and conduit")
    pulley_radius_m: Positive = Field(description="radius of both pulleys, m")
    load_stiffness_Nm_per_rad: Positive = Field(description="stiffness of the load's spring, N m/rad")
    pretension_N: Positive = Field(description="initial tension all along both cables, N")
    amplitude_rad: Positive = Field(description="amplitude of the drive angle, rad")
    frequency_Hz: Positive = Field(description="frequency of the drive angle, Hz")
    # A multiple of four, so that the reversals, at a quarter and three quarters of a cycle, are samples.
    samples_per_cycle: int = Field(4000, ge=8, multiple_of=4, description="samples of each cycle of the sine")
