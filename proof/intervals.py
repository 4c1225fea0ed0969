"""Rates and statistics with their intervals, as entries of the score."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from scipy.stats import binomtest

RESAMPLES = 2000


def count(what: str, cases: Iterable, is_right: Callable[..., bool], target: float | None = None) -> dict:
    """Rate of the cases for which `is_right` holds; see `rate`."""
    right = [is_right(case) for case in cases]
    return rate(what, sum(right), len(right), target)


def rate(what: str, k: int, n: int, target: float | None = None) -> dict:
    """`k` of `n` with the 95 % Wilson interval; `rate`, `low` and `high` are None for n = 0."""
    if n == 0:
        return {"what": what, "k": 0, "n": 0, "rate": None, "low": None, "high": None, "target": target}
    interval = binomtest(int(k), n).proportion_ci(0.95, method="wilson")
    return {
        "what": what,
        "k": int(k),
        "n": n,
        "rate": k / n,
        "low": interval.low,
        "high": interval.high,
        "target": target,
    }


def text_of(one: dict) -> str:
    """A rate in words: how many of how many, the share and its interval."""
    share = "" if one["rate"] is None else f" {one['rate']:.0%} ({one['low']:.0%} to {one['high']:.0%})"
    return f"{one['what']}: {one['k']} of {one['n']}{share}"


def bootstrap(what: str, values: Sequence, statistic: Callable[[Sequence], float], target: float | None = None) -> dict:
    """A statistic of `values` with its 95 % percentile bootstrap interval, from `RESAMPLES` resamples of a fixed seed.

    `value`, `low` and `high` are None without values.
    """
    if not len(values):
        return {"what": what, "n": 0, "value": None, "low": None, "high": None, "target": target}
    random = np.random.default_rng(0)
    values = list(values)
    resampled = [
        statistic([values[i] for i in random.integers(len(values), size=len(values))]) for _ in range(RESAMPLES)
    ]
    low, high = np.percentile(resampled, [2.5, 97.5])
    return {
        "what": what,
        "n": len(values),
        "value": float(statistic(values)),
        "low": float(low),
        "high": float(high),
        "target": target,
    }
