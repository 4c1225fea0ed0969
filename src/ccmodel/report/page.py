"""The page of a run: figures, error tables, fits, and what was left out."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined

from ccmodel.config import Config, Study
from ccmodel.recording import CHANNELS, ORIGIN

SYMBOL = {
    "theta_in_rad": "θ_in",
    "theta_out_rad": "θ_out",
    "tau_in_Nm": "τ_in",
    "tau_out_Nm": "τ_out",
    "F_drive_N": "F_drive",
    "F_load_N": "F_load",
    "T1_N": "T1",
    "T2_N": "T2",
    "T3_N": "T3",
    "T4_N": "T4",
}
# Table I of the paper: its fitted model against its own half-loop recording.
PAPER_TABLE_I = {"theta_out_rad": 3.7, "tau_in_Nm": 19.4, "tau_out_Nm": 3.7, "T1_N": 12.8, "T2_N": 4.1, "T3_N": 9.9,
                 "T4_N": 5.5}  # fmt: skip

PHASE_CAPTIONS = {
    "response": "As the paper's Fig. 5: tensions at both ends of cable A (a) and B (b), torques (c), angles (d); and"
    " over time (e, f). Grey: the way from rest into the cycle.",
    "torque-loop": "As the paper's Fig. 6: the torque loop and its phases. I: the load rests; II: one cable moves it"
    " and pulls the other; III: both move it; IV: one hangs slack.",
    "profiles": "As the paper's Fig. 7: tension along the cables at the instants, and halfway through phase II, where"
    " the released cable's tension falls at the drive and rises at the load, with the hump between them.",
}


def write_page(
    file: Path, config: Config, studies: dict[str, Study], batches: Sequence[dict], errors: pd.DataFrame,
    fits: Sequence[dict], diagnoses: Sequence[dict], left_out: Sequence[str], warnings: Sequence[str],
    judged: dict[str, dict],
) -> None:  # fmt: skip
    """Write the page; figures are looked for in `figures/` beside it.

    Parameters
    ----------
    file : Path
    config : Config
    studies : dict of str to Study
        By figure name.
    batches : sequence of dict
        What ingest said of each batch.
    errors : DataFrame
        All errors, with the columns of `ccmodel.compare.errors.COLUMNS`.
    fits, diagnoses : sequence of dict
    left_out, warnings : sequence of str
    judged : dict of str to dict
        Under "claims" and "accuracy" what these steps said, as far as they were asked for.
    """
    environment = Environment(
        loader=PackageLoader("ccmodel.report", "."), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    environment.filters |= {"interval": interval, "about": about, "number": number}
    template = environment.get_template("page.html.j2")
    channels = [c for c in CHANNELS if c in set(errors["channel"])]
    file.write_text(
        template.render(
            headline=_headline(errors),
            origins=sorted({ORIGIN[o] for o in errors["origin"]}),
            recordings=sum(len(b["recordings"]) for b in batches),
            batches=batches,
            phases=config.phases,
            phase_captions=PHASE_CAPTIONS,
            studies={n: (s, config.parameters_of(s)) for n, s in studies.items()},
            symbols=[SYMBOL[c] for c in channels],
            summary=_summary(errors, channels),
            # Table I is for rigs that show what the paper's did; an instrument without load cells is another thing.
            paper=[PAPER_TABLE_I.get(c) for c in channels] if set(PAPER_TABLE_I) <= set(channels) else None,
            simulated_only=set(errors["origin"]) == {"virtual-rig"},
            notes={b["batch"]["batch"]: b["batch"]["note"] for b in batches if b["batch"] and b["batch"].get("note")},
            rows=_rows(errors),
            fits=fits,
            diagnoses=diagnoses,
            left_out=left_out,
            warnings=warnings,
            claims=judged.get("claims"),
            accuracy=judged.get("accuracy"),
            origin=ORIGIN,
        )
    )


def _headline(errors: pd.DataFrame) -> list[str]:
    """A sentence a parameter set: how near the model is, and where it is furthest off."""
    sentences = []
    for parameters, table in errors.dropna(subset="nrmse_percent").groupby("parameters", sort=False):
        means = table.groupby(["batch", "channel"])["nrmse_percent"].mean()
        batch, channel = means.idxmax()
        sentences.append(
            f"With {parameters} parameters the model is off by {table['nrmse_percent'].median():.2g} % of peak to peak"
            f" in the median channel, and furthest in {SYMBOL[channel]} of batch {batch}: {means.max():.2g} %."
        )
    return sentences


def _summary(errors: pd.DataFrame, channels: list[str]) -> list[dict]:
    """A row a batch and parameter set: the mean over its recordings of each channel's normalised error, %."""
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
    rows = errors.to_dict("records")
    return [
        r
        | {"origin": ORIGIN[r["origin"]], "symbol": SYMBOL[r["channel"]], "nrmse_percent": _or_none(r["nrmse_percent"])}
        for r in rows
    ]


def _or_none(value: float) -> float | None:
    return None if np.isnan(value) else float(value)


def number(value: float | None) -> str:
    """Three digits; a dash for what is not known."""
    return "–" if value is None else f"{value:.3g}"


def interval(of: dict) -> str:
    """Ends of an interval, in as many digits as tell them apart."""
    if of["sd"] is None or of["low"] is None or of["high"] is None:
        return "not determined"
    return f"{_rounded(of['low'], of['sd'])} to {_rounded(of['high'], of['sd'])}"


def about(of: dict) -> str:
    """Middle of an interval and its reach."""
    if of["sd"] is None or of["low"] is None or of["high"] is None:
        return "not determined"
    reach = (of["high"] - of["low"]) / 2
    return f"{_rounded((of['high'] + of['low']) / 2, of['sd'])} ± {reach:.1g}"


def _rounded(value: float, sd: float) -> str:
    """A value to a tenth of its standard deviation."""
    return f"{value:.{max(1 - int(np.floor(np.log10(sd))), 0)}f}" if sd > 0 else f"{value:.5g}"
