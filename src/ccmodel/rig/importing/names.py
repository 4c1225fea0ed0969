"""What the name of a signal says: quantity, end of the transmission, unit, number. English and German."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from ccmodel.rig import units

ANGLE, TORQUE, CURRENT, FORCE, TIME = "angle", "torque", "current", "force", "time"
VELOCITY, COMMAND, COUNTER, OTHER = "speed", "command", "sample counter", "quantity without a column"
DRIVE, LOAD = "drive", "load"
LOADCELL = "loadcell"

# What the unit of each quantity may measure (`units.quantity_of`).
MEASURES = {
    ANGLE: ("an angle", "counts"),
    TORQUE: ("a torque", "counts"),
    CURRENT: ("a current",),
    FORCE: ("a force", "a voltage", "a mass"),
    TIME: ("a time",),
    VELOCITY: ("an angular speed", "a speed in counts", "a speed"),
}
# Whole words, and beginnings or ends of longer ones, which German joins (Antriebswinkel, Lastmoment).
_WORDS = {
    COMMAND: "cmd command ref reference set sp setpoint target des desired demand goal soll sollwert vorgabe",
    COUNTER: "index idx sample samples no nr row counter frame seq",
    OTHER: "temp temperature temperatur pwm power leistung voltage status state flag err error fehler trigger acc accel"
    " acceleration dt",
    VELOCITY: "vel velocity speed omega w dq qd dtheta rpm drehzahl geschwindigkeit",
    ANGLE: "q pos position ang angle theta th phi enc encoder rot rotation winkel drehwinkel geber drehgeber lage"
    " inkrementalgeber resolver counts",
    TORQUE: "torque torq trq tq tau moment mom drehmoment md effort",
    CURRENT: "current curr cur strom i iq amps isense",
    FORCE: "force f loadcell lc cell tension kraft seilkraft zugkraft dms kmd kraftsensor fsum pretension",
    TIME: "time t zeit timestamp stamp ts zeitstempel uhrzeit elapsed clock secs",
}
_PARTS = {
    COMMAND: ("soll", "setpoint", "command"),
    VELOCITY: ("velocity", "drehzahl", "geschwindigkeit", "speed"),
    ANGLE: ("winkel", "angle", "encoder", "position", "geber"),
    TORQUE: ("moment", "torque"),
    CURRENT: ("strom", "current"),
    FORCE: ("kraft", "force", "loadcell", "tension", "waegezelle"),
    TIME: ("zeit", "timestamp"),
}
_ENDS = {
    DRIVE: "drive drv motor mot mtr input in inp proximal prox actuator aktor servo winch antrieb an eingang ein master"
    " kurbel crank",
    LOAD: "load ld output out outp distal dist tip end ee endeffector effector abtrieb ab ausgang aus last slave"
    " gripper greifer jaw finger wrist spring feder link",
}
_END_PARTS = {
    DRIVE: ("antrieb", "motor", "drive", "input", "eingang", "proximal", "actuator"),
    LOAD: ("abtrieb", "last", "load", "output", "ausgang", "distal", "greifer"),
}
# Words for a device that both ends may have: in Load/Motor current the group says the end.
_DEVICES = ("motor", "mot", "mtr", "actuator", "aktor", "servo")
# Letters that name an end beside a quantity: q_m and q_l. They are hints only.
_END_LETTERS = {"m": DRIVE, "l": LOAD}
_SPELT = str.maketrans(
    {"ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss", "θ": " theta ", "ϑ": " theta ", "φ": " phi ", "τ": " tau "}
)
_WORD_END = re.compile(r"[^\s_./:,;()\[\]-]+$")
_PIECES = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")


@dataclass(frozen=True)
class Reading:
    """What a name says.

    Attributes
    ----------
    quantity : str or None
        One of the constants of this module.
    end : str or None
        "drive" or "load".
    end_is_hint : bool
        Whether a single letter says so.
    unit : str
        Unit at the end of the name; "" if there is none.
    number : int or None
        Number in it.
    cable : str or None
        "a" or "b", if a letter by itself says so.
    words : tuple of str
        The words that say so.
    """

    quantity: str | None
    end: str | None
    end_is_hint: bool
    unit: str
    number: int | None
    cable: str | None
    words: tuple[str, ...]


def read_name(name: str) -> Reading:
    """Read the name of a signal."""
    raw, pieces = _pieces(name)
    quantity, said_quantity = _find(pieces, _WORDS, _PARTS)
    unit = _unit_at_end(name, raw, quantity)
    without_unit = pieces[: len(pieces) - len(_PIECES.findall(unit))] if unit else pieces
    if quantity is None and "M" in raw:
        quantity, said_quantity = TORQUE, "M"
    if len(raw) == 2 and raw[0] == "T" and raw[1] in "1234":
        quantity, said_quantity = FORCE, "T"
    # A joined word may say both (Lastwinkel), a single one only one of the two.
    end, said_end, contradicted = _end([p for p in without_unit if p not in (said_quantity, LOADCELL)], name)
    if end is None and not contradicted and said_quantity != LOADCELL:
        end, said_end = _find([said_quantity], {}, _END_PARTS)
    hint = None
    if end is None and not contradicted and quantity is not None:
        hint = next((p for p in without_unit if p in _END_LETTERS and p != said_quantity.lower()), None)
    numbers = [int(piece) for piece in pieces if piece.isdigit() and len(piece) == 1]
    return Reading(
        quantity,
        end or (_END_LETTERS[hint] if hint else None),
        hint is not None,
        unit,
        numbers[-1] if numbers else None,
        cables.pop() if len(cables := {"a", "b"} & set(without_unit)) == 1 else None,
        tuple(dict.fromkeys(word for word in (said_quantity, said_end or hint) if word)),
    )


def _pieces(name: str) -> tuple[list[str], list[str]]:
    """Words of a name as they are written, and in small letters; "load cell" is one word."""
    raw = _PIECES.findall(name.translate(_SPELT))
    text = " ".join(piece.lower() for piece in raw)
    return raw, re.sub(r"\bload ?cell\b", LOADCELL, text).split()


def _find(pieces: list[str], words: Mapping[str, str], parts: Mapping[str, tuple[str, ...]]) -> tuple[str | None, str]:
    """Meaning of the first word that has one, and the word. Meanings that come first in the table win."""
    for meaning in dict.fromkeys((*words, *parts)):
        said = next((piece for piece in pieces if piece in words.get(meaning, "").split()), None)
        said = said or next((p for p in pieces if any(_joined(part, p) for part in parts.get(meaning, ()))), None)
        if said:
            return meaning, said
    return None, ""


def _end(pieces: list[str], name: str) -> tuple[str | None, str, bool]:
    """End that the words of a name say, the word, and whether other words say the other end, so that none is known."""
    said = {end: _find(pieces, {end: _ENDS[end]}, {end: _END_PARTS[end]})[1] for end in (DRIVE, LOAD)}
    if not all(said.values()):
        end = next((end for end, word in said.items() if word), None)
        return end, said[end] if end else "", False
    group, _, own = (_pieces(part)[1] for part in name.rpartition("/"))
    device_only = said[DRIVE] in _DEVICES and said[DRIVE] in own and said[LOAD] in group
    return (LOAD, said[LOAD], False) if device_only else (None, "", True)


def _joined(part: str, word: str) -> bool:
    return word.startswith(part) or word.endswith(part) or word.endswith(part + "s")


def _unit_at_end(name: str, raw: list[str], quantity: str | None) -> str:
    """Unit that ends a name, as in tau_Nm; a last word such as "in" is none unless it measures the quantity.

    The end of a joined word is none either if it may be a longer one: StromA may be A or mA.
    """
    if len(raw) < 2:
        return ""
    word = _WORD_END.search(name)
    ends = (word[0] if word else "", raw[-1])
    unit = next((end for end in ends if end and units.quantity_of(end) in MEASURES.get(quantity or "", ())), "")
    before = name[: name.rfind(unit)][-1:] if unit else ""
    longer = before.isalpha() and units.quantity_of(before + unit) == units.quantity_of(unit)
    return "" if longer else unit
