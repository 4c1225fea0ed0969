"""What can be wrong with a load cell, the sum F of the two tensions on one side.

Equations, by name:

- ``load-cell-scale``: reads (1 + gain) F;
- ``load-cell-offset``: reads F + offset;
- ``load-cell-drift``: reads F + rate (t - t_0), t_0 the start of the recording;
- ``load-cell-crosstalk``: reads F + crosstalk tau / R, a part of the torque's force in the sum.

Signature: one sum disagrees with all else, the torque on the same side among it, and the model is right everywhere
but in the tensions derived from that sum.

Mistaken for one another; drift for relaxation. Two pretensions tell gain from offset, a rest at the start shows
offset and drift, and strokes to both sides show crosstalk.
"""

from ccmodel.mechanisms.contract import Mechanism, Parameter, sensor_sum, sensor_torque, side

_PLACES = ("drive-sensor", "load-sensor")


def _scale(sensing, place, values):
    channel = sensor_sum(place)
    return {channel: sensing.channels[channel] * (1 + values["gain"])}


def _offset(sensing, place, values):
    channel = sensor_sum(place)
    return {channel: sensing.channels[channel] + values["offset"]}


def _drift(sensing, place, values):
    channel = sensor_sum(place)
    return {channel: sensing.channels[channel] + values["rate"] * (sensing.time_s - sensing.time_s[0])}


def _crosstalk(sensing, place, values):
    channel = sensor_sum(place)
    radius = sensing.drive_radius_m if side(place) == "drive" else sensing.load_radius_m
    force = sensing.channels[sensor_torque(place)] / radius
    return {channel: sensing.channels[channel] + values["crosstalk"] * force}


MECHANISMS = (
    Mechanism(
        name="load-cell-scale",
        places=_PLACES,
        parameters=(Parameter("gain", "1", 0.02, 0.1, 0.05, signed=True),),
        summary="a load cell reads too high or too low by a share",
        mistaken_for="load-cell-offset, cable-asymmetry",
        separated_by="two pretensions",
        modifies_observation=_scale,
    ),
    Mechanism(
        name="load-cell-offset",
        places=_PLACES,
        parameters=(Parameter("offset", "N", 0.2, 3.0, 0.5, signed=True),),
        summary="a load cell's zero is off",
        mistaken_for="load-cell-scale",
        separated_by="two pretensions, the rest at the start",
        modifies_observation=_offset,
    ),
    Mechanism(
        name="load-cell-drift",
        places=_PLACES,
        parameters=(Parameter("rate", "N/s", 0.02, 0.2, 0.05, signed=True),),
        summary="a load cell's zero moves with time",
        mistaken_for="relaxation, load-cell-offset",
        separated_by="rest at start and end; the other side's cell",
        modifies_observation=_drift,
    ),
    Mechanism(
        name="load-cell-crosstalk",
        places=_PLACES,
        parameters=(Parameter("crosstalk", "1", 0.02, 0.1, 0.05, signed=True),),
        summary="part of the torque shows in the load cell",
        mistaken_for="load-cell-scale",
        separated_by="strokes to both sides",
        modifies_observation=_crosstalk,
    ),
)
