"""Backlash: a dead zone of `half_gap_rad` on either side between pulley and spring, with hard or with soft flanks."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from virtualrig.effects.contract import ANGLES_RAD, Seeded, TrueLaw, Twin, along
from virtualrig.strict import NonNegative


def _soft(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"load": {"half_gap_rad": size, "soft_flank_rad": also["softness"] * size}}, {"half_gap": size}


def _law(rig: Any, place: str) -> TrueLaw:
    """What the gap takes off a spring's torque, as in the time loop."""
    load, theta = rig.effects.load, along(ANGLES_RAD)
    above, below = theta - load.half_gap_rad, theta + load.half_gap_rad
    if load.soft_flank_rad:
        above = (above + np.hypot(above, load.soft_flank_rad)) / 2
        below = (below - np.hypot(below, load.soft_flank_rad)) / 2
    beyond = np.maximum(above, 0.0) + np.minimum(below, 0.0)
    return TrueLaw("load", "load-angle", theta, rig.load.spring_stiffness_Nm_per_rad * (beyond - theta))


TWIN = Twin(
    name="backlash",
    fields={"load": {"half_gap_rad": (NonNegative, 0.0), "soft_flank_rad": (NonNegative, 0.0)}},
    places=("load-pulley",),
    size=(1e-3, 7e-2),
    unit="rad",
    also={"softness": (0.1, 0.5)},
    seed=lambda size, also, place, spring: ({"load": {"half_gap_rad": size}}, {"half_gap": size}),
    other_laws={"soft": _soft},
    law=_law,
    numbers=lambda effects: {"half_gap": effects.load.half_gap_rad, "soft_flank": effects.load.soft_flank_rad},
)
