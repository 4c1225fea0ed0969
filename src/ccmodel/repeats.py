"""What repeats of a condition say: their mean, and a 90 % interval from the scatter that all conditions share."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t

from ccmodel.recording import Recording

_REPEAT = re.compile(r"-[a-z]$")


def condition_of(recording: Recording) -> str:
    """Batch and condition of a recording: its name without the letter (-a, -b, ...) that repeats differ by."""
    return f"{recording.batch}/{without_repeat(recording.id)}"


def without_repeat(name: str) -> str:
    """A recording's name without the letter that repeats differ by."""
    return _REPEAT.sub("", name)


def pooled_scatter(groups: Sequence[Sequence[float]], relative: bool) -> tuple[float, int]:
    """Standard deviation of a single recording about the mean of its condition, and its degrees of freedom.

    Two repeats say little by themselves; all conditions are taken to scatter alike, relative to their means or, for
    shares that may be zero, absolutely. A condition of zeros only is no witness of any scatter. Without a repeat
    anywhere there is none: (0, 0).
    """
    square, freedom = 0.0, 0
    for group in groups:
        values = np.asarray(group, dtype=float)
        if values.size > 1 and values.any():
            scale = abs(values.mean()) if relative else 1.0
            square += float(((values - values.mean()) ** 2).sum()) / (scale**2 if scale > 0 else 1.0)
            freedom += values.size - 1
    return (float(np.sqrt(square / freedom)), freedom) if freedom else (0.0, 0)


@dataclass(frozen=True)
class Estimate:
    """A condition's mean over its repeats and how sure it is.

    Attributes
    ----------
    value : float
    sd : float
        Standard deviation of the mean.
    freedom : int
        Degrees of freedom behind `sd`; 0: nothing was repeated, and there is no interval.
    count : int
        Number of recordings.
    """

    value: float
    sd: float
    freedom: int
    count: int

    def reach(self, coverage: float) -> float | None:
        """Half the interval that holds the mean with probability `coverage`; None without repeats."""
        return float(t.ppf(0.5 + coverage / 2, self.freedom) * self.sd) if self.freedom else None


def estimates(groups: Sequence[Sequence[float]], relative: bool) -> list[Estimate]:
    """The mean of every condition, with the scatter pooled over all of them."""
    sd, freedom = pooled_scatter(groups, relative)
    found = []
    for group in groups:
        mean = float(np.mean(group))
        own = sd * abs(mean) if relative else sd
        found.append(Estimate(mean, own / np.sqrt(len(group)), freedom, len(group)))
    return found


def difference(first: Estimate, second: Estimate) -> Estimate:
    """Second less first."""
    sd = float(np.hypot(first.sd, second.sd))
    return Estimate(second.value - first.value, sd, first.freedom, first.count + second.count)
