"""Faults of a load cell, which measures the sum F of the two tensions on one side: gain, offset, drift, crosstalk."""

from ccmodel.mechanisms.contract import Mechanism, Parameter, sensor_sum, sensor_torque, side

_PLACES = ("drive-sensor", "load-sensor")
_SIGNATURE = (
    "One sum disagrees with all other channels, among them the torque on the same side. The model errs only in the "
    "tensions derived from that sum"
)
_VOCABULARY = "JCGM 200:2012, International vocabulary of metrology, 2012, doi:10.59161/JCGM200-2012"


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
        parameters=(Parameter("gain", "1", 0.02, 0.1, 0.05, "error of the gain", signed=True),),
        summary="a load cell's gain is off",
        equation="The cell reads (1 + gain) F.",
        signature=f"{_SIGNATURE}, in proportion to it.",
        mistaken_for=("load-cell-offset", "cable-asymmetry"),
        separated_by="two pretensions",
        source=f"{_VOCABULARY}, 4.12 (sensitivity)",
        depends_on_time=False,
        modifies_observation=_scale,
    ),
    Mechanism(
        name="load-cell-offset",
        places=_PLACES,
        parameters=(Parameter("offset", "N", 0.2, 3.0, 0.5, "error of the zero", signed=True),),
        summary="a load cell's zero is off",
        equation="The cell reads F + offset.",
        signature=f"{_SIGNATURE}, by a constant.",
        mistaken_for=("load-cell-scale",),
        separated_by="two pretensions; the rest at the start",
        source=f"{_VOCABULARY}, 4.20 (instrumental bias)",
        depends_on_time=False,
        modifies_observation=_offset,
    ),
    Mechanism(
        name="load-cell-drift",
        places=_PLACES,
        parameters=(Parameter("rate", "N/s", 0.02, 0.2, 0.05, "rate of the drift", signed=True),),
        summary="a load cell's zero drifts with time",
        equation="The cell reads F + rate (t - t_0), with t_0 the start of the recording.",
        signature=f"{_SIGNATURE}, by an error that grows with time.",
        mistaken_for=("relaxation", "load-cell-offset"),
        separated_by="rest at start and end; the other side's cell",
        source=f"{_VOCABULARY}, 4.21 (instrumental drift)",
        depends_on_time=True,
        modifies_observation=_drift,
    ),
    Mechanism(
        name="load-cell-crosstalk",
        places=_PLACES,
        parameters=(Parameter("crosstalk", "1", 0.02, 0.1, 0.05, "share of tau / R in the sum", signed=True),),
        summary="a load cell responds to the torque",
        equation="The cell reads F + crosstalk tau / R, with tau the torque on the same side.",
        signature=f"{_SIGNATURE}, by an error that follows the torque.",
        mistaken_for=("load-cell-scale",),
        separated_by="strokes to both sides",
        source=f"{_VOCABULARY}, 4.13 (selectivity)",
        depends_on_time=False,
        modifies_observation=_crosstalk,
    ),
)
