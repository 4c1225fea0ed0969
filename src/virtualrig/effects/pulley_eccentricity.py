"""Eccentricity: a pulley's radius times 1 + share sin(angle + phase), and of a bent one another lobe per half turn."""

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from virtualrig.effects.contract import ANGLES_RAD, Seeded, TrueLaw, Twin, along, group_of
from virtualrig.strict import Strict


class Eccentricity(Strict):
    """Share of the radius and phase, of the first harmonic of the angle and of the second."""

    share: Annotated[float, Field(ge=0, lt=0.5)]
    phase_rad: float = 0.0
    second_share: Annotated[float, Field(ge=0, lt=0.5)] = 0.0
    second_phase_rad: float = 0.0


def _numbers(effects: Any) -> dict[str, Any]:
    pulleys = {"drive": effects.drive_pulley.eccentricity, "load": effects.load_pulley.eccentricity}
    shares = {f"{side}_share": given.share if given else 0.0 for side, given in pulleys.items()}
    shares |= {f"{side}_second": given.second_share if given else 0.0 for side, given in pulleys.items()}
    shares |= {f"{side}_phase": given.phase_rad if given else 0.0 for side, given in pulleys.items()}
    return shares | {
        f"{side}_second_phase": given.second_phase_rad if given else 0.0 for side, given in pulleys.items()
    }


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    eccentricity = {"share": size, "phase_rad": also["phase"]}
    return {group_of(place): {"eccentricity": eccentricity}}, {"e": size, "psi": also["phase"]}


def _law(rig: Any, place: str) -> TrueLaw:
    given, theta = getattr(rig.effects, group_of(place)).eccentricity, along(ANGLES_RAD)
    factor = 1 + given.share * np.sin(theta + given.phase_rad)
    factor += given.second_share * np.sin(2 * theta + given.second_phase_rad)
    return TrueLaw("pulley-radius", f"{place.split('-')[0]}-angle", theta, factor)


def _two_lobes(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    # Over the angles of a motion the lobes are not orthogonal: the first one alone has another size and phase.
    settings, _ = _seed(size, also, place, spring)
    second = {"second_share": also["second"] * size, "second_phase_rad": 2.4 - also["phase"]}
    settings[group_of(place)]["eccentricity"] |= second
    return settings, {}


TWIN = Twin(
    name="pulley-eccentricity",
    fields={"pulley": {"eccentricity": (Eccentricity | None, None)}},
    places=("drive-pulley", "load-pulley"),
    size=(0.005, 0.08),
    unit="1",
    seed=_seed,
    law=_law,
    other_laws={"two-lobes": _two_lobes},
    also={"second": (0.2, 0.6)},
    numbers=_numbers,
)
