"""Faults of a load cell, which measures the sum F of the two tensions on one side: gain, offset, drift, crosstalk."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import SUM_AT, TORQUE_AT
from ccmodel.mechanisms.contract import SENSOR_MAP, Curve, Mechanism, Parameter, Sensing, side

CELLS = tuple(SUM_AT.values())
# Values of the cell from the sum of tensions, the fault's parameters, all channels, and the end of the transmission.
Reading = Callable[[NDArray, Mapping[str, float], Sensing, str], NDArray]


def _scale(force: NDArray, values: Mapping[str, float], sensing: Sensing, end: str) -> NDArray:
    """A load cell's gain is off.

    Equation: The cell reads (1 + gain) F.

    Signature: One force sum disagrees with all other channels, also with the torque on the same side. The model
    errs only in this sum and the two tensions derived from it, in proportion to it.

    Separated by: two pretensions.

    Source: JCGM 200:2012, International vocabulary of metrology, 2012, doi:10.59161/JCGM200-2012, 4.12 (sensitivity).
    """
    return force * (1 + values["gain"])


def _offset(force: NDArray, values: Mapping[str, float], sensing: Sensing, end: str) -> NDArray:
    """A load cell's zero is off.

    Equation: The cell reads F + offset.

    Signature: One force sum disagrees with all other channels, also with the torque on the same side. The model
    errs only in this sum and the two tensions derived from it, by a constant.

    Separated by: two pretensions; the rest at the start.

    Source: JCGM 200:2012, International vocabulary of metrology, 2012, doi:10.59161/JCGM200-2012, 4.20 (instrumental
    bias).
    """
    return force + values["offset"]


def _drift(force: NDArray, values: Mapping[str, float], sensing: Sensing, end: str) -> NDArray:
    """A load cell's zero drifts with time.

    Equation: The cell reads F + rate (1 - exp(-slowing t)) / slowing, with t the time since the recording started: the
    drift begins at a rate that falls off as the cell warms up, or stays as it is if slowing is 0.

    Signature: One force sum disagrees with all other channels, also with the torque on the same side. The model
    errs only in this sum and the two tensions derived from it, by an error that grows with time.

    Separated by: rest at start and end; the other side's cell.

    Source: JCGM 200:2012, International vocabulary of metrology, 2012, doi:10.59161/JCGM200-2012, 4.21 (instrumental
    drift), with the first-order response of a body that warms up.
    """
    return force + _drifted(sensing.time_s - sensing.time_s[0], values)


def _drifted(t: NDArray, values: Mapping[str, float]) -> NDArray:
    if values["slowing"] == 0.0:
        return values["rate"] * t
    return values["rate"] * -np.expm1(-values["slowing"] * t) / values["slowing"]


def _crosstalk(force: NDArray, values: Mapping[str, float], sensing: Sensing, end: str) -> NDArray:
    """A load cell responds to the torque.

    Equation: The cell reads F + crosstalk tau / R, with tau the torque on the same side, whatever its sensor reads.

    Signature: One force sum disagrees with all other channels, also with the torque on the same side. The model
    errs only in this sum and the two tensions derived from it, by an error that follows the torque.

    Separated by: strokes to both sides.

    Source: JCGM 200:2012, International vocabulary of metrology, 2012, doi:10.59161/JCGM200-2012, 4.13 (selectivity).
    """
    radius = sensing.drive_radius_m if end == "drive" else sensing.load_radius_m
    return force + values["crosstalk"] * (sensing.true[TORQUE_AT[end]] / radius)


def _fault(
    name: str,
    reading: Reading,
    tex: str,
    parameters: tuple[Parameter, ...],
    mistaken_for: tuple[str, ...],
    sentence: str,
    depends_on_time: bool = False,
    map_by: tuple[str, ...] = ("reading",),
    added: Callable[[NDArray, Mapping[str, float]], NDArray] | None = None,
) -> Mechanism:
    """Mechanism of one fault: `reading` gives the cell's values from the sum of tensions and the fault's parameters.

    `map_by` are the arguments by which it can be learned as a law, and ``added(x, values)`` is what it adds to the
    reading then: its first parameter times the argument, if not given.
    """

    def in_proportion(x: NDArray, values: Mapping[str, float]) -> NDArray:
        return values[parameters[0].name] * x

    def modifies_observation(sensing: Sensing, place: str, values: Mapping[str, float]) -> dict[str, NDArray]:
        end = side(place)
        return {SUM_AT[end]: reading(sensing.channels[SUM_AT[end]], values, sensing, end)}

    return Mechanism(
        name=name,
        text=reading.__doc__ or "",
        tex=tex,
        sentence=sentence,
        places=("drive-sensor", "load-sensor"),
        parameters=parameters,
        mistaken_for=mistaken_for,
        depends_on_time=depends_on_time,
        modifies_observation=modifies_observation,
        curves=tuple(Curve(SENSOR_MAP, by, added or in_proportion, parameters, CELLS) for by in map_by),
    )


_GAIN = Parameter("gain", "1", 0.02, 0.1, 0.05, "error of the gain", signed=True)
_OFFSET = Parameter("offset", "N", 0.2, 3.0, 0.5, "error of the zero", signed=True)
_RATE = Parameter("rate", "N/s", 0.02, 0.2, 0.05, "rate of the drift as a recording starts", signed=True)
_SLOWING = Parameter(
    "slowing",
    "1/s",
    0.0,
    1.0,
    0.0,
    "rate at which the drift falls off",
    scale="linear",
    screening_grid=(0.0, 0.3),
    default=0.0,
    optional=True,
)
_CROSSTALK = Parameter("crosstalk", "1", 0.02, 0.1, 0.05, "share of tau / R in the sum", signed=True)

MECHANISMS = (
    _fault(
        "load-cell-scale",
        _scale,
        r"F_\mathrm{read} = (1 + \mathrm{gain})\,F",
        (_GAIN,),
        ("load-cell-offset", "cable-asymmetry"),
        "the {side}'s load cell reads {gain:%} [high|low]",
    ),
    _fault(
        "load-cell-offset",
        _offset,
        r"F_\mathrm{read} = F + \mathrm{offset}",
        (_OFFSET,),
        ("load-cell-scale",),
        "the {side}'s load cell reads {offset} [high|low]",
        map_by=("reading", "time", "rate", "torque", "drive-angle", "load-angle"),
        added=lambda x, values: np.full(x.shape, values["offset"]),
    ),
    _fault(
        "load-cell-drift",
        _drift,
        r"F_\mathrm{read}(t) = F(t) + \mathrm{rate}\,\frac{1 - e^{-\mathrm{slowing}\,t}}{\mathrm{slowing}}",
        (_RATE, _SLOWING),
        ("relaxation", "load-cell-offset"),
        "the zero of the {side}'s load cell drifts [up|down] by {rate}[slowing: at first, falling off at {slowing}]",
        depends_on_time=True,
        map_by=("time",),
        added=_drifted,
    ),
    _fault(
        "load-cell-crosstalk",
        _crosstalk,
        r"F_\mathrm{read} = F + \mathrm{crosstalk}\cdot\frac{\tau}{R}",
        (_CROSSTALK,),
        ("load-cell-scale",),
        "the {side}'s load cell responds to {crosstalk:%} of the torque",
        map_by=("torque",),
    ),
)
