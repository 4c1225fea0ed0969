"""Discretisation error of the concealed rigs, against a finer rig with the rope's true mass."""

import numpy as np

from proof.build import simulate
from proof.cases import draw
from virtualrig.campaign import prepare, recording_generator
from virtualrig.sensors import Side
from virtualrig.trajectory import Trajectory

FINER = 2
MASS_FACTOR = 2


def measure(seed: int) -> dict[str, float]:
    """Root mean square error of each channel from grid and mass, over the sensor's noise, in a clean case's large sine.

    The reference has cells and bristles half as large and half the cable mass. The noise of an angle is taken as one
    encoder step over the square root of twelve.
    """
    case = draw(seed, "clean")
    campaign = case.campaign
    plan = next(p for p in case.recordings if p.id in ("sine-large", "loops-1"))
    preparation = prepare(campaign, plan, recording_generator(case.seed, case.name, plan.id))
    numerics = campaign.numerics
    finer = numerics.model_copy(
        update={
            "cell_length_m": numerics.cell_length_m / FINER,
            "cell_bend_rad": numerics.cell_bend_rad / FINER,
            "bristle_length_m": numerics.bristle_length_m / FINER,
            "drag_rate_per_s": numerics.drag_rate_per_s * MASS_FACTOR,
        }
    )
    cable = campaign.rig.cable.model_copy(
        update={"density_kg_per_m": campaign.rig.cable.density_kg_per_m / MASS_FACTOR}
    )
    fine = campaign.model_copy(
        update={"numerics": finer, "rig": campaign.rig.model_copy(update={"cable": cable})},
    )
    a, b = (_channels(simulate(c, plan, preparation), campaign.rig.pulley_radius_m) for c in (campaign, fine))
    sensors = campaign.sensors
    noise = {
        "theta_out": 2 * np.pi / sensors.encoder.counts_per_rev / np.sqrt(12),
        "tau_in": sensors.torque.noise_Nm,
        "tau_out": sensors.torque.noise_Nm,
        "F_drive": sensors.load_cell.noise_N,
        "F_load": sensors.load_cell.noise_N,
    }
    return {name: float(np.sqrt(np.mean((a[name] - b[name]) ** 2)) / noise[name]) for name in noise}


def _channels(t: Trajectory, radius_m: float) -> dict[str, np.ndarray]:
    drive = Side(t.theta_in_rad, t.tau_in_Nm, t.T1_N + t.T3_N)
    load = Side(t.theta_out_rad, t.tau_out_Nm, t.T2_N + t.T4_N)
    return {
        "theta_out": load.angle_rad,
        "tau_in": drive.torque_Nm,
        "tau_out": load.torque_Nm,
        "F_drive": drive.force_N,
        "F_load": load.force_N,
    }
