"""Friction builds up over sliding lengths of a range.

Equation: Friction is mu N times (1 - creep) of the mean of four elements xi_k, -1 to 1, and creep of a bristle xi. An
element is a spring that slips at its limit (generalised Maxwell slip): d xi_k/ds = 1/z_k along the sliding s while
|xi_k| < 1. Their lengths z_k are evenly spaced in the logarithm about z0; spread is the longest over the shortest. The
bristle follows Dahl's law: d xi/ds = (1 - sgn(ds) xi) / z0. Friction depends on the sliding distance and not on the
speed.

Signature: Corners at reversals, sharp in the paper's model, are rounded over a few z0 of sliding.

Separated by: reversals of growing amplitude. In small loops elements are elastic and lose no work, and a Dahl bristle
creeps. With a compliant termination small loops close as well, but the cable next to it slides, so that even the
smallest lose work.

Source: Iwan, Journal of Applied Mechanics 33(4), 893-900, 1966, doi:10.1115/1.3625199; Dahl, AIAA Journal 14(12),
1675-1682, 1976, doi:10.2514/3.61511.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccmodel.elementary import quick_exp
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import SLIDING_FRICTION, Curve, Mechanism, Parameter

# Elements of a contact. Four describe eight whose lengths differ by a factor of 3 or 15 to 0.4 and 3 % of friction
# (root mean square along nested reversals); one does to 9 and 19 %.
ELEMENTS = 4
# Longest over shortest length unless a model states it.
SPREAD = 4.0
# Most elements of a contact: as many as a learned law has.
MOST_ELEMENTS = 9
# Length of the bristle beside the elements of a learned law, which stands for friction that is there at once, m.
SHORTEST_BRISTLE_M = 1e-8


class Contacts(NamedTuple):
    """How friction builds up at the contacts: elements that yield, and a bristle of Dahl's law.

    Attributes
    ----------
    bristle_m : float
        Length of the bristle.
    creep : float
        Its share of friction.
    element_m : tuple of float
        Lengths of the elements; of `MOST_ELEMENTS` those beyond `elements` are of no account.
    element_share : tuple of float
        Their shares of friction, which add up to 1 with `creep`.
    elements : int
    """

    bristle_m: float
    creep: float
    element_m: tuple[float, ...]
    element_share: tuple[float, ...]
    elements: int

    @classmethod
    def of_mechanism(cls, z0: float, spread: float, creep: float) -> "Contacts":
        """Those of the mechanism."""
        return cls._of(z0, creep, element_lengths(z0, spread), ((1.0 - creep) / ELEMENTS,) * ELEMENTS)

    @classmethod
    def of_law(cls, travel_m: NDArray, shares: NDArray) -> "Contacts":
        """Those whose elements have these shares of friction, at most 1 together, and yield after these travels since a
        reversal, m.

        After a reversal from sliding an element has twice its length to go. The rest of friction acts from the start:
        its bristle is short.
        """
        lengths = (float(travel) / 2 for travel in travel_m)
        return cls._of(SHORTEST_BRISTLE_M, 1.0 - float(shares.sum()), tuple(lengths), tuple(map(float, shares)))

    @classmethod
    def _of(cls, bristle_m: float, creep: float, lengths: tuple[float, ...], shares: tuple[float, ...]) -> "Contacts":
        none = (0.0,) * (MOST_ELEMENTS - len(shares))
        return cls(float(bristle_m), float(creep), lengths + (1.0,) * len(none), shares + none, len(shares))


@kernel(inline="always")
def dahl(xi: float, slide: float, z0: float) -> tuple[float, float]:
    """Bristle xi = z / z0 after sliding by `slide` (m or rad) in one direction, and its derivative by it."""
    direction = 1.0 if slide >= 0.0 else -1.0
    decay = quick_exp(-abs(slide) / z0)
    return direction + (xi - direction) * decay, (1.0 - direction * xi) * decay / z0


def element_lengths(z0: float, spread: float) -> tuple[float, ...]:
    """Length of each element (m), the shortest first."""
    return tuple(float(z0 * spread ** (k / (ELEMENTS - 1) - 0.5)) for k in range(ELEMENTS))


def _since_reversal(travel: NDArray, values: Mapping[str, float]) -> NDArray:
    """Friction over that of sliding, by the travel since a reversal from sliding."""
    z0, creep = values["z0"], values["creep"]
    lengths = np.array(element_lengths(z0, values["spread"]))
    by_elements = np.maximum(1 - travel[:, None] / (2 * lengths), 0.0).mean(axis=1)
    return 1 - 2 * ((1 - creep) * by_elements + creep * np.exp(-travel / z0))


_PARAMETERS = (
    Parameter("z0", "m", 5e-6, 200e-6, 50e-6, "middle sliding length over which friction builds up"),
    Parameter(
        "spread",
        "1",
        1.0,
        30.0,
        SPREAD,
        "longest over shortest of these lengths",
        neutral=SPREAD,
        screening_grid=(0.4,),
        default=SPREAD,
        above=0.0,
    ),
    Parameter(
        "creep",
        "1",
        0.0,
        1.0,
        0.5,
        "share of a bristle of Dahl's law, whose small loops creep",
        neutral=1.0,
        scale="linear",
        screening_grid=(0.5,),
        default=1.0,
        above=-1e-9,
        below=1.0 + 1e-9,
    ),
)

MECHANISM = Mechanism(
    name="presliding",
    text=__doc__,
    tex=(
        r"\frac{F_\mathrm{friction}}{\mu N} = \frac{1 - \mathrm{creep}}{4} \sum_k \xi_k + \mathrm{creep}\,\xi, \qquad "
        r"\frac{d\xi_k}{ds} = \frac{1}{z_k} \ \text{while}\ |\xi_k| < 1, \qquad \frac{d\xi}{ds} = \frac{1 - "
        r"\operatorname{sgn}(ds)\,\xi}{z_0}"
    ),
    sentence="friction builds up over {z0} of sliding",
    places=("conduit",),
    parameters=_PARAMETERS,
    mistaken_for=("termination-compliance",),
    depends_on_time=False,
    settings={"bristle_m": "z0", "bristle_spread": "spread", "bristle_creep": "creep"},
    curves=(Curve(SLIDING_FRICTION, "distance-since-reversal", _since_reversal, _PARAMETERS),),
)
