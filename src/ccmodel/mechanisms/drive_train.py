"""Torsional compliance and backlash of the drive train.

Equation: The drive train connects the motor at angle phi with the pulley at theta. Beyond its gap it is a spring: phi -
theta = compliance tau + half_gap sgn(tau). The encoder of the pulley shows theta within a count; within that range the
pulley is where the torque of the train balances that of cables and bearing.

Signature: At a reversal the pulley stands while the motor crosses twist and gap of the train. The torque changes
meanwhile, at a rate in proportion to the motor's speed.

Separated by: the motor's own encoder (`motor_encoder_counts`), without which this mechanism has no effect.

Source: Nordin and Gutman, Controlling mechanical systems with backlash - a survey, Automatica 38(10), 1633-1649,
2002, doi:10.1016/S0005-1098(02)00047-X.
"""

from ccmodel.channels import THETA_MOTOR
from ccmodel.kernel import kernel
from ccmodel.mechanisms.backlash import dead_zone
from ccmodel.mechanisms.contract import Mechanism, Parameter


@kernel(error_model="numpy")
def train_torque(torsion: float, compliance: float, half_gap: float) -> float:
    """Torque (N m) of a train twisted by `torsion` (rad)."""
    return dead_zone(torsion, half_gap)[0] / compliance


MECHANISM = Mechanism(
    name="drive-train",
    text=__doc__,
    tex=(
        r"\varphi - \theta_\mathrm{in} = \mathrm{compliance}\cdot\tau + "
        r"\mathrm{half\_gap}\cdot\operatorname{sgn}(\tau)"
    ),
    sentence="the drive train yields by {compliance} beyond a gap of twice {half_gap}",
    places=("drive-pulley",),
    parameters=(
        Parameter("compliance", "rad/(N m)", 0.02, 2.0, 0.2, "torsional compliance of the train"),
        Parameter("half_gap", "rad", 1e-3, 0.1, 5e-3, "half of the train's backlash", default=0.0),
    ),
    mistaken_for=("pulley-friction",),
    depends_on_time=False,
    needs=(THETA_MOTOR,),
    settings={"train_compliance": "compliance", "train_half_gap": "half_gap"},
)
