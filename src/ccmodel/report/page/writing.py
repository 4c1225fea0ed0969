"""Write the page of a run, and the messages on what was left out."""

import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined
from pydantic import BaseModel

from ccmodel.channels import CHANNELS, PAPER_TABLE_ONE, symbol_of
from ccmodel.mechanisms import catalogue, names
from ccmodel.outputs import new_file
from ccmodel.progress import Progress, each_of, silent, within
from ccmodel.recording import ORIGIN, read_recordings
from ccmodel.report.embedding import as_json, asset, with_figures
from ccmodel.report.page import cards, viewer
from ccmodel.report.page.concealed import Concealed, beside, read_concealed
from ccmodel.report.page.formats import FILTERS
from ccmodel.report.verdict import INPUTS_INCONSISTENT, rounded
from ccmodel.rig.findings import Finding
from ccmodel.steps.files import read_json, write_json
from ccmodel.typed import InputError, load_json_model

LEFT_OUT = "left-out.json"
# Shares of the time at which the results are read and the readings collected. Estimated.
READ, COLLECTED = 0.1, 0.7
# Kinds of studies in the order of the page.
ORDER = ("baseline", "accuracy", "loops", "claims", "phases")


@dataclass(frozen=True)
class Content:
    """What the page shows.

    Attributes
    ----------
    batches : sequence of dict
        Summaries of the ingested batches.
    errors : DataFrame
        All errors, with the columns of `ccmodel.errors.COLUMNS`.
    fits : sequence of dict
    studies : sequence of dict
        In any order, as in `write_report`, with the content of their ``summary``. The template
        ``studies/<kind>/part.html.j2`` shows all studies of a kind.
    diagnoses : sequence of dict
        Contents of diagnosis.json.
    reports : mapping of str to str
        The reports of the diagnoses (HTML), by batch.
    runs : sequence of dict
        Recordings and models for the viewer (`viewer.entry`).
    concealed : Concealed, optional
        What the simulated rigs have.
    left_out, inconsistent, warnings : sequence of str
        Messages, as in `messages_of`.
    """

    batches: Sequence[dict]
    errors: pd.DataFrame
    fits: Sequence[dict] = ()
    studies: Sequence[dict] = ()
    diagnoses: Sequence[dict] = ()
    reports: Mapping[str, str] = field(default_factory=dict)
    runs: Sequence[dict] = ()
    concealed: Concealed | None = None
    left_out: Sequence[str] = ()
    inconsistent: Sequence[str] = ()
    warnings: Sequence[str] = ()


def write_report(
    page_file: Path, inputs: Mapping[str, Any], parameters: Sequence[str], studies: Sequence[dict],
    raw: Path, unusable: Sequence[str], progress: Progress = silent,
) -> None:  # fmt: skip
    """Write the page, and next to it the messages on what was left out (left-out.json).

    Parameters
    ----------
    page_file : Path
        The page, in the folder of all results.
    inputs : mapping of str to str or sequence of str
        JSON files: ``summaries`` of the ingested batches, ``fits``, ``simulations``, ``diagnoses``; ``reports``, the
        reports of the diagnoses (HTML) in the same order; ``recordings`` and ``simulated`` of every run (netCDF);
        ``errors``, the table of errors (Parquet); ``concealed``, what the simulated rigs have, if it is stated.
    parameters : sequence of str
        Parameter set of each of ``recordings``.
    studies : sequence of dict
        ``kind``, ``name``, ``heading``, ``settings``, ``parameters`` of each, and its JSON file, if any: ``summary``.
    raw : Path
        Folder of the batches, with an importer's findings.json if any.
    unusable : sequence of str
        Messages on folders that cannot be a batch.
    progress : Progress
    """
    progress("reading the results", 0.0)
    batches, fits, simulations = ([read_json(Path(f)) for f in inputs[k]] for k in ("summaries", "fits", "simulations"))
    diagnoses = [read_json(Path(file)) for file in inputs["diagnoses"]]
    messages = messages_of(raw, unusable, batches, fits, simulations, diagnoses)
    diagnosed = [Path(file).parent.name for file in inputs["diagnoses"]]
    write_json(page_file.parent / LEFT_OUT, messages | {"diagnosed": diagnosed})
    reports = [Path(file).read_text(encoding="utf-8") for file in inputs["reports"]]
    content = Content(
        batches=batches,
        errors=pd.read_parquet(inputs["errors"]),
        fits=fits,
        studies=[s | {"summary": read_json(s["summary"])} if "summary" in s else s for s in studies],
        diagnoses=diagnoses,
        reports={d["batch"]: report for d, report in zip(diagnoses, reports, strict=True)},
        runs=_runs(parameters, inputs["recordings"], inputs["simulated"], within(progress, READ, COLLECTED)),
        concealed=read_concealed(Path(inputs["concealed"])) if inputs.get("concealed") else None,
        **messages,
    )
    progress("writing the page", COLLECTED)
    write_page(page_file, content)


def _runs(
    parameters: Sequence[str], recordings: Sequence[str], simulated: Sequence[str], progress: Progress
) -> list[dict]:
    """Every recording with its simulations by parameter set, for the viewer."""
    models: dict[str, dict] = defaultdict(dict)
    for name, recorded, file in zip(parameters, recordings, simulated, strict=True):
        models[recorded][name] = {s.id: s for s in read_recordings(Path(file))}
    return [
        viewer.entry(recording, {name: by_id.get(recording.id) for name, by_id in sets.items()})
        for file, sets in each_of(
            models.items(), progress, lambda one: f"collecting the readings of {Path(one[0]).stem}"
        )
        for recording in read_recordings(Path(file))
    ]


def messages_of(
    raw: Path, unusable: Sequence[str], batches: Sequence[dict], fits: Sequence[dict], simulations: Sequence[dict],
    diagnoses: Sequence[dict],
) -> dict[str, list[str]]:  # fmt: skip
    """Lines on input that was left out, on input that contradicts itself, and on input that was used with a warning."""
    imported = raw / "findings.json"
    findings = [Finding(**f) for f in (read_json(imported) if imported.exists() else [])]
    findings += [Finding(**f) for batch in batches for f in batch["findings"]]
    # A contradiction in a batch that was diagnosed nevertheless is in inputs that the configuration trusts.
    judged = [d for d in diagnoses if d["verdict"] not in (None, INPUTS_INCONSISTENT)]
    trusted = {batch for d in judged for batch in d.get("batches", [d["batch"]])}
    contradictions = [f for f in findings if f.severity == "inconsistent"]
    failures = [line for simulation in simulations for line in simulation["failures"]]
    left_out = [
        *unusable,
        *(str(f) for f in findings if f.is_refused),
        *(f"fit {f['fit']}: {f['message']}" for f in fits if not f["succeeded"]),
        # A recording fails with every parameter set; one message is enough.
        *dict.fromkeys(f"not simulated: {line}" for line in failures),
        *(f"{d['batch']}: not diagnosed: {d['why']}" for d in diagnoses if d["verdict"] is None),
    ]
    return {
        "left_out": left_out,
        "inconsistent": [str(f) for f in contradictions if f.batch not in trusted],
        "warnings": [
            str(f) for f in findings if f.severity == "warning" or (f in contradictions and f.batch in trusted)
        ],
    }


class LeftOut(BaseModel):
    """Messages of a run, and the names of its diagnoses; a run of before named none, and had no contradictions."""

    left_out: list[str]
    inconsistent: list[str] = []
    warnings: list[str]
    diagnosed: list[str] | None = None


def left_out_of(results: Path) -> LeftOut:
    """Messages of the last run into a results folder.

    Raises
    ------
    InputError
        If no run has finished there, or its file cannot be read.
    """
    file = results / LEFT_OUT
    if not file.exists():
        text = "holds no results of a run that came to its end, and none of a diagnosis"
        raise InputError(f"{results}: {text}; give the folder that --out has named, or that of a run's results")
    return load_json_model(file, LeftOut, "a run")


def write_page(file: Path, content: Content) -> None:
    """Write the page, with the figures that it shows inside it; they are read from the folder of the page."""
    environment = Environment(
        loader=PackageLoader("ccmodel", "."), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    environment.filters |= FILTERS
    environment.globals["asset"] = asset
    verdicts = _verdicts(content)
    text = environment.get_template("report/page/page.html.j2").render(
        **verdicts, **_viewer(content, [card["batch"] for card in verdicts["cards"]]), **_errors(content),
        sections=_sections(content.studies), fits=content.fits, left_out=content.left_out,
        inconsistent=content.inconsistent, warnings=content.warnings,
        notes={_batch_of(b): b["batch"]["note"] for b in content.batches if b["batch"] and b["batch"].get("note")},
    )  # fmt: skip
    text = with_figures(text, file.parent)
    with new_file(file) as fresh:
        fresh.write_text(text, encoding="utf-8")


def _batch_of(summary: Mapping) -> str:
    return summary["batch"]["batch"]


def _verdicts(content: Content) -> dict:
    """Variables of the templates on verdicts and their evidence."""
    made = cards.cards(content.batches, content.diagnoses)
    named = cards.mechanisms_named(content.diagnoses)
    if content.concealed:
        named = sorted({*named, *(e.name for rig in content.concealed.rigs for e in rig.effects if e.name in names())})
    order = {card["batch"]: k for k, card in enumerate(made)}
    diagnoses = sorted(content.diagnoses, key=lambda d: order.get(d["batch"], len(order)))
    origins = {_batch_of(b): b["batch"]["origin"] for b in content.batches if b["batch"]}
    return {
        "cards": made,
        "overview": cards.overview(made),
        "measured": [batch for batch, origin in origins.items() if origin == "rig"],
        "simulated": [batch for batch, origin in origins.items() if origin == "virtual-rig"],
        "reports": [
            {"batch": d["batch"], "verdict": d["verdict"], "content": _section_of(content.reports[d["batch"]])}
            for d in diagnoses
        ],
        "concealed": beside(content.concealed, content.diagnoses) if content.concealed else [],
        "mechanisms": [catalogue.parts(name) for name in named],
        "mechanisms_listed": named,
    }


def _section_of(report: str) -> str:
    """The main part of a diagnosis's report, with its headings two levels lower."""
    main = report.partition("<main>")[2].rpartition("</main>")[0]
    return re.sub(r"<(/?)h([12])\b", lambda m: f"<{m[1]}h{int(m[2]) + 2}", main)


def _viewer(content: Content, batches: Sequence[str]) -> dict:
    """Variables of the viewer's template; `batches` is the order of the cards."""
    order = {batch: k for k, batch in enumerate(batches)}
    runs = sorted(content.runs, key=lambda run: order.get(run["batch"], len(order)))
    runs = [run | {"number": k} for k, run in enumerate(runs)]
    return {
        "viewer_runs": runs,
        "viewer_batches": {batch: list(of) for batch, of in groupby(runs, key=lambda run: run["batch"])},
        "viewer_settings": as_json(viewer.settings()),
        "viewer_library": viewer.library() if runs else "",
        "most_samples": viewer.MOST_SAMPLES,
    }


def _errors(content: Content) -> dict:
    """Variables of the template of all errors."""
    errors = content.errors
    channels = [c for c in CHANNELS if c in set(errors["channel"])]
    return {
        "headline": _headline(errors),
        "origin": ORIGIN,
        "channels": channels,
        "summary": _summary(errors, channels),
        "table_one": list(_beside_table_one(content)),
        "paper": PAPER_TABLE_ONE,
        "rows": errors.to_dict("records"),
    }


def _beside_table_one(content: Content) -> Iterable[dict]:
    """For each fit, errors on its own recordings over three norms, beside those of the paper's Table I, %.

    Only rigs that record the table's channels have them; an instrument without load cells does not.
    """
    for fit in content.fits:
        fitted_to = set(fit.get("recordings", ()))
        errors = content.errors[content.errors["parameters"] == fit["fit"]]
        errors = errors[(errors["batch"] + "/" + errors["recording"]).isin(fitted_to)]
        if fit["succeeded"] and set(PAPER_TABLE_ONE) <= set(errors["channel"]):
            means = {
                name: (100 * errors["rmse"] / errors[norm]).groupby(errors["channel"]).mean()
                for name, norm in (("peak to peak", "peak_to_peak"), ("maximum", "maximum"), ("rms", "rms"))
            }
            yield {
                "fit": fit,
                "batches": sorted(set(errors["batch"])),
                "origin": errors["origin"].iloc[0],
                "over": means,
            }


def _sections(studies: Iterable[dict]) -> dict[str, list[dict]]:
    """Studies by kind, in the order of the page; kinds that it does not name come last."""
    kinds: dict[str, list[dict]] = {kind: [] for kind in ORDER}
    for study in studies:
        kinds.setdefault(study["kind"], []).append(study)
    return {kind: parts for kind, parts in kinds.items() if parts}


def _headline(errors: pd.DataFrame) -> list[str]:
    """A sentence for each parameter set: the median error, and the largest one."""
    sentences = []
    for parameters, table in errors.dropna(subset="nrmse_percent").groupby("parameters", sort=False):
        means = table.groupby(["batch", "channel"])["nrmse_percent"].mean()
        batch, channel = means.idxmax()
        sentences.append(
            f"With {parameters} parameters the median error of the model in a recording is"
            f" {rounded(table['nrmse_percent'].median() / 100, '%')} of peak to peak; the largest mean over the"
            f" recordings of a batch is {rounded(means.max() / 100, '%')}, in {symbol_of(channel)} of batch {batch}."
        )
    return sentences


def _summary(errors: pd.DataFrame, channels: list[str]) -> list[dict]:
    """A row for each batch and parameter set: normalised error of each channel, mean over the recordings, %."""
    groups = ["batch", "parameters"]
    table = errors.pivot_table("nrmse_percent", groups, "channel").reindex(columns=channels)
    counted = errors.groupby(groups).agg(origin=("origin", "first"), count=("recording", "nunique"))
    return table.join(counted).reset_index().to_dict("records")
