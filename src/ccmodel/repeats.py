"""Repeated recordings of a condition: means, and intervals from the scatter pooled over all conditions."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ccmodel.distributions import student_quantile
from ccmodel.recording import Recording

_REPEAT = re.compile(r"-[a-z]$")


def condition_of(recording: Recording) -> str:
    """Batch and condition of a recording: its name without the letter of the repeat (-a, -b, ...)."""
    return f"{recording.batch}/{without_repeat(recording.id)}"


def without_repeat(name: str) -> str:
    """Name of a recording without the letter of the repeat."""
    return _REPEAT.sub("", name)


def pooled_scatter(groups: Sequence[Sequence[float]], relative: bool) -> tuple[float, int]:
    """Pooled standard deviation of a recording about the mean of its condition, and its degrees of freedom.

    Two repeats estimate a standard deviation poorly, so it is assumed equal for all conditions.

    Parameters
    ----------
    groups : sequence of sequences of float
        Values of the repeats of each condition. A condition whose values are all zero is not used.
    relative : bool
        Whether the standard deviation is a share of the mean of the condition, or absolute, for values that may be
        zero.

    Returns
    -------
    sd : float
        0 without repeats.
    freedom : int
        0 without repeats.
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
    """Mean of a condition over its repeats, and its uncertainty.

    Attributes
    ----------
    value : float
    sd : float
        Standard deviation of the mean.
    freedom : int
        Degrees of freedom of `sd`; 0 without repeats, and there is no interval.
    count : int
        Number of recordings.
    """

    value: float
    sd: float
    freedom: int
    count: int

    def reach(self, coverage: float) -> float | None:
        """Half width of the confidence interval of the mean; None without repeats."""
        return self.half_width(coverage) if self.freedom else None

    def half_width(self, coverage: float) -> float:
        """Half width of that interval, with repeats; NaN without."""
        return float(student_quantile(0.5 + coverage / 2, self.freedom) * self.sd)


def estimates(groups: Sequence[Sequence[float]], relative: bool) -> list[Estimate]:
    """Mean of every condition, with its standard deviation from the pooled scatter."""
    sd, freedom = pooled_scatter(groups, relative)
    means = [float(np.mean(group)) for group in groups]
    sds = [sd * abs(mean) if relative else sd for mean in means]
    return [Estimate(m, s / np.sqrt(len(g)), freedom, len(g)) for m, s, g in zip(means, sds, groups, strict=True)]


def difference(first: Estimate, second: Estimate) -> Estimate:
    """Second minus first; the two are independent."""
    sd = float(np.hypot(first.sd, second.sd))
    return Estimate(second.value - first.value, sd, first.freedom, first.count + second.count)
