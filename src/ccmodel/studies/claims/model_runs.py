"""Runs of the model alone, over conditions that no recording varies: load, place of the loop, sections."""

from collections.abc import Mapping
from itertools import takewhile

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import TABLE_ONE, THETA_IN
from ccmodel.errors import last_cycle
from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.model import paper
from ccmodel.model.exact import pair as exact
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.parameters import Parameters
from ccmodel.model.transmission import Transmission
from ccmodel.recording import Recording
from ccmodel.studies.claims.settings import ModelStudies


def drive(study: ModelStudies) -> NDArray:
    """A sine from rest, rad, shape (n,); a tenth of a further cycle completes the last one."""
    n = study.cycles * study.samples_a_cycle + study.samples_a_cycle // 10
    return study.amplitude_rad * np.sin(2 * np.pi * np.arange(n) / study.samples_a_cycle)


def run(
    parameters: Parameters, path: ConduitPath, study: ModelStudies, load_Nm_per_rad: float | None = None,
    sections: int = 0,
) -> Recording:  # fmt: skip
    """One run against a spring; initially both cables have the study's pretension.

    Parameters
    ----------
    parameters : Parameters
        Cable, friction, pulleys and, without `load_Nm_per_rad`, the load's spring.
    path : ConduitPath
    study : ModelStudies
    load_Nm_per_rad : float, optional
        Stiffness of another spring.
    sections : int
        Sections of each cable in the paper's discretisation; 0 for the exact solver.

    Returns
    -------
    Recording
        With the origin "model". A cycle takes one second; the model does not depend on time.

    Raises
    ------
    ModelError
        If the load has no stiffness, or the solver does not reach the last sample.
    """
    p, theta = parameters, drive(study)
    rigidity = p.stiffness_N_per_m * p.reference_length_m
    transmission = Transmission(path, rigidity, p.friction, p.drive_radius_m, p.load_radius_m)
    if (stiffness := load_Nm_per_rad or p.load_stiffness_Nm_per_rad) is None:
        raise ModelError("the load of the model's rig is a measurement; a run of the model alone takes a spring")
    load = SpringLoad(stiffness)
    initial = InitialTension.uniform(path, study.pretension_N)
    if sections:
        response = paper.simulate_pair(transmission, load, theta, initial, sections)
    else:
        response = exact.simulate_pair(transmission, load, theta, initial).complete()
    channels = {THETA_IN: theta} | {c: getattr(response, c) for c in TABLE_ONE}
    sources, time_s = dict.fromkeys(channels, "model"), np.arange(theta.size) / study.samples_a_cycle
    return Recording("model-study", "model", "model", time_s, channels, sources, study.pretension_N, path)


def even(study: ModelStudies, bend_rad: float | None = None) -> ConduitPath:
    """The conduit, evenly bent."""
    return ConduitPath(np.array([study.conduit_length_m]), np.array([study.bend_rad if bend_rad is None else bend_rad]))


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
        "at the drive end": ConduitPath(np.array([loop, straight]), np.array([study.bend_rad, 0.0])),
        "in the middle": ConduitPath(
            np.array([straight / 2, loop, straight / 2]), np.array([0.0, study.bend_rad, 0.0])
        ),
        "at the load end": ConduitPath(np.array([straight, loop]), np.array([0.0, study.bend_rad])),
    }


def error_percent(simulated: Recording, exact_run: Recording) -> float:
    """Rms difference over the last cycle in the worst channel, % of its peak to peak in the exact run."""
    window = last_cycle(exact_run)
    exact_values, values = (np.array([run[c][window] for c in TABLE_ONE]) for run in (exact_run, simulated))
    rms = np.sqrt(np.mean((values - exact_values) ** 2, axis=1))
    return 100 * float((rms / np.ptp(exact_values, axis=1)).max())


def sections_needed(errors: Mapping[int, float], limit_percent: float) -> int | None:
    """Fewest sections from which on every error is within the limit; None if the most sections have a larger error."""
    largest_first = sorted(errors, reverse=True)
    return min(takewhile(lambda sections: errors[sections] <= limit_percent, largest_first), default=None)


def loop_placements(parameters: Parameters, study: ModelStudies) -> dict[str, Recording]:
    """Runs with the loop at each of its places, against the load's own spring."""
    return {place: run(parameters, path, study) for place, path in placements(study).items()}
