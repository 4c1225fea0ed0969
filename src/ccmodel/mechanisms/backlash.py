"""A dead zone between load pulley and load.

Equation: The load engages only beyond half_gap on either side of its neutral angle: a spring load gives tau_out =
K_e (theta - half_gap sgn(theta)) outside the dead zone and zero inside. At rest the load lies against the side to
which the cables' torque holds it; where this torque is less than the sensors resolve, its place is unknown.

Signature: The load's torque is flat around zero while the pulley turns.

Separated by: torque near zero at two pretensions: backlash does not depend on pretension.

Source: Nordin and Gutman, Controlling mechanical systems with backlash - a survey, Automatica 38(10), 1633-1649,
2002, doi:10.1016/S0005-1098(02)00047-X.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import LOAD, Curve, Mechanism, Parameter


@kernel(inline="always")
def dead_zone(theta: float, half_gap: float) -> tuple[float, float]:
    """Angle beyond the gap (rad) and its derivative by `theta`."""
    if theta > half_gap:
        return theta - half_gap, 1.0
    if theta < -half_gap:
        return theta + half_gap, 1.0
    return 0.0, 0.0


def _lost(theta: NDArray, values: Mapping[str, float]) -> NDArray:
    """What the gap takes off a spring's torque."""
    return -values["K_e"] * np.clip(theta, -values["half_gap"], values["half_gap"])


_HALF_GAP = Parameter("half_gap", "rad", 3.5e-3, 70e-3, 15e-3, "half of the dead zone")
_K_E = Parameter("K_e", "N m/rad", 1e-3, 10.0, 0.05, "the load's stiffness")

MECHANISM = Mechanism(
    name="backlash",
    text=__doc__,
    tex=(
        r"\tau_\mathrm{out} = \begin{cases} K_e\,(\theta - \mathrm{half\_gap}\,\operatorname{sgn}(\theta)) & "
        r"|\theta| > \mathrm{half\_gap} \\ 0 & |\theta| \le \mathrm{half\_gap} \end{cases}"
    ),
    sentence="the load follows its pulley with a dead zone of ±{half_gap}",
    places=("load-pulley",),
    parameters=(_HALF_GAP,),
    mistaken_for=("strand-settling", "slack"),
    depends_on_time=False,
    settings={"half_gap": "half_gap"},
    curves=(Curve(LOAD, "load-angle", _lost, (_HALF_GAP, _K_E)),),
)
