"""A virtual rig whose recordings have a past, and the model with the states that this past leaves."""

from dataclasses import replace

import numpy as np
import pytest
from virtual_runs import changed, plan_of, strung

from ccmodel.geometry import ConduitPath
from ccmodel.mechanisms.relaxation import relaxed_after
from ccmodel.model.general import Active, simulate
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.transmission import Transmission
from virtualrig.campaign import run
from virtualrig.effects import Effects

TENSIONS = ("T1_N", "T2_N", "T3_N", "T4_N")


def modelled(rig, plan, trajectory, *active):
    """The model of a rig's run from even initial tension, with the mechanisms `active`."""
    cable = rig.rig.cable
    pieces = [(piece.length_m, piece.bend_rad) for piece in plan.conduit]
    path = ConduitPath(*map(list, zip(*pieces, strict=True)))
    radius = rig.rig.pulley_radius_m
    transmission = Transmission(path, cable.EA_N, cable.friction_coefficient, radius, radius)
    load = SpringLoad(rig.rig.load.spring_stiffness_Nm_per_rad)
    initial = InitialTension.uniform(path, trajectory.T1_N[0])
    return simulate(transmission, load, trajectory.time_s, trajectory.theta_in_rad, initial, active).complete()


def worst(a, b):
    """Largest difference of a tension, over its range."""
    return max(np.abs(getattr(a, c) - getattr(b, c)).max() / np.ptp(getattr(b, c)) for c in TENSIONS)


@pytest.mark.parametrize("waited_s", [0.2, 1.0])
def test_a_cable_tensioned_before_has_relaxed_by_its_time_constant(campaign, waited_s):
    r, tau = 0.2, 0.5
    effects = Effects.model_validate({"relaxation": [{"share": r, "time_constant_s": tau}]})
    coarse = {"cell_length_m": 0.05, "cell_bend_rad": 0.2, "bristle_length_m": 4e-7, "tension_limit_N": 40.0}
    rig = changed(campaign, rig__effects=effects, **{f"numerics__{key}": value for key, value in coarse.items()})
    plan = plan_of(rig, "half-loop", "half-loop-7.3N-a", rest_s=0.05, start_up_cycles=0.25, cycles=0.5)
    recorded = run(rig, plan, replace(strung(rig, plan, (0.0, 0.0)), tensioned_before_s=waited_s))
    values = {"r": r, "tau": tau, "relaxed": relaxed_after(waited_s, r, tau)}
    settled = modelled(rig, plan, recorded, Active("relaxation", "cable", values))
    fresh = modelled(rig, plan, recorded, Active("relaxation", "cable", {"r": r, "tau": tau}))
    assert worst(settled, recorded) < 0.015
    assert worst(settled, recorded) < worst(fresh, recorded) / 4
