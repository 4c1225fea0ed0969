"""Eccentricity: a pulley's radius times 1 + share sin(angle + phase)."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from virtualrig.effects.contract import Seeded, Twin, group_of
from virtualrig.strict import Strict


class Eccentricity(Strict):
    """Its share of the radius, and its phase."""

    share: Annotated[float, Field(ge=0, lt=0.5)]
    phase_rad: float = 0.0


def _numbers(effects: Any) -> dict[str, Any]:
    pulleys = {"drive": effects.drive_pulley.eccentricity, "load": effects.load_pulley.eccentricity}
    shares = {f"{side}_share": given.share if given else 0.0 for side, given in pulleys.items()}
    return shares | {f"{side}_phase": given.phase_rad if given else 0.0 for side, given in pulleys.items()}


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    eccentricity = {"share": size, "phase_rad": also["phase"]}
    return {group_of(place): {"eccentricity": eccentricity}}, {"e": size, "psi": also["phase"]}


TWIN = Twin(
    name="pulley-eccentricity",
    fields={"pulley": {"eccentricity": (Eccentricity | None, None)}},
    places=("drive-pulley", "load-pulley"),
    size=(0.005, 0.08),
    unit="1",
    seed=_seed,
    numbers=_numbers,
)
