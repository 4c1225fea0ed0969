"""Stribeck: friction that is higher at rest than in motion.

Equation: mu (1 + a r), where r is what the contact remembers of its speed: 1 after a rest, and
dr/ds = (exp(-(v / vs)^2) - r) / RENEWAL_M along the way s that it slides, v the sliding speed. In steady sliding this
is mu (1 + a exp(-(v / vs)^2)).

Without the way on which a contact renews itself, friction that falls with speed has no unique step, and not with
inertia either: explicit dynamics then chatters on ever shorter pieces of cable the finer its grid, and its mean is
that of mu alone, whatever a and vs (docs/verification.md). With it the course is smooth and unique.

Signature: a peak at break-away, and a loss that falls with speed.

Mistaken for presliding and for viscous friction. A sweep of speeds tells.
"""

from ccmodel.elementary import quick_exp
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Mechanism, Parameter

RENEWAL_M = 2e-5


@kernel(inline="always")
def renewed(rested, slide, dt, vs):
    """What the contact remembers (0 to 1) after it has slid by `slide` (m) within `dt` (s)."""
    left = quick_exp(-abs(slide) / RENEWAL_M)
    ratio = slide / (dt * vs)
    return rested * left + (1.0 - left) * quick_exp(-ratio * ratio)


def _enters(settings, place, values):
    if not values["vs"] > 0:
        raise ValueError(f"the speed at which friction has fallen, vs, is above zero; got {values['vs']} m/s")
    settings.stribeck_rise = values["a"]
    settings.stribeck_speed = values["vs"]


MECHANISM = Mechanism(
    name="stribeck",
    places=("conduit",),
    parameters=(Parameter("a", "1", 0.05, 0.6, 0.2), Parameter("vs", "m/s", 1e-4, 1e-2, 2e-3, neutral=1e-3)),
    summary="friction is higher at rest than in motion",
    mistaken_for="presliding, viscous-friction",
    separated_by="a sweep of speeds",
    enters=_enters,
)
