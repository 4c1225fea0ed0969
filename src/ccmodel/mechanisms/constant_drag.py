"""Friction that does not depend on tension.

Equation: Friction per length is mu T dphi/dx + f0 / L.

Signature: A loss remains as the tension goes to zero.

Separated by: loss against pretension: the drag is the intercept at zero tension.

Source: Gao, Luedtke, Gourdon, Ruths, Israelachvili and Landman, Frictional forces and Amontons' law: from the
molecular to the macroscopic scale, Journal of Physical Chemistry B 108(11), 3410-3425, 2004.
"""

import numpy as np

from ccmodel.mechanisms.contract import SLIDING_FRICTION, Curve, Mechanism, Parameter

# The drag over mu and the bend: the tension at which it is as large as Coulomb friction. Below a tenth of a newton the
# factor of friction that it is would grow without bound.
_AS_LARGE_AT = Parameter("as_large_at", "N", 0.1, 30.0, 1.0, "tension at which the drag equals Coulomb friction")
FLOOR_N = 0.1
_PER_LENGTH = Parameter("per_length", "N/m", 0.1, 5.0, 0.5, "drag over the length of the conduit")

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
    curves=(
        Curve(
            SLIDING_FRICTION,
            "tension",
            lambda tension, values: 1 + values["as_large_at"] / np.maximum(tension, FLOOR_N),
            (_AS_LARGE_AT,),
        ),
        *(
            Curve(
                SLIDING_FRICTION,
                argument,
                lambda x, values: np.full(x.shape, values["per_length"]),
                (_PER_LENGTH,),
                form="drag",
            )
            for argument in ("speed", "position-along-conduit")
        ),
    ),
)
