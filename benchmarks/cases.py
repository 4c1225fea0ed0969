"""The runs that the benchmarks measure."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccmodel import mechanisms
from ccmodel.geometry import ConduitPath
from ccmodel.model.general import Active, simulate
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.parameters import Parameters
from ccmodel.model.transmission import Transmission
from ccmodel.recording import Recording

SAMPLES_A_CYCLE = 1000
# The paper's own step, 0.25 ms, at its 1 Hz.
PAPER_SAMPLES_A_CYCLE = 4000
PAPER_SECTIONS = 16


@dataclass(frozen=True)
class Case:
    """A pair, its load and its initial tension.

    Attributes
    ----------
    transmission : Transmission
    load : SpringLoad
    initial : InitialTension
    """

    transmission: Transmission
    load: SpringLoad
    initial: InitialTension


def paper(loops: float = 3, pieces: int = 1) -> Case:
    """The paper's Section IV: 2 m in three loops, 10 N, 1 kN/m. The paper states no friction, pulleys and load.

    Parameters
    ----------
    loops : float
    pieces : int
        The conduit has this many pieces of equal length, with more and less bend in alternation.
    """
    share = 1 + 0.5 * np.cos(np.pi * np.arange(pieces)) if pieces > 1 else np.ones(1)
    path = ConduitPath(np.full(pieces, 2.0 / pieces), 2 * np.pi * loops * share / share.sum())
    return Case(
        Transmission(path, 1000.0 * path.length_m, 0.147, 0.012, 0.012),
        SpringLoad(0.03),
        InitialTension.uniform(path, 10.0),
    )


def as_recording(case: Case, theta_in: NDArray, active: tuple[Active, ...]) -> tuple[Recording, Parameters]:
    """A run of a pair as a recording with counts of 2000 a turn, and the parameters that it was made with."""
    t, count = case.transmission, 2 * np.pi / 2000
    parameters = Parameters(
        stiffness_N_per_m=t.axial_rigidity_N / t.path.length_m,
        reference_length_m=t.path.length_m,
        friction_coefficient=t.friction_coefficient,
        drive_radius_m=t.drive_radius_m,
        load_radius_m=t.load_radius_m,
        load_stiffness_Nm_per_rad=case.load.stiffness_Nm_per_rad,
        mechanisms=tuple(active),
    )
    time_s = np.arange(theta_in.size) / SAMPLES_A_CYCLE
    torque = simulate(t, case.load, time_s, theta_in, case.initial, active).complete().tau_in_Nm
    channels = {"theta_in_rad": count * np.round(theta_in / count), "tau_in_Nm": torque}
    recording = Recording(
        "bench",
        "run",
        "model",
        time_s,
        channels,
        dict.fromkeys(channels, "model"),
        float(case.initial.tension_A_N[0]),
        t.path,
        accuracy={"tau_in_Nm": 1e-4},
        encoder_step_rad={"theta_in_rad": count},
    )
    return recording, parameters


def half_loop() -> Case:
    """The paper's rig with half a loop (its Section V), with a softer load spring."""
    path = ConduitPath([1.2], [np.pi])
    return Case(
        Transmission(path, 7750 * 1.2, 0.156, 0.006, 0.006), SpringLoad(0.05), InitialTension.uniform(path, 7.3)
    )


def sine(cycles: int, amplitude: float = 1.0, samples_a_cycle: int = SAMPLES_A_CYCLE) -> NDArray:
    """Drive angle, rad, shape (cycles * samples_a_cycle + 1,)."""
    return amplitude * np.sin(2 * np.pi * np.arange(cycles * samples_a_cycle + 1) / samples_a_cycle)


def after_nested_reversals(cycles: int, reversals: int = 1000) -> NDArray:
    """Small cycles after a history of nested reversals, all of which remain in the state; rad."""
    nested = 0.2 * np.linspace(1, 0.5, reversals) * (-1) ** np.arange(reversals)
    return np.concatenate([nested, nested[-1] - 0.05 * np.sign(nested[-1]) * (1 - sine(cycles))])


def noisy(cycles: int, amplitude: float = 0.6) -> NDArray:
    """A sine with white noise of 1.5 mrad, half a step of an encoder with 2,000 counts; rad."""
    theta_in = sine(cycles, amplitude)
    theta_in[1:] += np.random.default_rng(1).normal(0, 1.5e-3, theta_in.size - 1)
    return theta_in


def jumping(cycles: int, amplitude: float = 0.6) -> NDArray:
    """Independent angles at every sample, uniform within the amplitude; rad."""
    theta_in = np.random.default_rng(1).uniform(-amplitude, amplitude, cycles * SAMPLES_A_CYCLE + 1)
    theta_in[0] = 0.0
    return theta_in


def presliding() -> list[Active]:
    """Presliding alone."""
    return [Active("presliding", "conduit", {"z0": 50e-6})]


def every_effect() -> list[Active]:
    """Every mechanism at every one of its places, with its starting values."""
    return [Active(n, p, mechanisms.get(n).start) for n in mechanisms.names() for p in mechanisms.get(n).places]
