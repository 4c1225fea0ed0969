"""Friction or stiffness differs between the cables.

Equation: Cable B has ratio times the friction coefficient mu and K_ratio times the axial rigidity EA of cable A.

Signature: The residual changes with the direction of motion: the strokes that one cable pulls fit, those of the
other do not.

Separated by: exchange of the cables: the residual moves with them.

Source: Agrawal, Peine and Yao 2010: (1) to (5), with separate parameters for each cable.
"""

from ccmodel.mechanisms.contract import Mechanism, Parameter

MECHANISM = Mechanism(
    name="cable-asymmetry",
    text=__doc__,
    tex=r"\mu_B = \mathrm{ratio}\cdot\mu_A, \qquad (EA)_B = \mathrm{K\_ratio}\cdot(EA)_A",
    sentence="cable B has {ratio} times the friction and {K_ratio} times the stiffness of cable A",
    places=("cable",),
    parameters=(
        Parameter("ratio", "1", 0.6, 1.4, 1.1, "friction coefficient, B over A", neutral=1.0, ratio=True),
        Parameter("K_ratio", "1", 0.6, 1.4, 1.0, "axial rigidity, B over A", neutral=1.0, ratio=True, above=0.0),
    ),
    mistaken_for=("load-cell-scale",),
    depends_on_time=False,
    settings={"friction_ratio_B": "ratio", "stiffness_ratio_B": "K_ratio"},
)
