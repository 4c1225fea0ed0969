"""Friction builds up over a bristle length.

Equation: Dahl's law: at a sliding speed v the bristle z follows dz/dt = v (1 - sgn(v) z / z0), and friction is mu N
z / z0. It depends on the sliding distance and not on the speed, so a step of any size in one direction has a closed
form.

Signature: Corners at reversals, sharp in the paper's model, are rounded over a few z0 of sliding.

Separated by: nested reversals of small amplitude: with bristles the tension creeps from one small loop to the next,
with a compliant termination the small loops close.

Source: Dahl, Solid friction damping of mechanical vibrations, AIAA Journal 14(12), 1675-1682, 1976,
doi:10.2514/3.61511.
"""

from ccmodel.elementary import quick_exp
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Mechanism, Parameter


@kernel(inline="always")
def dahl(xi: float, slide: float, z0: float) -> tuple[float, float]:
    """Bristle xi = z / z0 after sliding by `slide` (m) in one direction, and its derivative by `slide` (1/m)."""
    direction = 1.0 if slide >= 0.0 else -1.0
    decay = quick_exp(-abs(slide) / z0)
    return direction + (xi - direction) * decay, (1.0 - direction * xi) * decay / z0


MECHANISM = Mechanism(
    name="presliding",
    text=__doc__,
    tex=(
        r"\frac{dz}{dt} = v \left(1 - \operatorname{sgn}(v)\,\frac{z}{z_0}\right), \qquad F_\mathrm{friction} = "
        r"\mu N\,\frac{z}{z_0}"
    ),
    sentence="friction builds up over {z0} of sliding",
    places=("conduit",),
    parameters=(Parameter("z0", "m", 5e-6, 200e-6, 50e-6, "presliding length of the bristle"),),
    mistaken_for=("termination-compliance",),
    depends_on_time=False,
    # One bristle stands for asperities of many lengths. Of five practice rigs with elastic-slip elements whose lengths
    # differ by factors of 3 to 15, it misses 1.3 to 9.6 % (Iwan, Journal of Applied Mechanics 33(4), 893-900, 1966,
    # doi:10.1115/1.3625199).
    model_form_error=0.1,
    settings={"bristle_m": "z0"},
)
