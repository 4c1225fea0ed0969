"""Stribeck: friction that is higher at rest than in motion.

Equation: mu (1 + a r), where r is what the contact remembers of its speed: 1 after a rest, and
dr/ds = (exp(-(v / vs)^delta) - r) / RENEWAL_M along the way s that it slides, v the sliding speed. In steady sliding
this is mu (1 + a exp(-(v / vs)^delta)): a Gaussian where delta is 2, as it is where nothing else is said, and
exponential where it is 1; what is measured lies between and beyond (Armstrong-Helouvry, Dupont, Canudas de Wit,
Automatica 30(7), 1083-1138, 1994).

Without the way on which a contact renews itself, friction that falls with speed has no unique step, and not with
inertia either: explicit dynamics then chatters on ever shorter pieces of cable the finer its grid, and its mean is
that of mu alone, whatever a and vs (docs/verification.md). With it the course is smooth and unique.

Signature: a peak at break-away, and a loss that falls with speed.

Mistaken for presliding and for viscous friction. A sweep of speeds tells.
"""

from ccmodel.elementary import quick_exp, quick_log
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Mechanism, Parameter

RENEWAL_M = 2e-5


@kernel(inline="always")
def renewed(rested, slide, dt, vs, delta):
    """What the contact remembers (0 to 1) after it has slid by `slide` (m) within `dt` (s)."""
    left = quick_exp(-abs(slide) / RENEWAL_M)
    ratio = abs(slide) / (dt * vs)
    if delta == 2.0:
        ratio *= ratio
    elif ratio > 0.0:
        ratio = quick_exp(delta * quick_log(ratio))
    return rested * left + (1.0 - left) * quick_exp(-ratio)


def _modifies_physics(settings, place, values):
    if not values["vs"] > 0:
        raise ValueError(f"the speed at which friction has fallen, vs, is above zero; got {values['vs']} m/s")
    settings.stribeck_rise = values["a"]
    settings.stribeck_speed, settings.stribeck_fall = values["vs"], values["delta"]


MECHANISM = Mechanism(
    name="stribeck",
    places=("conduit",),
    parameters=(
        Parameter("a", "1", 0.05, 0.6, 0.2),
        Parameter("vs", "m/s", 1e-4, 1e-2, 2e-3, neutral=1e-3),
        Parameter("delta", "1", 0.5, 2.5, 1.5, neutral=2.0, screening_grid=(0.7,), default=2.0),
    ),
    summary="friction is higher at rest than in motion",
    mistaken_for="presliding, viscous-friction",
    separated_by="a sweep of speeds",
    modifies_physics=_modifies_physics,
)
