"""A motion of the drive, a model and the batch that says on which rig -> what the sensors would read."""

from pathlib import Path

import numpy as np
import pandas as pd

from ccmodel.failure import ModelError
from ccmodel.model.files import read_model
from ccmodel.model.run import ModelInput, simulate
from ccmodel.recording import Recording
from ccmodel.rig.ingest import ingest_batch
from ccmodel.stages.files import write_channels
from ccmodel.typed import InputError

COLUMNS = ["time_s", "theta_in_rad"]


def simulate_motion(
    motion_file: Path,
    model_file: Path,
    batch: Path,
    out: Path,
    recording: str | None = None,
    pretension_N: float | None = None,
) -> None:
    """Write what the sensors would read, at the motion's own times.

    Parameters
    ----------
    motion_file : Path
        CSV with time_s (s, increasing) and theta_in_rad (rad).
    model_file, batch, out : Path
        The model, a batch of the rig, and the CSV to write.
    recording : str, optional
        The recording whose conduits and pretension are taken; the first of the batch if none is named.
    pretension_N : float, optional
        Of both cables all along, in place of what was aimed at in that recording.

    Raises
    ------
    InputError
        If a file cannot be used, the batch has no such recording, or the model cannot be run.
    """
    motion, parameters = _motion(motion_file), read_model(model_file)
    like = _recording(batch, recording)
    time_s, theta_in = (motion[c].to_numpy(float) for c in COLUMNS)
    given = ModelInput.prescribed(like, time_s, theta_in, like.pretension_N if pretension_N is None else pretension_N)
    try:
        said = simulate(given, parameters)
    except (ModelError, ValueError) as error:
        raise InputError(f"{motion_file}: {error}") from None
    out.parent.mkdir(parents=True, exist_ok=True)
    write_channels(out, said)


def _recording(batch: Path, name: str | None) -> Recording:
    usable = {r.id: r for r in ingest_batch(batch).recordings}
    if not usable or (name is not None and name not in usable):
        raise InputError(f"{batch}: no recording {name or ''} that can be used; there is {', '.join(usable) or 'none'}")
    return next(iter(usable.values())) if name is None else usable[name]


def _motion(file: Path) -> pd.DataFrame:
    try:
        table = pd.read_csv(file, usecols=COLUMNS, dtype=float)
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: a motion is a CSV with the columns {' and '.join(COLUMNS)}; {error}") from None
    bad = np.flatnonzero(~np.isfinite(table).all(axis=1) | (table["time_s"].diff() <= 0))
    if bad.size:
        raise InputError(f"{file}: line {bad[0] + 2}: both are numbers, and time_s increases from line to line")
    if table.empty:
        raise InputError(f"{file}: no samples")
    return table
