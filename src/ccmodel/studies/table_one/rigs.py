"""The last cycle of a simulated rig, and of the paper's model of it: arrays of shape (channels, samples)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product, starmap

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import F_DRIVE, F_LOAD, SUM_AT, TABLE_ONE, TAU_IN, TAU_OUT, TENSIONS_AT, THETA_OUT
from ccmodel.geometry import ConduitPath
from ccmodel.model.exact import pair as exact
from ccmodel.model.general import run as general
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.transmission import Transmission
from ccmodel.studies.table_one.effects import DIFFERENCE, Effect
from ccmodel.studies.table_one.settings import Cable, NotStated, Rig

START_UP_CYCLES = 0.5
ENDS = ("drive-end", "load-end")


@dataclass(frozen=True)
class Condition:
    """A choice for everything that the paper leaves open."""

    rig: str
    load_stiffness_Nm_per_rad: float
    amplitude_rad: float
    frequency_Hz: float
    fit_over: str = "peak-to-peak"

    @property
    def without_fit(self) -> "Condition":
        """The condition without the norm of the fit."""
        return replace(self, fit_over="")

    def cable(self, rig: Rig) -> Cable:
        """Stiffness and friction of the rig's cables in their conduits."""
        return rig.fitted if self.rig == "fitted" else rig.measured


def conditions(open_: NotStated) -> list[Condition]:
    """Every combination."""
    choices = (open_.rigs, open_.load_stiffness_Nm_per_rad, open_.amplitude_rad, open_.frequency_Hz, open_.fit_over)
    return list(starmap(Condition, product(*choices)))


def within_ranges(rig: Rig, condition: Condition) -> bool:
    """Whether the condition is within the ranges of the paper's sensors."""
    cable = condition.cable(rig)
    _, tau_in, tau_out, T1, T2, T3, T4 = plain(rig, condition, cable.stiffness_N_per_m, cable.friction_coefficient)
    torque = np.abs([tau_in, tau_out]).max()
    force = max((T1 + T3).max(), (T2 + T4).max())
    return bool(torque <= rig.torque_range_Nm and force <= rig.load_cell_range_N)


def recorded(rig: Rig, condition: Condition, effects: Sequence[Effect]) -> NDArray:
    """Sensor readings of a rig in which `effects` act.

    Raises
    ------
    ModelError
        If the general solver finds no solution.
    """
    cable = condition.cable(rig)
    ratio = {e.name: 1 + e.values[DIFFERENCE] for e in effects if e.is_set_up}
    path = _path(rig)
    time_s, theta_in = motion(rig, condition)
    response = general.simulate(
        _transmission(rig, cable.stiffness_N_per_m, cable.friction_coefficient),
        SpringLoad(condition.load_stiffness_Nm_per_rad * ratio.get("load-stiffness", 1.0)),
        time_s,
        theta_in,
        InitialTension.uniform(path, rig.pretension_N * ratio.get("pretension", 1.0)),
        _acting(rig, condition, effects),
    )
    return _table_channels(response.complete().read, rig)


def plain(rig: Rig, condition: Condition, stiffness: float, friction: float) -> NDArray:
    """The paper's model under the same motion, with a stiffness (N/m) and a friction coefficient.

    Raises
    ------
    ModelError
        If the exact solver does not reach the last sample.
    """
    initial = InitialTension.uniform(_path(rig), rig.pretension_N)
    load = SpringLoad(condition.load_stiffness_Nm_per_rad)
    pair = _transmission(rig, stiffness, friction)
    response = exact.simulate_pair(pair, load, motion(rig, condition)[1], initial).complete()
    read = {channel: getattr(response, channel) for channel in TABLE_ONE}
    sums = {SUM_AT[end]: read[first] + read[second] for end, (first, second) in TENSIONS_AT.items()}
    return _table_channels(read | sums, rig)


def motion(rig: Rig, condition: Condition) -> tuple[NDArray, NDArray]:
    """Times (s) and drive angles (rad): a sine whose amplitude grows smoothly in the first half cycle."""
    cycle = np.arange(rig.motion.cycles * rig.motion.samples_per_cycle + 1) / rig.motion.samples_per_cycle
    s = np.minimum(cycle / START_UP_CYCLES, 1.0)
    growth = s**3 * (10 - 15 * s + 6 * s**2)
    return cycle / condition.frequency_Hz, condition.amplitude_rad * growth * np.sin(2 * np.pi * cycle)


def _acting(rig: Rig, condition: Condition, effects: Sequence[Effect]) -> list[general.Active]:
    acting = {(e.name, e.place): dict(e.values) for e in effects if not e.is_set_up}
    if condition.rig == "measured-free":
        for end in ENDS:  # the compliance of a termination adds to that of the free cable
            own = acting.setdefault(("termination-compliance", end), {"compliance": 0.0})
            own["compliance"] += rig.free_end_compliance
    return [general.Active(name, place, values) for (name, place), values in acting.items()]


def _path(rig: Rig) -> ConduitPath:
    return ConduitPath(np.array([rig.conduit_length_m]), np.array([rig.bend_rad]))


def _transmission(rig: Rig, stiffness: float, friction: float) -> Transmission:
    R = rig.pulley_radius_m
    return Transmission(_path(rig), stiffness * rig.conduit_length_m, friction, R, R)


def _table_channels(read: Mapping[str, NDArray], rig: Rig) -> NDArray:
    """Table I's channels over the last cycle; the tensions are derived from torques and sums, as in the paper."""
    drive, load = read[TAU_IN] / rig.pulley_radius_m, read[TAU_OUT] / rig.pulley_radius_m
    F_drive, F_load = read[F_DRIVE], read[F_LOAD]
    tensions = [(F_drive + drive) / 2, (F_load + load) / 2, (F_drive - drive) / 2, (F_load - load) / 2]
    channels = np.stack([read[THETA_OUT], read[TAU_IN], read[TAU_OUT], *tensions])
    return channels[:, -rig.motion.samples_per_cycle :]
