"""A model file -> predicted sensor readings: of a batch's recordings, or of any motion of the drive."""

import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from ccmodel import inputs
from ccmodel.channels import CHANNELS, TENSIONS, THETA_IN
from ccmodel.errors import error_table
from ccmodel.mechanisms import Sensing, laws
from ccmodel.model.files import Model
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import ModelInput, simulate
from ccmodel.progress import Progress, silent
from ccmodel.recording import Recording
from ccmodel.rig.findings import LogError
from ccmodel.rig.readers.content import content_of
from ccmodel.steps.files import longer_rows_refused
from ccmodel.steps.simulate import simulate_each
from ccmodel.typed import InputError

# Share of reading the logs in the time of a prediction.
READING = 0.5
# Share of the samples beyond the range of a learned law that is worth a word. One of a hundred is beyond it in the
# recordings that it was learned from.
BEYOND = 0.05
MOTION = ["time_s", THETA_IN]


def _expected(columns: Sequence[str]) -> str:
    return f"a motion is a CSV with the columns {' and '.join(columns)}"


@dataclass(frozen=True)
class Predicted:
    """Simulations of recordings by a model.

    Attributes
    ----------
    pairs : list of (Recording, Recording)
        Each recording with its simulation.
    failures : list of str
        A line on each recording on which the model cannot be run.
    errors : DataFrame
        Errors of the others (`ccmodel.errors.error_table`).
    notes : list of str
        What of the model lies beyond what it was learned from (`beyond_laws`).
    """

    pairs: list[tuple[Recording, Recording]]
    failures: list[str]
    errors: pd.DataFrame
    notes: list[str]


def predicted(
    recordings: Sequence[Recording], parameters: Parameters, name: str = "model", progress: Progress = silent
) -> Predicted:
    """Predict the sensor readings of recordings, at their times.

    The model is given the drive angle, the readings at rest and, if it has no load law, the load torque.

    Parameters
    ----------
    recordings : sequence of Recording
    parameters : Parameters
    name : str
        Name of the parameters in the table of errors.
    progress : Progress
    """
    pairs, failures = simulate_each(recordings, parameters, progress)
    lines = [f"{recording.batch}/{recording.id}: {error}" for recording, error in failures]
    notes = beyond_laws([simulation for _, simulation in pairs], parameters)
    return Predicted(pairs, lines, error_table(pairs, name), notes)


def beyond_laws(simulations: Sequence[Recording], parameters: Parameters) -> list[str]:
    """A line on each learned law whose argument is often beyond the range that it was learned in."""
    lines = []
    for active in parameters.mechanisms:
        law = laws().get(active.name)
        if law is None or law.has_one_coefficient or law.form.has_elements or not simulations:
            continue
        x = np.concatenate([law.argument.of(_sensing(one, parameters)).ravel() for one in simulations])
        first, last = active.values["first"], active.values["last"]
        if np.mean((x < first) | (x > last)) > BEYOND:
            unit = f" {law.argument.unit}" if law.argument.unit != "1" else ""
            lines.append(
                f"the learned law of {law.argument.meaning} was learned from {first:.3g} to {last:.3g}{unit} and is"
                f" constant beyond; here it is asked from {x.min():.3g} to {x.max():.3g}{unit}"
            )
    return lines


def _sensing(simulation: Recording, parameters: Parameters) -> Sensing:
    channels = {c: simulation[c] for c in (THETA_IN, *CHANNELS, *TENSIONS) if c in simulation}
    return Sensing(simulation.time_s, channels, parameters.drive_radius_m, parameters.load_radius_m)


def simulated_motion(
    motion: pd.DataFrame, parameters: Parameters, like: Recording, pretension_N: float | None = None
) -> Recording:
    """Sensor readings of a rig for a motion of its drive that was not recorded, at the motion's times.

    Parameters
    ----------
    motion : DataFrame
        Columns time_s (s, increasing) and theta_in_rad (rad).
    parameters : Parameters
    like : Recording
        Gives the conduits' path, the far end and the pretension; its samples are not used.
    pretension_N : float, optional
        Pretension of both cables, instead of the nominal one of `like` and of one that was fitted.

    Raises
    ------
    ModelError
        If the model cannot be run.
    """
    if pretension_N is None:
        pretension_N = like.pretension_N
    else:
        parameters = replace(parameters, pretension_N=None)
    time_s, theta_in = (motion[c].to_numpy(float) for c in MOTION)
    return simulate(ModelInput.prescribed(like, time_s, theta_in, pretension_N), parameters)


def conditions_of(
    model: Model, name: str | None, recordings: Sequence[Recording] | None = None, batch: str = "batch"
) -> Recording:
    """The recording with the conduits and the pretension of a simulation, without its samples if the model gives it.

    Parameters
    ----------
    model : Model
    name : str, optional
        Id of the recording; the first if there is none.
    recordings : sequence of Recording, optional
        Of a batch of the rig; otherwise what the model knows of its own.
    batch : str
        The batch in messages.

    Raises
    ------
    InputError
        If neither knows the conduits, or there is no such recording.
    """
    if recordings is None:
        if model.rig is None:
            raise InputError("the model does not state its rig's conduits (its file is an old one): state a batch too")
        return model.rig.recording(name)
    usable = {r.id: r for r in model.placed(recordings)}
    if not usable or (name is not None and name not in usable):
        raise InputError(f"{batch}: no recording {name or ''} that can be used; there is {', '.join(usable) or 'none'}")
    return next(iter(usable.values())) if name is None else usable[name]


def read_motion(file: Path, columns: Sequence[str] = MOTION) -> pd.DataFrame:
    """A motion from a CSV file, that of the drive unless other columns are named.

    Raises
    ------
    InputError
        If the file cannot be used.
    """
    try:
        inputs.check_file(file, inputs.LOG)
        content = content_of(file)
        _check_separator(file, content, columns)
        with longer_rows_refused():
            table = pd.read_csv(
                io.BytesIO(content), skipinitialspace=True, skip_blank_lines=False, low_memory=False, index_col=False
            )
    except LogError as error:
        raise InputError(f"{file}: {error.defect.text}") from None
    except pd.errors.EmptyDataError:
        raise InputError(f"{file}: is empty; {_expected(columns)}") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: {_expected(columns)}; {' '.join(str(error).split())}") from None
    # Blank lines at the end are none of the motion.
    filled = np.flatnonzero(table.notna().any(axis=1))
    return checked_motion(table[: filled[-1] + 1 if filled.size else 0], str(file), 2, columns)


def _check_separator(file: Path, content: bytes, columns: Sequence[str]) -> None:
    """Raise `InputError` if another separator than a comma stands between the columns.

    It is looked for in the first line, since decimal commas would cut the rows below into other numbers of cells.
    """
    head = content.partition(b"\n")[0].decode("utf-8", "replace").replace('"', "")
    for separator, name in ((";", "';'"), ("\t", "tabs")):
        if separator in head and set(columns) & set(head.replace(separator, " ").split()):
            raise InputError(f"{file}: its columns are separated by {name}; use commas, and decimal points in numbers")


def checked_motion(table: pd.DataFrame, source: str, first: int = 0, columns: Sequence[str] = MOTION) -> pd.DataFrame:
    """The columns of a motion, if they are numbers and time increases.

    Parameters
    ----------
    table : DataFrame
    source : str
        What the table is, in messages.
    first : int
        Number of its first row there; the header of a file is row 1.
    columns : sequence of str

    Raises
    ------
    InputError
        With one line on the first fault.
    """
    if missing := [name for name in columns if name not in table]:
        found = ", ".join(map(str, table.columns)) or "none"
        raise InputError(f"{source}: no column {' and no '.join(missing)}; the columns are {found}")
    if table.empty:
        raise InputError(f"{source}: no samples")
    table = table[list(columns)].reset_index(drop=True)
    motion = table.apply(pd.to_numeric, errors="coerce").astype(float)
    faults = {name: np.flatnonzero(~np.isfinite(motion[name])) for name in columns}
    faulty = [(rows[0], name) for name, rows in faults.items() if rows.size]
    if faulty:
        row, name = min(faulty, key=lambda one: one[0])
        value = table[name].iloc[row]
        fault = "is empty" if pd.isna(value) else f"is no finite number: {str(value)!r}"
        raise InputError(f"{source}: row {row + first}: {name} {fault}")
    time_s = motion["time_s"].to_numpy()
    back = np.flatnonzero(np.diff(time_s) <= 0) + 1
    if back.size:
        row = back[0]
        text = f"time_s does not increase: {time_s[row]:g} after {time_s[row - 1]:g}"
        raise InputError(f"{source}: row {row + first}: {text}")
    return motion
