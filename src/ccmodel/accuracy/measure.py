"""Measure a run: bias, scatter and normalised error of every channel, batch and parameter set.

With the error e(t) = simulated - recorded over the last cycle of recording r, as a share of the recording's peak to
peak there, and n recordings of a batch,

    bias_r = mean over t of e,     error_r = root mean square over t of e,
    bias = 1/n sum bias_r,         error = sqrt(1/n sum error_r^2),       scatter = sqrt(error^2 - bias^2).

The error therefore contains the other two: a model that errs more has more bias, more scatter or both.
"""

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Self

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from ccmodel.channels import CHANNELS
from ccmodel.errors import error_table
from ccmodel.failure import ModelError
from ccmodel.model.model_input import ModelInput
from ccmodel.model.run import simulate
from ccmodel.recording import read_provenance
from ccmodel.steps.files import Fitted, Pair, fitted, read_json, read_pairs
from ccmodel.typed import LARGEST, OneOf, TypedModel

# A parameter set that no verdict accepts is not watched.
NOT_ACCEPTED = ("nearest",)
DIGITS = 5
# Beginning and end of what is compared of a recording, s, and its samples.
Window = Annotated[list[float], Field(min_length=3, max_length=3)]


@dataclass(frozen=True)
class Simulated:
    """A batch that was simulated with a parameter set, in files.

    Attributes
    ----------
    rig : str
        Rig of the batch.
    parameters : str
        Name of the parameter set.
    recordings, simulated : Path
        Recordings and simulations (netCDF).
    fit : Path or None
        The set's fit or model (JSON); next to a model stands its diagnosis. None for the batch's own estimates.
    """

    rig: str
    parameters: str
    recordings: Path
    simulated: Path
    fit: Path | None = None


class ChannelAccuracy(TypedModel):
    """Errors of one channel of a batch with one parameter set, % of peak to peak; None where it was not recorded."""

    accepted: dict[str, list[float | None]] = Field(
        default_factory=dict,
        description="in a baseline, for readers: bias, scatter and error, each with the interval that holds it if the"
        " batch is recorded again",
    )
    biases: list[float | None] = Field(description="bias_r, in the order of the batch's recordings")
    errors: list[float | None] = Field(description="error_r, in the same order")
    fit_sd: float = Field(
        0.0, ge=0.0, lt=LARGEST, description="relative standard deviation of the error due to the fit's uncertainty"
    )

    @property
    def bias(self) -> float:
        """Mean of the recordings' biases."""
        return float(np.mean(_numbers(self.biases)))

    @property
    def error(self) -> float:
        """Root mean square of the recordings' errors."""
        return float(np.sqrt(np.mean(_numbers(self.errors) ** 2)))

    @property
    def scatter(self) -> float:
        """Standard deviation of all errors about the bias."""
        return float(np.sqrt(max(self.error**2 - self.bias**2, 0.0)))


class SetAccuracy(TypedModel):
    """Accuracy of one parameter set on a batch."""

    fitted_to: list[str] = Field(description="batches that the set was fitted to")
    channels: dict[Annotated[str, OneOf(CHANNELS)], ChannelAccuracy]


class BatchAccuracy(TypedModel):
    """Accuracy of all parameter sets on a batch."""

    rig: str
    origin: str = Field(description="origin of the recordings, as in batch.yaml")
    digest: str = Field(description="digest of the batch's raw files")
    verdict: str | None = Field(None, description="verdict of its diagnosis and what it names; None: not diagnosed")
    recordings: dict[str, Window] = Field(description="what is compared of each recording: from s, to s, samples")
    sets: dict[str, SetAccuracy]

    @model_validator(mode="after")
    def _a_number_for_each_recording(self) -> Self:
        for one in (channel for of in self.sets.values() for channel in of.channels.values()):
            if not len(one.biases) == len(one.errors) == len(self.recordings):
                raise ValueError("biases and errors have a number for each of the batch's recordings")
            errors = _numbers(one.errors)
            if not errors.size or not np.all((errors > 0.0) & (errors < LARGEST)):
                raise ValueError("at least one recording has an error, and an error is a positive number")
        return self


Batches = dict[str, BatchAccuracy]


def measure(runs: Iterable[Simulated], for_comparison: bool = True) -> Batches:
    """Accuracy of every batch and parameter set of a run; a set without a simulation is left out.

    Parameters
    ----------
    runs : iterable of Simulated
    for_comparison : bool
        Whether to add what a comparison needs besides the errors: the digest of the raw files, and the uncertainty of
        fits, run through the model (`ChannelAccuracy.fit_sd`).
    """
    by_batch: dict[str, list[Simulated]] = {}
    for run in runs:
        by_batch.setdefault(run.recordings.stem, []).append(run)
    measured = {batch: _batch(of_batch, for_comparison) for batch, of_batch in by_batch.items()}
    return {batch: accuracy for batch, accuracy in measured.items() if accuracy.sets}


def _batch(runs: Sequence[Simulated], for_comparison: bool) -> BatchAccuracy:
    recordings: dict[str, list[float]] = {}
    sets: dict[str, SetAccuracy] = {}
    origin = ""
    for run in runs:
        pairs = read_pairs(run.recordings, run.simulated)
        table = error_table(pairs, run.parameters).dropna(subset="nrmse_percent")
        if table.empty:
            continue
        origin = table["origin"].iloc[0]
        recordings = recordings or {recorded.id: [0.0, 0.0, 0.0] for recorded, _ in pairs}
        for row in table.itertuples():
            recordings[row.recording] = [round(row.window_from_s, 4), round(row.window_to_s, 4), float(row.samples)]
        known = fitted(run.recordings, run.fit) if for_comparison else Fitted(None)
        fit_sds = _fit_sds(pairs, known, table)
        sets[run.parameters] = SetAccuracy(
            fitted_to=sorted({name.partition("/")[0] for name in known.recordings}),
            channels={
                channel: _channel(rows.set_index("recording"), list(recordings), fit_sds.get(channel, 0.0))
                for channel, rows in table.groupby("channel", sort=False)
            },
        )
    verdicts = [verdict for run in runs if (verdict := _verdict(run.fit)) is not None]
    return BatchAccuracy(
        rig=runs[0].rig,
        origin=origin,
        digest=_digest(runs[0].recordings) if for_comparison else "",
        verdict=next(iter(verdicts), None),
        recordings=recordings,
        sets=sets,
    )


def _channel(rows: pd.DataFrame, recordings: Sequence[str], fit_sd: float) -> ChannelAccuracy:
    """Numbers in the order of the recordings, rounded so that a file of them can be read and compared."""
    biases = (100 * rows["bias"] / rows["peak_to_peak"]).reindex(recordings)
    errors = rows["nrmse_percent"].reindex(recordings)
    return ChannelAccuracy(biases=_rounded(biases), errors=_rounded(errors), fit_sd=_round(fit_sd, 3))


def _rounded(values: Iterable[float], digits: int = DIGITS) -> list[float | None]:
    return [None if np.isnan(value) else _round(value, digits) for value in values]


def _round(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")


def _numbers(values: Iterable[float | None]) -> np.ndarray:
    return np.array([value for value in values if value is not None])


def _fit_sds(pairs: Sequence[Pair], known: Fitted, table: pd.DataFrame) -> dict[str, float]:
    """By channel, the relative change of the error if a fitted parameter is larger by its standard deviation.

    The changes of several parameters are added in squares. A parameter that the recordings do not determine, or with
    which the model cannot be run, is left out, and so is a channel's change to or from an error of zero.
    """
    sds = {name: sd for name, sd in known.sds.items() if np.isfinite(sd)}
    if not sds or known.parameters is None:
        return {}
    given = [(recorded, ModelInput.of(recorded)) for recorded, simulated in pairs if simulated is not None]
    squares: dict[str, float] = {}
    for name, sd in sds.items():
        shifted = known.parameters.with_values({name: known.parameters.value_of(name) + sd})
        try:
            moved = error_table([(recorded, simulate(one, shifted)) for recorded, one in given], "")
        except (ModelError, ValueError):
            continue
        change = np.log(_error_by_channel(moved) / _error_by_channel(table))
        for channel, value in change.items():
            if np.isfinite(value):
                squares[channel] = squares.get(channel, 0.0) + value**2
    return {channel: float(np.sqrt(square)) for channel, square in squares.items()}


def _error_by_channel(table: pd.DataFrame) -> pd.Series:
    return np.sqrt((table["nrmse_percent"] ** 2).groupby(table["channel"]).mean())


def _verdict(fit: Path | None) -> str | None:
    """Verdict of a diagnosis with the mechanisms it names; None if the parameters are no diagnosis's."""
    file = None if fit is None else fit.with_name("diagnosis.json")
    if file is None or not file.exists():
        return None
    content = read_json(file)
    if content["verdict"] is None:
        return "not diagnosed"
    named = ", ".join(f"{m['name']} at {m['place']}" for m in content["mechanisms"])
    return f"{content['verdict']}: {named}" if named else content["verdict"]


def _digest(recordings: Path) -> str:
    """Digest of the raw files that a batch's recordings were read from."""
    text = json.dumps(read_provenance(recordings)["sha256"], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]
