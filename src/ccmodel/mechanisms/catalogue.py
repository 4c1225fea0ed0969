"""The mechanisms as text: a table, whole entries, and the page ``docs/mechanisms.md``."""

from ccmodel.mechanisms import get, names
from ccmodel.mechanisms.contract import Mechanism, Parameter

_PAGE = """# Mechanisms

Physics that the paper's model leaves out. Made from the files of `src/ccmodel/mechanisms` by
`ccmodel mechanisms --markdown > docs/mechanisms.md`; do not edit. [How to add one](how-to/add-a-mechanism.md).

Symbols are those of the [glossary](glossary.md), in plain letters. "Mistaken for" also lists two parameters and a state
of the paper's model: the stiffness K, the friction coefficient mu, and a slack cable.
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


def page() -> str:
    """The page of all mechanisms, Markdown."""
    return "\n".join([_PAGE, _table(rows()), *map(_section, map(get, names()))])


def _section(mechanism: Mechanism) -> str:
    lines = ["", f"## {mechanism.name}", "", f"{mechanism.summary[0].upper()}{mechanism.summary[1:]}.", ""]
    lines += [f"- **{title}.** {text}" for title, text in _facts(mechanism)]
    lines += ["", "| parameter | plausible range | start of a fit | meaning |", "|---|---|---|---|"]
    lines += [
        f"| `{p.name}` | {_range(p).removeprefix(f'{p.name} ')} | {p.start:.3g} | {p.meaning}{_notes(p)} |"
        for p in mechanism.parameters
    ]
    return "\n".join(lines)


def _facts(mechanism: Mechanism) -> list[tuple[str, str]]:
    text = mechanism.paragraphs
    return [
        ("Places", ", ".join(mechanism.places)),
        ("Equation", f"{text['Equation']}."),
        ("Signature", f"{text['Signature']}."),
        ("Mistaken for", ", ".join(mechanism.mistaken_for)),
        ("Separated by", mechanism.separated_by),
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


def _table(lines: list[tuple[str, ...]]) -> str:
    head = ["| name | places | parameters | what it is |", "|---|---|---|---|"]
    return "\n".join(head + [f"| [{name}](#{name}) | {' | '.join(rest)} |" for name, *rest in lines])
