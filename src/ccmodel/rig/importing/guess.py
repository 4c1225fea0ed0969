"""A guess of the map, from names, units and the signals' own shapes.

A guess that is not sure is shown with its reason and never taken: its line in the map stands behind a comment sign.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import ANGLE_AT
from ccmodel.rig import units
from ccmodel.rig.batch import DRIVE_ANGLE_COLUMNS, RAW_COLUMNS
from ccmodel.rig.columns import CHANNELS, UNIT_OF
from ccmodel.rig.importing import names, shapes
from ccmodel.rig.importing.map import TimeSource
from ccmodel.rig.importing.names import ANGLE, CURRENT, DRIVE, FORCE, LOAD, TIME, TORQUE, Reading
from ccmodel.rig.readers.contract import Signal, SignalFile
from ccmodel.typed import nearest

# Column by quantity, end and what the unit measures.
_COLUMNS = {
    (ANGLE, DRIVE, "counts"): "drive_encoder_counts",
    (ANGLE, LOAD, "counts"): "load_encoder_counts",
    (ANGLE, DRIVE, "an angle"): "theta_in_rad",
    (ANGLE, LOAD, "an angle"): "theta_out_rad",
    (TORQUE, DRIVE, "counts"): "drive_torque_counts",
    (TORQUE, LOAD, "counts"): "load_torque_counts",
    (TORQUE, DRIVE, "a torque"): "tau_in_Nm",
    (TORQUE, LOAD, "a torque"): "tau_out_Nm",
    (CURRENT, DRIVE, "a current"): "drive_current_A",
    (CURRENT, LOAD, "a current"): "load_current_A",
    (FORCE, DRIVE, "a force"): "F_drive_N",
    (FORCE, LOAD, "a force"): "F_load_N",
    (FORCE, DRIVE, "a voltage"): "drive_load_cell_V",
    (FORCE, LOAD, "a voltage"): "load_load_cell_V",
}
# The unit of a quantity where nothing states one: a guess to be confirmed.
_USUAL_UNIT = {ANGLE: "deg", TORQUE: "Nm", CURRENT: "A", FORCE: "N"}
_WEIGHT = {"g": "gf", "kg": "kgf", "lb": "lbf", "oz": "ozf"}
# Turns of a pulley above which the unit of its angle is in doubt: a cable is not wound up.
_TURN_RAD, _MOST_TURNS = 2 * np.pi, 20.0
_ENDS = (DRIVE, LOAD)
# Numbers of the tensions of cables A and B at each end.
_TENSIONS = {DRIVE: (1, 3), LOAD: (2, 4)}
# Correlation from which two tensions are seen to move alike.
_ALIKE = 0.5
# Quantity of each raw column; of the others, the column is the quantity itself.
_CHANNEL_OF = {column: channel for channel, raw in RAW_COLUMNS.items() for column in raw}
_UNKNOWN = "its name does not say what it is, and it has no unit: not used"


@dataclass(frozen=True)
class Guess:
    """What a signal is taken for.

    Attributes
    ----------
    signal : str
        Its name.
    column : str or None
        Column of the log; None if it is not used.
    unit : str
        Unit of the signal, "" if not known.
    sign : int
        1 or -1.
    sure : bool
        Whether the line of the map stands without confirmation.
    why : tuple of str
        Reasons, or doubts.
    quantity, end : str or None
        What the signal measures, and where.
    score : int
        Number of things that speak for it.
    time : TimeSource or None
        Its times, if they are not those of its file.
    """

    signal: str
    column: str | None
    unit: str
    sign: int = 1
    sure: bool = False
    why: tuple[str, ...] = ()
    quantity: str | None = None
    end: str | None = None
    score: int = 0
    time: TimeSource | None = None

    @property
    def needs_gain(self) -> bool:
        """Whether its unit has another dimension than the column, so that a person must state a gain."""
        return self.column is not None and units.quantity_of(self.unit) != units.quantity_of(UNIT_OF[self.column])


@dataclass(frozen=True)
class GuessedFile:
    """The guess for one file of a recording.

    Attributes
    ----------
    time : TimeSource or None
        None if the file stores its times, or none was found.
    time_is_sure : bool
        False if `time` is to be confirmed.
    time_why : str
        Its reason.
    guesses : tuple of Guess
        In the order of the file's signals, without that of time.
    open : tuple of str
        What neither the file nor the guess can know, a sentence each.
    """

    time: TimeSource | None
    time_is_sure: bool
    time_why: str
    guesses: tuple[Guess, ...]
    open: tuple[str, ...] = field(default=())


def guess_file(file: SignalFile, end: str | None = None) -> GuessedFile:
    """Guess what the signals of a file are.

    Parameters
    ----------
    file : SignalFile
        One file of a recording.
    end : str or None
        End of the transmission that the name of the file says, for signals whose names say none.

    Returns
    -------
    GuessedFile
        A guess for each signal.
    """
    readings = {signal.name: names.read_name(signal.name) for signal in file.signals}
    time, sure, why = _guess_time(file.signals, readings)
    rest = [s for s in file.signals if time is None or s.name != time.signal]
    guesses = [_first_guess(signal, readings[signal.name]) for signal in rest]
    aligned = _aligned(rest)
    guesses = [_with_end_of_file(g, end) for g in guesses] if end else guesses
    guesses = _without_lone_letters(guesses, readings)
    guesses = _by_shape(guesses, aligned)
    guesses = _with_tensions(guesses, readings, aligned)
    guesses = _with_ends(guesses, aligned)
    guesses = _with_cables(guesses, readings, aligned)
    guesses = _with_columns(guesses)
    guesses = _without_rivals(guesses)
    guesses = _with_signs(guesses, aligned)
    guesses = _with_own_times(guesses, file.signals, readings, time) if time else guesses
    return GuessedFile(time, sure, why, tuple(guesses), tuple(open_questions(guesses)))


def _guess_time(signals: Sequence[Signal], readings: Mapping[str, Reading]) -> tuple[TimeSource | None, bool, str]:
    if all(signal.time_s is not None for signal in signals):
        return None, True, "the file stores the time of each sample"
    clocks = [s for s in signals if shapes.is_clock(s.values) and readings[s.name].quantity != names.COUNTER]
    named = _called_times(signals, readings)
    if not clocks and not named:
        return None, False, "no signal rises in even steps: state time by its signal, or by rate_Hz"
    signal = (named or clocks)[0]
    why = "called so, and never falls" if named else "rises in even steps"
    stated = _unit_of_time(signal, readings)
    possible = shapes.units_of_clock(signal.values)
    step = float(np.median(np.diff(signal.values[np.isfinite(signal.values)])))
    if stated:
        says = "file states" if units.quantity_of(signal.unit) == "a time" else "name says"
        return TimeSource(signal=signal.name, unit=stated), bool(named), f"{why}; the {says} {stated}"
    if len(possible) == 1:
        rate = 1 / (step * shapes.TIME_UNITS[possible[0]])
        why += f"; a step of {step:.6g} is {rate:.6g} Hz in {possible[0]}, and no rate of a recording in other units"
        return TimeSource(signal=signal.name, unit=possible[0]), bool(named), why
    why += f"; a step of {step:.6g} may be in {' or '.join(possible or shapes.TIME_UNITS)}: state the unit"
    return TimeSource(signal=signal.name, unit=(possible or ["s"])[0]), False, why


def _with_own_times(
    guesses: list[Guess], signals: Sequence[Signal], readings: Mapping[str, Reading], time: TimeSource
) -> list[Guess]:
    """Signals of a file with several times: the one of their end, or the only one with as many samples."""
    clocks = [s for s in _called_times(signals, readings) if s.name != time.signal and _unit_of_time(s, readings)]
    size = {s.name: s.values.size for s in signals}
    result = []
    for g in guesses:
        end = g.end if g.end and readings[time.signal or ""].end != g.end else None
        is_other = size[g.signal] != size[time.signal or ""]
        fits = [s for s in clocks if size[s.name] == size[g.signal]]
        fits = [s for s in fits if is_other or (end and readings[s.name].end == end)]
        if g.column and len(fits) == 1:
            own = TimeSource(signal=fits[0].name, unit=_unit_of_time(fits[0], readings))
            why = f"its time is '{fits[0].name}', {'with as many samples' if is_other else f'that of the {end}'}"
            g = replace(g, time=own, why=(*g.why, why))
        result.append(g)
    return result


def _called_times(signals: Sequence[Signal], readings: Mapping[str, Reading]) -> list[Signal]:
    """Signals that are called a time or have the unit of one, and never fall."""
    called = [s for s in signals if readings[s.name].quantity == TIME or units.quantity_of(s.unit) == "a time"]
    return [s for s in called if shapes.never_falls(s.values)]


def _unit_of_time(signal: Signal, readings: Mapping[str, Reading]) -> str:
    """Unit of a time as the file or its name states it; "" if neither does."""
    return signal.unit if units.quantity_of(signal.unit) == "a time" else readings[signal.name].unit


def _first_guess(signal: Signal, reading: Reading) -> Guess:
    """Quantity, end and unit of one signal by itself."""
    if signal.name in CHANNELS:
        column, unit = signal.name, signal.unit or UNIT_OF[signal.name]
        said = ("the name of a column of the format",)
        return Guess(signal.name, column, unit, 1, True, said, reading.quantity, reading.end, 9)
    if shapes.is_constant(signal.values):
        return Guess(signal.name, None, signal.unit, why=("constant: not used",))
    stated = signal.unit if units.states_unit(signal.unit) else reading.unit
    measured = units.quantity_of(stated) if stated else ""
    if reading.quantity == TIME and measured not in ("", "a time"):
        reading = replace(reading, quantity=None)  # T is a torque or a tension too
    if reading.quantity in (names.COMMAND, names.COUNTER, names.OTHER, names.VELOCITY, TIME):
        return Guess(signal.name, None, signal.unit, why=(f"a {reading.quantity}, by its name: not used",))
    quantity, why, doubt = _quantity(reading, measured, stated)
    if quantity is None:
        return Guess(signal.name, None, stated, why=why)
    unit, unit_why, unit_is_sure = _unit(signal, quantity, stated, measured)
    score = (reading.quantity is not None) + 2 * (reading.end is not None and not reading.end_is_hint) + bool(stated)
    sure = unit_is_sure and not doubt
    if quantity == FORCE and reading.words == ("load",):
        return Guess(signal.name, None, unit, 1, False, (*why, "load may mean the force"), quantity, None, score)
    return Guess(signal.name, None, unit, 1, sure, (*why, *unit_why), quantity, reading.end, score)


def _quantity(reading: Reading, measured: str, stated: str) -> tuple[str | None, tuple[str, ...], bool]:
    """Quantity of a signal by name and unit; reasons; and whether the two are in doubt."""
    said = f"name says {' '.join(w for w in reading.words)}" if reading.words else ""
    by_unit = next((q for q, m in names.MEASURES.items() if measured in m and measured != "counts"), None)
    if reading.quantity is None:
        if by_unit in (ANGLE, TORQUE, CURRENT, FORCE) and measured != "a voltage":
            return by_unit, tuple(filter(None, (said, f"unit {stated} is {measured}"))), False
        return (
            None,
            (f"neither its name nor its unit {stated} says what it is: not used" if stated else _UNKNOWN,),
            False,
        )
    if measured in names.MEASURES[reading.quantity] or not stated:
        return reading.quantity, (said,), False
    if by_unit in (ANGLE, TORQUE, CURRENT, FORCE) and measured != "a voltage":
        doubt = f"but its unit {stated} is {measured}: state what it is"
        return by_unit, (said, doubt), True
    doubt = f"unit {stated} is {measured or 'not known'}: state unit, or a gain with its unit"
    return reading.quantity, (said, doubt), True


def _unit(signal: Signal, quantity: str, stated: str, measured: str) -> tuple[str, tuple[str, ...], bool]:
    """Unit of a signal, reasons, and whether it is sure."""
    if measured == "a mass":
        weight = _WEIGHT.get(stated, "kgf")
        return weight, (f"{stated} is a mass: a weight is {weight}, if that is meant",), False
    if stated:
        doubt = _impossible(signal.values, quantity, measured, stated)
        return stated, (doubt,) if doubt else (f"unit {stated}",), not doubt
    if quantity == ANGLE and shapes.is_whole(signal.values):
        counted = any(word in signal.name.lower() for word in ("enc", "count", "cnt", "geber", "ink", "tick"))
        if counted:
            return "count", ("whole numbers", "unit by its name"), True
        return "count", ("no unit; whole numbers, so counts, if not whole degrees",), False
    usual = _USUAL_UNIT[quantity]
    if quantity == ANGLE:
        spread = float(np.nanmax(signal.values) - np.nanmin(signal.values))
        usual = "rad" if spread <= _TURN_RAD else "deg"
        return usual, (f"no unit; a range of {spread:.3g} may be {usual}: state it",), False
    return usual, (f"no unit; it may be {usual}: state it",), False


def _impossible(values: NDArray, quantity: str, measured: str, stated: str) -> str:
    """What contradicts a stated unit; "" if nothing does."""
    if quantity != ANGLE or measured != "an angle":
        return ""
    turns = float(np.nanmax(values) - np.nanmin(values)) * units.factor(stated, "rad") / _TURN_RAD
    return f"in {stated} it would turn {turns:.3g} times: is that its unit?" if turns > _MOST_TURNS else ""


def _aligned(signals: Sequence[Signal]) -> dict[str, NDArray]:
    """Values of all signals at the samples of the longest, to compare their shapes."""
    if not signals:
        return {}
    longest = max(signals, key=lambda s: s.values.size)
    rows = np.linspace(0, 1, longest.values.size)
    at = longest.time_s if longest.time_s is not None else rows
    aligned = {}
    for signal in signals:
        own = signal.time_s if signal.time_s is not None else np.linspace(0, 1, signal.values.size)
        has = np.isfinite(signal.values)
        filled = np.interp(at, own[has], signal.values[has]) if has.any() else np.full(at.size, np.nan)
        aligned[signal.name] = filled
    return aligned


def _with_end_of_file(one: Guess, end: str) -> Guess:
    if one.quantity is None or one.end is not None or one.column is not None:
        return one
    return replace(one, end=end, score=one.score + 2, why=(*one.why, f"the name of the file says {end}"))


def _without_lone_letters(guesses: list[Guess], readings: Mapping[str, Reading]) -> list[Guess]:
    """An end that a letter says (q_m, q_l) is sure only if both letters occur: F_l may be the left force."""
    hinted = {g.signal for g in guesses if g.end and readings[g.signal].end_is_hint}
    if {readings[name].end for name in hinted} == set(_ENDS):
        return guesses
    doubt = "its end is said by one letter only"
    return [replace(g, sure=False, why=(*g.why, doubt)) if g.signal in hinted else g for g in guesses]


def _by_shape(guesses: list[Guess], aligned: Mapping[str, NDArray]) -> list[Guess]:
    """Angles among signals that neither name nor unit tells, where no angle is known: the smoothest that move alike."""
    unknown = [g for g in guesses if g.quantity is None and g.column is None and g.why == (_UNKNOWN,)]
    if any(g.quantity == ANGLE for g in guesses) or not unknown:
        return guesses
    drive = min(unknown, key=lambda g: shapes.roughness(aligned[g.signal]))
    alike = [
        g for g in unknown if g is not drive and shapes.follows(aligned[drive.signal], aligned[g.signal]) is not None
    ]
    chosen = [drive, *sorted(alike, key=lambda g: shapes.roughness(aligned[g.signal]))[:1]]
    result = list(guesses)
    for one in chosen:
        why = "its name and unit do not say so, but it is smooth as an angle"
        unit = "count" if shapes.is_whole(aligned[one.signal]) else "deg"
        result[result.index(one)] = replace(one, quantity=ANGLE, unit=unit, sure=False, why=(why,))
    return result


def _with_tensions(
    guesses: list[Guess], readings: Mapping[str, Reading], aligned: Mapping[str, NDArray]
) -> list[Guess]:
    """Four forces with the numbers 1 to 4 and no end are the tensions at the cables' ends."""
    numbered = {
        readings[g.signal].number: g
        for g in guesses
        if g.quantity == FORCE and g.end is None and units.quantity_of(g.unit) == "a force"
    }
    if not {1, 2, 3, 4} <= numbered.keys():
        return guesses
    doubt = _numbering_doubt({number: aligned[numbered[number].signal] for number in (1, 2, 3, 4)})
    result = {}
    for number in (1, 2, 3, 4):
        one = numbered[number]
        called = "T" in readings[one.signal].words
        why = (*one.why, doubt or ("numbered as in the paper" if called else "one of four: numbered as in the paper?"))
        sure = one.sure and called and not doubt
        result[one.signal] = replace(one, column=f"T{number}_N", sure=sure, why=why, score=one.score + 2)
    return [result.get(g.signal, g) for g in guesses]


def _numbering_doubt(tensions: Mapping[int, NDArray]) -> str:
    """What contradicts the paper's numbers: 1 and 2 are of cable A, and 1 falls where 3 rises. "" if nothing does."""
    like = {number: shapes.correlation(tensions[1], tensions[number]) for number in (2, 3, 4)}
    if max(like, key=lambda number: like[number]) == 2 or max(like.values()) < _ALIKE:
        return ""
    other = max(like, key=lambda number: like[number])
    return f"tension 1 moves like {other}, and not like 2 as in the paper: which ends are these?"


def _with_ends(guesses: list[Guess], aligned: Mapping[str, NDArray]) -> list[Guess]:
    """Ends of signals whose names do not say them."""
    result = list(guesses)
    for quantity in (ANGLE, TORQUE, CURRENT, FORCE):
        without = [g for g in result if g.quantity == quantity and g.end is None and g.column is None]
        taken = {g.end for g in result if g.quantity == quantity and g.end}
        for one, changed in zip(without, _ends_of(without, taken, quantity, aligned, result), strict=True):
            result[result.index(one)] = changed
    return result


def _ends_of(
    without: list[Guess], taken: set[str], quantity: str, aligned: Mapping[str, NDArray], guesses: list[Guess]
) -> list[Guess]:
    free = [end for end in _ENDS if end not in taken]
    if not without or not free:
        return [replace(g, sure=False, why=(*g.why, "its end is not said")) for g in without]
    if quantity == ANGLE and len(without) == 2 and len(free) == 2:
        return _by_lag(without, aligned)
    if quantity == ANGLE and len(without) == 1 and free == [*_ENDS]:
        return [replace(without[0], end=DRIVE, why=(*without[0].why, "the only angle"))]
    if quantity == CURRENT and len(without) == 1 and DRIVE in free:
        why = (*without[0].why, "the only current: that of the drive motor?")
        return [replace(without[0], end=DRIVE, sure=False, why=why)]
    if len(without) == 1 and len(free) == 1:
        return [_the_other(without[0], free[0], quantity, aligned, guesses)]
    doubtful = []
    for g, end in zip(without, [*free, *[free[-1]] * len(without)], strict=False):
        why = (*g.why, f"its end is not said: drive or load? ({end} by its order only)")
        doubtful.append(replace(g, end=end, sure=False, why=why))
    return doubtful


def _by_lag(pair: list[Guess], aligned: Mapping[str, NDArray]) -> list[Guess]:
    """Two angles without ends: the load lags the drive."""
    later = shapes.follows(*(aligned[g.signal] for g in pair))
    ends = (LOAD, DRIVE) if later is False else (DRIVE, LOAD)
    reason = "by its order only" if later is None else "since the load lags the drive"
    return [
        replace(g, end=end, sure=False, why=(*g.why, f"its end is not said; {end} {reason}"))
        for g, end in zip(pair, ends, strict=True)
    ]


def _the_other(one: Guess, end: str, quantity: str, aligned: Mapping[str, NDArray], guesses: list[Guess]) -> Guess:
    """The only signal of a quantity whose other end is known."""
    other = next(g for g in guesses if g.quantity == quantity and g.end is not None)
    drive, load = (one, other) if end == DRIVE else (other, one)
    seen = quantity == ANGLE and shapes.follows(aligned[drive.signal], aligned[load.signal])
    reason = f"the {end} is the only end without {'an' if quantity == ANGLE else 'a'} {quantity}"
    reason += ", and it lags the drive" if seen and end == LOAD else ""
    return replace(one, end=end, sure=one.sure and bool(seen), why=(*one.why, reason))


def _with_cables(guesses: list[Guess], readings: Mapping[str, Reading], aligned: Mapping[str, NDArray]) -> list[Guess]:
    """Forces in cable A and in cable B at one end are tensions, and not their sum."""
    forces = [g for g in guesses if g.quantity == FORCE and g.column is None and units.quantity_of(g.unit) == "a force"]
    at = {(g.end, readings[g.signal].cable): g for g in forces}
    angle = {g.end: aligned[g.signal] for g in guesses if g.quantity == ANGLE and g.end}
    result = {}
    for end in _ENDS:
        a, b = at.get((end, "a")), at.get((end, "b"))
        if a is None or b is None or sum(g.end == end for g in forces) > 2:
            continue
        rule = shapes.sign_of_drive_torque if end == DRIVE else shapes.sign_of_load_torque
        difference = aligned[a.signal] - aligned[b.signal]
        swapped = end in angle and rule(angle[end], difference) == -1
        for g, number, cable in zip((a, b), _TENSIONS[end], "AB", strict=True):
            doubt = "but a positive angle pulls B: which cable is A, or which sign has the angle?" if swapped else ""
            why = (*g.why, f"cable {cable} at the {end}", doubt)
            result[g.signal] = replace(g, column=f"T{number}_N", sure=g.sure and not swapped, why=why)
    return [result.get(g.signal, g) for g in guesses]


def _with_columns(guesses: list[Guess]) -> list[Guess]:
    result = []
    for g in guesses:
        if g.column is None and g.quantity is not None and g.end is not None:
            measured = units.quantity_of(g.unit)
            column = _COLUMNS.get((g.quantity, g.end, measured)) or _column_by_gain(g.quantity, g.end)
            g = replace(g, column=column)
        result.append(g)
    return result


def _column_by_gain(quantity: str, end: str) -> str | None:
    """Column of a signal whose unit needs a gain that only a person knows."""
    unit = {ANGLE: "an angle", TORQUE: "a torque", CURRENT: "a current", FORCE: "a force"}[quantity]
    return _COLUMNS[quantity, end, unit]


def _without_rivals(guesses: list[Guess]) -> list[Guess]:
    """Only one signal is surely a column, and only one column a quantity at one end."""
    result = list(guesses)
    for column in CHANNELS:
        rivals = [g for g in result if g.column == column and g.sure]
        best = [g for g in rivals if g.score == max(r.score for r in rivals)]
        for g in rivals:
            if len(best) > 1 or g is not best[0]:
                others = ", ".join(f"'{r.signal}'" for r in rivals if r is not g)
                result[result.index(g)] = replace(g, sure=False, why=(*g.why, f"{others} may be {column} too"))
    for channel, raw in RAW_COLUMNS.items():
        sure = {g.column for g in result if g.sure}
        if channel not in sure or not sure & set(raw):
            continue
        # Counts are what the sensor of an angle gave; a torque or force is closer to what is wanted than its signal.
        kept, dropped = (raw[0], {channel}) if channel in ANGLE_AT.values() else (channel, set(raw))
        for g in [g for g in result if g.column in dropped and g.sure]:
            why = (*g.why, f"the same quantity as {kept}: only one of the two can be used")
            result[result.index(g)] = replace(g, sure=False, why=why)
    return result


def without_copies(
    guessed: Mapping[str, GuessedFile], ends: Mapping[str, str | None]
) -> tuple[dict[str, GuessedFile], dict[str, tuple[str, str]]]:
    """Only one file of a recording surely has a quantity; a copy of it in another file tells the other's clock.

    Parameters
    ----------
    guessed : mapping of str to GuessedFile
        Guesses by role of the file, the first file of a recording first.
    ends : mapping of str to str or None
        End of the transmission that each file is called by.

    Returns
    -------
    guessed : dict of str to GuessedFile
        Copies are not sure. A file keeps the quantities of its own end, and the first file all others.
    matches : dict of str to tuple of str
        By role, the signal of a further file and the first file's signal of the same quantity.
    """
    first = next(iter(guessed))
    sure: dict[str, dict[str, Guess]] = {}
    for role, one in guessed.items():
        for g in one.guesses:
            if g.column and g.sure:
                sure.setdefault(_CHANNEL_OF.get(g.column, g.column), {})[role] = g
    changed: dict[str, GuessedFile] = dict(guessed)
    matches: dict[str, tuple[str, str]] = {}
    # An angle is smoother than a torque or a force, so that it tells the clock best.
    for channel in sorted(sure, key=lambda channel: channel not in ANGLE_AT.values()):
        copies = sure[channel]
        kept = next((role for role, g in copies.items() if ends.get(role) == g.end), next(iter(copies)))
        for role, copy in copies.items():
            if role != kept and _are_same(copy, copies[kept]):
                changed[role] = _without(changed[role], copy, f"'{copies[kept].signal}' of '{kept}'")
            if role != first and first in copies and _are_same(copy, copies[first]):
                matches.setdefault(role, (copy.signal, copies[first].signal))
    return changed, matches


def _are_same(one: Guess, other: Guess) -> bool:
    """Whether a log can have one of two columns only. A motor's current and a torque sensor can stand side by side."""
    channels = [_CHANNEL_OF.get(g.column or "", g.column) for g in (one, other)]
    return channels[0] == channels[1] and (one.column == other.column or channels[0] in (one.column, other.column))


def _without(file: GuessedFile, copy: Guess, original: str) -> GuessedFile:
    why = (*copy.why, f"the same quantity as {original}: only one of the two can be used")
    guesses = tuple(replace(g, sure=False, why=why) if g is copy else g for g in file.guesses)
    return replace(file, guesses=guesses)


def _with_signs(guesses: list[Guess], aligned: Mapping[str, NDArray]) -> list[Guess]:
    """Signs by the conventions of the format, where the samples show them."""
    at: dict[str | None, dict[str | None, NDArray]] = {}
    for g in guesses:
        if g.column and (g.sure or g.quantity not in at.get(g.end, {})):
            at.setdefault(g.end, {}).setdefault(g.quantity, aligned[g.signal])
    drive = at.get(DRIVE, {}).get(ANGLE)
    load = at.get(LOAD, {}).get(ANGLE)
    load_sign = None if drive is None or load is None else shapes.sign_of_angle(drive, load)
    upright = None if load is None else load * (load_sign or 1)
    rules: dict[tuple, tuple[Callable[[NDArray], int | None], str]] = {}
    if drive is not None:
        rules[ANGLE, LOAD] = lambda v: shapes.sign_of_angle(drive, v), "falls when the drive angle rises"
        for quantity in (TORQUE, CURRENT):
            rules[quantity, DRIVE] = lambda v: shapes.sign_of_drive_torque(drive, v), "would take energy from the drive"
    against = upright if upright is not None else drive
    if against is not None:
        for quantity in (TORQUE, CURRENT):
            rules[quantity, LOAD] = lambda v: shapes.sign_of_load_torque(against, v), "falls when the load angle rises"
    result = []
    for g in guesses:
        rule = rules.get((g.quantity, g.end))
        if g.quantity == FORCE and units.quantity_of(g.unit) == "a force":
            rule = shapes.sign_of_tension, "is negative, and cables only pull"
        if g.column and rule and rule[0](aligned[g.signal]) == -1:
            result.append(replace(g, sign=-1, why=(*g.why, f"sign -1, since it {rule[1]}")))
        else:
            result.append(g)
    return result


def open_questions(guesses: Sequence[Guess]) -> list[str]:
    """What no log says and batch.yaml needs."""
    columns = {g.column for g in guesses if g.column}
    texts = []
    if not columns & set(DRIVE_ANGLE_COLUMNS):
        close = nearest("drive angle", [g.signal for g in guesses], 0.3)
        texts.append(f"no signal is seen to be the drive angle{f' (is it {close!r}?)' if close else ''}: state it")
    for end in _ENDS:
        if f"{end}_encoder_counts" in columns:
            texts.append(f"counts per revolution of the {end} encoder: batch.yaml, rig.{end}.encoder_counts_per_rev")
        if f"{end}_current_A" in columns:
            texts.append(f"torque constant of the {end} motor: batch.yaml, rig.{end}.torque_constant_Nm_per_A")
        if f"{end}_load_cell_V" in columns:
            texts.append(f"sensitivity and zero of the {end} load cell: batch.yaml, rig.{end}.load_cell")
        if f"{end}_torque_counts" in columns:
            texts.append(f"torque per count at the {end}: batch.yaml, rig.{end}.torque_sensor")
    if not columns & {"tau_out_Nm", "load_torque_counts", "load_current_A"}:
        texts.append("no load torque is logged: the stiffness of the load's spring goes to batch.yaml, if it has one")
    return [*texts, "radii, cable, conduit and pretension are in no log: batch.yaml"]
