"""Extra bend at one place of the conduits.

Equation: The bend angle phi(x) jumps by beta at x = s L, in both conduits, which run side by side. At rest the
tension changes at the kink by hold times its change over an equal bend elsewhere: hold = 1 for conduits that had
their kink when the cables were tensioned, hold = 0 for conduits that were bent afterwards. The tensions at the ends
do not show hold at rest; the travel until the friction front passes the kink does.

Signature: The friction front stalls part-way, and the loss in full slip exceeds mu times the measured bend.

Separated by: the time at which the friction front passes, which also gives s.

Source: Agrawal, Peine and Yao 2010, Section VI: kinks introduced inadvertently.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccmodel.mechanisms.contract import SLIDING_FRICTION, Curve, Mechanism, Parameter, Settings

# Half of the width that a law of the position gives to a kink, as a share of the length: a kink itself has none.
HALF_WIDTH = 0.125


class Kink(NamedTuple):
    """A sharp bend: its place as a share of the length, its angle (rad), and the share of its friction held at rest."""

    share: float
    bend_rad: float
    hold: float = 1.0


def _modifies_physics(settings: Settings, values: Mapping[str, float]) -> None:
    if not 0 < values["s"] < 1:
        raise ValueError(f"a kink's s is a share of the length between 0 and 1; got {values['s']}")
    if not 0 <= values["hold"] <= 1:
        raise ValueError(f"what a kink holds at rest is a share between 0 and 1; got hold = {values['hold']}")
    settings.kinks += (Kink(values["s"], values["beta"], values["hold"]),)


def _peak(share: NDArray, s: float) -> NDArray:
    """A triangle of height 1 about `s`."""
    return (1 - np.abs(share - s) / HALF_WIDTH).clip(0.0)


def _of_position(share: NDArray, values: Mapping[str, float]) -> NDArray:
    """Friction over that of an even bend."""
    return 1 + values["rise"] * _peak(share, values["s"])


def _bend_by_position(share: NDArray, values: Mapping[str, float]) -> NDArray:
    """Bend of the kink over the conduit's length, rad."""
    return values["beta"] / HALF_WIDTH * _peak(share, values["s"])


_BETA = Parameter("beta", "rad", 0.2, 1.5, 0.6, "angle of the bend")
_S = Parameter("s", "1", 0.05, 0.95, 0.5, "place, as a share of the length", neutral=0.5, scale="linear")
# A bend of 0.2 to 1.5 rad over what an even bend of 1 to 9 rad has within the width.
_RISE = Parameter("rise", "1", 0.1, 15.0, 2.0, "rise of friction at the kink, over that of an even bend")

MECHANISM = Mechanism(
    name="kink",
    text=__doc__,
    tex=r"\varphi(x) = \varphi_\mathrm{path}(x) + \begin{cases} 0 & x < s L \\ \beta & x \ge s L \end{cases}",
    sentence="the conduits have an extra bend of {beta} at one place",
    places=("conduit",),
    parameters=(
        _BETA,
        _S,
        Parameter(
            "hold",
            "1",
            0.0,
            1.0,
            0.5,
            "share of its friction that holds tension at rest",
            neutral=1.0,
            scale="linear",
            screening_grid=(0.5,),
            default=1.0,
        ),
    ),
    mistaken_for=("mu", "termination-compliance"),
    depends_on_time=False,
    structures={"kinks": ()},
    modifies_physics=_modifies_physics,
    curves=(
        Curve(SLIDING_FRICTION, "position-along-conduit", _of_position, (_RISE, _S)),
        Curve(SLIDING_FRICTION, "position-along-conduit", _bend_by_position, (_BETA, _S), form="bend"),
    ),
)
