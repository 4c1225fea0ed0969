"""Viscous friction: a drag per length of cable in proportion to the sliding speed, or to a power of it.

A grease that thins under shear has a power below one (Ostwald and de Waele's law).
"""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from virtualrig.effects.contract import Seeded, TrueLaw, Twin
from virtualrig.strict import NonNegative

# Speed at which the drag of every power is that of the linear law, m/s.
REFERENCE_M_PER_S = 0.01


def _in_rig(values: dict[str, float], campaign: Any) -> dict[str, float]:
    """With the drag on the rig's cables, of the same law, and the load's damping, taken as a drag on both cables.

    No recording separates these from the film.
    """
    rig = campaign.rig
    cables = campaign.numerics.drag_rate_per_s * rig.cable.density_kg_per_m
    load = rig.load.damping_Nms_per_rad / (2 * rig.pulley_radius_m**2 * rig.cable.length_m)
    return {"c": values["c"] + cables + load} if values else {}


def _thinning(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"viscous_Ns_per_m2": size, "viscous_power": also["power"]}, {}


TWIN = Twin(
    name="viscous-friction",
    fields={
        "rig": {
            "viscous_Ns_per_m2": (NonNegative, 0.0),
            "viscous_power": (Annotated[float, Field(gt=0, le=2)], 1.0),
        }
    },
    places=("conduit",),
    size=(2.0, 200.0),  # 0.7 to 70 % of Coulomb friction at 10 mm/s
    unit="N s/m^2",
    seed=lambda size, also, place, spring: ({"viscous_Ns_per_m2": size}, {"c": size}),
    other_laws={"power": _thinning},
    law=lambda rig, place: TrueLaw("sliding-friction", "speed"),
    also={"power": (0.3, 0.7)},
    numbers=lambda effects: {"viscous_power": effects.viscous_power},
    in_rig=_in_rig,
)
