"""Stribeck friction: the friction coefficient times 1 + rise g(|v| / speed), v the sliding speed.

The law g(s) is exp(-s^exponent); 1 / (1 + s)^2 (Hess and Soom, Journal of Tribology 112(1), 147-152, 1990); or falls
with the logarithm of the speed over two decades about it (Dieterich, Journal of Geophysical Research 84(B5), 2161-2168,
1979).
"""

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveFloat

from virtualrig.effects.contract import LOG_SPEEDS, Seed, Seeded, TrueLaw, Twin, along
from virtualrig.strict import NonNegative, Strict

# Laws, and their numbers in the time loop.
LAWS = ("exponential", "hess-soom", "logarithmic")
EXPONENTIAL, HESS_SOOM, LOGARITHMIC = range(len(LAWS))


class Stribeck(Strict):
    """Its numbers; a contact adapts to a new speed over `renewal_m` of sliding.

    Without such a length a cable chatters ever faster on ever shorter pieces of itself.
    """

    law: Literal["exponential", "hess-soom", "logarithmic"] = "exponential"
    rise: NonNegative
    speed_m_per_s: PositiveFloat
    exponent: PositiveFloat = 1.0
    renewal_m: PositiveFloat = 20e-6


def _steady(given: Stribeck, speed: NDArray) -> NDArray:
    """Law g of steady sliding, as in the time loop."""
    s = speed / given.speed_m_per_s
    if given.law == "hess-soom":
        return 1 / (1 + s) ** 2
    if given.law == "logarithmic":
        return (1 - np.log1p(10 * s) / np.log1p(100)).clip(0.0)
    return np.exp(-(s**given.exponent))


def _law(rig: Any, place: str) -> TrueLaw:
    given, log_speed = rig.effects.stribeck, along(LOG_SPEEDS)
    return TrueLaw("sliding-friction", "speed", log_speed, 1 + given.rise * _steady(given, 10**log_speed))


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.stribeck or Stribeck(rise=0.0, speed_m_per_s=1.0, renewal_m=1.0)
    return {
        "stribeck_rise": given.rise,
        "stribeck_speed": given.speed_m_per_s,
        "stribeck_law": LAWS.index(given.law),
        "stribeck_exponent": given.exponent,
        "stribeck_renewal": given.renewal_m,
    }


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    settings = {"rise": size, "speed_m_per_s": also["vs"], "exponent": also["exponent"], "renewal_m": also["renewal_m"]}
    return {"stribeck": settings}, {"a": size}


def _another(law: str) -> Seed:
    def seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
        # These fall over more speeds than recordings have, so that the rise of the mechanism's law is another.
        settings = {"law": law, "rise": size, "speed_m_per_s": also["vs"], "renewal_m": also["renewal_m"]}
        return {"stribeck": settings}, {}

    return seed


TWIN = Twin(
    name="stribeck",
    fields={"rig": {"stribeck": (Stribeck | None, None)}},
    places=("conduit",),
    size=(0.03, 0.4),  # above 40 % cables chatter
    unit="1",
    also={"vs": (5e-4, 5e-3), "exponent": (0.7, 2.0), "renewal_m": (5e-6, 1e-4)},
    seed=_seed,
    other_laws={law: _another(law) for law in ("hess-soom", "logarithmic")},
    numbers=_numbers,
    law=_law,
)
