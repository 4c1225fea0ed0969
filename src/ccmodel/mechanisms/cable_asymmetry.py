"""Two cables that are not alike.

Equation: cable B has mu times ``ratio`` and EA times ``K_ratio`` of cable A's.

Signature: a residual that is odd in the direction of motion: cable A's stroke fits and B's does not.

Mistaken for the gain of a load cell. Exchange the cables: the residual goes with them.
"""

from ccmodel.mechanisms.contract import Mechanism, Parameter


def _modifies_physics(settings, place, values):
    if not values["K_ratio"] > 0:
        raise ValueError(f"both cables have some stiffness, so K_ratio is above zero; got {values['K_ratio']}")
    settings.friction_ratio_B = values["ratio"]
    settings.stiffness_ratio_B = values["K_ratio"]


MECHANISM = Mechanism(
    name="cable-asymmetry",
    places=("cable",),
    parameters=(
        Parameter("ratio", "1", 0.6, 1.4, 1.1, neutral=1.0, ratio=True),
        Parameter("K_ratio", "1", 0.6, 1.4, 1.0, neutral=1.0, ratio=True),
    ),
    summary="friction or stiffness differs between the cables",
    mistaken_for="load-cell-scale",
    separated_by="exchange of the cables",
    modifies_physics=_modifies_physics,
)
