"""Friction or stiffness differs between the cables.

Equation: Cable B has ratio times the friction coefficient mu and K_ratio times the axial rigidity EA of cable A.

Signature: The residual changes with the direction of motion: the strokes that one cable pulls fit, those of the
other do not.

Separated by: exchange of the cables: the residual moves with them.

Source: Agrawal, Peine and Yao 2010: (1) to (5), with separate parameters for each cable.
"""

import numpy as np

from ccmodel.mechanisms.contract import CABLE_STRETCH, SLIDING_FRICTION, Curve, Mechanism, Parameter

_RATIO = Parameter("ratio", "1", 0.6, 1.4, 1.1, "friction coefficient, B over A", neutral=1.0, ratio=True)
_K_RATIO = Parameter("K_ratio", "1", 0.6, 1.4, 1.0, "axial rigidity, B over A", neutral=1.0, ratio=True, above=0.0)

MECHANISM = Mechanism(
    name="cable-asymmetry",
    text=__doc__,
    tex=r"\mu_B = \mathrm{ratio}\cdot\mu_A, \qquad (EA)_B = \mathrm{K\_ratio}\cdot(EA)_A",
    sentence="cable B has {ratio} times the friction and {K_ratio} times the stiffness of cable A",
    places=("cable",),
    parameters=(_RATIO, _K_RATIO),
    mistaken_for=("load-cell-scale",),
    depends_on_time=False,
    settings={"friction_ratio_B": "ratio", "stiffness_ratio_B": "K_ratio"},
    curves=(
        Curve(SLIDING_FRICTION, "cable", lambda cable, values: np.where(cable > 0, values["ratio"], 1.0), (_RATIO,)),
        Curve(
            CABLE_STRETCH, "cable", lambda cable, values: np.where(cable > 0, 1 / values["K_ratio"], 1.0), (_K_RATIO,)
        ),
    ),
)
