"""Commands of the validation."""

import hashlib
import json
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np
import typer

from ccmodel.cli import FormerOptions
from proof import conceal
from proof.archive import pack, unpack
from proof.build import build as build_case
from proof.cases import SEVERAL, Case, draw
from proof.families import family as family_of
from proof.plan import read_plan


class _FormerOptions(FormerOptions):
    """Former names of the proof's options."""

    renamed: ClassVar = {"--rivals": "--regressors", "--of": "--selection"}


app = typer.Typer(cls=_FormerOptions, no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)

Seed = Annotated[int, typer.Option(min=0, help="Seed of the first case; the others follow.")]
Count = Annotated[int, typer.Option(min=1, help="Number of cases.")]
Kind = Annotated[str | None, typer.Option(help="clean, single, pair, unlisted, removed or poor; drawn if not given.")]
Effect = Annotated[str | None, typer.Option(help="Effect of a single, removed, poor or unlisted case.")]
Regressors = Annotated[
    bool,
    typer.Option("--regressors", help="Also fit the reference regressors; needs the extra 'proof'."),
]
Cores = Annotated[int, typer.Option(min=1, help="Number of cases at a time.")]
Out = Annotated[Path, typer.Option(help="Folder that gets one folder a case.")]


@app.callback()
def _describe() -> None:
    """Validate the diagnosis on cases with concealed effects."""


@app.command()
def build(
    out: Annotated[Path, typer.Option(help="Folder that gets cases/, kept-back/ and manifest.json.")],
    seed: Seed = 0,
    count: Count = 1,
    kind: Kind = None,
    effect: Effect = None,
    with_keys: Annotated[bool, typer.Option(help="Also write the answers to keys.json, for practice.")] = False,
) -> None:
    """Record cases; existing ones are kept. Without --with-keys only digests of the answers are written."""
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
    regressors: Regressors = False,
    cores: Cores = 1,
) -> None:
    """Record cases and diagnose each in isolation; results of the same sources are kept."""
    _judge_each(cases_of(seed, count, kind, effect), out, regressors, cores)


@app.command()
def family(
    out: Out,
    name: Annotated[str, typer.Argument(help="removed, unlisted or doubtful.")],
    seed: Seed = 0,
    count: Annotated[int | None, typer.Option(min=1, help="Number of cases; the plan's if not given.")] = None,
    first: Annotated[int, typer.Option(min=0, help="Number of the first case, from 0.")] = 0,
    regressors: Regressors = False,
    cores: Cores = 1,
) -> None:
    """Run a family of cases: every effect in turn, at each strength of the family."""
    if name not in (families := read_plan().families):
        raise typer.BadParameter(f"there is no family {name!r}; there are {', '.join(families)}")
    _judge_each(list(family_of(name, seed, count, first)), out, regressors, cores)


@app.command()
def quick(out: Out, cores: Cores = 1) -> None:
    """Run the cases with fixed seeds; exit with 1 if a verdict is not the one that the plan states."""
    fixed = read_plan().quick
    cases = [draw(q.seed, q.kind, q.effect, q.strength) for q in fixed]
    _judge_each(cases, out, False, cores)
    failed = False
    for case, wanted in zip(cases, fixed, strict=True):
        result = json.loads((out / case.name / "result.json").read_text(encoding="utf-8"))
        found = result["diagnosis"]["verdict"] if result["diagnosis"] else None
        if wanted.verdict not in (None, found):
            typer.echo(f"{case.name}: the verdict is {found}; {wanted.verdict} was expected", err=True)
            failed = True
    if failed:
        raise typer.Exit(1)


@app.command()
def full(
    out: Annotated[Path, typer.Option(help="Folder of this one case.")],
    index: Annotated[int, typer.Option(min=0, help="Number of the case in the full validation.")],
    regressors: Regressors = False,
    digest: Annotated[str | None, typer.Option(help="Digest of the sources that the run started with.")] = None,
) -> None:
    """Run one case of the full validation. Its seed follows from the diagnosis's sources and its number."""
    found = conceal.digest_of()
    if digest not in (None, found):
        raise typer.BadParameter("the diagnosis has changed since this run began: restart it, or undo the change")
    _judge(draw(seed_of(found, index)), out, regressors)


@app.command()
def sample(
    n: Annotated[int | None, typer.Option(min=1, help="Number of cases; the plan's if not given.")] = None,
) -> None:
    """Print, as JSON, digests of the diagnosis and the builder, and numbers of N cases of the full validation."""
    digest = conceal.digest_of()
    cases = sample_of(digest, n or read_plan().full.sample)
    typer.echo(json.dumps({"digest": digest, "builder": conceal.builder_digest(), "cases": cases}))


@app.command()
def resume(
    out: Annotated[Path, typer.Option(help="Folder that gets one folder a case.")],
    archive: Annotated[Path, typer.Option(help="Archive of an earlier run.")],
) -> None:
    """Restore archived results of the same sources and the same cases."""
    if restored := unpack(archive, out, conceal.made_by()):
        typer.echo(f"{restored} results from {archive}", err=True)


@app.command()
def score(
    results: Annotated[Path, typer.Argument(exists=True, file_okay=False, help="Folder with one folder a case.")],
    out: Annotated[Path, typer.Option(help="JSON file that gets the score.")],
    page: Annotated[Path, typer.Option(help="Markdown page.")],
    figures: Annotated[Path, typer.Option(help="Folder of the page's figures.")],
    command: Annotated[str, typer.Option(help="Command that made the results, for the page.")] = "python -m proof run",
    selection: Annotated[str, typer.Option(help="Which cases these are, for the page.")] = "",
    numbers: Annotated[str | None, typer.Option(help="Score only these folders, separated by commas.")] = None,
    archive: Annotated[Path | None, typer.Option(help="File that gets every result below RESULTS.")] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Exit with 1 if any case was missed.")] = False,
) -> None:
    """Score results against the answers, which are made again from the seeds."""
    from proof.figures import write_figures
    from proof.outcome import read_outcomes
    from proof.page import Source
    from proof.page import page as page_of
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
    source = Source(page, figures, command, selection)
    page.write_text(page_of(scored, write_figures(scored, figures), source), encoding="utf-8")
    for rate in scored["rates"]:
        if rate["n"]:
            typer.echo(f"{rate['what']:60s}{rate['k']:5d}/{rate['n']:<5d}{rate['rate']:7.1%}")
    typer.echo(str(page))
    if strict and scored["misses"]:
        _report_misses(scored["misses"])
        raise typer.Exit(1)


@app.command()
def laws(
    results: Annotated[Path, typer.Argument(exists=True, file_okay=False, help="Folder with one folder a case.")],
) -> None:
    """Score the laws that were learned in the families, against the tables of the answers."""
    from proof.laws import score_of_laws
    from proof.outcome import read_outcomes

    for one in score_of_laws(read_outcomes(results)):
        value = one["rate"] if "rate" in one else one["value"]
        share = "-" if value is None else f"{value:.0%} ({one['low']:.0%} to {one['high']:.0%})"
        typer.echo(f"{one['what']:62s}{one['n']:4d}  {share:24s} wanted {one['target']:.0%}")


def _report_misses(misses: list[dict]) -> None:
    for miss in misses:
        truth, reported = ", ".join(miss["truth"]) or "clean", ", ".join(miss["identified"])
        typer.echo(f"missed {miss['case']} ({truth}): {miss['verdict']} {reported}", err=True)


@app.command()
def real(
    raw: Annotated[Path, typer.Argument(exists=True, file_okay=False, help="Imported batches of measured recordings.")],
    out: Annotated[Path, typer.Option(help="Folder that gets the baseline model and one folder a case.")],
    page: Annotated[Path | None, typer.Option(help="Markdown page.")] = None,
) -> None:
    """Seed faults in measured recordings, diagnose them with a frozen baseline; results of the same plan are kept."""
    from proof.real.cases import cases_of as real_cases_of
    from proof.real.page import real_page
    from proof.real.plan import read_real_plan
    from proof.real.run import BASELINE, find_baseline, judge_real, made_by
    from proof.real.score import read_real_outcomes

    plan, baseline = read_real_plan(), out / "baseline"
    source = raw if raw.name == plan.batch else raw / plan.batch
    if not (source / "batch.yaml").exists():
        raise typer.BadParameter(f"there is no batch {plan.batch} in {raw}: import it with ccmodel import-mis-tool")
    find_baseline(plan, source, baseline, typer.echo)
    made = made_by(plan, baseline)
    for case in real_cases_of(plan, json.loads((baseline / BASELINE).read_text(encoding="utf-8"))):
        if not _is_of(made, out / "cases" / case.name / "result.json"):
            judge_real(case, plan, source, baseline, out / "cases" / case.name, typer.echo)
    if page is not None:
        earlier = page.read_text(encoding="utf-8") if page.exists() else ""
        page.write_text(real_page(read_real_outcomes(plan, out), plan, baseline, earlier), encoding="utf-8")
        typer.echo(str(page))


@app.command()
def convergence(seed: Seed = 0) -> None:
    """Measure the discretisation error of the concealed rigs, against a finer rig with the rope's true mass."""
    from proof.convergence import measure

    for name, share in measure(seed).items():
        typer.echo(f"{name:16s}{share:6.2f} of the sensor's noise")


def seed_of(digest: str, index: int) -> int:
    """Seed of a case of the full validation."""
    return int(hashlib.sha256(f"{digest} {index}".encode()).hexdigest()[:15], 16)


def sample_of(digest: str, n: int) -> list[int]:
    """Numbers of `n` cases of the full validation, drawn with the digest as seed; a larger sample holds the smaller."""
    order = np.random.default_rng(int(digest, 16)).permutation(read_plan().full.cases)
    return sorted(map(int, order[:n]))


def _judge_each(cases: list[Case], out: Path, regressors: bool, cores: int) -> None:
    """Run the cases that have no result of these sources, `cores` at a time."""
    made_by = conceal.made_by()
    pending = [case for case in cases if not _is_of(made_by, out / case.name / "result.json")]
    with ProcessPoolExecutor(cores) as pool:
        list(pool.map(partial(_judge, regressors=regressors), pending, [out / case.name for case in pending]))


def _is_of(made_by: dict[str, str], result: Path) -> bool:
    return result.exists() and made_by.items() <= json.loads(result.read_text(encoding="utf-8")).items()


def _judge(case: Case, out: Path, regressors: bool) -> None:
    from proof.judge import judge

    result = judge(case, out, report=typer.echo, with_regressors=regressors)
    if result["tampering"]:
        typer.echo(f"{case.name} is refused: {'; '.join(result['tampering'])}", err=True)


def cases_of(seed: int, count: int, kind: str | None, effect: str | None) -> list[Case]:
    """Cases of consecutive seeds.

    Raises
    ------
    typer.BadParameter
        If the kind or the effect is unknown, or if they do not fit together.
    """
    plan = read_plan()
    known = {"kind": (kind, plan.kinds), "effect": (effect, {**plan.effects, **plan.unlisted})}
    for what, (given, names) in known.items():
        if given is not None and given not in names:
            raise typer.BadParameter(f"there is no {what} {given!r}; there are {', '.join(names)}")
    if effect is not None and kind in (None, "clean", *SEVERAL):
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
