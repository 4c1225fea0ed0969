"""What a simulated rig has, beside what the diagnoses said without knowing it."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from pydantic import Field

from ccmodel import mechanisms as registry
from ccmodel.report.page.cards import after_is
from ccmodel.report.verdict import (
    INPUTS_INCONSISTENT,
    SYMBOL,
    place_in_words,
    recognised_as,
    strength,
    worst_channel,
)
from ccmodel.typed import TypedModel, load_yaml_model

IDENTIFIED, ALTERNATIVE, NEAREST, NOT_IDENTIFIED = (
    "identified",
    "alternative",
    "in the nearest model, not accepted",
    "not identified",
)


class Effect(TypedModel):
    """One effect of a rig; `name` and `place` are those of a mechanism, or None if no mechanism describes it."""

    name: str | None = None
    place: str | None = None
    text: str
    source: str = ""


class Rig(TypedModel):
    """A simulated rig: its batches and its effects."""

    batches: list[str]
    effects: list[Effect]


class Concealed(TypedModel):
    """Content of the file that the key ``concealed`` of the configuration names."""

    format: int = Field(ge=1, le=1)
    rigs: list[Rig]


def read_concealed(file: Path) -> Concealed:
    """Read and check the file of what the rigs have.

    Raises
    ------
    InputError
        With one line a problem: the file, the key, what to do.
    """
    return load_yaml_model(file, Concealed)


def beside(concealed: Concealed, diagnoses: Sequence[Mapping]) -> list[dict]:
    """For each rig its effects, what each diagnosis said of them and besides them, and the held-out errors."""
    of_batch = {d["batch"]: d for d in diagnoses}
    tables = []
    for rig in concealed.rigs:
        said = [of_batch.get(batch) or {"batch": batch, "verdict": None} for batch in rig.batches]
        joint = [d for d in diagnoses if d.get("batches") and set(d["batches"]) <= set(rig.batches)]
        columns = [*rig.batches, *(f"{d['batch']} ({len(d['batches'])} batches together)" for d in joint)]
        said += joint
        effects = [
            {
                "text": e.text,
                "name": e.name,
                "place": place_in_words(e.place) if e.place else "–",
                "source": e.source,
                "said": [_said_of(e, rig, d) for d in said],
            }
            for e in rig.effects
        ]
        tables.append(
            {
                "batches": rig.batches,
                "columns": columns,
                "effects": effects,
                "besides": [_besides(rig, d) for d in said],
                "verdicts": [d["verdict"] or "not diagnosed" for d in said],
                "falls": [_fall(d) for d in said],
            }
        )
    return tables


def _said_of(effect: Effect, rig: Rig, diagnosis: Mapping) -> str:
    """What a diagnosis said of an effect, and not of the same effect at another place of the rig."""
    if not diagnosis["verdict"] or diagnosis["verdict"] == INPUTS_INCONSISTENT:
        return "–"
    laws = [_in_words(law) for law in diagnosis["laws"] if _is_law_of(law, effect)]
    learned = f"learned: {', '.join(laws)}" if laws else ""
    if effect.name is None:
        return learned or "no mechanism describes it"
    kinds = (
        (diagnosis["mechanisms"], IDENTIFIED),
        (diagnosis["alternatives"], ALTERNATIVE),
        ((diagnosis.get("nearest") or {}).get("mechanisms", []), NEAREST),
    )
    taken = {e.place for e in rig.effects if e.name == effect.name and e is not effect}
    for listed, said in kinds:
        of_name = [m for m in listed if m["name"] == effect.name and m["place"] not in taken]
        here = [m for m in of_name if effect.place in (m["place"], None)]
        if of_name and not here:
            said = f"{said}, but at the {place_in_words(of_name[0]['place'])}"
        if of_name:
            one = (here or of_name)[0]
            return f"{said}: {strength(one)}" if "parameters" in one else said
    return learned or NOT_IDENTIFIED


def _besides(rig: Rig, diagnosis: Mapping) -> str:
    """Mechanisms that a diagnosis identifies and laws that it learns, of effects that the rig does not have."""
    if not diagnosis["verdict"]:
        return "–"
    there = {e.name for e in rig.effects}
    laws = [_in_words(law) for law in diagnosis["laws"] if not any(_is_law_of(law, e) for e in rig.effects)]
    identified = [m["name"] for m in diagnosis["mechanisms"] if m["name"] not in there]
    return ", ".join([*identified, *laws]) or "–"


def _is_law_of(law: Mapping, effect: Effect) -> bool:
    """Whether a law stands at the place of an effect, and is the one of its mechanism, or of none if it has none.

    A mechanism that acts at one place only, as cables that differ, has its law wherever that stands.
    """
    if recognised_as(law) != effect.name:
        return False
    is_at_one_place = effect.name is not None and len(registry.get(effect.name).places) == 1
    return is_at_one_place or effect.place in (law["place"], None)


def _in_words(law: Mapping) -> str:
    """A learned law by its slot and arguments."""
    return f"{law['slot']} by {' and '.join(law['arguments'])}"


def _fall(diagnosis: Mapping) -> str:
    """Held-out error of the worst channel, before and after."""
    if not diagnosis["verdict"] or not diagnosis["fit"]["error"]:
        return "–"
    error = diagnosis["fit"]["error"]
    worst = worst_channel(error)
    nearest = (diagnosis.get("nearest") or {}).get("error")
    noise = error[worst]["noise"]
    before, after = error[worst]["before"] / noise, (nearest or error)[worst]["after"] / noise
    model = after_is(diagnosis)
    if not model:
        return f"{SYMBOL[worst]}: {before:.1f} times the noise floor"
    return f"{SYMBOL[worst]}: {before:.1f} to {after:.1f} times the noise floor (model: {model})"
