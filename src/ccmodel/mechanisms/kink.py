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

from ccmodel.mechanisms.contract import Mechanism, Parameter, Settings


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


MECHANISM = Mechanism(
    name="kink",
    text=__doc__,
    tex=r"\varphi(x) = \varphi_\mathrm{path}(x) + \begin{cases} 0 & x < s L \\ \beta & x \ge s L \end{cases}",
    sentence="the conduits have an extra bend of {beta} at one place",
    places=("conduit",),
    parameters=(
        Parameter("beta", "rad", 0.2, 1.5, 0.6, "angle of the bend"),
        Parameter("s", "1", 0.05, 0.95, 0.5, "place, as a share of the length", neutral=0.5, scale="linear"),
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
)
