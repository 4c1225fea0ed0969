"""A load spring that is not straight.

Equation: tau_out = K_e theta + K_3 theta^3 (on top of what the load itself has).

Signature: tau_out against theta_out is curved.

Mistaken for backlash. The torque near zero tells: flat with backlash, straight with a cubic.
"""

from ccmodel.mechanisms.contract import Mechanism, Parameter


def _modifies_physics(settings, place, values):
    settings.cubic_stiffness = values["K3"]


MECHANISM = Mechanism(
    name="load-stiffening",
    places=("load",),
    parameters=(Parameter("K3", "N m/rad^3", 1e-3, 1.0, 0.03, signed=True),),
    summary="the load's spring stiffens with its angle",
    mistaken_for="backlash",
    separated_by="torque near zero angle",
    modifies_physics=_modifies_physics,
)
