"""Sensors with faults: from true values to readings, and back at rest."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.mechanisms.contract import Sensing
from ccmodel.model.active import Active, active_of

# Each iteration reduces the error to the share that the fault is of the reading.
FAULT_ITERATIONS = 8


def driven(active: Sequence[Active], time_s: NDArray, theta_in: NDArray) -> NDArray:
    """The drive's angle as it was, from that which its sensor read, both rad of shape (n,).

    Every parameter of `active` has a value.
    """
    for a in active:
        if (modifies_input := registry.get(a.name).modifies_input) is not None:
            theta_in = modifies_input(time_s, theta_in, a.place, a.values)
    return theta_in


def true_at(active: Sequence[Active], seconds: float, read: Mapping[str, float], radii: tuple[float, float]) -> dict:
    """What the sensors would have read without their faults, `seconds` into a recording in which nothing moves.

    Parameters
    ----------
    active : sequence of Active
    seconds : float
        Since the start of the recording.
    read : mapping of str to float
        Reading of each channel of a run.
    radii : (float, float)
        Radii of the drive and the load pulley, m.

    Returns
    -------
    dict of str to float
        The same channels, by fixed-point iteration.
    """
    faults = [a for a in active_of(active) if registry.get(a.name).modifies_observation is not None]
    true = dict(read)
    for _ in range(FAULT_ITERATIONS if faults else 0):
        steady = {c: np.full(2, value) for c, value in true.items()}
        faulty = _read(faults, np.array([0.0, seconds]), steady, radii)
        true = {c: true[c] + read[c] - float(faulty[c][1]) for c in true}
    return true


def read_by_sensors(
    active: Sequence[Active], time_s: NDArray, channels: dict[str, NDArray], radii: tuple[float, float]
) -> dict[str, NDArray]:
    """Readings of the sensors (n samples a channel) from true values, with the faults that act on them."""
    if time_s.size == 0:  # a run that ended before its first sample
        return channels
    return _read(active_of(active), time_s, channels, radii)


def _read(
    active: Sequence[Active], time_s: NDArray, channels: dict[str, NDArray], radii: tuple[float, float]
) -> dict[str, NDArray]:
    """The same, where every parameter has a value."""
    true = channels
    for a in active:
        mechanism = registry.get(a.name)
        if mechanism.modifies_observation is not None:
            sensing = Sensing(time_s, channels, *radii, true)
            channels = channels | mechanism.modifies_observation(sensing, a.place, a.values)
    return channels
