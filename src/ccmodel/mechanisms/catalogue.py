"""The mechanisms as text: a table, whole entries, and the pages of ``docs/mechanisms.md`` and ``docs/mechanisms``."""

import re
from math import isfinite
from pathlib import Path

from ccmodel.mechanisms import get, module_of, names
from ccmodel.mechanisms.contract import PAPER_LOOK_ALIKES, Mechanism, Parameter

INDEX = "mechanisms.md"
_MADE = """Made from `src/ccmodel/mechanisms` by `ccmodel mechanisms --markdown docs`; do not edit."""
_INDEX = f"""# Mechanisms

Physics that the paper's model leaves out, a page each. {_MADE} [How to add one](how-to/add-a-mechanism.md).

Symbols are those of the [glossary](glossary.md). "Look-alikes" are other mechanisms, or two parameters and a state of
the paper's model: the stiffness K, the friction coefficient mu, and a slack cable. Names, places, parameters and ranges
are a format: diagnoses and model files contain them.
"""
_CONTENTS = """
```{toctree}
:hidden:
:glob:

mechanisms/*
```
"""


def rows() -> list[tuple[str, str, str, str]]:
    """Name, places, parameters with range and unit, and summary of every mechanism."""
    mechanisms = map(get, names())
    return [(m.name, ", ".join(m.places), "; ".join(map(_range, m.parameters)), m.summary) for m in mechanisms]


def entry(name: str) -> str:
    """All that is known of a mechanism, as text.

    Raises
    ------
    UnknownMechanismError
        If there is none of that name.
    """
    mechanism = get(name)
    lines = [f"{mechanism.name}: {mechanism.summary}", ""]
    lines += [f"{title}: {text}" for title, text in _facts(mechanism)]
    lines += ["", "Parameters:", *(f"  {_range(p)}: {p.meaning}{_notes(p)}" for p in mechanism.parameters)]
    return "\n".join(lines)


def parts(name: str) -> dict:
    """All that is known of a mechanism, in parts: name, summary, titled facts, rows of its parameters."""
    mechanism = get(name)
    rows = [(p.name, _range(p).removeprefix(f"{p.name} "), f"{p.meaning}{_notes(p)}") for p in mechanism.parameters]
    return {"name": name, "summary": mechanism.summary, "facts": _facts(mechanism), "parameters": rows}


def data(name: str) -> dict:
    """All that is known of a mechanism, as plain data: ranges and defaults as numbers in the parameter's unit."""
    mechanism, text = get(name), get(name).paragraphs
    parameters = [
        {
            "name": p.name,
            "meaning": p.meaning,
            "unit": p.unit,
            "low": p.low,
            "high": p.high,
            "signed": p.signed,
            "start": p.start,
            "default": p.default,
        }
        for p in mechanism.parameters
    ]
    return {
        "name": name,
        "summary": mechanism.summary,
        "places": list(mechanism.places),
        "equation": text["Equation"],
        "tex": mechanism.tex,
        "signature": text["Signature"],
        "look_alikes": list(mechanism.mistaken_for),
        "separating_experiment": mechanism.separated_by,
        "depends_on_rate": mechanism.depends_on_time,
        "source": text["Source"],
        "parameters": parameters,
    }


def pages() -> dict[str, str]:
    """Markdown pages by their paths within ``docs``: an index, and a page for each mechanism."""
    return {INDEX: _INDEX + "\n" + _index() + _CONTENTS} | {f"mechanisms/{name}.md": _page(name) for name in names()}


def write_pages(folder: Path) -> None:
    """Write `pages` into a folder; the page of a mechanism that no longer exists stays."""
    (folder / "mechanisms").mkdir(parents=True, exist_ok=True)
    for path, text in pages().items():
        (folder / path).write_text(text, encoding="utf-8")


def _page(name: str) -> str:
    mechanism, module = get(name), module_of(name)
    text = mechanism.paragraphs
    sections = {
        "Equation": f"{text['Equation']}.\n\n$$\n{mechanism.tex}\n$$\n\n{_where(mechanism)}",
        "Parameters": _parameters(mechanism),
        "Signature": f"{text['Signature']}.",
        "Look-alikes": f"{_look_alikes(mechanism)}.",
        "Separating experiment": f"{_sentence(mechanism.separated_by)}.",
        "Source": f"{_linked(text['Source'])}.",
        "In the code": f"[`ccmodel.mechanisms.{module}`](../../src/ccmodel/mechanisms/{module}.py). {_role(mechanism)}",
    }
    body = "\n\n".join(f"## {title}\n\n{section}" for title, section in sections.items())
    return f"# {name}\n\n{_sentence(mechanism.summary)}.\n\n{body}\n\n---\n\n{_MADE}\n"


def _sentence(text: str) -> str:
    return text[0].upper() + text[1:]


def _linked(source: str) -> str:
    """A source with its DOIs as links."""
    return re.sub(r"doi:(10\.\d{4,}/[^\s,;]*[^\s,;:.])", r"[doi:\1](https://doi.org/\1)", source)


def _where(mechanism: Mechanism) -> str:
    acts = " or ".join(f"`{place}`" for place in mechanism.places)
    rate = "depends" if mechanism.depends_on_time else "does not depend"
    return f"It acts at {acts}. Its effect {rate} on the rate of the motion."


def _parameters(mechanism: Mechanism) -> str:
    titles = ["parameter", "meaning", "unit", "plausible range", "start of a fit", "default"]
    return "\n".join([f"| {' | '.join(titles)} |", "|---" * len(titles) + "|", *map(_row, mechanism.parameters)])


def _limit(sense: str, value: float) -> str:
    """A limit as it is printed. One that a value may reach stands a rounding error beyond it."""
    reached = round(value, 6) + 0.0  # no -0
    return f"{sense} {value:g}" if reached == value else f"{sense}= {reached:g}"


def _row(p: Parameter) -> str:
    sign = "±" if p.signed else ""
    unit = "" if p.unit == "1" else p.unit
    limits = [_limit(sense, value) for sense, value in ((">", p.above), ("<", p.below)) if isfinite(value)]
    possible = f" (always {' and '.join(limits)})" if limits else ""
    default = "must be given" if p.default is None else f"{p.default:.3g}"
    cells = (
        f"`{p.name}`",
        p.meaning,
        unit,
        f"{sign}{p.low:.4g} to {sign}{p.high:.4g}{possible}",
        f"{p.start:.3g}",
        default,
    )
    return f"| {' | '.join(cells)} |"


def _look_alikes(mechanism: Mechanism) -> str:
    return ", ".join(
        f"`{name}` of the paper's model" if name in PAPER_LOOK_ALIKES else f"[{name}]({name}.md)"
        for name in mechanism.mistaken_for
    )


def _role(mechanism: Mechanism) -> str:
    """What it changes, and what it needs."""
    if mechanism.modifies_observation is not None:
        role = "It modifies the observation: the sensors' readings after a run."
    elif mechanism.drift is not None:
        drifting = (
            f"[{mechanism.drift}]({mechanism.drift}.md)" if mechanism.drift in names() else f"`{mechanism.drift}`"
        )
        role = f"It drifts the model's {drifting} from recording to recording."
    else:
        settings = ", ".join(f"`{name}`" for name in mechanism.neutral_settings)
        role = f"It modifies the physics: the general solver's {settings}."
    needs = ", ".join(f"`{channel}`" for channel in mechanism.needs)
    return role + (f" A diagnosis considers it where {needs} was recorded." if needs else "")


def _facts(mechanism: Mechanism) -> list[tuple[str, str]]:
    text = mechanism.paragraphs
    return [
        ("Places", ", ".join(mechanism.places)),
        ("Equation", f"{text['Equation']}."),
        ("Signature", f"{text['Signature']}."),
        ("Look-alikes", ", ".join(mechanism.mistaken_for)),
        ("Separating experiment", mechanism.separated_by),
        ("Depends on the rate of the motion", "yes" if mechanism.depends_on_time else "no"),
        ("Source", text["Source"]),
    ]


def _range(p: Parameter) -> str:
    """As in ``z0 5e-06 to 0.0002 m``."""
    sign = "±" if p.signed else ""
    unit = "" if p.unit == "1" else f" {p.unit}"
    return f"{p.name} {sign}{p.low:.4g} to {sign}{p.high:.4g}{unit}"


def _notes(p: Parameter) -> str:
    return "" if p.default is None else f"; {p.default:.3g} if a model omits it"


def _index() -> str:
    head = ["| name | places | parameters | what it is |", "|---|---|---|---|"]
    return (
        "\n".join(head + [f"| [{name}](mechanisms/{name}.md) | {' | '.join(rest)} |" for name, *rest in rows()]) + "\n"
    )
