"""A made-up rig's last cycle, and what the plain model says of it: arrays of shape (channels, samples)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ccmodel.compare.table_one.effects import DIFFERENCE, Effect
from ccmodel.compare.table_one.settings import Cable, NotStated, Rig
from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.model.exact import pair as exact
from ccmodel.model.general import run as general
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.transmission import Transmission

START_UP_CYCLES = 0.5
ENDS = ("drive-end", "load-end")


@dataclass(frozen=True)
class Condition:
    """A choice for each thing that the paper leaves open."""

    rig: str
    load_stiffness_Nm_per_rad: float
    amplitude_rad: float
    frequency_Hz: float
    fit_over: str = "peak-to-peak"

    @property
    def without_fit(self) -> "Condition":
        """The same for everything but the fit."""
        return replace(self, fit_over="")

    def cable(self, rig: Rig) -> Cable:
        """Stiffness and friction of the rig's cables in their conduits."""
        return rig.fitted if self.rig == "fitted" else rig.measured


def conditions(open_: NotStated) -> list[Condition]:
    """Every combination."""
    choices = (open_.rigs, open_.load_stiffness_Nm_per_rad, open_.amplitude_rad, open_.frequency_Hz, open_.fit_over)
    return [Condition(*choice) for choice in product(*choices)]


def within_ranges(rig: Rig, condition: Condition) -> bool:
    """Whether the paper's sensors could have recorded it."""
    cable = condition.cable(rig)
    said = plain(rig, condition, cable.stiffness_N_per_m, cable.friction_coefficient)
    torque = np.abs(said[1:3]).max()
    force = max((said[3] + said[5]).max(), (said[4] + said[6]).max())
    return bool(torque <= rig.torque_range_Nm and force <= rig.load_cell_range_N)


def recorded(rig: Rig, condition: Condition, effects: Sequence[Effect]) -> NDArray:
    """What the sensors of a rig show in which `effects` act.

    Raises
    ------
    ModelError
        If the general solver finds no solution.
    """
    cable = condition.cable(rig)
    wrong = {e.name: 1 + e.values[DIFFERENCE] for e in effects if e.is_set_up}
    path = _path(rig)
    time_s, theta_in = motion(rig, condition)
    response = general.simulate(
        _transmission(rig, cable.stiffness_N_per_m, cable.friction_coefficient),
        SpringLoad(condition.load_stiffness_Nm_per_rad * wrong.get("load-stiffness", 1.0)),
        time_s,
        theta_in,
        InitialTension.uniform(path, rig.pretension_N * wrong.get("pretension", 1.0)),
        _acting(rig, condition, effects),
    )
    return _table_channels(response.complete().read, rig)


def plain(rig: Rig, condition: Condition, stiffness: float, friction: float) -> NDArray:
    """What the paper's model says of the same motion with a stiffness (N/m) and a friction coefficient.

    Raises
    ------
    ModelError
        If the exact solver does not come to the end.
    """
    initial = InitialTension.uniform(_path(rig), rig.pretension_N)
    load = SpringLoad(condition.load_stiffness_Nm_per_rad)
    response = exact.simulate_pair(_transmission(rig, stiffness, friction), load, motion(rig, condition)[1], initial)
    if response.status is not exact.Status.OK:
        raise ModelError(f"{response.status.name}: {response.status.value}")
    read = {
        "theta_out_rad": response.theta_out_rad,
        "tau_in_Nm": response.tau_in_Nm,
        "tau_out_Nm": response.tau_out_Nm,
        "F_drive_N": response.T1_N + response.T3_N,
        "F_load_N": response.T2_N + response.T4_N,
    }
    return _table_channels(read, rig)


def motion(rig: Rig, condition: Condition) -> tuple[NDArray, NDArray]:
    """Times (s) and drive angles (rad): a sine that grows within half a cycle, so that no load starts with a jolt."""
    cycle = np.arange(rig.motion.cycles * rig.motion.samples_per_cycle + 1) / rig.motion.samples_per_cycle
    s = np.minimum(cycle / START_UP_CYCLES, 1.0)
    growth = s**3 * (10 - 15 * s + 6 * s**2)
    return cycle / condition.frequency_Hz, condition.amplitude_rad * growth * np.sin(2 * np.pi * cycle)


def _acting(rig: Rig, condition: Condition, effects: Sequence[Effect]) -> list[general.Active]:
    acting = {(e.name, e.place): dict(e.values) for e in effects if not e.is_set_up}
    if condition.rig == "measured-free":
        for end in ENDS:  # a termination that gives comes on top of the free cable
            own = acting.setdefault(("termination-compliance", end), {"compliance": 0.0})
            own["compliance"] += rig.free_end_compliance
    return [general.Active(name, place, values) for (name, place), values in acting.items()]


def _path(rig: Rig) -> ConduitPath:
    return ConduitPath([rig.conduit_length_m], [rig.bend_rad])


def _transmission(rig: Rig, stiffness: float, friction: float) -> Transmission:
    R = rig.pulley_radius_m
    return Transmission(_path(rig), stiffness * rig.conduit_length_m, friction, R, R)


def _table_channels(read: Mapping[str, NDArray], rig: Rig) -> NDArray:
    """Table I's channels over the last cycle, the tensions from torques and sums as the paper has them."""
    R = rig.pulley_radius_m
    drive, load = read["tau_in_Nm"] / R, read["tau_out_Nm"] / R
    channels = (
        read["theta_out_rad"],
        read["tau_in_Nm"],
        read["tau_out_Nm"],
        (read["F_drive_N"] + drive) / 2,
        (read["F_load_N"] + load) / 2,
        (read["F_drive_N"] - drive) / 2,
        (read["F_load_N"] - load) / 2,
    )
    return np.stack(channels)[:, -rig.motion.samples_per_cycle :]
