"""Compliances without friction in series at either end of both cables, linear or of a knot that beds in."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from virtualrig.effects.contract import TENSIONS_N, Seeded, TrueLaw, Twin, along
from virtualrig.strict import NonNegative, Strict


class TerminationCompliance(Strict):
    """Of the drive's and of the load's end; a knot is soft up to a tension of about its bedding."""

    drive_m_per_N: NonNegative = 0.0
    load_m_per_N: NonNegative = 0.0
    drive_bedding_N: NonNegative = 0.0
    load_bedding_N: NonNegative = 0.0


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    end = {"drive-end": "drive_m_per_N", "load-end": "load_m_per_N"}[place]
    return {"termination_compliance": {end: size}}, {"compliance": size}


def _knot(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    end = place.removesuffix("-end")
    return {"termination_compliance": {f"{end}_m_per_N": size, f"{end}_bedding_N": also["bedding_N"]}}, {}


def _law(rig: Any, place: str) -> TrueLaw:
    """The compliance of one end; a knot's falls to it as a settling cable's does (`strand_settling`, hyperbolic)."""
    ends, tension = rig.effects.termination_compliance, along(TENSIONS_N)
    end = place.removesuffix("-end")
    compliance, bedding = getattr(ends, f"{end}_m_per_N"), getattr(ends, f"{end}_bedding_N")
    beyond = tension / bedding + 1 if bedding else np.full(tension.size, np.inf)
    return TrueLaw("end-stretch", "tension", tension, compliance / np.sqrt(1 - beyond**-2.0))


TWIN = Twin(
    name="termination-compliance",
    fields={"rig": {"termination_compliance": (TerminationCompliance, TerminationCompliance())}},
    places=("drive-end", "load-end"),
    size=(3e-6, 1e-4),
    unit="m/N",
    seed=_seed,
    other_laws={"knot": _knot},
    law=_law,
    also={"bedding_N": (0.5, 4.0)},
)
