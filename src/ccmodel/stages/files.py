"""What the steps hand to one another: a batch's recordings, its summary, and what a model says of them."""

import json
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from ccmodel.model.files import read_model
from ccmodel.model.parameters import Parameters
from ccmodel.recording import CHANNELS, Recording, read_recordings
from ccmodel.rig.batch import Batch


def read_json(file: Path) -> dict:
    """Content of a JSON file."""
    return json.loads(Path(file).read_text())


def write_json(file: Path, data: dict) -> None:
    """Write plain data for people and programs to read."""
    Path(file).write_text(json.dumps(data, indent=1) + "\n")


def estimates_of(recordings_file: Path) -> Parameters | None:
    """The batch's beforehand estimates, from the summary beside its recordings; None where the batch was refused."""
    batch = read_json(recordings_file.with_suffix(".json"))["batch"]
    return None if batch is None else Parameters.estimated(Batch.model_validate(batch, strict=False).rig)


@dataclass(frozen=True)
class Fitted:
    """What a batch is simulated with.

    Attributes
    ----------
    parameters : Parameters or None
        None where the batch was refused, or no fit or diagnosis came of it.
    sds : dict of str to float
        Standard deviations, as far as they were worked out.
    recordings : list of str
        Names of those it was fitted to.
    """

    parameters: Parameters | None
    sds: dict[str, float] = field(default_factory=dict)
    recordings: list[str] = field(default_factory=list)


def fitted(recordings_file: Path, fit_file: Path | None) -> Fitted:
    """A batch's own estimates, or what a fit or a diagnosis made of them, from the file that it wrote."""
    estimates = estimates_of(recordings_file)
    if fit_file is None or estimates is None:
        return Fitted(estimates)
    said = read_json(fit_file)
    if "parameters" in said:
        return Fitted(read_model(fit_file), recordings=[f"{r.batch}/{r.id}" for r in read_recordings(recordings_file)])
    if not said["succeeded"]:
        return Fitted(None)
    sds = {name: interval["sd"] for name, interval in said.get("intervals", {}).items()}
    return Fitted(estimates.with_values(said["values"]), sds, said["recordings"])


def read_pairs(recordings_file: Path, simulated_file: Path) -> list[tuple[Recording, Recording | None]]:
    """Every recording of a batch with what the model says of it, or None where the model could not be run."""
    simulated = {s.id: s for s in read_recordings(simulated_file)}
    return [(r, simulated.get(r.id)) for r in read_recordings(recordings_file)]


def write_channels(file: Path, recording: Recording) -> None:
    """Write all channels of a run over its times as CSV."""
    table = pd.DataFrame({"time_s": recording.time_s} | {c: recording[c] for c in CHANNELS if c in recording})
    table.to_csv(file, index=False, float_format="%.9g")
