"""What the steps hand to one another: a batch's recordings, its summary, and what a model says of them."""

import json
from pathlib import Path

from ccmodel.model.parameters import Parameters
from ccmodel.recording import Recording, read_recordings
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


def read_pairs(recordings_file: Path, simulated_file: Path) -> list[tuple[Recording, Recording | None]]:
    """Every recording of a batch with what the model says of it, or None where the model could not be run."""
    simulated = {s.id: s for s in read_recordings(simulated_file)}
    return [(r, simulated.get(r.id)) for r in read_recordings(recordings_file)]
