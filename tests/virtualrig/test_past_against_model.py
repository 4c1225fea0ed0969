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


def rig_and_plan(campaign, **effects):
    """The committed rig with effects on a quarter of its cells, and a short motion."""
    coarse = {"cell_length_m": 0.05, "cell_bend_rad": 0.2, "bristle_length_m": 4e-7, "tension_limit_N": 40.0}
    numerics = {f"numerics__{key}": value for key, value in coarse.items()}
    rig = changed(campaign, rig__effects=Effects.model_validate(effects), **numerics)
    return rig, plan_of(rig, "half-loop", "half-loop-7.3N-a", rest_s=0.05, start_up_cycles=0.25, cycles=0.5)


@pytest.mark.parametrize("waited_s", [0.2, 1.0])
def test_a_cable_tensioned_before_has_relaxed_by_its_time_constant(campaign, waited_s):
    r, tau = 0.2, 0.5
    rig, plan = rig_and_plan(campaign, relaxation=[{"share": r, "time_constant_s": tau}])
    recorded = run(rig, plan, replace(strung(rig, plan, (0.0, 0.0)), tensioned_before_s=waited_s))
    values = {"r": r, "tau": tau, "relaxed": relaxed_after(waited_s, r, tau)}
    settled = modelled(rig, plan, recorded, Active("relaxation", "cable", values))
    fresh = modelled(rig, plan, recorded, Active("relaxation", "cable", {"r": r, "tau": tau}))
    assert worst(settled, recorded) < 0.015
    assert worst(settled, recorded) < worst(fresh, recorded) / 4


@pytest.mark.parametrize("over", ["time_s", "travel_m"])
def test_friction_that_has_run_in_before_goes_on_from_there(campaign, over):
    change, scale, before = 0.3, {"time_s": 0.5, "travel_m": 0.005}[over], 2.0
    rig, plan = rig_and_plan(campaign, running_in={"change": change, "over": over, "scale": scale})
    recorded = run(rig, plan, replace(strung(rig, plan, (0.0, 0.0)), ran_in_before=before))
    rates = {"tau": scale} if over == "time_s" else {"tau": 1e9, "per_m": 1 / scale}
    values = {"change": change, "done": -np.expm1(-before), **rates}
    aged = modelled(rig, plan, recorded, Active("running-in", "conduit", values))
    fresh = modelled(rig, plan, recorded, Active("running-in", "conduit", values | {"done": 0.0}))
    assert worst(aged, recorded) < 0.015
    assert worst(aged, recorded) < worst(fresh, recorded) / 3


def test_an_initial_tension_may_be_curved(campaign):
    """The ends are as without curvature, the middle is tighter; friction holds it at rest."""
    rig, plan = rig_and_plan(campaign)
    plain = strung(rig, plan, (0.2, 0.2))
    curved = replace(plain, profile_curvature=(0.3, -0.3))
    along = curved.bristles(9)
    assert along.mean(axis=1) == pytest.approx([0.2, 0.2])
    assert np.ptp(along, axis=1) == pytest.approx([0.6 * 8 / 9] * 2)
    assert np.abs(replace(curved, profile_share=(0.9, -0.9)).bristles(9)).max() == 1.0
    a, b = (run(rig, plan, one) for one in (plain, curved))
    rest = a.time_s <= 0.04
    for tension in TENSIONS:
        assert np.ptp(getattr(b, tension)[rest]) < 1e-4
    assert b.T1_N[0] / b.T2_N[0] == pytest.approx(a.T1_N[0] / a.T2_N[0], rel=1e-6)
    assert np.abs(b.T2_N - a.T2_N).max() > 0.02
