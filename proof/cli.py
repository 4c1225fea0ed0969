"""Commands of the proof."""

import hashlib
import json
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from proof import conceal
from proof.archive import pack, unpack
from proof.build import build as build_case
from proof.cases import Case, draw
from proof.plan import read_plan

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)

Seed = Annotated[int, typer.Option(min=0, help="Seed of the first case; the others follow.")]
Count = Annotated[int, typer.Option(min=1, help="How many cases.")]
Kind = Annotated[str | None, typer.Option(help="clean, single, pair, unlisted, removed or poor; else by shares.")]
Effect = Annotated[str | None, typer.Option(help="The effect of a single, removed, poor or unlisted case.")]
Rivals = Annotated[
    bool, typer.Option("--rivals", help="Hold the rivals to the same recordings; needs the extra 'proof'.")
]
Cores = Annotated[int, typer.Option(min=1, help="How many cases at a time.")]
Out = Annotated[Path, typer.Option(help="Folder that gets a folder a case.")]


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


@app.command()
def run(
    out: Out,
    seed: Seed = 0,
    count: Count = 1,
    kind: Kind = None,
    effect: Effect = None,
    rivals: Rivals = False,
    cores: Cores = 1,
) -> None:
    """Record cases and have each diagnosed where nothing else is in reach; results of the same sources are kept."""
    _judge_each(cases_of(seed, count, kind, effect), out, rivals, cores)


@app.command()
def quick(out: Out, cores: Cores = 1) -> None:
    """The handful of cases whose seeds never change."""
    _judge_each([draw(q.seed, q.kind, q.effect) for q in read_plan().quick], out, False, cores)


@app.command()
def full(
    out: Annotated[Path, typer.Option(help="Folder of this one case.")],
    index: Annotated[int, typer.Option(min=0, help="Number of the case in the full proof.")],
    rivals: Rivals = False,
    digest: Annotated[str | None, typer.Option(help="Of the sources that the run began with.")] = None,
) -> None:
    """One case of the full proof, whose seed follows from the diagnosis's sources and its number."""
    found = conceal.digest_of()
    if digest not in (None, found):
        raise typer.BadParameter("the diagnosis has changed since this run began: begin it again, or undo the change")
    _judge(draw(seed_of(found, index)), out, rivals)


@app.command()
def part(n: Annotated[int | None, typer.Option(min=1, help="How many; else as planned.")] = None) -> None:
    """Print digests of the diagnosis and of what makes cases, and the numbers of the cases of N of the full proof."""
    digest = conceal.digest_of()
    cases = part_of(digest, n or read_plan().full.part)
    typer.echo(json.dumps({"digest": digest, "builder": conceal.builder_digest(), "cases": cases}))


@app.command()
def resume(
    out: Annotated[Path, typer.Option(help="Folder with a folder a case.")],
    archive: Annotated[Path, typer.Option(help="What an earlier proof packed.")],
) -> None:
    """Bring back the results of an earlier proof of the same sources and the same cases."""
    if brought := unpack(archive, out, conceal.made_by()):
        typer.echo(f"{brought} results from {archive}", err=True)


@app.command()
def score(
    results: Annotated[Path, typer.Argument(exists=True, file_okay=False, help="Folder with a folder a case.")],
    out: Annotated[Path, typer.Option(help="JSON file with the score.")],
    page: Annotated[Path, typer.Option(help="Markdown page.")],
    figures: Annotated[Path, typer.Option(help="Folder of the page's figures.")],
    command: Annotated[str, typer.Option(help="What made the results, for the page.")] = "python -m proof run",
    of: Annotated[str, typer.Option(help="Which cases these are, for the page.")] = "",
    numbers: Annotated[str | None, typer.Option(help="Only these folders, by comma; else all.")] = None,
    archive: Annotated[Path | None, typer.Option(help="File that gets every result below RESULTS.")] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Exit with 1 where a case was missed.")] = False,
) -> None:
    """Score results against keys made again from their seeds."""
    from proof.figures import write_figures
    from proof.page import page as page_of
    from proof.score import read_outcomes
    from proof.score import score as score_of

    outcomes = read_outcomes(results, numbers.split(",") if numbers else None)
    if not outcomes:
        raise typer.BadParameter(f"there is no result below {results}")
    if archive is not None:
        pack(results, archive)
    scored = score_of(outcomes)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps(scored, indent=1), encoding="utf-8")
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(page_of(scored, write_figures(scored, figures), figures, page, command, of), encoding="utf-8")
    for rate in scored["rates"]:
        if rate["n"]:
            typer.echo(f"{rate['what']:60s}{rate['k']:5d}/{rate['n']:<5d}{rate['rate']:7.1%}")
    typer.echo(str(page))
    for miss in scored["misses"] if strict else []:
        hidden = ", ".join(miss["truth"]) or "nothing"
        typer.echo(f"missed {miss['case']}: {hidden} was called {miss['verdict']} {', '.join(miss['named'])}", err=True)
    if strict and scored["misses"]:
        raise typer.Exit(1)


@app.command()
def real(
    raw: Annotated[Path, typer.Argument(exists=True, file_okay=False, help="Imported batches of measured recordings.")],
    out: Annotated[Path, typer.Option(help="Folder that gets the model in use and a folder a case.")],
    page: Annotated[Path | None, typer.Option(help="Markdown page.")] = None,
) -> None:
    """Put something into measured recordings and have them diagnosed beside a model in use; done ones are kept."""
    from proof.real.cases import cases_of as real_cases_of
    from proof.real.page import real_page
    from proof.real.plan import read_real_plan
    from proof.real.run import MODEL, find_model, judge_real
    from proof.real.score import read_real_outcomes

    plan, in_use = read_real_plan(), out / "model"
    source = raw if raw.name == plan.batch else raw / plan.batch
    if not (source / "batch.yaml").exists():
        raise typer.BadParameter(f"there is no batch {plan.batch} in {raw}: import it with ccmodel import-mis-tool")
    find_model(plan, source, in_use, typer.echo)
    made_by = {"sources": conceal.digest_of()}
    for case in real_cases_of(plan, json.loads((in_use / MODEL).read_text(encoding="utf-8"))):
        if not _is_of(made_by, out / "cases" / case.name / "result.json"):
            judge_real(case, plan, source, in_use, out / "cases" / case.name, typer.echo)
    if page is not None:
        earlier = page.read_text(encoding="utf-8") if page.exists() else ""
        page.write_text(real_page(read_real_outcomes(plan, out), plan, in_use, earlier), encoding="utf-8")
        typer.echo(str(page))


@app.command()
def convergence(seed: Seed = 0) -> None:
    """Measure what the rig's numerics leave: against cells and bristles half as large and the rope's own mass."""
    from proof.convergence import measure

    for name, share in measure(seed).items():
        typer.echo(f"{name:16s}{share:6.2f} of the sensor's noise")


def seed_of(digest: str, index: int) -> int:
    """Seed of a case of the full proof."""
    return int(hashlib.sha256(f"{digest} {index}".encode()).hexdigest()[:15], 16)


def part_of(digest: str, n: int) -> list[int]:
    """Numbers of `n` cases of the full proof, drawn by the digest; a larger part holds the smaller ones."""
    order = np.random.default_rng(int(digest, 16)).permutation(read_plan().full.cases)
    return sorted(map(int, order[:n]))


def _judge_each(cases: list[Case], out: Path, rivals: bool, cores: int) -> None:
    """Cases that have no result of these sources yet, some at a time."""
    made_by = conceal.made_by()
    wanted = [case for case in cases if not _is_of(made_by, out / case.name / "result.json")]
    with ProcessPoolExecutor(cores) as pool:
        list(pool.map(partial(_judge, rivals=rivals), wanted, [out / case.name for case in wanted]))


def _is_of(made_by: dict[str, str], result: Path) -> bool:
    return result.exists() and made_by.items() <= json.loads(result.read_text(encoding="utf-8")).items()


def _judge(case: Case, out: Path, rivals: bool) -> None:
    from proof.judge import judge

    result = judge(case, out, tell=typer.echo, with_rivals=rivals)
    if result["tampering"]:
        typer.echo(f"{case.name} is refused: {'; '.join(result['tampering'])}", err=True)


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
