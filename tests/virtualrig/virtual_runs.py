"""Shared by the tests of the virtual rig: variants of the campaign, runs without draws, noise-free channels."""

from pathlib import Path

import numpy as np

from virtualrig.trajectory import Preparation, Trajectory

ROOT = Path(__file__).parents[2]


def changed(model, **updates):
    """A copy of a nested config with nested keys replaced; `__` separates the levels."""
    for path, value in updates.items():
        head, _, rest = path.partition("__")
        model = model.model_copy(update={head: changed(getattr(model, head), **{rest: value}) if rest else value})
    return model


def plan_of(campaign, batch, recording, **excitation):
    """A recording's plan, with parts of its excitation replaced."""
    (plan,) = [p for p in campaign.batches[batch].recordings if p.id == recording]
    return changed(plan, **{f"excitation__{key}": value for key, value in excitation.items()})


def strung(campaign, plan, profile_share=(0.2, 0.2)) -> Preparation:
    """The nominal preparation, without a draw."""
    return Preparation(campaign.rig.cable.friction_coefficient, (plan.pretension_N,) * 2, profile_share)


def channels(campaign, trajectory: Trajectory) -> dict[str, np.ndarray]:
    """Channels of a trajectory before noise and quantisation."""
    radius, t = campaign.rig.pulley_radius_m, trajectory
    return {
        "theta_out": t.theta_out_rad,
        "tau_in": radius * (t.T1_N - t.T3_N),
        "tau_out": radius * (t.T2_N - t.T4_N),
        "F_drive": t.T1_N + t.T3_N,
        "F_load": t.T2_N + t.T4_N,
    }
