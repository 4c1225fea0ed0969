"""A verdict in words: sentences made from the content of diagnosis.json."""

import re
from collections.abc import Mapping, Sequence
from math import floor, inf, isinf, log10

from ccmodel import mechanisms as registry
from ccmodel.channels import TABLE, symbol_of
from ccmodel.diagnosis.formula import CONSTANT
from ccmodel.diagnosis.settings import CONSPICUOUS
from ccmodel.mechanisms.contract import (
    BEARING_TORQUE,
    CABLE_STRETCH,
    END_STRETCH,
    LOAD,
    PULLEY_RADIUS,
    SENSOR_MAP,
    SLIDING_FRICTION,
    side,
)
from ccmodel.sentences import joined

# By the short names of diagnosis.json.
SYMBOL = {channel.short_name: channel.symbol for channel in TABLE.values()}
IN_WORDS = {channel.short_name: channel.words for channel in TABLE.values()}
NOT_ACCEPTED = "not accepted"
# Verdict on recordings that contradict one another or batch.yaml: no model is run.
INPUTS_INCONSISTENT = "inputs-inconsistent"
# What `not_judged` says a limit on runs or time has left: candidates, and the place of an unexplained mismatch.
CANDIDATES_LEFT, PLACE_LEFT = "further candidates", "the place of the mismatch"
# A unit is printed with a prefix if the value is below a tenth of it; these units take none.
_PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
_WITHOUT_PREFIX = ("1", "kg*m^2")
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def sentence(diagnosis: Mapping) -> str:
    """The verdict of a batch in a sentence, without the batch's name.

    Parameters
    ----------
    diagnosis : mapping
        Content of diagnosis.json.
    """
    verdict = diagnosis["verdict"]
    if verdict is None:
        return f"Not diagnosed: {diagnosis['why']}."
    if verdict == INPUTS_INCONSISTENT:
        return _contradiction(diagnosis["not_judged"])
    held = diagnosis["is_held"]
    missing = "has changed" if held else "is missing"
    if verdict == "agrees":
        model, nothing = ("frozen baseline", "no change") if held else ("calibrated model", "no missing physics")
        return f"The {model} agrees with the recordings within their noise; they show {nothing}."
    if verdict == "explained":
        return _capital(f"{'this has changed: ' if held else ''}{_with_confidence(diagnosis['mechanisms'])}.")
    if verdict == "learned":
        return law_sentence(diagnosis)
    if verdict == "undecided":
        return _undecided(diagnosis, missing)
    where = _where(possible_places(diagnosis))
    if leaves(diagnosis, CANDIDATES_LEFT):
        limit = "The search ended at its limit before all candidates were fitted, and none of those fitted explains it."
        return f"Something {missing}{where}. {limit}"
    return f"Something {missing}{where}{',' if where else ''} and no listed mechanism explains it."


def _where(places: Sequence[str]) -> str:
    """The possible places of an unexplained mismatch; the conduit alone is what other places were excluded for."""
    if not places:
        return ""
    eliminated = " (by elimination)" if list(places) == ["conduit"] else ""
    return f", most likely at {' or '.join(f'the {place_in_words(place)}' for place in places)}{eliminated}"


def leaves(diagnosis: Mapping, what: str) -> bool:
    """Whether `not_judged` has an entry on this."""
    return any(one["what"] == what for one in diagnosis.get("not_judged", ()))


def _contradiction(not_judged: Sequence[Mapping]) -> str:
    """The first contradiction of the inputs, and how many there are besides."""
    first, *others = not_judged
    more = f" ({len(others)} more in the report)" if others else ""
    return f"The inputs contradict one another. {first['what']}: {first['why'].rstrip('.')}{more}. No model is given."


def possible_places(diagnosis: Mapping) -> list[str]:
    """Places of a mismatch: those of the mechanisms that are named or most likely, otherwise all that are possible.

    None if a limit ended the diagnosis before the place of an unexplained mismatch was looked for.
    """
    acting = [m["place"] for m in [*diagnosis["mechanisms"], *diagnosis["likeliest"]]]
    if leaves(diagnosis, PLACE_LEFT):
        return acting
    location = diagnosis["location"]
    return list(dict.fromkeys(p for p in acting or location.get("places") or [location["place"]] if p))


def _with_confidence(mechanisms: Sequence[Mapping]) -> str:
    """Claims with their confidence, once if it is the same for all."""
    confidences = [f"confidence {m['confidence']:.2f}" for m in mechanisms]
    claims = [claim(m) for m in mechanisms]
    if len(set(confidences)) == 1:
        return f"{'; and '.join(claims)}{', ' if len(claims) == 1 else '; '}{confidences[0]}"
    return "; and ".join(map(", ".join, zip(claims, confidences, strict=True)))


def _undecided(diagnosis: Mapping, missing: str) -> str:
    together = [_placed(one) for one in diagnosis["likeliest"]]
    named = {_placed(one): f"{_placed(one)} ({one['confidence']:.2f})" for one in diagnosis["alternatives"]}
    others = [name for one, name in named.items() if one not in together]
    if diagnosis["mechanisms"]:
        certain = {_placed(one) for one in diagnosis["mechanisms"]}
        further = " and ".join(named.get(one, one) for one in together if one not in certain)
        possible = [name for name in (further, *others) if name]
        rest = f": perhaps {' or '.join(possible)}" if possible else ""
        part = f"Part of what {missing}: {_with_confidence(diagnosis['mechanisms'])}"
        return f"{part}. These recordings do not tell what else {missing}, if anything{rest}."
    if len(together) > 1 and others:
        most = f"{joined([named.get(one, one) for one in together])} together"
        also = f"also possible: {joined(others)}"
        return f"Something {missing}, and these recordings do not tell what: best described by {most}; {also}."
    names = [f"{joined(together)} together"] if len(together) > 1 else list(named.values())
    if not names:
        return f"Something {missing}, and these recordings do not tell what."
    if len(names) == 1:
        return f"Something {missing}; it may be {names[0]}, but these recordings do not confirm it."
    return f"Something {missing}, and these recordings cannot tell {' or '.join(names)} apart."


def headline(diagnosis: Mapping) -> str:
    """The verdict in a line, with the batch's name and how far the held-out error fell."""
    text = f"{diagnosis['batch']}: {sentence(diagnosis)}"
    if diagnosis["verdict"] not in ("explained", "learned"):
        return text
    return f"{text} {_gain(diagnosis['fit'])}"


def _gain(fit: Mapping) -> str:
    """How far the held-out error falls: of the worst channel, or else of the one in which it falls most.

    Where it falls in none, the mean square of the errors is stated, for which what differs from run to run is noise.
    A further sentence names the channels in which it does not fall, if it is more than differences between runs.
    """
    worst, error = worst_channel(fit["error"]), error_name(fit)
    before, after = ({c: round(e[w] / e["noise"], 1) for c, e in fit["error"].items()} for w in ("before", "after"))
    falls = {channel: before[channel] - after[channel] for channel in before}
    most = worst if falls[worst] > 0.0 else max(falls, key=lambda channel: falls[channel])
    rest = _remaining(before, after, most if falls[most] > 0.0 else worst)
    if falls[most] > 0.0:
        fall = f"falls from {before[most]:.1f} to {after[most]:.1f} times the noise floor"
        return f"With this in the model, the {error} of {SYMBOL[most]} {fall}.{rest}"
    changes = f"{before[worst]:.1f} times the noise floor before and {after[worst]:.1f} after"
    low, high = (f"{fit['mean_square'][model]:.2f}" for model in ("extended", "calibrated"))
    if not float(low) < float(high):
        return f"The {error} of no channel falls; that of {SYMBOL[worst]} is {changes}.{rest}"
    return (
        f"The effect is smaller than the scatter between runs: the {error} of {SYMBOL[worst]} is {changes}.{rest}"
        f" The mean square of the residuals, for which this scatter is noise, falls from {high} to {low} (1: noise)."
    )


def _remaining(before: Mapping[str, float], after: Mapping[str, float], named: str) -> str:
    """A sentence on the other channels whose error does not fall and is above the noise floor; empty without any.

    The noise floor includes what differs from run to run.

    Parameters
    ----------
    before, after : mapping of str to float
        Errors over the noise floor by channel, as they are printed.
    named : str
        The channel that the sentence before is about.
    """
    rest = [c for c in before if c != named and after[c] >= before[c] and after[c] > CONSPICUOUS]
    changes = [
        f"that of {SYMBOL[c]} "
        + (f"rises from {before[c]:.1f} to {after[c]:.1f}" if after[c] > before[c] else f"stays at {after[c]:.1f}")
        for c in sorted(rest, key=lambda c: before[c] - after[c])
    ]
    return f" {_capital(joined(changes))} times the noise floor." if changes else ""


# What has a law of each slot; that of a sensor is named by its channel, and that of all channels of a side is a delay.
IN_SLOT = {
    SLIDING_FRICTION: "Friction along the conduits",
    CABLE_STRETCH: "The cables' compliance",
    END_STRETCH: "The compliance of the cables' fastening at the {side}",
    BEARING_TORQUE: "The torque at the {side} pulley",
    LOAD: "The load's torque",
    PULLEY_RADIUS: "The radius of the {side} pulley",
    SENSOR_MAP: "The delay of the {side}'s channels",
}


def law_sentence(diagnosis: Mapping) -> str:
    """What the learned laws say, that they are on no list, and what acts beside them."""
    others = diagnosis["mechanisms"]
    beside = f" Listed mechanisms that act as well: {_with_confidence(others)}." if others else ""
    return " ".join(map(law_claim, diagnosis["laws"])) + beside


def law_claim(law: Mapping) -> str:
    """What a learned law says and how large it is, with its confidence."""
    is_of_one = law["slot"] == SENSOR_MAP and law["channel"] is not None
    what = f"The error of {symbol_of(law['channel'])}" if is_of_one else IN_SLOT[law["slot"]]
    what = what.format(side=side(law["place"]))
    others = f" (or on {' or '.join(law['indistinguishable'])})" if law["indistinguishable"] else ""
    if law.get("formula") != CONSTANT:
        says = f"depends on {law['argument_is']}{others}: {law_size(law)}"
    elif law["slot"] == PULLEY_RADIUS:
        says = f"is {law['parameters'][0]['value']:.3g} times the stated one"
    else:
        says = _constant(law)
    return (
        f"{what} {says}, confidence {law['confidence']:.2f}. {_resemblance(law)}; the law was learned from the"
        " recordings."
    )


def _constant(law: Mapping) -> str:
    """What is constant, and its value."""
    (constant,) = law["parameters"]
    learned = registry.laws()[law["name"]]
    low, high = constant["low"], constant["high"]
    if learned.form.is_factor:
        return f"is constant: {constant['value']:.3g} ({low:.3g} to {high:.3g}) times the calibrated one"
    value, interval = quantity(constant["value"], low, high, learned.unit.replace(" ", "*"))
    is_added = law["slot"] == SLIDING_FRICTION
    return f"{f'has a constant {_added(law)}' if is_added else 'is constant'}: {value} ({interval})"


def _added(law: Mapping) -> str:
    """What is added to friction: a drag, or a bend."""
    return registry.laws()[law["name"]].curve_is.partition(",")[0]


def law_size(law: Mapping) -> str:
    """How far apart the two values of a law are, what its constant is, or between which values its curve goes."""
    learned = registry.laws()[law["name"]]
    curve, is_factor, unit = law["curve"], learned.form.is_factor, learned.unit.replace(" ", "*")
    if learned.argument.has_two_values:
        # Both follow from one number: as one grows, the other falls.
        (_, *first), (_, *second) = curve
        lower, higher = sorted((first, second))
        pairs = zip(higher, (lower[0], lower[2], lower[1]), strict=True)
        apart, least, most = (_apart(high, low, is_factor) for high, low in pairs)
        value, interval = quantity(apart, least, most, "%" if is_factor else unit)
        names = learned.argument.two_values
        more, less = names if higher is first else names[::-1]
        return f"{value} ({interval}) higher {more} than {less}"
    if learned.form.in_proportion:
        (constant,) = law["parameters"]
        value, interval = quantity(constant["value"], constant["low"], constant["high"], constant["unit"])
        return f"{value} ({interval}) times it"
    (x_low, low, *_), (x_high, high, *_) = (end(curve, key=lambda row: row[1]) for end in (min, max))
    at_low, at_high = (_argument(x, law["argument_unit"]) for x in (x_low, x_high))
    if is_factor:
        reference = "stated" if law["slot"] == PULLEY_RADIUS else "calibrated"
        return f"from {low:.3g} times the {reference} one at {at_low} to {high:.3g} times at {at_high}"
    added = f"{_added(law)} " if law["slot"] == SLIDING_FRICTION else ""
    return f"{added}from {rounded(low, unit)} at {at_low} to {rounded(high, unit)} at {at_high}"


def _apart(high: float, low: float, is_factor: bool) -> float:
    """How far apart two values are; of factors by a share, which has no limit where the lower one may be zero."""
    if not is_factor:
        return high - low
    return high / low - 1 if low > 0 else inf


def _argument(x: float, unit: str) -> str:
    """A value of a law's argument; of a logarithm, that of which it is taken."""
    of = re.fullmatch(r"log10\((.*)\)", unit)
    return rounded(10.0**x, of[1]) if of else rounded(x, unit.replace(" ", "*"))


def recognised_as(law: Mapping) -> str | None:
    """The listed mechanism whose law a learned one may be, if there is one."""
    nearest = law["nearest_listed"]
    return nearest["name"] if nearest and nearest["distance"] <= (nearest["limit"] or inf) else None


def _resemblance(law: Mapping) -> str:
    """Whether a learned law is that of a listed mechanism within its uncertainty, or how far the nearest one is."""
    nearest = law["nearest_listed"]
    if nearest is None:
        return "No listed mechanism does this"
    if nearest["limit"] is None:
        return f"A law with so few constants may be {nearest['name']}"
    if (name := recognised_as(law)) is not None:
        return f"Within its uncertainty this is the law of {name}"
    away = f"{nearest['distance']:.1f} standard deviations away"
    return f"No listed mechanism does this (the nearest is {nearest['name']}, {away})"


def nearest_sentence(diagnosis: Mapping) -> str | None:
    """The nearest model of an unexplained batch in a sentence; None without one."""
    nearest = diagnosis.get("nearest")
    if not nearest or not nearest["mechanisms"]:
        return None
    places = possible_places(diagnosis)
    elsewhere = {m["place"] for m in nearest["mechanisms"]}.isdisjoint(places)
    where = " and at another place than the mismatch" if places and elsewhere else ""
    return f"Nearest model, {NOT_ACCEPTED}{where}: {'; and '.join(map(claim, nearest['mechanisms']))}."


def error_name(fit: Mapping) -> str:
    """What the errors of a diagnosis are called: of a single recording nothing can be held out."""
    return "held-out error" if fit.get("held_out") else "error of the fit"


def errors_in_words(fit: Mapping) -> str:
    """Errors over the noise floor, as ``τ_in 12.1 -> 1.3``; one number where no mechanism was added."""
    error = fit["error"]

    def fall(channel: str) -> str:
        before, after = (f"{error[channel][when] / error[channel]['noise']:.1f}" for when in ("before", "after"))
        return f"{SYMBOL[channel]} {before}" if before == after else f"{SYMBOL[channel]} {before} -> {after}"

    return f"{error_name(fit)} over the noise floor: {', '.join(map(fall, error))}"


def worst_channel(error: Mapping[str, Mapping]) -> str:
    """Short name of the channel whose error before is largest over its noise."""
    return max(error, key=lambda c: error[c]["before"] / error[c]["noise"])


def claim(mechanism: Mapping) -> str:
    """What is said of one mechanism, as ``the load's torque sensor reads 15 % high (14.7 to 14.9 %)``."""
    known = registry.get(mechanism["name"])
    parameters = {p["name"]: p for p in mechanism["parameters"]}
    strength = parameters[known.strengths[0].name]["value"]
    direction = re.compile(r"\[(.*?)\|(.*?)\]")
    signed = direction.search(known.sentence) is not None
    intervals = []

    def value(match: re.Match) -> str:
        if match[1] == "side":
            return side(mechanism["place"])
        p = parameters[match[1]]
        flip = -1.0 if signed and p["value"] < 0 else 1.0
        low, high = sorted((flip * p["low"], flip * p["high"]))
        text, interval = quantity(flip * p["value"], low, high, "%" if match[2] else p["unit"])
        intervals.append(interval)
        return text

    def clause(match: re.Match) -> str:
        p = parameters[match[1]]
        return "" if p["low"] <= known.parameter(match[1]).neutral <= p["high"] else match[2]

    said = re.sub(r"\[(\w+):(.*?)\]", clause, known.sentence)
    said = direction.sub(lambda match: match[1] if strength >= 0 else match[2], said)
    said = re.sub(r"\{(\w+)(:%)?\}", value, said)
    return f"{said} ({'; '.join(intervals)})" if intervals else said


def strength(mechanism: Mapping) -> str:
    """Value of a mechanism's strength with its interval, as ``23.0 mN m (22.3 to 23.7 mN m)``."""
    name = registry.get(mechanism["name"]).strengths[0].name
    p = next(p for p in mechanism["parameters"] if p["name"] == name)
    value, interval = quantity(p["value"], p["low"], p["high"], p["unit"])
    return f"{value} ({interval})"


def quantity(value: float, low: float, high: float, unit: str) -> tuple[str, str]:
    """A value with its unit, and its interval, both with as many digits as the interval leaves.

    An interval that excludes zero has no end that is printed as zero.

    Parameters
    ----------
    value, low, high : float
        In SI units; `high` may be infinite.
    unit : str
        SI unit as in diagnosis.json, "1" for a number, or "%" for a number that is shown in per cent.
    """
    if isinf(high):
        factor, printed = _scale(max(abs(value), abs(low)), unit)
        return f"{factor * value:.3g}{printed}", f"at least {factor * low:.2g}{printed}"
    factor, printed = _scale(max(abs(value), abs(low), abs(high)), unit)
    value, low, high = factor * value, factor * low, factor * high
    reach = float(f"{(high - low) / 2:.3g}")  # without the rounding of binary numbers
    digits = min(-_exponent(reach), 3 - _exponent(value)) if reach > 0 else 2 - _exponent(value)
    middle, lower, upper = (_fixed(number, max(digits, 0), low * high > 0) for number in (value, low, high))
    return f"{middle}{printed}", f"{lower} to {upper}{printed}"


def _fixed(number: float, digits: int, is_not_zero: bool) -> str:
    """A number with so many decimals; with one digit where it is not zero and they would make it so."""
    return f"{number:.1g}" if is_not_zero and round(number, digits) == 0 else f"{number:.{digits}f}"


def _exponent(value: float) -> int:
    return floor(log10(abs(value))) if value else 0


def _scale(value: float, unit: str) -> tuple[float, str]:
    """Factor from SI to the printed unit, and that unit with a space before it."""
    if unit == "%":
        return 100.0, " %"
    printed = printed_unit(unit)
    if unit in _WITHOUT_PREFIX or unit.startswith(("1/", "log10")):
        printed = "" if unit == "1" else f" {printed}"
        power = _exponent(value)
        if -3 <= power <= 3:
            return 1.0, printed
        return 10.0**-power, f"·10{str(power).translate(_SUPERSCRIPT)}{printed}"
    size, prefix = next((p for p in _PREFIXES if abs(value) >= 0.1 * p[0]), _PREFIXES[0])
    return 1 / size, f" {prefix}{printed}"


def rounded(value: float, unit: str) -> str:
    """A value with two digits and its unit, as ``98 µN m``; parameters as of `quantity`."""
    factor, printed = _scale(value, unit)
    return f"{float(f'{factor * value:.2g}'):g}{printed}"  # 100, not 1e+02


def with_symbols(text: str) -> str:
    """A text of diagnosis.json with the symbols of channels in place of their names."""
    return re.sub(rf"\b({'|'.join(SYMBOL)})\b", lambda m: SYMBOL[m[0]], text)


def printed_unit(unit: str) -> str:
    """A unit of diagnosis.json as it is printed: ``N m`` for ``N*m``, ``m²`` for ``m^2``."""
    return re.sub(r"\^(\d)", lambda m: m[1].translate(_SUPERSCRIPT), unit).replace("*", " ")


def place_in_words(place: str) -> str:
    """A place without its hyphen, as in ``drive pulley``."""
    return place.replace("-", " ")


def _placed(one: Mapping) -> str:
    return f"{one['name']} at the {place_in_words(one['place'])}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
