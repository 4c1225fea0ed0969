"""Wrong signs and exchanged sensors: which mistake makes the parity relations of sign negative."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ccmodel.channels import F_DRIVE, F_LOAD, TAU_IN, TAU_OUT, THETA_IN, THETA_OUT
from ccmodel.rig.batch import RAW_COLUMNS, End
from ccmodel.rig.consistency import limits
from ccmodel.rig.consistency.contradiction import Contradiction
from ccmodel.rig.consistency.exchanges import ENCODERS, ENDS, Exchange, exchange_of, median_loss, travel_of
from ccmodel.rig.consistency.parity import SUMS, Parity


class _Fault(NamedTuple):
    """A mistake, the relations (`Parity.signs`) that it makes negative, and its remedy.

    The remedy has fields for how a torque or sum is turned, which depends on what the logs hold (`turning`).
    """

    what: str
    text: str
    negative: frozenset[str]
    remedy: str


def _fault(what: str, text: str, negative: str, remedy: str) -> _Fault:
    return _Fault(what, text, frozenset(negative.split()), remedy)


FAULTS = (
    _fault(TAU_IN, "the drive torque has the wrong sign", "work torques", "{tau_in_Nm}"),
    _fault(TAU_OUT, "the load torque has the wrong sign", "load torques", "{tau_out_Nm}"),
    _fault(THETA_OUT, "the load angle has the wrong sign", "angles load", "change rig.load.encoder_sign"),
    _fault(THETA_IN, "the drive angle has the wrong sign", "angles work", "change rig.drive.encoder_sign"),
    _fault(
        "cables A and B",
        "cables A and B are exchanged: both torques have the wrong sign for the angles",
        "work load",
        "{tau_in_Nm} and {tau_out_Nm}, or change both encoder signs",
    ),
    _fault(
        "cables A and B",
        "cables A and B are exchanged at one end",
        "angles torques",
        "at one end, change encoder_sign and turn the torque: {tau_in_Nm}, or {tau_out_Nm}",
    ),
    _fault(F_DRIVE, "the load cell at the drive has the wrong sign", "F_drive", "{F_drive_N}"),
    _fault(F_LOAD, "the load cell at the load has the wrong sign", "F_load", "{F_load_N}"),
)
EXCHANGED = _fault(*ENDS[:2], "loss", ENDS.remedy)
EVIDENCE = {
    "angles": "the load angle runs against the drive angle (correlation {:.2f})",
    "torques": "the load torque runs against the drive torque (correlation {:.2f})",
    "work": "the drive takes energy out of the cables ({:.2f} of the work exchanged; a drive puts energy in)",
    "load": "the load torque pushes where a load resists ({:.2f}, +1 for a spring)",
    "loss": "more energy leaves at the load than enters at the drive ({:.2f} of the energy exchanged)",
    "F_drive": "the sum of tensions at the drive is negative, and cables cannot push",
    "F_load": "the sum of tensions at the load is negative, and cables cannot push",
}
# Evidence of exchanged sensors by the relation of `Parity.lags` that is turned.
TURNED = {
    "angles": "the load angle reverses before the drive angle, which moves it (lag {:.2f}, the area of their loop)",
    "torques": "the load torque turns before the drive torque, which causes it (lag {:.2f}, the area of their loop)",
}


def wrong_signs(parities: Sequence[Parity]) -> list[Contradiction]:
    """Sensors with a wrong sign and exchanged sensors, of the batch or of single recordings."""
    if throughout := _exchanged_throughout(parities):
        return [throughout]
    positive = {name for name in SUMS if any(p.signs.get(name, 0.0) > 0 for p in parities)}
    negatives = [negative_relations(p.signs) for p in parities]
    by_recording = [
        negative - {name for name in negative & positive if _may_be_offset(p, name)}
        for p, negative in zip(parities, negatives, strict=True)
    ]
    most_common, count = Counter(by_recording).most_common(1)[0]
    found = []
    if most_common and count >= limits.MOST_RECORDINGS * len(parities):
        showing = [p for p, negative in zip(parities, by_recording, strict=True) if negative == most_common]
        found += _contradictions(most_common, showing, None, f"in {count} of {len(parities)} recordings ")
    for parity, negative in zip(parities, by_recording, strict=True):
        if negative and not (found and negative == most_common):
            found += _contradictions(negative, [parity], parity.recording.id, "")
    return found


def _exchanged_throughout(parities: Sequence[Parity]) -> Contradiction | None:
    """Sensors that are exchanged in most recordings that could show it."""
    telling = [(p, negative_relations(p.signs)) for p in parities if "loss" in p.signs]
    drive, load = (end.side for end in parities[0].batch.rig.ends)
    is_unlike = drive.encoder_sign != load.encoder_sign or drive.torque_sign != load.torque_sign
    for is_mirrored in (False, True) if is_unlike else (False,):
        # Exchanged signs that are unlike turn the work of both ends; the load's torque does little work at the drive.
        turned = {"load"} if is_mirrored else set()
        of = [p for p, negative in telling if negative - {"work", "loss"} == turned]
        if len(of) < max(limits.MOST_RECORDINGS * len(telling), 1):
            continue
        if exchange := exchange_of(of, is_mirrored):
            where = f"in {len(of)} of {len(parities)} recordings "
            return _exchange_contradiction(exchange, of, None, where, is_mirrored)
    return None


def _exchange_contradiction(
    exchange: Exchange, parities: Sequence[Parity], recording: str | None, where: str, is_mirrored: bool = False
) -> Contradiction:
    """An exchange with the energies and lags that show it."""
    of_scale = f"at the cable the load moves {travel_of(parities):.3g} times as far as the drive"
    evidence = [of_scale if exchange == ENCODERS else EVIDENCE["loss"].format(median_loss(parities, is_mirrored))]
    for name, text in TURNED.items():
        lag = float(np.median([p.lags.get(name, 0.0) for p in parities]))
        evidence += [text.format(lag)] if lag < 0 else []
    return Contradiction(
        exchange.what, f"{exchange.text}: {where}{' and '.join(evidence)}; {exchange.remedy}", recording
    )


def _may_be_offset(parity: Parity, name: str) -> bool:
    """Whether an offset of the load cell may make a sum of tensions negative that is positive in other recordings."""
    return float(np.median(parity.moving[SUMS[name]])) >= min(limits.CELL_OFFSETS_N)


def negative_relations(signs: Mapping[str, float]) -> frozenset[str]:
    """Relations that are negative. The loss counts if all others are right: every wrong sign makes it negative."""
    negative = {name for name, value in signs.items() if value < limits.WRONG_SIGN and name != "loss"}
    if not negative and signs.get("loss", 1.0) < limits.WRONG_LOSS:
        negative = {"loss"}
    return frozenset(negative)


def explanation(negative: frozenset[str], available: Iterable[str]) -> tuple[_Fault, ...]:
    """The fewest mistakes that make just these of the available relations negative; empty if no two do."""
    if negative == EXCHANGED.negative:
        return (EXCHANGED,)
    # Friction that stores little and loses much can turn this correlation alone.
    if negative == {"torques"}:
        return ()
    for count in (1, 2):
        for faults in combinations(FAULTS, count):
            expected: frozenset[str] = frozenset()
            for fault in faults:
                expected ^= fault.negative
            if expected & set(available) == negative:
                return faults
    return ()


def _contradictions(
    negative: frozenset[str], parities: Sequence[Parity], recording: str | None, where: str
) -> list[Contradiction]:
    # A single relation of correlation may turn negative by physics alone; every mistake makes two of them negative.
    faults = explanation(negative, set.intersection(*(set(p.signs) for p in parities)))
    if faults == (EXCHANGED,):
        return [_exchange_contradiction(exchange_of(parities) or ENDS, parities, recording, where)]
    found = []
    for fault in faults:
        shown = sorted(fault.negative & negative)
        evidence = " and ".join(
            EVIDENCE[name].format(float(np.median([p.signs[name] for p in parities]))) for name in shown
        )
        remedy = fault.remedy.format(**turning(parities[0]))
        found.append(Contradiction(fault.what, f"{fault.text}: {where}{evidence}; {remedy}", recording))
    return found


def turning(parity: Parity) -> dict[str, str]:
    """By channel, how the sign of a torque or of a sum of tensions is turned in a batch."""
    found = {}
    for end in parity.batch.rig.ends:
        found[end.torque] = _turn_torque(parity, end)
        found[end.force] = _turn_sum(parity, end)
    return found


def _turn_torque(parity: Parity, end: End) -> str:
    """By its sign in `batch.yaml`, which only a sensor's torque follows; otherwise by the names of the tensions."""
    tensions = [name for name in parity.sources(end.torque) if name in end.tensions]
    if not tensions:
        return f"change rig.{end.name}.torque_sign"
    if len(tensions) == 1:
        (other,) = set(end.tensions) - set(tensions)
        return f"rename the column {tensions[0]} to {other}"
    return f"exchange the columns {' and '.join(tensions)}"


def _turn_sum(parity: Parity, end: End) -> str:
    """By its columns: no key has the sign of a load cell."""
    (volts,) = RAW_COLUMNS[end.force]
    if volts in parity.recording.derived_from.get(end.force, ""):
        return f"turn the sign of the column {volts} and of rig.{end.name}.load_cell.zero_V"
    columns = [name for name in parity.sources(end.force) if name in end.tensions] or [end.force]
    return f"turn the sign of the column{'s' * (len(columns) > 1)} {' and '.join(columns)}"
