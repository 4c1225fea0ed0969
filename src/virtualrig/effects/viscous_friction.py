"""Viscous friction: a drag in proportion to the sliding speed, per length of cable."""

from typing import Any

from virtualrig.effects.contract import Twin
from virtualrig.strict import NonNegative


def _in_rig(values: dict[str, float], campaign: Any) -> dict[str, float]:
    """With the drag on the rig's cables, of the same law, and the load's damping, taken as a drag on both cables.

    No recording separates these from the film.
    """
    rig = campaign.rig
    cables = campaign.numerics.drag_rate_per_s * rig.cable.density_kg_per_m
    load = rig.load.damping_Nms_per_rad / (2 * rig.pulley_radius_m**2 * rig.cable.length_m)
    return {"c": values["c"] + cables + load}


TWIN = Twin(
    name="viscous-friction",
    fields={"rig": {"viscous_Ns_per_m2": (NonNegative, 0.0)}},
    places=("conduit",),
    size=(2.0, 200.0),  # 0.7 to 70 % of Coulomb friction at 10 mm/s
    unit="N s/m^2",
    seed=lambda size, also, place, spring: ({"viscous_Ns_per_m2": size}, {"c": size}),
    in_rig=_in_rig,
)
