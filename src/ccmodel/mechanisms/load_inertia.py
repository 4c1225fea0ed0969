"""A load with mass.

Equation: J alpha besides the load's spring K_e, and B omega that damps it, B = 2 zeta sqrt(J K_e).

Signature: a torque that grows with the square of the frequency, against the angle; where the cables hold still the
load rings on them.

Mistaken for a clock that is late. A sweep of frequencies tells: a delay's error grows with the first power.
"""

from ccmodel.mechanisms.contract import Mechanism, Parameter


def _modifies_physics(settings, place, values):
    settings.inertia, settings.ring_damping = values["J"], values["zeta"]


# A ring that is a few per cent out of tune soon rings against what it should account for. So many masses are tried, and
# with much damping, under which a ring is heard from further off; then with less and less.
TRIED = tuple(k / 24 for k in range(1, 24))

MECHANISM = Mechanism(
    name="load-inertia",
    places=("load",),
    parameters=(
        Parameter("J", "kg m^2", 1e-5, 1e-3, 1e-4, screening_grid=TRIED),
        Parameter("zeta", "1", 1e-3, 0.3, 0.1, screening_grid=(0.85,), continuation=True, default=0.0),
    ),
    summary="the load's moment of inertia",
    mistaken_for="time-skew",
    separated_by="a sweep of frequencies",
    modifies_physics=_modifies_physics,
)
