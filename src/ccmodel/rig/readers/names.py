"""Names and units of signals, as headers write them."""

import re
from collections import Counter
from collections.abc import Iterable

# Only to tell a line of units from a line of names, and a unit in a name from a word in brackets: the value of a unit
# is not needed here.
_UNIT_WORDS = """
s sec secs second seconds ms msec us µs μs usec ns min h hr d
rad rads radian radians mrad urad µrad deg degs degree degrees ° º rev revs turn turns grad
N mN kN cN µN Newton newtons lbf lb gf kgf g kg mg oz
Nm N-m mNm mN-m Ncm cNm Nmm kNm µNm ozin
V mV µV uV kV volt volts A mA µA uA amp amps ampere W mW Ohm Ω
m mm cm um µm km inch Hz kHz MHz rpm min-1
count counts cnt cnts ct cts inc incs increment increments tick ticks pulse pulses lsb bit bits digit digits
Pa kPa MPa bar mbar psi °C C degC K F °F
% - -- 1 [] () raw none n/a a.u. au
"""
_UNITS = {word.casefold() for word in _UNIT_WORDS.split()}
_POWER = re.compile(r"(\^|\*\*)?[-+]?\d+$|[²³¹⁻]+$")
_JOINED = re.compile(r"\s*[*·⋅/ ]\s*")
_BRACKETED = re.compile(r"^(?P<name>.*?)\s*[\[({<](?P<unit>[^\[\](){}<>]*)[\])}>]\s*$")
# "torque / Nm", "Kraft in N", "angle, deg": only before a known unit.
_TRAILING = re.compile(r"^(?P<name>.*\S)(\s+/\s*|\s*/\s+|\s+in\s+|,\s*)(?P<unit>\S+)$")


def is_unit(text: str) -> bool:
    """Whether a text is a unit, with or without brackets: "[deg]", "N*m", "rad/s^2"."""
    text = text.strip()
    if text[:1] + text[-1:] in ("[]", "()", "{}", "<>"):
        text = text[1:-1].strip()
        if not text:
            return True
    if text.casefold() in _UNITS:
        return True
    parts = _JOINED.split(text)
    return (len(parts) > 1 and all(_POWER.sub("", part.strip("()")).casefold() in _UNITS for part in parts)) or (
        _POWER.sub("", text).casefold() in _UNITS - {""}
    )


def split_unit(name: str) -> tuple[str, str]:
    """Name and unit of "angle [deg]", "torque (Nm)", "force / N"; the unit is "" if the name has none."""
    if (found := _BRACKETED.match(name)) and found["name"]:
        # Words in round brackets ("angle (filtered)") are part of the name.
        if "[" in name[len(found["name"]) :] or is_unit(found["unit"]):
            return found["name"], found["unit"].strip()
    elif (found := _TRAILING.match(name)) and is_unit(found["unit"]):
        return found["name"].strip(), found["unit"]
    return name, ""


def bare_unit(text: str) -> str:
    """A unit without its brackets; "" for the signs of "no unit"."""
    text = text.strip()
    if text[:1] + text[-1:] in ("[]", "()", "{}", "<>"):
        text = text[1:-1].strip()
    return "" if text in ("-", "--", "n/a", "none") else text


def unique(names: Iterable[str]) -> list[str]:
    """Names of which none is there twice: a repeated one is numbered, "angle", "angle (2)"."""
    names = list(names)
    seen: Counter[str] = Counter()
    taken, result = set(names), []
    for name in names:
        seen[name] += 1
        new, number = name, seen[name]
        while number > 1 and new in taken:
            new, number = f"{name} ({number})", number + 1
        taken.add(new)
        result.append(new)
    return result
