"""Friction that does not depend on tension.

Equation: Friction per length is mu T dphi/dx + f0 (1 - local) / L, with a step of f0 local at x = s L. The drag is
spread along the conduit for local = 0, as that of a lubricant or of a cover, and that of a seal for local = 1.

Signature: A loss remains as the tension goes to zero.

Separated by: loss against pretension: the drag is the intercept at zero tension. A seal and a pulley's bearing differ
in how far the cables move before the other end does.

Source: Gao, Luedtke, Gourdon, Ruths, Israelachvili and Landman, Frictional forces and Amontons' law: from the
molecular to the macroscopic scale, Journal of Physical Chemistry B 108(11), 3410-3425, 2004.
"""

import numpy as np
from numpy.typing import NDArray

from ccmodel.mechanisms.contract import SLIDING_FRICTION, Curve, Mechanism, Parameter, Settings, optional_share

# The drag over mu and the bend: the tension at which it is as large as Coulomb friction. Below a tenth of a newton the
# factor of friction that it is would grow without bound.
_AS_LARGE_AT = Parameter("as_large_at", "N", 0.1, 30.0, 1.0, "tension at which the drag equals Coulomb friction")
FLOOR_N = 0.1
# Standard deviation of a place that may be anywhere. A drag that is spread all along does not determine it.
PLACE_SD = 0.3
_PER_LENGTH = Parameter("per_length", "N/m", 0.1, 5.0, 0.5, "drag over the length of the conduit")


def drag_shares(settings: Settings, cell_m: NDArray) -> NDArray:
    """Share of the drag in each cell of a conduit; both arrays have the shape (cells,).

    That of a seal is divided between the cells whose middles are next to its place, so that their mean place is its.
    """
    along = cell_m / cell_m.sum()
    middle = np.cumsum(along) - along / 2
    number = np.arange(along.size)
    seal = (1.0 - np.abs(number - np.interp(settings.drag_place, middle, number))).clip(0.0)
    return (1.0 - settings.drag_local) * along + settings.drag_local * seal


MECHANISM = Mechanism(
    name="constant-drag",
    text=__doc__,
    tex=(
        r"\left|\frac{\partial T}{\partial x}\right| \le \mu\,T\,\frac{d\varphi}{dx} + f_0 \left(\frac{1 - "
        r"\mathrm{local}}{L} + \mathrm{local}\;\delta(x - s L)\right)"
    ),
    sentence=(
        "each cable drags with a constant {f0}, whatever its tension[local:, {local:%} of it at one place, at {s:%} "
        "of the length]"
    ),
    places=("conduit",),
    parameters=(
        Parameter("f0", "N", 0.1, 5.0, 0.5, "drag of one whole cable"),
        optional_share("local", "share of the drag that acts at one place"),
        Parameter(
            "s",
            "1",
            0.0,
            1.0,
            0.5,
            "place of a seal, as a share of the length",
            neutral=0.5,
            scale="linear",
            screening_grid=(0.1, 0.9),
            default=0.5,
            prior_sd=PLACE_SD,
        ),
    ),
    mistaken_for=("load-dependent-friction", "pulley-friction"),
    depends_on_time=False,
    settings={"drag_N": "f0", "drag_local": "local", "drag_place": "s"},
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
