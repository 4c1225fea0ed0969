"""Contacts that grow stronger with their age: friction is 1 + rise log10(1 + age / shortest), the age in s.

A contact's age grows with the time, and sliding by `renewal_m` renews it (Dieterich's ageing law, Journal of
Geophysical Research 84(B5), 2161-2168, 1979).
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import PositiveFloat

from virtualrig.effects.contract import LOG_AGES, Seeded, TrueLaw, Twin, along
from virtualrig.strict import NonNegative, Strict

# Age of the contacts at the start of a recording, and the most that one has, s.
FIRST_S, OLDEST_S = 10.0, 100.0


class AgeingContact(Strict):
    """Its numbers."""

    rise: NonNegative
    shortest_s: PositiveFloat
    renewal_m: PositiveFloat


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.ageing_contact
    return {
        "ageing_rise": given.rise if given else 0.0,
        "ageing_shortest": given.shortest_s if given else 1.0,
        "ageing_renewal": given.renewal_m if given else 1.0,
    }


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"ageing_contact": {"rise": size, "shortest_s": also["shortest_s"], "renewal_m": also["renewal_m"]}}, {}


def _law(rig: Any, place: str) -> TrueLaw:
    given, log_age = rig.effects.ageing_contact, along(LOG_AGES)
    return TrueLaw("sliding-friction", "dwell", log_age, 1 + given.rise * np.log10(1 + 10**log_age / given.shortest_s))


TWIN = Twin(
    name="unlisted-ageing-contact",
    fields={"rig": {"ageing_contact": (AgeingContact | None, None)}},
    places=("conduit",),
    size=(0.01, 0.15),  # a decade of age
    unit="1",
    also={"shortest_s": (0.01, 0.1), "renewal_m": (1e-4, 4e-4)},
    seed=_seed,
    numbers=_numbers,
    law=_law,
)
