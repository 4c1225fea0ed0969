"""A model file -> predicted sensor readings: of a batch's recordings, or of any motion of the drive."""

from pathlib import Path

import numpy as np
import pandas as pd

from ccmodel.channels import THETA_IN
from ccmodel.errors import error_table
from ccmodel.failure import ModelError
from ccmodel.model.files import read_model
from ccmodel.model.run import ModelInput, simulate
from ccmodel.progress import Progress, silent, within
from ccmodel.recording import Recording
from ccmodel.rig.ingest import ingest_batch
from ccmodel.steps.files import write_channels
from ccmodel.steps.simulate import simulate_each
from ccmodel.typed import InputError

# Share of reading the logs in the time of a prediction.
READING = 0.5
MOTION = ["time_s", THETA_IN]


def predict(batch: Path, model_file: Path, out: Path, progress: Progress = silent) -> tuple[list[str], pd.DataFrame]:
    """Write a CSV for each recording of a batch folder: the sensor readings by a model file, at the recording's times.

    The model is given the drive angle, the readings at rest and, if it has no load law, the load torque.

    Returns
    -------
    list of str
        A line on each recording without a prediction.
    DataFrame
        Errors of the others (`ccmodel.errors.error_table`).
    """
    parameters, ingested = read_model(model_file), ingest_batch(batch, within(progress, 0.0, READING))
    messages = [str(f) for f in ingested.findings if f.severity == "refused"]
    pairs, failures = simulate_each(ingested.recordings, parameters, within(progress, READING, 1.0))
    messages += [f"{recording.batch}/{recording.id}: {error}" for recording, error in failures]
    out.mkdir(parents=True, exist_ok=True)
    for recording, simulated in pairs:
        write_channels(out / f"{recording.id}.csv", simulated)
    return messages, error_table(pairs, model_file.stem)


def simulate_motion(
    motion_file: Path,
    model_file: Path,
    batch: Path,
    out: Path,
    recording: str | None = None,
    pretension_N: float | None = None,
) -> None:
    """Write the sensor readings for a given motion of the drive, at the motion's times.

    Parameters
    ----------
    motion_file : Path
        CSV with time_s (s, increasing) and theta_in_rad (rad).
    model_file, batch, out : Path
        The model, a batch of the rig, and the CSV to write.
    recording : str, optional
        Recording whose conduits and pretension are used; the first of the batch if none is named.
    pretension_N : float, optional
        Pretension of both cables, instead of the nominal one of that recording.

    Raises
    ------
    InputError
        If a file cannot be used, the batch has no such recording, or the model cannot be run.
    """
    motion, parameters = _motion(motion_file), read_model(model_file)
    like = _recording(batch, recording)
    time_s, theta_in = (motion[c].to_numpy(float) for c in MOTION)
    given = ModelInput.prescribed(like, time_s, theta_in, like.pretension_N if pretension_N is None else pretension_N)
    try:
        simulated = simulate(given, parameters)
    except (ModelError, ValueError) as error:
        raise InputError(f"{motion_file}: {error}") from None
    out.parent.mkdir(parents=True, exist_ok=True)
    write_channels(out, simulated)


def _recording(batch: Path, name: str | None) -> Recording:
    usable = {r.id: r for r in ingest_batch(batch).recordings}
    if not usable or (name is not None and name not in usable):
        raise InputError(f"{batch}: no recording {name or ''} that can be used; there is {', '.join(usable) or 'none'}")
    return next(iter(usable.values())) if name is None else usable[name]


def _motion(file: Path) -> pd.DataFrame:
    try:
        table = pd.read_csv(file, usecols=MOTION, dtype=float)
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: a motion is a CSV with the columns {' and '.join(MOTION)}; {error}") from None
    bad = np.flatnonzero(~np.isfinite(table).all(axis=1) | (table["time_s"].diff() <= 0))
    if bad.size:
        raise InputError(f"{file}: line {bad[0] + 2}: both are numbers, and time_s increases from line to line")
    if table.empty:
        raise InputError(f"{file}: no samples")
    return table
