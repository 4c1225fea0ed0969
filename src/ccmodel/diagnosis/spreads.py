"""Spreads: how much friction, initial tension and sensor zeros differ from run to run, as stated or estimated."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

FRICTION, PRETENSION = "friction_coefficient", "pretension_scale"
# Parameter that is the friction of a single recording over the rig's.
FRICTION_SCALE = "friction_scale"


@dataclass(frozen=True)
class Spread:
    """Standard deviation of a nuisance from run to run.

    Attributes
    ----------
    nuisance : str
        Name of its parameter.
    ratio : float
        Estimated over stated standard deviation.
    source : {"repeats", "scatter", "assumed"}
        Differences of repeats, scatter of all recordings, or the stated value.
    recordings : int
        Number of recordings that it rests on; 0 if assumed.
    """

    nuisance: str
    ratio: float = 1.0
    source: str = "assumed"
    recordings: int = 0


@dataclass(frozen=True)
class Repeatability:
    """Spreads of the nuisances, and the conditions of the recordings.

    Attributes
    ----------
    spreads : mapping of str to Spread
        By nuisance; one that is not among them has its stated spread.
    conditions : sequence of sequence of int
        Recordings of each condition, by their number.
    tolerance : mapping of str to float
        Estimated tolerance by channel (`ccmodel.diagnosis.repeatability.estimated_tolerance`); of a channel that is
        not among them as stated.
    """

    spreads: Mapping[str, Spread]
    conditions: Sequence[Sequence[int]] = ()
    tolerance: Mapping[str, float] = field(default_factory=dict)

    def ratio(self, nuisance: str) -> float:
        """Estimated over stated standard deviation."""
        return self.spreads[nuisance].ratio if nuisance in self.spreads else 1.0

    def applied(self, nuisances: Sequence[tuple[str, float, float]]) -> list[tuple[str, float, float]]:
        """Name, value and stated standard deviation of nuisances, with the estimated standard deviations instead."""
        return [(name, value, self.ratio(name) * spread) for name, value, spread in nuisances]


STATED = Repeatability({})
