"""Batches drawn at random and recorded with the exact solver: what a fit is to find is known.

Every recording has a friction of its own (1 %), a pretension, a tension profile in each cable and zeros of its sensors;
angles are counted, the drive's too, and torques and sums are noisy as on the paper's rig.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from builders import RIG
from ccmodel.geometry import ConduitPath
from ccmodel.inference.observations import Observations
from ccmodel.inference.problem import Free, Problem
from ccmodel.model.exact.pair import simulate_pair
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.parameters import Parameters
from ccmodel.model.transmission import Transmission
from ccmodel.recording import Recording
from ccmodel.rig.batch import Rig
from ccmodel.rig.calibration import calibrate

STEP_RAD = 2 * np.pi / 2000
TORQUE_NM, SUM_N = 1e-4, 0.05  # noise
ZERO_TORQUE_NM, ZERO_SUM_N = 1e-4, 0.1  # a zero lies anywhere within this
FRICTION, PRETENSION, PROFILE = 0.01, 0.01, (0.05, 0.4)
REST_S = 0.4
# A half loop and a whole one, tight and less so: k, mu and the load are determined.
CONDITIONS = ((np.pi, 7.0), (2 * np.pi, 7.0), (np.pi, 4.0), (2 * np.pi, 4.0))
# Standard deviations of what was drawn.
SPREAD = {
    "friction_scale": FRICTION,
    "pretension_scale": PRETENSION,
    "drive_encoder_offset": 1.0,
    "theta_out_zero_rad": STEP_RAD / np.sqrt(12),
    "tau_in_zero_Nm": ZERO_TORQUE_NM / np.sqrt(3),
    "tau_out_zero_Nm": ZERO_TORQUE_NM / np.sqrt(3),
    "F_drive_zero_N": ZERO_SUM_N / np.sqrt(3),
    "F_load_zero_N": ZERO_SUM_N / np.sqrt(3),
}


@dataclass(frozen=True)
class Drawn:
    """A batch and what is true of it: shared values, and of each recording the values that can be stated."""

    recordings: list[Recording]
    shared: dict[str, float]
    own: list[dict[str, float]]


def draw(seed: int, conditions=CONDITIONS, duration_s=3.4, rate_Hz=200.0, friction=FRICTION, curvature=0.0) -> Drawn:
    """A batch with values of its own; with `curvature`, that curvature of the initial tension of cable A."""
    random = np.random.default_rng(seed)
    shared = {
        "stiffness_N_per_m": random.uniform(6000, 10000),
        "friction_coefficient": random.uniform(0.12, 0.18),
        "load_stiffness_Nm_per_rad": random.uniform(0.04, 0.06),
    }
    made = [
        _recorded(random, shared, i, *c, duration_s, rate_Hz, friction, curvature) for i, c in enumerate(conditions)
    ]
    return Drawn([r for r, _ in made], shared, [own for _, own in made])


def problem_of(drawn: Drawn, own=SPREAD, **more: Free) -> Problem:
    """The fit of a drawn batch, from estimates that are a fifth off."""
    start = {n: v * (1.2 if n.startswith("stiff") else 0.8) for n, v in drawn.shared.items()}
    free = {n: Free(v, 0.2 * v, 5 * v) for n, v in start.items()} | more
    parameters = Parameters(reference_length_m=1.2, drive_radius_m=0.006, load_radius_m=0.006, **start)
    observations = [
        Observations.of(r, parameters, offset_is_free="drive_encoder_offset" in own) for r in drawn.recordings
    ]
    at = {"friction_scale": 1.0, "pretension_scale": 1.0}
    return Problem(observations, free, {name: Free(at.get(name, 0.0), spread=own[name]) for name in own})


def _recorded(random, shared, i, bend_rad, pretension_N, duration_s, rate_Hz, friction, curvature):
    t = np.arange(1, round(duration_s * rate_Hz) + 1) / rate_Hz
    moving = np.maximum(t - REST_S, 0)
    amplitude, frequency = random.uniform(0.7, 1.0), random.uniform(0.5, 0.8)
    theta = amplitude * (1 - np.exp(-((moving / 0.3) ** 2))) * np.sin(2 * np.pi * frequency * moving)
    path = ConduitPath([1.2], [bend_rad])
    scale = 1 + friction * random.standard_normal()
    mu = shared["friction_coefficient"] * scale
    tension = pretension_N * (1 + PRETENSION * random.standard_normal())
    A, B = ([tension, tension * np.exp(-s * mu * bend_rad)] for s in random.uniform(*PROFILE, 2))
    transmission = Transmission(path, shared["stiffness_N_per_m"] * 1.2, mu, 0.006, 0.006)
    load = SpringLoad(shared["load_stiffness_Nm_per_rad"])
    initial = InitialTension.between_ends(path, mu, tuple(A), tuple(B), (curvature, 0.0))
    r = simulate_pair(transmission, load, theta, initial)
    zero = {
        "tau_in_zero_Nm": random.uniform(-1, 1) * ZERO_TORQUE_NM,
        "tau_out_zero_Nm": random.uniform(-1, 1) * ZERO_TORQUE_NM,
        "F_drive_zero_N": random.uniform(-1, 1) * ZERO_SUM_N,
        "F_load_zero_N": random.uniform(-1, 1) * ZERO_SUM_N,
    }

    def read(values, name, noise):
        return values + zero[name] + noise * random.standard_normal(t.size)

    log = pd.DataFrame(
        {
            "time_s": t,
            "drive_encoder_counts": np.floor(theta / STEP_RAD + random.uniform(-500, 500)),
            "load_encoder_counts": np.floor(r.theta_out_rad / STEP_RAD + random.uniform(-500, 500)),
            "drive_current_A": read(r.tau_in_Nm, "tau_in_zero_Nm", TORQUE_NM) / 0.0234,
            "load_current_A": read(r.tau_out_Nm, "tau_out_zero_Nm", TORQUE_NM) / 0.0234,
            "drive_load_cell_V": 0.25 + 0.1 * read(r.T1_N + r.T3_N, "F_drive_zero_N", SUM_N),
            "load_load_cell_V": 0.25 + 0.1 * read(r.T2_N + r.T4_N, "F_load_zero_N", SUM_N),
        }
    )
    c = calibrate(log, Rig.model_validate(RIG, strict=False))
    recording = Recording(
        "drawn", f"r{i}", "virtual-rig", t, c.channels, c.derived_from, pretension_N, path, c.accuracy,
        c.encoder_step_rad, rest_s=c.rest_s,
    )  # fmt: skip
    return recording, zero | {"friction_scale": scale, "friction": mu}
