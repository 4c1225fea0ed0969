"""Drift from recording to recording: friction or stiffness times 1 + change x, x a recording's place in its session.

It is constant within a recording (`virtualrig.campaign.prepare` and `run`).
"""

from collections.abc import Mapping
from typing import Annotated

from pydantic import Field

from virtualrig.effects.contract import Seeded, Twin

Change = Annotated[float, Field(gt=-2, lt=2)]


def _twin(what: str, place: str) -> Twin:
    def seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
        return {f"{what}_drift": size}, {"change": size}

    return Twin(
        name=f"{what}-drift",
        fields={"rig": {f"{what}_drift": (Change, 0.0)}},
        places=(place,),
        size=(0.02, 0.4),
        unit="1",
        signed=True,
        between_recordings=True,
        seed=seed,
    )


TWINS = (_twin("friction", "conduit"), _twin("stiffness", "cable"))
