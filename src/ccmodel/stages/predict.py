"""A model and a batch -> what the sensors would read of every recording."""

from pathlib import Path

import pandas as pd

from ccmodel.compare.errors import error_table
from ccmodel.failure import ModelError
from ccmodel.model.files import read_model
from ccmodel.model.run import simulate_recording
from ccmodel.rig.ingest import ingest_batch
from ccmodel.stages.files import write_channels


def predict(batch: Path, model_file: Path, out: Path) -> tuple[list[str], pd.DataFrame]:
    """Write a CSV a recording, at the recording's own times.

    From a recording come the drive angle, what its rest shows and, where the model has no load law, the load: nothing
    else.

    Returns
    -------
    list of str
        A line on each recording for which there is no prediction.
    DataFrame
        Errors of the others (`ccmodel.compare.errors.error_table`).
    """
    parameters = read_model(model_file)
    ingested = ingest_batch(batch)
    said = [str(f) for f in ingested.findings if f.severity == "refused"]
    out.mkdir(parents=True, exist_ok=True)
    predicted = []
    for recording in ingested.recordings:
        try:
            modelled = simulate_recording(recording, parameters)
        except (ModelError, ValueError) as error:
            said.append(f"{recording.batch}/{recording.id}: {error}")
            continue
        write_channels(out / f"{recording.id}.csv", modelled)
        predicted.append((recording, modelled))
    return said, error_table(predicted, model_file.stem)
