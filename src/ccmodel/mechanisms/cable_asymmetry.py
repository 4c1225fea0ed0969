"""Friction or stiffness differs between the cables.

Equation: Cable B has ratio times the friction coefficient mu and K_ratio times the axial rigidity EA of cable A.

Signature: The residual changes with the direction of motion: the strokes that one cable pulls fit, those of the
other do not.

Separated by: exchange of the cables: the residual moves with them.

Source: Agrawal, Peine and Yao 2010: (1) to (5), with separate parameters for each cable.
"""

from ccmodel.mechanisms.contract import Mechanism, Parameter


def _modifies_physics(settings, place, values):
    if not values["K_ratio"] > 0:
        raise ValueError(f"both cables have some stiffness, so K_ratio is above zero; got {values['K_ratio']}")
    settings.friction_ratio_B = values["ratio"]
    settings.stiffness_ratio_B = values["K_ratio"]


MECHANISM = Mechanism(
    name="cable-asymmetry",
    text=__doc__,
    places=("cable",),
    parameters=(
        Parameter("ratio", "1", 0.6, 1.4, 1.1, "friction coefficient, B over A", neutral=1.0, ratio=True),
        Parameter("K_ratio", "1", 0.6, 1.4, 1.0, "axial rigidity, B over A", neutral=1.0, ratio=True),
    ),
    mistaken_for=("load-cell-scale",),
    depends_on_time=False,
    settings={"friction_ratio_B": 1.0, "stiffness_ratio_B": 1.0},
    modifies_physics=_modifies_physics,
)
