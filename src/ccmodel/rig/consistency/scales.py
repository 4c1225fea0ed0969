"""Wrong scales: a constant of the batch file that the recordings contradict."""

from collections.abc import Mapping, Sequence
from math import isclose

import numpy as np

from ccmodel.channels import ANGLE_AT, F_DRIVE, F_LOAD, SUM_AT, THETA_IN, THETA_OUT, TORQUE_AT
from ccmodel.rig.batch import Batch
from ccmodel.rig.consistency import limits
from ccmodel.rig.consistency.contradiction import DOUBTFUL, LIKELY, SURE, Contradiction
from ccmodel.rig.consistency.exchanges import travel_of, travels_as_exchanged
from ccmodel.rig.consistency.parity import Parity

# Factors that have a name, within 30 %: edges of an encoder, units of an angle.
_NAMED = {
    2.0: "twice the counts per turn",
    4.0: "the edges of a quadrature encoder",
    57.3: "degrees for radians",
    6.28: "turns for radians",
}
_NAMED_WITHIN = 0.3
# What a negative friction or stiffness means.
_EXCHANGED = {
    "friction": (
        f"{F_DRIVE} and {F_LOAD}",
        "the sum of tensions is lower at the drive, which pulls, than friction allows: the load cells of drive and load"
        " are exchanged",
    ),
    "nearest stiffness": (
        f"{THETA_IN} and {THETA_OUT}",
        "the tension falls where the cables stretch: the angles of drive and load are exchanged",
    ),
}
_TORQUE_ACCURACY = "rig.accuracy.torque_Nm"
# Factor up to which a relation that supports another may be right: estimates and compliant ends reach it.
_SAME = 1.8


def wrong_geometry(parities: Sequence[Parity]) -> list[Contradiction]:
    """Radii, and scales of angles: the first that is found, since one makes the other relations wrong."""
    ratios, batch = pooled(parities), parities[0].batch
    if units := [*_radii(batch), *_conduits(parities, batch)]:
        return units
    turned = [p.signs.get("loss", 0.0) for p in parities], [p.lags.get("angles", 0.0) for p in parities]
    exchanged = travels_as_exchanged(parities) and any(np.median(values) < 0 for values in turned)
    return [] if exchanged else _angle_of_one_end(ratios) or _both_angles(ratios)


def wrong_scales(parities: Sequence[Parity]) -> list[Contradiction]:
    """Scale of the load torque, and stated values of spring, cable and pretension that the recordings contradict."""
    ratios, batch = pooled(parities), parities[0].batch
    of_torques = {
        "load": _torque(ratios, "load", limits.MOST_TORQUE),
        "drive": _torque(ratios, "drive", limits.MOST_DRIVE_TORQUE),
    }
    found = (of_torques["load"] or _spring(ratios, batch)) + of_torques["drive"] + _pretension(ratios)
    accuracies = _accuracies(parities)
    if any(of_torques.values()):
        # With a wrong torque its noise is wrong, and the tensions that follow from it say nothing of the cable.
        accuracies = [c for c in accuracies if c.what != _TORQUE_ACCURACY]
    else:
        found += [c for c in _cable(ratios, batch) if c.confidence > DOUBTFUL]
    return [*found, *_frequency(ratios), *accuracies]


def doubtful_stiffness(parities: Sequence[Parity]) -> list[Contradiction]:
    """A cable that is softer than stated, by what its fastenings may yield."""
    return [c for c in _cable(pooled(parities), parities[0].batch) if c.confidence == DOUBTFUL]


def pooled(parities: Sequence[Parity]) -> dict[str, float]:
    """Median of each relation over the recordings; the travel is that of the greatest stroke.

    The spring is the one without what an inertia of the load takes off it, and absent where that is not known.
    """
    by_relation: dict[str, list[float]] = {}
    for parity in parities:
        for name, value in parity.ratios.items():
            by_relation.setdefault(name, []).append(value)
    found = {name: float(np.median(values)) for name, values in by_relation.items()}
    if (travel := travel_of(parities)) is not None:
        found["travel"] = travel
    if beyond(found.get("spring"), _SAME) and (spring := _without_inertia(parities, found.pop("spring"))) is not None:
        found["spring"] = spring
    return found


def _without_inertia(parities: Sequence[Parity], median: float) -> float | None:
    """Torque over angle of a load that is slow, over the stated spring, from its `median` over the recordings.

    An inertia lowers it in proportion to `Parity.load_speed`, below zero above the load's resonance. Motions that are
    alike do not tell the two apart; a negative spring is then none.
    """
    pairs = [(w, p.ratios["spring"]) for p in parities if "spring" in p.ratios and (w := p.load_speed) is not None]
    speeds, springs = np.array(pairs).reshape(-1, 2).T
    if not speeds.size or speeds.max() < limits.UNLIKE_MOTIONS * speeds.min():
        return median if median > 0 else None
    from scipy.stats import theilslopes  # it takes 0.3 s to import

    line = theilslopes(springs, speeds)
    return float(line.intercept) if line.slope < 0 else median


def beyond(ratio: float | None, factor: float) -> int:
    """1 if a ratio is above a factor, -1 if it is below its inverse, otherwise 0; 0 for a relation that is absent."""
    if ratio is None:
        return 0
    return 1 if ratio > factor else -1 if ratio < 1 / factor else 0


def _radii(batch: Batch) -> list[Contradiction]:
    found = []
    for end in batch.rig.ends:
        radius = end.side.pulley_radius_m
        if not limits.SMALLEST_RADIUS_M <= radius <= limits.LARGEST_RADIUS_M:
            unit = f" (is it {radius:g} mm?)" if radius > limits.LARGEST_RADIUS_M else ""
            text = f"rig.{end.name}.pulley_radius_m is {radius:g} m{unit}: no pulley of a cable rig; state it in m"
            found.append(Contradiction(f"rig.{end.name}.pulley_radius_m", text))
    return found


def _conduits(parities: Sequence[Parity], batch: Batch) -> list[Contradiction]:
    """Conduits and a cable that are longer or shorter than any, as lengths in mm are, or bend more, as degrees do."""
    longest = max(parities, key=lambda p: p.recording.path.length_m).recording
    lengths = {
        ("length_m", f"the conduit of {longest.id}"): longest.path.length_m,
        ("rig.cable.length_m", "the cable that has the stated stiffness"): batch.rig.cable.length_m,
    }
    most_bent = max(parities, key=lambda p: p.recording.path.bend_rad).recording
    bend = most_bent.path.bend_rad
    text = f"the conduit of {most_bent.id} bends by {bend:g} rad: is the bend in degrees? State bend_rad in rad"
    found = [Contradiction("bend_rad", text)] if bend > limits.LARGEST_BEND_RAD else []
    for (key, what), length in lengths.items():
        if not limits.SHORTEST_PATH_M <= length <= limits.LONGEST_PATH_M:
            why = "is the length in mm? State" if length > limits.LONGEST_PATH_M else "no conduit of a cable rig; state"
            found.append(Contradiction(key, f"{what} is {length:g} m long: {why} {key} in m"))
    return found


def _accuracies(parities: Sequence[Parity]) -> list[Contradiction]:
    """Stated accuracies that are as large as what the sensors read, or far less than their noise or step."""
    found: dict[str, Contradiction] = {}
    for end in parities[0].batch.rig.ends:
        own = end.side.encoder_accuracy_rad
        channels_of = {
            _TORQUE_ACCURACY: (end.torque,),
            "rig.accuracy.load_cell_N": (end.force, *end.tensions),
            f"rig.{end.name}.encoder_accuracy_rad" if own else "rig.accuracy.encoder_rad": (end.angle,),
        }
        for key, channels in channels_of.items():
            if wrong := _wrong_accuracy(parities, channels):
                found[key] = Contradiction(key, f"{key} is {wrong}")
    return list(found.values())


def _wrong_accuracy(parities: Sequence[Parity], channels: Sequence[str]) -> str:
    """The accuracy of the sensors among channels of one end, and what contradicts it; empty if nothing does.

    A channel that follows from others has another accuracy, which nobody stated.
    """
    reading = {c: [p for p in parities if c in p.recording and not p.sources(c)] for c in channels}
    reading = {c: of for c, of in reading.items() if of}
    if not reading:
        return ""
    accuracy = next(of[0].recording.accuracy[c] for c, of in reading.items())
    # The tension of a cable that is always slack tells nothing of its sensor's unit, but the other tension does.
    largest, at = max((float(np.abs(p.moving[c]).max()), c) for c, of in reading.items() for p in of)
    error, of_what, channel = max((*_least_error(of, c), c) for c, of in reading.items())
    if accuracy > limits.COARSEST_ACCURACY * largest:
        return f"{accuracy:g}, but {at} reads at most {largest:.3g}: is it in another unit?"
    if error > limits.NOISE_BEYOND_ACCURACY * accuracy:
        return (
            f"{accuracy:g}, but {of_what} of {channel} alone is {error:.3g}, {error / accuracy:.3g} times as much: the"
            f" accuracy includes noise and zero, state {_rounded_up(error)} or more, in the unit of the key"
        )
    return ""


def _least_error(parities: Sequence[Parity], channel: str) -> tuple[float, str]:
    """Standard deviation of the error that the readings of a channel have by themselves, and what it is."""
    if channel in ANGLE_AT.values():
        steps = [p.recording.encoder_step_rad.get(channel, 0.0) for p in parities]
        return limits.ROUNDING * min(steps), "the rounding to whole steps"
    noises = [p.noise(channel) for p in parities if _samples_in_cycle(p) > limits.NOISE_CYCLE_SAMPLES]
    return float(np.median([n for n in noises if np.isfinite(n)] or [0.0])), "the noise from sample to sample"


def _samples_in_cycle(parity: Parity) -> float:
    """Of a sine with the speed and size of the drive's motion."""
    return 2 * np.pi * parity.recording.rate_Hz / max(parity.frequency_per_s, 1e-12)


def _rounded_up(value: float) -> str:
    digit = 10.0 ** np.floor(np.log10(value))
    return f"{np.ceil(value / digit) * digit:g}"


def _angle_of_one_end(ratios: Mapping[str, float]) -> list[Contradiction]:
    """Scale of one angle, from the travel of the load over that of the drive."""
    travel = ratios.get("travel")
    if travel is None or limits.LEAST_OF_TWICE <= travel <= limits.MOST_TRAVEL_OF_RADII:
        return []
    large = travel > 1
    if not large and ratios.get("nearest stiffness", 0.0) > 1 / _SAME:
        return []  # The cables stretch that much: a stiff load, not a scale.
    # The relations that contain one of the two angles alone.
    spring, amplitude = ratios.get("spring"), ratios.get("amplitude")
    at_load = beyond(spring, _SAME) == (-1 if large else 1)
    at_drive = beyond(amplitude, _SAME) == (-1 if large else 1)
    end = "load" if at_load and not at_drive else "drive" if at_drive and not at_load else None
    if limits.LEAST_TRAVEL <= travel <= limits.MOST_TRAVEL and not _twice(ratios, end):
        return []
    share = f"at the cable the load moves {travel:.3g} times as far as the drive"
    reason = "it cannot move further" if large else "far more is lost than friction and stretch take"
    which = f"of the {end} angle" if end else "of one of the two angles, or a pulley's radius,"
    keys = f"rig.{end}.encoder_counts_per_rev" if end else "encoder_counts_per_rev and pulley_radius_m of both ends"
    text = f"the scale {which} is wrong: {share}, and {reason}{_named(travel)}; check {keys} and the unit of the angle"
    what = ANGLE_AT[end] if end else f"{THETA_IN} or {THETA_OUT}"
    return [Contradiction(what, text, None, SURE if end else LIKELY)]


def _twice(ratios: Mapping[str, float], end: str | None) -> bool:
    """Whether travel and the relation that contains the angle of one end alone are off by two, as of encoder edges.

    A load that is stiff over cables of unknown stiffness loses as much travel.
    """
    travel = ratios["travel"]
    is_likely = travel > limits.MOST_OF_TWICE or "nearest stiffness" in ratios or end == "drive"
    if limits.LEAST_OF_TWICE < travel < limits.MOST_OF_TWICE or not is_likely:
        return False
    ratio = ratios.get({"load": "spring", "drive": "amplitude"}.get(end or "", ""))
    return bool(ratio and isclose(max(ratio, 1 / ratio), 2.0, rel_tol=limits.JUST))


def doubtful_travel(parities: Sequence[Parity]) -> list[Contradiction]:
    """A load that moves further than the drive, by less than an error of one key alone makes it."""
    travel = travel_of(parities)
    if travel is None or not travel > limits.MOST_TRAVEL_OF_RADII:
        return []
    text = (
        f"at the cable the load moves {travel:.3g} times as far as the drive, and no cable makes it move further; check"
        " encoder_counts_per_rev and pulley_radius_m of both ends, and whether the encoders are exchanged"
    )
    return [Contradiction(f"{THETA_IN} or {THETA_OUT}", text, None, DOUBTFUL)]


def _both_angles(ratios: Mapping[str, float]) -> list[Contradiction]:
    """Scale of both angles: spring, stiffness and noted amplitude are wrong by about the same factor."""
    inverse = {name: 1 / ratios[name] for name in ("spring", "nearest stiffness") if ratios.get(name, 0) > 0}
    factors = inverse | {name: ratios[name] for name in ("amplitude",) if name in ratios}
    sides = {beyond(f, limits.AMPLITUDE_FACTOR if name == "amplitude" else _SAME) for name, f in factors.items()}
    found = factors.get("spring", factors.get("amplitude", 1.0))
    if len(factors) < 2 or len(sides) != 1 or beyond(found, limits.AMPLITUDE_FACTOR) == 0:
        return []
    # A load torque that is too large makes spring and stiffness too large as well. No angle makes it exceed the sum.
    if _torque(ratios, "load", limits.MOST_TORQUE):
        return []
    size = "large" if sides == {1} else "small"
    factor = max(found, 1 / found)
    values = ", ".join(f"{name} {ratios[name]:.3g} times" for name in factors)
    text = (
        f"both angles are {factor:.3g} times too {size}{_named(factor)}: found over stated is {values}; check"
        " encoder_counts_per_rev of both ends and the unit of the angles"
    )
    return [Contradiction(f"{THETA_IN} and {THETA_OUT}", text)]


def _named(ratio: float) -> str:
    """The name of a factor, or of its inverse, in words."""
    factor = max(ratio, 1 / ratio)
    for size, name in _NAMED.items():
        if isclose(factor, size, rel_tol=_NAMED_WITHIN):
            return f" (a factor of {size:g} is that of {name})"
    return ""


def _torque(ratios: Mapping[str, float], end: str, most: float) -> list[Contradiction]:
    found = ratios.get(f"torque at the {end}")
    if found is None or found <= most:
        return []
    text = (
        f"the {end} torque over the radius reaches {found:.3g} times the sum of tensions there, which cables that only"
        f" pull cannot do; check the scale of the {end} torque, the radius and the load cell of the {end}"
    )
    return [Contradiction(TORQUE_AT[end], text)]


def _spring(ratios: Mapping[str, float], batch: Batch) -> list[Contradiction]:
    key = "load.spring_stiffness_Nm_per_rad"
    ratio, stated = ratios.get("spring"), batch.rig.load.spring_stiffness_Nm_per_rad
    if ratio is None or stated is None or not beyond(ratio, limits.STATED_FACTOR) or key in batch.rig.nominal:
        return []
    text = (
        f"rig.{key} is {stated:g}, and the recordings show {ratio * stated:.3g} N m/rad (load torque over load angle,"
        f" {ratio:.3g} times as much); correct it, or the scale of the load torque or load angle"
    )
    return [Contradiction(f"rig.{key}", text)]


def _pretension(ratios: Mapping[str, float]) -> list[Contradiction]:
    ends = {name: ratios[name] for name in ("pretension at the drive", "pretension at the load") if name in ratios}
    sides = {name: beyond(ratio, limits.PRETENSION_FACTOR) for name, ratio in ends.items()}
    if not any(sides.values()):
        return []
    of_ends = [f"{ratio:.3g} times pretension_N at the {name.rsplit(' ', 1)[1]}" for name, ratio in ends.items()]
    values = f"half the sum of tensions at rest is {' and '.join(of_ends)}"
    alike = max(ends.values()) < limits.BOTH_ENDS_ALIKE * min(ends.values())
    if len(ends) == 2 and (alike or len(set(sides.values())) == 1):
        text = f"{values}; pretension_N is the tension of one cable, in N: check it, or the scale of both load cells"
        return [Contradiction("pretension_N", text, None, LIKELY)]
    name = next(name for name, side in sides.items() if side).rsplit(" ", 1)[1]
    text = f"{values}; check rig.{name}.load_cell"
    return [Contradiction(SUM_AT[name], text, None, LIKELY)]


def _frequency(ratios: Mapping[str, float]) -> list[Contradiction]:
    """Scale of time, from the noted frequency of a sine or triangle."""
    ratio = ratios.get("frequency")
    if not beyond(ratio, limits.FREQUENCY_FACTOR):
        return []
    text = (
        f"the drive moves at {ratio:.3g} times the frequency that is noted: are the times in another unit than s?"
        " Correct time_s, or excitation.frequency_Hz, which is in Hz"
    )
    return [Contradiction("time_s", text, None, LIKELY)]


def _cable(ratios: Mapping[str, float], batch: Batch) -> list[Contradiction]:
    """Stated stiffness and friction of the cable."""
    stated = batch.rig.cable
    found = []
    for relation, key, value, unit, how in (
        ("nearest stiffness", "stiffness_N_per_m", stated.stiffness_N_per_m, " N/m", "mean tension over stretch"),
        ("friction", "friction_coefficient", stated.friction_coefficient, "", "ratio of tensions in full slip"),
    ):
        ratio = ratios.get(relation)
        if ratio is None or not beyond(ratio, limits.STATED_FACTOR) or f"cable.{key}" in batch.rig.nominal:
            continue
        if ratio < -1 / limits.STATED_FACTOR:
            found.append(Contradiction(*_EXCHANGED[relation]))
            continue
        other = "bend_rad" if key == "friction_coefficient" else "length_m, the pulley radii or the scale of a torque"
        if key == "stiffness_N_per_m" and ratio < 1 and ratios.get("travel", 1.0) < limits.LEAST_OF_TWICE:
            share = f"{ratios['travel']:.3g} of the drive's travel arrives at the load"
            other += f", or encoder_counts_per_rev of one end: {share}"
        text = (
            f"rig.cable.{key} is {value:g}, and the recordings show {ratio * value:.3g}{unit} ({how}, {ratio:.3g} times"
            f" as much); correct it, or {other}"
        )
        confidence = SURE
        if key == "stiffness_N_per_m" and _may_be_of_ends(ratio, value):
            confidence, text = DOUBTFUL, f"{text}; fastenings of the cable that yield look the same"
        found.append(Contradiction(f"rig.cable.{key}", text, None, confidence))
    return found


def _may_be_of_ends(ratio: float, stiffness_N_per_m: float) -> bool:
    """Whether a cable that is softer than stated, by this ratio, may have the stated stiffness between soft ends."""
    further_m_per_N = (1.0 / ratio - 1.0) / stiffness_N_per_m
    return 1.0 / limits.FITTED_FACTOR < ratio < 1.0 and further_m_per_N <= limits.END_COMPLIANCE_M_PER_N
