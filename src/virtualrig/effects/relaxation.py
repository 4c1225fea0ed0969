"""Relaxation: branches of the cable that each lose their share of the tension with a time constant."""

from collections.abc import Mapping
from typing import Annotated

from pydantic import AfterValidator, PositiveFloat

from virtualrig.effects.contract import OpenShare, Seeded, Twin
from virtualrig.strict import Strict


class Relaxation(Strict):
    """One branch."""

    share: OpenShare
    time_constant_s: PositiveFloat


def _not_all(branches: tuple[Relaxation, ...]) -> tuple[Relaxation, ...]:
    lost = sum(branch.share for branch in branches)
    if lost >= 1:
        raise ValueError(f"relaxation takes {lost:g} of the tension; less than 1 in all")
    return branches


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    half, root = size / 2, 10**0.5
    return {"relaxation": [{"share": half, "time_constant_s": also["tau"] * f} for f in (1 / root, root)]}, {"r": size}


TWIN = Twin(
    name="relaxation",
    fields={"rig": {"relaxation": (Annotated[tuple[Relaxation, ...], AfterValidator(_not_all)], ())}},
    places=("cable",),
    size=(0.005, 0.2),
    unit="1",
    also={"tau": (5.0, 60.0)},
    seed=_seed,
)
