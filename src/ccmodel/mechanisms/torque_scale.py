"""A torque sensor, or a motor's torque constant, with a wrong gain.

Equation: the channel reads (1 + gain) times the torque.

Signature: an error in proportion to the torque, zero where the torque is.

Mistaken for friction in a pulley. The sign of the speed tells: a gain's error does not know it.
"""

from ccmodel.mechanisms.contract import Mechanism, Parameter, sensor_torque


def _modifies_observation(sensing, place, values):
    channel = sensor_torque(place)
    return {channel: sensing.channels[channel] * (1 + values["gain"])}


MECHANISM = Mechanism(
    name="torque-scale",
    places=("drive-sensor", "load-sensor"),
    parameters=(Parameter("gain", "1", 0.02, 0.1, 0.05, signed=True),),
    summary="a torque reads too high or too low by a share",
    mistaken_for="pulley-friction",
    separated_by="sign of speed",
    modifies_observation=_modifies_observation,
)
