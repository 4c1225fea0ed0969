"""A torque's gain is off.

Equation: The channel reads (1 + gain) tau.

Signature: The error is proportional to the torque and zero where the torque is.

Separated by: strokes in both directions at equal torque: the error of a gain does not depend on the direction.

Source: Isermann, Fault-Diagnosis Systems, Springer, 2006, doi:10.1007/3-540-30368-5, on sensor gain faults.
"""

from collections.abc import Mapping

from numpy.typing import NDArray

from ccmodel.channels import TORQUE_AT
from ccmodel.mechanisms.contract import SENSOR_MAP, Curve, Mechanism, Parameter, Sensing, side


def _modifies_observation(sensing: Sensing, place: str, values: Mapping[str, float]) -> dict[str, NDArray]:
    channel = TORQUE_AT[side(place)]
    return {channel: sensing.channels[channel] * (1 + values["gain"])}


_GAIN = Parameter("gain", "1", 0.02, 0.1, 0.05, "error of the gain", signed=True)

MECHANISM = Mechanism(
    name="torque-scale",
    text=__doc__,
    tex=r"\tau_\mathrm{read} = (1 + \mathrm{gain})\,\tau",
    sentence="the {side}'s torque sensor reads {gain:%} [high|low]",
    places=("drive-sensor", "load-sensor"),
    parameters=(_GAIN,),
    mistaken_for=("pulley-friction",),
    depends_on_time=False,
    modifies_observation=_modifies_observation,
    curves=(
        Curve(SENSOR_MAP, "reading", lambda tau, values: values["gain"] * tau, (_GAIN,), tuple(TORQUE_AT.values())),
    ),
)
