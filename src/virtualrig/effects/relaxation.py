"""Relaxation: branches of the cable that each lose their share of the tension with a time constant.

One branch is the standard linear solid, many are any creep: two that are far apart, or a stretched exponential
exp(-(t / tau)^beta) (Kohlrausch, Williams and Watts).
"""

from collections.abc import Mapping
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, PositiveFloat
from scipy.optimize import nnls

from virtualrig.effects.contract import OpenShare, Seeded, Twin
from virtualrig.strict import Strict

# Branches of the chain.
BRANCHES = 6


class Relaxation(Strict):
    """One branch."""

    share: OpenShare
    time_constant_s: PositiveFloat


def _not_all(branches: tuple[Relaxation, ...]) -> tuple[Relaxation, ...]:
    lost = sum(branch.share for branch in branches)
    if lost >= 1:
        raise ValueError(f"relaxation takes {lost:g} of the tension; less than 1 in all")
    return branches


def _seeded(size: float, shares: NDArray, times_s: NDArray) -> Seeded:
    pairs = zip((size * shares).tolist(), times_s.tolist(), strict=True)
    return {"relaxation": [{"share": share, "time_constant_s": time} for share, time in pairs]}, {"r": size}


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    """Times that are evenly spaced in the logarithm."""
    root = np.sqrt(also["spread"])
    return _seeded(size, np.full(BRANCHES, 1 / BRANCHES), also["tau"] * np.geomspace(1 / root, root, BRANCHES))


def _two_times(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    fast = also["fast_share"]
    return _seeded(size, np.array([fast, 1 - fast]), also["tau"] * np.array([10**-0.5, 10**0.5]))


def _stretched(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    """Branches whose decay is nearest to a stretched exponential's from 0.01 to 100 time constants."""
    t, times = np.geomspace(1e-2, 1e2, 200), np.geomspace(1e-2, 1e2, 10)
    decay = np.exp(-(t ** also["beta"]))
    shares, _ = nnls(np.exp(-t[:, None] / times), decay)
    kept = shares > 1e-4
    return _seeded(size, shares[kept] / shares[kept].sum(), also["tau"] * times[kept])


TWIN = Twin(
    name="relaxation",
    fields={"rig": {"relaxation": (Annotated[tuple[Relaxation, ...], AfterValidator(_not_all)], ())}},
    places=("cable",),
    size=(0.005, 0.2),
    unit="1",
    also={"tau": (5.0, 60.0), "spread": (1.0, 30.0), "fast_share": (0.3, 0.7), "beta": (0.35, 0.7)},
    seed=_seed,
    other_laws={"two-times": _two_times, "stretched": _stretched},
)
