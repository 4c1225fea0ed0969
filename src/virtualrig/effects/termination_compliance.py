"""Compliances without friction in series at either end of both cables."""

from collections.abc import Mapping

from virtualrig.effects.contract import Seeded, Twin
from virtualrig.strict import NonNegative, Strict


class TerminationCompliance(Strict):
    """Of the drive's and of the load's end."""

    drive_m_per_N: NonNegative = 0.0
    load_m_per_N: NonNegative = 0.0


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    end = {"drive-end": "drive_m_per_N", "load-end": "load_m_per_N"}[place]
    return {"termination_compliance": {end: size}}, {"compliance": size}


TWIN = Twin(
    name="termination-compliance",
    fields={"rig": {"termination_compliance": (TerminationCompliance, TerminationCompliance())}},
    places=("drive-end", "load-end"),
    size=(3e-6, 1e-4),
    unit="m/N",
    seed=_seed,
)
