"""The page of a run: errors, the parts of the studies, fits, and the recordings that were left out."""

from collections.abc import Iterable, Mapping, Sequence
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


def write_report(
    page_file: Path, inputs: Mapping[str, Sequence[str]], studies: Sequence[dict], raw: Path, unusable: Sequence[str]
) -> None:
    """Write the page, and next to it the messages on what was left out (left-out.json).

    Parameters
    ----------
    page_file : Path
        The page, in the folder of all results.
    inputs : mapping of str to sequence of str
        JSON files: ``summaries`` of the ingested batches, ``fits``, ``simulations``, ``diagnoses``; and ``errors``, the
        table of errors (Parquet).
    studies : sequence of dict
        ``kind``, ``name``, ``heading``, ``settings``, ``parameters`` of each, and its JSON file, if any: ``summary``.
    raw : Path
        Folder of the batches, with an importer's findings.json if any.
    unusable : sequence of str
        Messages on folders that cannot be a batch.
    """
    batches, fits, simulations = ([read_json(f) for f in inputs[k]] for k in ("summaries", "fits", "simulations"))
    messages = _messages(raw, unusable, batches, fits, simulations)
    write_json(page_file.parent / LEFT_OUT, messages)
    diagnoses = [{"kind": "diagnosis", "heading": "Diagnoses", "summary": f} for f in inputs["diagnoses"]]
    parts = [p | {"summary": read_json(p["summary"])} if "summary" in p else p for p in (*diagnoses, *studies)]
    write_page(page_file, parts, batches, pd.read_parquet(inputs["errors"]), fits, messages)


def _messages(
    raw: Path, unusable: Sequence[str], batches: Sequence[dict], fits: Sequence[dict], simulations: Sequence[dict]
) -> dict[str, list[str]]:
    """Lines on input that was left out, and on input that was used with a warning."""
    imported = raw / "findings.json"
    findings = [Finding(**f) for f in (read_json(imported) if imported.exists() else [])]
    findings += [Finding(**f) for batch in batches for f in batch["findings"]]
    failures = [line for simulation in simulations for line in simulation["failures"]]
    left_out = [
        *unusable,
        *(str(f) for f in findings if f.severity == "refused"),
        *(f"fit {f['fit']}: {f['message']}" for f in fits if not f["succeeded"]),
        # A recording fails with every parameter set; one message is enough.
        *dict.fromkeys(f"not simulated: {line}" for line in failures),
    ]
    return {"left_out": left_out, "warnings": [str(f) for f in findings if f.severity == "warning"]}


def left_out_of(results: Path) -> dict[str, list[str]]:
    """Messages of the last run into a results folder: ``left_out`` and ``warnings``.

    Raises
    ------
    InputError
        If no run has finished there.
    """
    file = results / LEFT_OUT
    if not file.exists():
        raise InputError(f"{file}: not there, so no run came to its end; its own messages say why")
    return read_json(file)


def write_page(
    file: Path, parts: Iterable[dict], batches: Sequence[dict], errors: pd.DataFrame, fits: Sequence[dict],
    messages: dict[str, list[str]],
) -> None:  # fmt: skip
    """Write the page; it refers to the figures in `figures/` next to it.

    Parameters
    ----------
    file : Path
    parts : iterable of dict
        Studies in the order of the page, as in `write_report`, with the content of their ``summary``. The template
        ``studies/<kind>/part.html.j2`` shows all parts of a kind.
    batches : sequence of dict
        Summaries of the ingested batches.
    errors : DataFrame
        All errors, with the columns of `ccmodel.errors.COLUMNS`.
    fits : sequence of dict
    messages : dict of str to list of str
        As `left_out_of` reads them.
    """
    environment = Environment(
        loader=PackageLoader("ccmodel", "."), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    environment.filters |= {shown.__name__: shown for shown in (interval, about, number, two_decimals, symbol_of)}
    channels = [c for c in CHANNELS if c in set(errors["channel"])]
    sections: dict[str, list[dict]] = {}
    for part in parts:
        sections.setdefault(part["kind"], []).append(part)
    text = environment.get_template("report/page.html.j2").render(
        headline=_headline(errors),
        origins=sorted({ORIGIN[o] for o in errors["origin"]}),
        origin=ORIGIN,
        recordings=sum(len(b["recordings"]) for b in batches),
        batches=batches,
        sections=sections,
        channels=channels,
        summary=_summary(errors, channels),
        # The row of Table I is for rigs that record its channels; an instrument without load cells does not.
        paper=[PAPER_TABLE_I.get(c) for c in channels] if set(PAPER_TABLE_I) <= set(channels) else None,
        simulated_only=set(errors["origin"]) == {"virtual-rig"},
        notes={b["batch"]["batch"]: b["batch"]["note"] for b in batches if b["batch"] and b["batch"].get("note")},
        rows=errors.to_dict("records"),
        fits=fits,
        **messages,
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
    groups = ["batch", "parameters"]
    table = errors.pivot_table("nrmse_percent", groups, "channel").reindex(columns=channels)
    counted = errors.groupby(groups).agg(origin=("origin", "first"), count=("recording", "nunique"))
    return table.join(counted).reset_index().to_dict("records")


def two_decimals(value: float) -> str:
    """A number with two decimals; a dash for NaN."""
    return "–" if np.isnan(value) else f"{value:.2f}"


def number(value: float | None) -> str:
    """A number with three digits; a dash for None."""
    return "–" if value is None else f"{value:.3g}"


def interval(of: dict) -> str:
    """Ends of an interval, rounded to a tenth of its standard deviation."""
    if None in of.values():
        return "not determined"
    return f"{_rounded(of['low'], of['sd'])} to {_rounded(of['high'], of['sd'])}"


def about(of: dict) -> str:
    """Middle of an interval and half its width."""
    if None in of.values():
        return "not determined"
    reach = (of["high"] - of["low"]) / 2
    return f"{_rounded((of['high'] + of['low']) / 2, of['sd'])} ± {reach:.1g}"


def _rounded(value: float, sd: float) -> str:
    """A value to a tenth of its standard deviation."""
    return f"{value:.{max(1 - int(np.floor(np.log10(sd))), 0)}f}" if sd > 0 else f"{value:.5g}"
