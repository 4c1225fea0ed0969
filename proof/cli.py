"""Commands of the proof."""

import json
import time
from pathlib import Path
from typing import Annotated

import typer

from proof.build import build as build_case
from proof.cases import Case, draw
from proof.plan import read_plan

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)

Seed = Annotated[int, typer.Option(min=0, help="Seed of the first case; the others follow.")]
Count = Annotated[int, typer.Option(min=1, help="How many cases.")]
Kind = Annotated[str | None, typer.Option(help="clean, single, pair, unlisted, removed or poor; else by shares.")]
Effect = Annotated[str | None, typer.Option(help="The effect of a single, removed, poor or unlisted case.")]


@app.callback()
def _describe() -> None:
    """Concealed cases, and what a diagnosis makes of them."""


@app.command()
def build(
    out: Annotated[Path, typer.Option(help="Folder that gets cases/, kept-back/ and manifest.json.")],
    seed: Seed = 0,
    count: Count = 1,
    kind: Kind = None,
    effect: Effect = None,
    with_keys: Annotated[bool, typer.Option(help="Leave the answers in keys.json, for practice.")] = False,
) -> None:
    """Record cases. Without --with-keys no answer is left on disk, only its digest; built ones are kept."""
    manifest_file = out / "manifest.json"
    manifest = json.loads(manifest_file.read_text()) if manifest_file.exists() else {}
    cases = cases_of(seed, count, kind, effect)
    for case in cases:
        if case.name in manifest:
            continue
        started = time.process_time()
        manifest[case.name] = build_case(case, out)
        manifest_file.write_text(json.dumps(manifest, indent=1), encoding="utf-8")
        took_s = time.process_time() - started
        typer.echo(f"{case.name}: {len(case.recordings)} recordings in {took_s:.0f} s of one core")
    if with_keys:
        _add_keys(cases, out)


def cases_of(seed: int, count: int, kind: str | None, effect: str | None) -> list[Case]:
    """Cases of consecutive seeds; what cannot be drawn is said in one line."""
    plan = read_plan()
    known = {"kind": (kind, plan.kinds), "effect": (effect, {**plan.effects, **plan.unlisted})}
    for what, (given, names) in known.items():
        if given is not None and given not in names:
            raise typer.BadParameter(f"there is no {what} {given!r}; there are {', '.join(names)}")
    if effect is not None and kind in (None, "clean", "pair"):
        raise typer.BadParameter("--effect needs --kind single, removed, poor or unlisted")
    if effect is not None and (effect in plan.unlisted) != (kind == "unlisted"):
        raise typer.BadParameter(f"{effect} is not an effect of a case of kind {kind}")
    return [draw(seed + i, kind, effect) for i in range(count)]


def _add_keys(cases: list[Case], out: Path) -> None:
    file = out / "keys.json"
    keys = {key["case"]: key for key in (json.loads(file.read_text()) if file.exists() else [])}
    for case in cases:
        floor = json.loads((out / "kept-back" / case.name / "floor.json").read_text())
        keys[case.name] = case.key | {"floor": floor}
    file.write_text(json.dumps(list(keys.values()), indent=1), encoding="utf-8")


def main() -> None:
    """Run the command line."""
    app()
