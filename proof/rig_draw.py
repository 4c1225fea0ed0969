"""Random draws of a case's rig: cables, load, stated estimates and sensors, within the ranges of the plan."""

import numpy as np
from numpy.random import Generator

from proof.plan import Plan, SensorsPlan
from virtualrig.config import (
    Cable,
    Campaign,
    Encoder,
    Estimates,
    Load,
    LoadCell,
    Numerics,
    Repeatability,
    Rig,
    Sensors,
    SlowNoise,
    TorqueSensor,
)
from virtualrig.effects import Effects


def log_uniform(between: tuple[float, float], random: Generator) -> float:
    """A number whose logarithm is uniform between those of two bounds."""
    return float(np.exp(random.uniform(*np.log(between))))


def rounded(value: float, digits: int = 3) -> float:
    """A number with so many significant digits."""
    return float(f"{value:.{digits}g}")


def draw_campaign(seed: int, plan: Plan, spring: float, effects: Effects, random: Generator) -> Campaign:
    """A rig with `effects` and a load spring of `spring` (N m/rad), and its sensors; without batches."""
    rig, numerics = plan.rig, plan.numerics.model_dump()
    limit = numerics.pop("first_tension_limit_N")
    length_m = round(random.uniform(*rig.length_m), 4)
    stiffness = log_uniform(rig.stiffness_N_per_m, random)
    friction = random.uniform(*rig.friction_coefficient)
    return Campaign(
        seed=seed,
        rig=Rig(
            pulley_radius_m=rig.pulley_radius_m,
            cable=Cable(
                stiffness_N_per_m=stiffness,
                length_m=length_m,
                friction_coefficient=friction,
                density_kg_per_m=rig.density_kg_per_m,
            ),
            estimates=Estimates(
                stiffness_N_per_m=rounded(stiffness * _estimate_over_truth(plan, random)),
                length_m=length_m,
                friction_coefficient=rounded(friction * _estimate_over_truth(plan, random)),
            ),
            load=Load(
                spring_stiffness_Nm_per_rad=rounded(spring, 5),
                inertia_kg_m2=rig.load_inertia_kg_m2,
                damping_Nms_per_rad=rig.load_damping_Nms_per_rad,
            ),
            effects=effects,
        ),
        sensors=_draw_sensors(plan.sensors, random),
        repeatability=_repeatability(plan, effects, random),
        numerics=Numerics(**numerics, tension_limit_N=limit),
        batches={},
    )


def _repeatability(plan: Plan, effects: Effects, random: Generator) -> Repeatability:
    """What differs between recordings, with a past that lasts as long as the rig's effects remember it."""
    past: dict = {name: log_uniform(getattr(plan.repeats, name), random) for name in ("friction", "pretension")}
    past |= {"ran_in_before": plan.past.ran_in_for, "profile_curvature": plan.past.profile_curvature}
    if effects.relaxation:
        time_s = float(np.exp(np.mean(np.log([branch.time_constant_s for branch in effects.relaxation]))))
        past["tensioned_before_s"] = tuple(time_s * t for t in plan.past.relaxed_for)
    return plan.repeatability.model_copy(update=past)


def _estimate_over_truth(plan: Plan, random: Generator) -> float:
    far = random.uniform() < plan.estimates.far_share
    factor = 1 + random.uniform(*(plan.estimates.far if far else plan.estimates.near))
    return factor if random.uniform() < 0.5 else 1 / factor


def _draw_sensors(plan: SensorsPlan, random: Generator) -> Sensors:
    noise = random.uniform(*plan.noise_factor)
    slow = SlowNoise(
        ratio=random.uniform(*plan.slow_ratio),
        lasts_samples=log_uniform(plan.slow_s, random) * plan.sample_rate_Hz,
    )
    return Sensors(
        sample_rate_Hz=plan.sample_rate_Hz,
        encoder=Encoder(counts_per_rev=plan.counts_per_rev, accuracy_rad=rounded(2 * np.pi / plan.counts_per_rev)),
        torque=TorqueSensor(
            constant_Nm_per_A=plan.constant_Nm_per_A,
            accuracy_Nm=plan.torque_accuracy_Nm,
            noise_Nm=plan.torque_noise_Nm * noise,
            range_Nm=plan.torque_range_Nm,
            slow_noise=slow,
        ),
        load_cell=LoadCell(
            sensitivity_V_per_N=plan.sensitivity_V_per_N,
            zero_V=plan.zero_V,
            accuracy_N=plan.load_cell_accuracy_N,
            noise_N=plan.load_cell_noise_N * noise,
            range_N=plan.load_cell_range_N,
            slow_noise=slow,
        ),
    )
