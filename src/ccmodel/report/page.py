"""The page of a run: errors, the parts of the studies, fits, and the recordings that were left out."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined

from ccmodel.channels import CHANNELS, TABLE_ONE, symbol_of
from ccmodel.recording import ORIGIN
from ccmodel.rig.findings import Finding
from ccmodel.steps.files import read_json, write_json
from ccmodel.typed import InputError

LEFT_OUT = "left-out.json"
# Table I of the paper, %: its fitted model against its own half-loop recording.
PAPER_TABLE_I = dict(zip(TABLE_ONE, (3.7, 19.4, 3.7, 12.8, 4.1, 9.9, 5.5), strict=True))


@dataclass(frozen=True)
class Part:
    """A study on the page; `ccmodel/studies/<kind>/part.html.j2` shows all parts of its kind.

    Attributes
    ----------
    kind, name : str
        Folder of the study in `ccmodel.studies`; name in the configuration.
    heading : str
        Name of the section in the navigation.
    settings : dict
        Settings of the study.
    parameters : str
        Parameter set of the model, if the study has one.
    summary : dict
        Content of the study's JSON file, if it has one.
    """

    kind: str
    name: str
    heading: str
    settings: dict = field(default_factory=dict)
    parameters: str = ""
    summary: dict = field(default_factory=dict)


@dataclass(frozen=True)
class LeftOut:
    """Messages of a run: on input that was left out, and on input that was used with a warning."""

    left_out: list[str]
    warnings: list[str]


def write_report(
    page_file: Path, raw: Path, unusable: Sequence[str], summary_files: Sequence[Path], fit_files: Sequence[Path],
    simulation_files: Sequence[Path], errors_file: Path, diagnosis_files: Sequence[Path], studies: Sequence[dict],
) -> None:  # fmt: skip
    """Write the page, and next to it the messages on what was left out (left-out.json).

    Parameters
    ----------
    page_file, raw : Path
        The page, in the folder of all results; the folder of the batches, with an importer's findings.json if any.
    unusable : sequence of str
        Messages on folders that cannot be a batch.
    summary_files, fit_files, simulation_files, diagnosis_files : sequence of Path
        JSON files of ingested batches, fits, simulations and diagnoses.
    errors_file : Path
        The table of errors (Parquet).
    studies : sequence of dict
        Attributes of a `Part` for each study; ``has_summary`` stands for its summary.
    """
    batches, fits = ([read_json(f) for f in files] for files in (summary_files, fit_files))
    messages = _messages(raw, unusable, batches, fits, [read_json(f) for f in simulation_files])
    write_json(page_file.parent / LEFT_OUT, asdict(messages))
    parts = [Part("diagnosis", f.parent.name, "Diagnoses", summary=read_json(f)) for f in diagnosis_files]
    for study in studies:
        summary = read_json(page_file.parent / f"tables/{study['name']}.json") if study.pop("has_summary") else {}
        parts.append(Part(**study, summary=summary))
    write_page(page_file, parts, batches, pd.read_parquet(errors_file), fits, messages)


def _messages(
    raw: Path, unusable: Sequence[str], batches: Sequence[dict], fits: Sequence[dict], simulations: Sequence[dict]
) -> LeftOut:
    findings = [Finding(**f) for batch in batches for f in batch["findings"]]
    imported = raw / "findings.json"
    if imported.exists():
        findings = [Finding(**f) for f in read_json(imported)] + findings
    failures = [line for simulation in simulations for line in simulation["failures"]]
    return LeftOut(
        left_out=[
            *unusable,
            *(str(f) for f in findings if f.severity == "refused"),
            *(f"fit {f['fit']}: {f['message']}" for f in fits if not f["succeeded"]),
            # A recording fails with every parameter set; one message is enough.
            *dict.fromkeys(f"not simulated: {line}" for line in failures),
        ],
        warnings=[str(f) for f in findings if f.severity == "warning"],
    )


def left_out_of(results: Path) -> LeftOut:
    """Messages of the last run into a results folder.

    Raises
    ------
    InputError
        If no run has finished there.
    """
    file = results / LEFT_OUT
    if not file.exists():
        raise InputError(f"{file}: not there, so no run came to its end; its own messages say why")
    return LeftOut(**read_json(file))


def write_page(
    file: Path, parts: Iterable[Part], batches: Sequence[dict], errors: pd.DataFrame, fits: Sequence[dict],
    messages: LeftOut,
) -> None:  # fmt: skip
    """Write the page; it refers to the figures in `figures/` next to it.

    Parameters
    ----------
    file : Path
    parts : iterable of Part
        In the order of the page.
    batches : sequence of dict
        Summaries of the ingested batches.
    errors : DataFrame
        All errors, with the columns of `ccmodel.errors.COLUMNS`.
    fits : sequence of dict
    messages : LeftOut
    """
    environment = Environment(
        loader=PackageLoader("ccmodel", "."), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    environment.filters |= {"interval": interval, "about": about, "number": number}
    channels = [c for c in CHANNELS if c in set(errors["channel"])]
    sections: dict[str, list[Part]] = {}
    for part in parts:
        sections.setdefault(part.kind, []).append(part)
    text = environment.get_template("report/page.html.j2").render(
        headline=_headline(errors),
        origins=sorted({ORIGIN[o] for o in errors["origin"]}),
        origin=ORIGIN,
        recordings=sum(len(b["recordings"]) for b in batches),
        batches=batches,
        sections=sections,
        symbols=[symbol_of(c) for c in channels],
        summary=_summary(errors, channels),
        # The row of Table I is for rigs that record its channels; an instrument without load cells does not.
        paper=[PAPER_TABLE_I.get(c) for c in channels] if set(PAPER_TABLE_I) <= set(channels) else None,
        simulated_only=set(errors["origin"]) == {"virtual-rig"},
        notes={b["batch"]["batch"]: b["batch"]["note"] for b in batches if b["batch"] and b["batch"].get("note")},
        rows=_rows(errors),
        fits=fits,
        left_out=messages.left_out,
        warnings=messages.warnings,
    )
    file.write_text(text)


def _headline(errors: pd.DataFrame) -> list[str]:
    """A sentence for each parameter set: the median error, and the largest one."""
    sentences = []
    for parameters, table in errors.dropna(subset="nrmse_percent").groupby("parameters", sort=False):
        means = table.groupby(["batch", "channel"])["nrmse_percent"].mean()
        batch, channel = means.idxmax()
        sentences.append(
            f"With {parameters} parameters the median error of the model is {table['nrmse_percent'].median():.2g} % of"
            f" peak to peak; the largest is {means.max():.2g} %, in {symbol_of(channel)} of batch {batch}."
        )
    return sentences


def _summary(errors: pd.DataFrame, channels: list[str]) -> list[dict]:
    """A row for each batch and parameter set: normalised error of each channel, mean over the recordings, %."""
    if errors.empty:
        return []
    table = errors.pivot_table("nrmse_percent", ["batch", "parameters"], "channel", aggfunc="mean", observed=True)
    groups = errors.groupby(["batch", "parameters"])
    counts, origins = groups["recording"].nunique(), groups["origin"].first()
    return [
        {
            "batch": batch,
            "parameters": parameters,
            "origin": ORIGIN[origins[batch, parameters]],
            "count": int(counts[batch, parameters]),
            "values": [_or_none(row.get(c, np.nan)) for c in channels],
        }
        for (batch, parameters), row in table.iterrows()
    ]


def _rows(errors: pd.DataFrame) -> list[dict]:
    return [
        row
        | {"origin": ORIGIN[row["origin"]], "symbol": symbol_of(row["channel"])}
        | {"nrmse_percent": _or_none(row["nrmse_percent"])}
        for row in errors.to_dict("records")
    ]


def _or_none(value: float) -> float | None:
    return None if np.isnan(value) else float(value)


def number(value: float | None) -> str:
    """A number with three digits; a dash for None."""
    return "–" if value is None else f"{value:.3g}"


def interval(of: dict) -> str:
    """Ends of an interval, rounded to a tenth of its standard deviation."""
    if of["sd"] is None or of["low"] is None or of["high"] is None:
        return "not determined"
    return f"{_rounded(of['low'], of['sd'])} to {_rounded(of['high'], of['sd'])}"


def about(of: dict) -> str:
    """Middle of an interval and half its width."""
    if of["sd"] is None or of["low"] is None or of["high"] is None:
        return "not determined"
    reach = (of["high"] - of["low"]) / 2
    return f"{_rounded((of['high'] + of['low']) / 2, of['sd'])} ± {reach:.1g}"


def _rounded(value: float, sd: float) -> str:
    """A value to a tenth of its standard deviation."""
    return f"{value:.{max(1 - int(np.floor(np.log10(sd))), 0)}f}" if sd > 0 else f"{value:.5g}"
