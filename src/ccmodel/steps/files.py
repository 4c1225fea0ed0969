"""Files that the steps exchange: recordings of a batch, its summary, fits and simulations."""

import json
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from math import inf
from pathlib import Path

import pandas as pd

from ccmodel.model.files import read_model_file
from ccmodel.model.parameters import Parameters, mechanism_key
from ccmodel.outputs import new_file
from ccmodel.recording import Recording, read_recordings
from ccmodel.rig.batch import Batch

# A recording and its simulation; None where the model could not be run.
Pair = tuple[Recording, Recording | None]


def read_json(file: Path) -> dict:
    """Content of a JSON file."""
    return json.loads(Path(file).read_text())


def write_json(file: Path, data: dict) -> None:
    """Write plain data as JSON."""
    with new_file(file) as fresh:
        fresh.write_text(json.dumps(data, indent=1) + "\n")


def estimates_of(recordings_file: Path) -> Parameters | None:
    """The batch's own estimates, from the summary next to its recordings; None for a refused batch."""
    batch = read_json(recordings_file.with_suffix(".json"))["batch"]
    return None if batch is None else Parameters.estimated(Batch.model_validate(batch, strict=False).rig)


@dataclass(frozen=True)
class Fitted:
    """Parameters that a batch is simulated with.

    Attributes
    ----------
    parameters : Parameters or None
        None for a refused batch, a failed fit or a batch that could not be diagnosed.
    sds : dict of str to float
        Standard deviations of the fitted parameters; infinite where the file states none, as of a parameter that the
        recordings do not determine.
    recordings : list of str
        Names (batch/id) of the recordings that they were fitted to.
    """

    parameters: Parameters | None
    sds: dict[str, float] = field(default_factory=dict)
    recordings: list[str] = field(default_factory=list)


def fitted(recordings_file: Path, fit_file: Path | None) -> Fitted:
    """A batch's own estimates, or the parameters in the file of a fit or a diagnosis."""
    estimates = estimates_of(recordings_file)
    if fit_file is None or estimates is None:
        return Fitted(estimates)
    result = read_json(fit_file)
    if "parameters" in result:
        file = read_model_file(fit_file)
        model = file.parameters
        names = [f.name for f in fields(model) if getattr(model, f.name) != getattr(estimates, f.name)]
        known = {"mechanisms", "session_start_s", "session_end_s"}
        sds = dict.fromkeys([name for name in names if name not in known], inf)
        sds |= {mechanism_key(m.name, m.place, name): inf for m in model.mechanisms for name in m.values}
        sds |= {name: one["sd"] for name, one in file.intervals.items() if one["sd"] is not None}
        return Fitted(model, sds, [f"{r.batch}/{r.id}" for r in read_recordings(recordings_file)])
    if not result["succeeded"]:
        return Fitted(None)
    intervals = result.get("intervals", {})
    sds = {name: inf if one["sd"] is None else one["sd"] for name, one in intervals.items()}
    return Fitted(estimates.with_values(result["values"]), sds, result["recordings"])


def read_pairs(recordings_file: Path, simulated_file: Path) -> list[Pair]:
    """Every recording of a batch with its simulation."""
    simulated = {s.id: s for s in read_recordings(simulated_file)}
    return [(r, simulated.get(r.id)) for r in read_recordings(recordings_file)]


@contextmanager
def longer_rows_refused() -> Iterator[None]:
    """Raise `ValueError` where a CSV that pandas reads has rows with more cells than its header.

    Their first cells would be taken for an index, and all columns be shifted.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error", pd.errors.ParserWarning)
        try:
            yield
        except pd.errors.ParserWarning:
            raise ValueError("its rows have more cells than its header") from None


def write_table(file: Path, table: pd.DataFrame, digits: int = 6) -> None:
    """Write a table as CSV. Times have nine decimals: on the clock of a log they may be seconds since 1970."""
    if "time_s" in table:
        table = table.assign(time_s=[f"{t:.9f}".rstrip("0").rstrip(".") for t in table["time_s"]])
    with new_file(file) as fresh:
        table.to_csv(fresh, index=False, float_format=f"%.{digits}g")


def write_channels(file: Path, recording: Recording) -> None:
    """Write all channels over time as CSV."""
    write_table(file, recording.to_frame().reset_index(), digits=9)
