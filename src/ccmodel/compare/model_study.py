"""Runs of the model alone, for what the paper says and no recording varies: load, loop placement, sections."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ccmodel.compare.errors import last_cycle
from ccmodel.config import ModelStudies
from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.model import paper
from ccmodel.model.exact import pair as exact
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.parameters import Parameters
from ccmodel.model.transmission import Transmission
from ccmodel.recording import Recording

# Worst of these is the error of a number of sections.
COMPARED = ("theta_out_rad", "tau_in_Nm", "tau_out_Nm", "T1_N", "T2_N", "T3_N", "T4_N")


def drive(study: ModelStudies) -> NDArray:
    """A sine from rest, and a little of one more cycle so that the last one ends; rad, shape (n,)."""
    n = study.cycles * study.samples_a_cycle + study.samples_a_cycle // 10
    return study.amplitude_rad * np.sin(2 * np.pi * np.arange(n) / study.samples_a_cycle)


def run(
    parameters: Parameters, path: ConduitPath, stiffness_Nm_per_rad: float, study: ModelStudies, sections: int = 0
) -> Recording:
    """One run against a spring, with both cables at the study's pretension before it.

    Parameters
    ----------
    parameters : Parameters
        Cable, friction and pulleys.
    path : ConduitPath
    stiffness_Nm_per_rad : float
    study : ModelStudies
    sections : int
        Of each cable in the paper's discretisation; 0 for the exact solver.

    Returns
    -------
    Recording
        Of origin "model"; a cycle takes one second, on which nothing depends.

    Raises
    ------
    ModelError
        If the solver does not come to the end.
    """
    transmission = Transmission(
        path=path,
        axial_rigidity_N=parameters.stiffness_N_per_m * parameters.reference_length_m,
        friction_coefficient=parameters.friction,
        drive_radius_m=parameters.drive_radius_m,
        load_radius_m=parameters.load_radius_m,
    )
    theta, load = drive(study), SpringLoad(stiffness_Nm_per_rad)
    initial = InitialTension.uniform(path, study.pretension_N)
    if sections:
        response = paper.simulate_pair(transmission, load, theta, initial, sections)
    else:
        response = exact.simulate_pair(transmission, load, theta, initial)
        if response.status is not exact.Status.OK:
            raise ModelError(f"{response.status.name} at sample {response.reached}: {response.status.value}")
    channels = {"theta_in_rad": theta} | {c: getattr(response, c) for c in COMPARED}
    return Recording(
        batch="model-study",
        id="model",
        origin="model",
        time_s=np.arange(theta.size) / study.samples_a_cycle,
        channels=channels,
        derived_from=dict.fromkeys(channels, "model"),
        pretension_N=study.pretension_N,
        path=path,
    )


def even(study: ModelStudies, bend_rad: float | None = None) -> ConduitPath:
    """The conduit with its bend spread evenly along it."""
    return ConduitPath([study.conduit_length_m], [study.bend_rad if bend_rad is None else bend_rad])


def placements(study: ModelStudies) -> Mapping[str, ConduitPath]:
    """The conduit with one loop of the study's radius at the drive end, in the middle and at the load end.

    Raises
    ------
    ModelError
        If the loop is longer than the conduit.
    """
    loop = study.loop_radius_m * study.bend_rad
    straight = study.conduit_length_m - loop
    if straight <= 0:
        raise ModelError(f"a loop of {loop:.3g} m does not go into a conduit of {study.conduit_length_m:.3g} m")
    return {
        "at the drive end": ConduitPath([loop, straight], [study.bend_rad, 0.0]),
        "in the middle": ConduitPath([straight / 2, loop, straight / 2], [0.0, study.bend_rad, 0.0]),
        "at the load end": ConduitPath([straight, loop], [0.0, study.bend_rad]),
    }


def error_percent(said: Recording, exact_run: Recording) -> float:
    """Largest rms difference of a channel over the last cycle, % of its peak to peak in the exact run."""
    window = last_cycle(exact_run)
    worst = 0.0
    for channel in COMPARED:
        true = exact_run[channel][window]
        worst = max(worst, float(np.sqrt(np.mean((said[channel][window] - true) ** 2)) / np.ptp(true)))
    return 100 * worst


def sections_needed(errors: Mapping[int, float], limit_percent: float) -> int | None:
    """Fewest sections from which on every error is within the limit; None if the last is not."""
    needed = None
    for sections in sorted(errors, reverse=True):
        if errors[sections] > limit_percent:
            break
        needed = sections
    return needed
