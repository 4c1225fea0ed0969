"""Viscous friction: a drag per length of cable in proportion to the sliding speed, or to another function of it.

A grease that thins under shear has a power below one (Ostwald and de Waele's law). In a thin film between hard surfaces
the drag rises with the inverse hyperbolic sine of the speed (Eyring, Journal of Chemical Physics 4, 283-291, 1936).
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

    No recording separates these from a film whose drag is in proportion to the speed.
    """
    rig = campaign.rig
    cables = campaign.numerics.drag_rate_per_s * rig.cable.density_kg_per_m
    load = rig.load.damping_Nms_per_rad / (2 * rig.pulley_radius_m**2 * rig.cable.length_m)
    return values | {"c": values["c"] + cables + load} if values else {}


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    # In half of the rigs the film thins under shear.
    power = also["power"] if also["power"] < 0.67 else 1.0
    return {"viscous_Ns_per_m2": size, "viscous_power": power}, {"c": size, "power": power}


def _eyring(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"viscous_Ns_per_m2": size, "viscous_eyring_m_per_s": also["eyring_m_per_s"]}, {}


TWIN = Twin(
    name="viscous-friction",
    fields={
        "rig": {
            "viscous_Ns_per_m2": (NonNegative, 0.0),
            "viscous_power": (Annotated[float, Field(gt=0, le=2)], 1.0),
            "viscous_eyring_m_per_s": (NonNegative, 0.0),
        }
    },
    places=("conduit",),
    size=(2.0, 200.0),  # 0.7 to 70 % of Coulomb friction at 10 mm/s
    unit="N s/m^2",
    seed=_seed,
    other_laws={"eyring": _eyring},
    law=lambda rig, place: TrueLaw("sliding-friction", "speed"),
    also={"power": (0.3, 1.5), "eyring_m_per_s": (1e-3, 1e-2)},
    numbers=lambda effects: {
        "viscous_power": effects.viscous_power,
        "viscous_eyring": effects.viscous_eyring_m_per_s,
    },
    in_rig=_in_rig,
)
