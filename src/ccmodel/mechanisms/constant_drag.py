"""Friction that does not depend on tension.

Equation: Friction per length is mu T dphi/dx + f0 / L.

Signature: A loss remains as the tension goes to zero.

Separated by: loss against pretension: the drag is the intercept at zero tension.

Source: Gao, Luedtke, Gourdon, Ruths, Israelachvili and Landman, Frictional forces and Amontons' law: from the
molecular to the macroscopic scale, Journal of Physical Chemistry B 108(11), 3410-3425, 2004.
"""

from ccmodel.mechanisms.contract import Mechanism, Parameter

MECHANISM = Mechanism(
    name="constant-drag",
    text=__doc__,
    tex=r"\left|\frac{\partial T}{\partial x}\right| \le \mu\,T\,\frac{d\varphi}{dx} + \frac{f_0}{L}",
    sentence="each cable drags with a constant {f0}, whatever its tension",
    places=("conduit",),
    parameters=(Parameter("f0", "N", 0.1, 5.0, 0.5, "drag of one whole cable"),),
    mistaken_for=("load-dependent-friction", "pulley-friction"),
    depends_on_time=False,
    settings={"drag_N": "f0"},
)
