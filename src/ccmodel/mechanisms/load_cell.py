"""Faults of a load cell, which measures the sum F of the two tensions on one side: gain, offset, drift, crosstalk."""

from ccmodel.mechanisms.contract import Mechanism, Parameter, sensor_sum, sensor_torque, side

_PLACES = ("drive-sensor", "load-sensor")


def _scale(sensing, place, values):
    """A load cell's gain is off.

    Equation: The cell reads (1 + gain) F.

    Signature: One force sum disagrees with all other channels, also with the torque on the same side. The model
    errs only in this sum and the two tensions derived from it, in proportion to it.

    Separated by: two pretensions.

    Source: JCGM 200:2012, International vocabulary of metrology, 2012, doi:10.59161/JCGM200-2012, 4.12 (sensitivity).
    """
    channel = sensor_sum(place)
    return {channel: sensing.channels[channel] * (1 + values["gain"])}


def _offset(sensing, place, values):
    """A load cell's zero is off.

    Equation: The cell reads F + offset.

    Signature: One force sum disagrees with all other channels, also with the torque on the same side. The model
    errs only in this sum and the two tensions derived from it, by a constant.

    Separated by: two pretensions; the rest at the start.

    Source: JCGM 200:2012, International vocabulary of metrology, 2012, doi:10.59161/JCGM200-2012, 4.20 (instrumental
    bias).
    """
    channel = sensor_sum(place)
    return {channel: sensing.channels[channel] + values["offset"]}


def _drift(sensing, place, values):
    """A load cell's zero drifts with time.

    Equation: The cell reads F + rate (t - t_0), with t_0 the start of the recording.

    Signature: One force sum disagrees with all other channels, also with the torque on the same side. The model
    errs only in this sum and the two tensions derived from it, by an error that grows with time.

    Separated by: rest at start and end; the other side's cell.

    Source: JCGM 200:2012, International vocabulary of metrology, 2012, doi:10.59161/JCGM200-2012, 4.21 (instrumental
    drift).
    """
    channel = sensor_sum(place)
    return {channel: sensing.channels[channel] + values["rate"] * (sensing.time_s - sensing.time_s[0])}


def _crosstalk(sensing, place, values):
    """A load cell responds to the torque.

    Equation: The cell reads F + crosstalk tau / R, with tau the torque on the same side.

    Signature: One force sum disagrees with all other channels, also with the torque on the same side. The model
    errs only in this sum and the two tensions derived from it, by an error that follows the torque.

    Separated by: strokes to both sides.

    Source: JCGM 200:2012, International vocabulary of metrology, 2012, doi:10.59161/JCGM200-2012, 4.13 (selectivity).
    """
    channel = sensor_sum(place)
    radius = sensing.drive_radius_m if side(place) == "drive" else sensing.load_radius_m
    force = sensing.channels[sensor_torque(place)] / radius
    return {channel: sensing.channels[channel] + values["crosstalk"] * force}


MECHANISMS = (
    Mechanism(
        name="load-cell-scale",
        text=_scale.__doc__,
        places=_PLACES,
        parameters=(Parameter("gain", "1", 0.02, 0.1, 0.05, "error of the gain", signed=True),),
        mistaken_for=("load-cell-offset", "cable-asymmetry"),
        depends_on_time=False,
        modifies_observation=_scale,
    ),
    Mechanism(
        name="load-cell-offset",
        text=_offset.__doc__,
        places=_PLACES,
        parameters=(Parameter("offset", "N", 0.2, 3.0, 0.5, "error of the zero", signed=True),),
        mistaken_for=("load-cell-scale",),
        depends_on_time=False,
        modifies_observation=_offset,
    ),
    Mechanism(
        name="load-cell-drift",
        text=_drift.__doc__,
        places=_PLACES,
        parameters=(Parameter("rate", "N/s", 0.02, 0.2, 0.05, "rate of the drift", signed=True),),
        mistaken_for=("relaxation", "load-cell-offset"),
        depends_on_time=True,
        modifies_observation=_drift,
    ),
    Mechanism(
        name="load-cell-crosstalk",
        text=_crosstalk.__doc__,
        places=_PLACES,
        parameters=(Parameter("crosstalk", "1", 0.02, 0.1, 0.05, "share of tau / R in the sum", signed=True),),
        mistaken_for=("load-cell-scale",),
        depends_on_time=False,
        modifies_observation=_crosstalk,
    ),
)
