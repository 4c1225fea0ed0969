"""Drift from recording to recording of a session, in proportion to a recording's place x in it.

Friction and stiffness are times 1 + change x, and the zero of a load cell is off by change x. All are constant within a
recording (`virtualrig.campaign.prepare` and `rig_during`).
"""

from collections.abc import Mapping
from typing import Annotated

from pydantic import Field

from virtualrig.effects.contract import Seeded, Twin, group_of

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


def _seed_zero(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {group_of(place): {"load_cell_zero_drift_N": size}}, {"change": size}


TWINS = (
    _twin("friction", "conduit"),
    _twin("stiffness", "cable"),
    Twin(
        name="zero-drift",
        fields={"sensors": {"load_cell_zero_drift_N": (float, 0.0)}},
        places=("drive-sensor", "load-sensor"),
        size=(0.1, 3.0),
        unit="N",
        signed=True,
        between_recordings=True,
        seed=_seed_zero,
    ),
)
