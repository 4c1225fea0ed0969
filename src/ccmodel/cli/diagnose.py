"""Diagnosis of a batch, or of several batches of one rig."""

from collections.abc import Mapping
from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from ccmodel.cli import completion
from ccmodel.cli.group import MODEL, command
from ccmodel.cli.interruption import leaving
from ccmodel.cli.options import (
    Batches,
    Cycles,
    Json,
    Quiet,
    Step,
    Tolerance,
    TrustInputs,
    input_file,
    out_folder,
    tolerance_of,
)
from ccmodel.cli.output import Output


def add_to(app: typer.Typer) -> None:
    """Add the command."""
    of_a_rig = "ccmodel diagnose data/raw/loops data/raw/later --out rig"
    later = "ccmodel diagnose data/raw/later --baseline out/model.json --freeze --out later"
    command(app, "diagnose", MODEL, ["ccmodel diagnose data/raw/loops --out out", of_a_rig, later])(diagnose)


def diagnose(
    batches: Batches,
    out: Annotated[Path, out_folder("Folder for diagnosis.json, the page and the models.")],
    without: Annotated[
        list[str],
        typer.Option(
            help="Mechanism that is no candidate; may be repeated.",
            autocompletion=completion.mechanisms,
            show_default=False,
        ),
    ] = [],  # noqa: B006
    tolerance: Tolerance = [],  # noqa: B006
    step: Step = None,
    cycles: Cycles = None,
    baseline: Annotated[
        Path | None,
        typer.Option(
            help="Model file to start from, instead of the estimates.", callback=input_file, show_default=False
        ),
    ] = None,
    freeze: Annotated[
        bool, typer.Option("--freeze", help="Keep the baseline's values, but for sensor zeros, and look for a change.")
    ] = False,
    candidate: Annotated[
        list[str],
        typer.Option(
            help="As 'kink at conduit', or up to four with commas: fit it in full whatever the screening says.",
            autocompletion=completion.candidates,
            show_default=False,
        ),
    ] = [],  # noqa: B006
    keep_law: Annotated[
        str | None,
        typer.Option(
            "--keep-law",
            metavar="NAME",
            help="Write a learned law as a mechanism of this name, a Python file in --out.",
            show_default=False,
        ),
    ] = None,
    run_limit: Annotated[
        int | None,
        typer.Option(
            "--run-limit",
            help="Model runs after which no further candidate is fitted; 50000 if not given.",
            show_default=False,
        ),
    ] = None,
    time_limit: Annotated[
        float | None,
        typer.Option(
            "--time-limit",
            help="Time after which no further candidate is fitted, s; 160 if not given.",
            show_default=False,
        ),
    ] = None,
    trust_inputs: TrustInputs = False,
    strict: Annotated[bool, typer.Option("--strict", help="Exit with 1 unless the model agrees.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Decide whether the calibrated model explains a batch; if not, locate and name the physics left out.

    Several batches of one rig are diagnosed together, with one stiffness, one friction and one set of mechanisms.
    Exits with 0 at any verdict, unless --strict is given, or --keep-law and no law was learned.
    """
    import ccmodel
    from ccmodel.diagnosis.kept_law import check_name
    from ccmodel.paths import try_folder
    from ccmodel.studies.diagnosis.run import FILES

    output, shares = Output(as_json, quiet), tolerance_of(tolerance)
    # The same check as below, with the name that the option has here.
    try_folder(out, "--out", FILES, () if baseline is None else (baseline,))
    if keep_law is not None:
        check_name(keep_law)
    with leaving(out), output.progress() as progress:
        found = ccmodel.diagnose(
            batches,
            out,
            baseline=baseline,
            freeze=freeze,
            without=without,
            tolerance=shares,
            step_s=step,
            cycles=cycles,
            candidates=candidate,
            run_limit=run_limit,
            time_limit_s=time_limit,
            trust_inputs=trust_inputs,
            progress=progress,
        )
    kept = None if keep_law is None else found.keep_law(keep_law, out)
    output.result({**found.report, "out": out}, found.headline)
    for finding in found.batch.findings:
        if finding.is_refused:
            output.finding(str(finding), "refused")
    for line in _not_judged(found.report):
        output.finding(line, "warning")
    output.hint(f"wrote {out}: diagnosis.json, report.html and the models. Next: ccmodel report {quote(str(out))}")
    if kept is not None:
        output.hint(f"wrote {kept}: the law as a mechanism, to be reviewed (docs/how-to/add-a-mechanism.md)")
    elif keep_law is not None:
        output.message(f"--keep-law {keep_law}: no law was learned (verdict '{found.verdict}'); no file is written")
    if (strict and found.verdict != "agrees") or (keep_law is not None and kept is None):
        raise typer.Exit(1)


def _not_judged(report: Mapping) -> list[str]:
    """Lines on what was not judged, and on what gives a search more room; refused files have lines of their own."""
    from ccmodel.report.verdict import CANDIDATES_LEFT, INPUTS_INCONSISTENT, PLACE_LEFT

    if report["verdict"] == INPUTS_INCONSISTENT:  # the verdict states them
        return []
    lines = []
    for one in report.get("not_judged", ()):
        more = f"; {_remedy(one['why'])}" if one["what"] in (CANDIDATES_LEFT, PLACE_LEFT) else ""
        if not one.get("refused"):
            lines.append(f"not judged: {one['what']}: {one['why']}{more}")
    return lines


def _remedy(why: str) -> str:
    """What to do about a limit, by the reason that names it."""
    options = {"model runs": "a higher --run-limit", "time limit": "a higher --time-limit, such as 900"}
    named = [option for words, option in options.items() if words in why]
    return f"repeat with {' or '.join(named or options.values())}"
