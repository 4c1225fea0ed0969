"""Models in use: simulations of motions, predictions of recordings."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from html import escape
from math import inf
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeAlias, runtime_checkable

import pandas as pd
import xarray as xr

from ccmodel.api.batch import Batch, as_batch
from ccmodel.api.options import progress_of
from ccmodel.api.recordings import Recordings, counted
from ccmodel.failure import ModelError
from ccmodel.model.files import Model, read_model_file
from ccmodel.outputs import new_files
from ccmodel.paths import existing_file, try_file, try_folder
from ccmodel.progress import Progress, within
from ccmodel.recording import Recording
from ccmodel.rig.findings import Finding
from ccmodel.steps.files import write_channels
from ccmodel.steps.predict import (
    MOTION,
    READING,
    checked_motion,
    conditions_of,
    predicted,
    read_motion,
    simulated_motion,
)
from ccmodel.typed import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Model", "Motion", "Prediction", "predict", "read_model", "simulate"]

Motion: TypeAlias = pd.DataFrame | xr.Dataset | Recording | str | Path


@runtime_checkable
class HasModel(Protocol):
    """A fit or a diagnosis, which stands for its model."""

    @property
    def model(self) -> Model | None:
        """Its model, if there is one."""


@dataclass(frozen=True, eq=False, repr=False)
class Prediction(Recordings):
    """Sensor readings of a batch's recordings, predicted by a model.

    Attributes
    ----------
    recordings : tuple of Recording
        The simulations; ``prediction["id"]`` is that of one recording.
    errors : DataFrame
        A row for each recording and channel: ``bias`` (mean of simulated minus recorded) and ``rmse`` over the last
        cycle in ``unit``, ``nrmse_percent`` over the recording's peak to peak in that cycle.
    left_out : tuple of str
        A line on each recording without a prediction.
    findings : tuple of Finding
        Faults and contradictions of the batch, which is used all the same; ``str(finding)`` says where and what.
    notes : tuple of str
        A line on each learned law of the model whose argument is beyond the range that it was learned in.
    """

    recordings: tuple[Recording, ...]
    errors: pd.DataFrame
    left_out: tuple[str, ...]
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]
    # What was predicted, in the order of `recordings`.
    _recorded: tuple[Recording, ...]
    # Ids of all recordings of the batch.
    _stated: tuple[str, ...]

    @property
    def table(self) -> pd.DataFrame:
        """Root mean square error over the last cycle in % of peak to peak: recordings by channels."""
        by_channel = self.errors.pivot(index="recording", columns="channel", values="nrmse_percent")
        return by_channel[self.errors["channel"].unique()].rename_axis(columns=None)

    def plot(self, channel: str | None = None, recording: str | None = None) -> "Figure":
        """Recorded and predicted channels over time: a row for each channel, a column for each recording.

        Parameters
        ----------
        channel : str, optional
            One channel alone, as ``tau_in_Nm``; without it, every angle, torque and sum of tensions that was not given
            to the model.
        recording : str, optional
            Id of one recording alone; without it, the first six.

        Raises
        ------
        InputError
            If there is no such recording, or it has no such channel.
        """
        from ccmodel.api import figures

        shown = self.recordings if recording is None else (self[recording],)
        if not shown:
            raise InputError("no recording has a prediction")
        pairs = [pair for pair in zip(self._recorded, self.recordings, strict=True) if pair[1] in shown]
        return figures.compared(pairs, channel)

    def save(self, folder: str | Path) -> None:
        """Write a CSV for each recording, as ``ccmodel predict --out`` does: its id, all channels over time.

        An earlier one of a recording that has no prediction now is removed.

        Raises
        ------
        InputError
            If the folder cannot be made or written to.
        """
        with new_files(folder, without=[f"{id}.csv" for id in self._stated]) as path:
            for recording in self.recordings:
                write_channels(path / f"{recording.id}.csv", recording)

    def __repr__(self) -> str:
        table = self.table.to_string(float_format="{:.2f}".format)
        return "\n".join([self._title, table, *self.left_out, *self.notes])

    def _repr_html_(self) -> str:
        table = self.table.to_html(float_format="{:.2f}".format, border=0)
        lines = "".join(f"<li>{escape(line)}</li>" for line in (*self.left_out, *self.notes))
        return f"<p>{self._title}</p>{table}{f'<ul>{lines}</ul>' if lines else ''}"

    @property
    def _title(self) -> str:
        return f"Prediction of {counted(len(self))}: error over the last cycle, % of peak to peak"


def read_model(file: str | Path) -> Model:
    """Read a model file, as a fit, a diagnosis or the pipeline writes it.

    Parameters
    ----------
    file : str or Path

    Returns
    -------
    Model

    Raises
    ------
    InputError
        With one line on the file's fault.

    Examples
    --------
    >>> import ccmodel as cc
    >>> fit = cc.fit("data/raw/half-loop")
    >>> fit.save(folder / "fit.json")
    >>> model = cc.read_model(folder / "fit.json")
    >>> model.parameters == fit.model.parameters
    True
    >>> model.rig.batch, [condition.recording for condition in model.rig.conditions]
    ('half-loop', ['half-loop-7.3N-a', 'half-loop-7.3N-b'])
    """
    return read_model_file(existing_file(file))


def predict(
    model: Model | HasModel | str | Path,
    batch: Batch | str | Path,
    out: str | Path | None = None,
    *,
    progress: bool | Progress = False,
) -> Prediction:
    """Predict the sensor readings of a batch's recordings by a model.

    The model is given the drive angle, the readings at rest and, if it has no load law, the load torque.

    Parameters
    ----------
    model : Model, Fit, Diagnosis, str or Path
        A model, what has one, or its file.
    batch : Batch, str or Path
        A batch, or its folder.
    out : str or Path, optional
        Folder for the predictions, a CSV for each recording; `Prediction.save` writes them later.
    progress : bool or callable
        True shows progress; a callable gets ``(text, share of the work done)``.

    Returns
    -------
    Prediction
        The simulations with their errors.

    Raises
    ------
    InputError
        If the model file or the batch cannot be used, or `out` cannot be written.

    Examples
    --------
    >>> import ccmodel as cc
    >>> batch = cc.load("data/raw/half-loop")
    >>> prediction = cc.predict(cc.fit(batch).model, batch)
    >>> prediction.table[["theta_out_rad", "tau_out_Nm"]]
                      theta_out_rad  tau_out_Nm
    recording
    half-loop-7.3N-a           ...          ...
    half-loop-7.3N-b           ...          ...
    """
    known = as_model(model)
    if out is not None:
        try_folder(out)
    with progress_of(progress) as report:
        batch = as_batch(batch, within(report, 0.0, READING))
        check_same_rig(known, batch)
        name = Path(model).stem if isinstance(model, str | Path) else "model"
        found = predicted(known.placed(batch.recordings), known.parameters, name, within(report, READING, 1.0))
    refused, others = sorted_findings(batch)
    recorded, simulations = (tuple(pair[i] for pair in found.pairs) for i in (0, 1))
    left_out = (*refused, *found.failures)
    notes, stated = tuple(found.notes), stated_ids(batch)
    prediction = Prediction(simulations, found.errors, left_out, others, notes, recorded, stated)
    if out is not None:
        prediction.save(out)
    return prediction


def simulate(
    model: Model | HasModel | str | Path,
    motion: Motion,
    *,
    recording: str | None = None,
    batch: Batch | str | Path | None = None,
    pretension_N: float | None = None,
    out: str | Path | None = None,
    progress: bool | Progress = False,
) -> Recording:
    """Simulate the sensor readings of a rig for a motion of its drive, by a model.

    The drive angle is zero where both cables have the pretension, evenly along their length. A motion that begins
    elsewhere begins with a step from zero to its first angle. The load angle is zero before the first sample.

    All channels are readings of sensors. As in a recording, ``T1_N`` to ``T4_N`` follow from torques and sums of
    tensions: T1 and T3 are ``F_drive_N`` / 2 plus and minus ``tau_in_Nm`` over twice the pulley's radius, T2 and T4 the
    same at the load. Where the model has friction of a drive pulley, the torque contains it, and T1 and T3 are not the
    cables' tensions; those are seen with ``model.without("pulley-friction")``, since the drive's motion is prescribed.

    Parameters
    ----------
    model : Model, Fit, Diagnosis, str or Path
        A model, what has one, or its file. The load of the rig has to be a spring.
    motion : DataFrame, xarray Dataset, Recording, str or Path
        ``time_s`` (s, increasing) and ``theta_in_rad`` (rad), as columns, as the index, in a CSV file, or as recorded.
    recording : str, optional
        Id of the recording whose conduits and pretension are used; without it, the first that the model was fitted to.
    batch : Batch, str or Path, optional
        Batch with that recording. A model file that was written before models knew their rig needs it.
    pretension_N : float, optional
        Pretension of both cables, N, instead of that recording's.
    out : str or Path, optional
        CSV file for the readings.
    progress : bool or callable
        True shows progress; a callable gets ``(text, share of the work done)``.

    Returns
    -------
    Recording
        Of origin "model", at the motion's times; ``to_frame()`` gives its channels.

    Raises
    ------
    InputError
        If an input cannot be used, the model cannot be run on it, or `out` cannot be written.

    Examples
    --------
    >>> import ccmodel as cc
    >>> import numpy as np, pandas as pd
    >>> time_s = np.arange(0, 2, 0.004)
    >>> motion = pd.DataFrame({"time_s": time_s, "theta_in_rad": 0.5 * np.sin(2 * np.pi * time_s)})
    >>> model = cc.fit("data/raw/half-loop").model
    >>> readings = cc.simulate(model, motion, pretension_N=7.0)
    >>> readings.to_frame().loc[0.0, ["T1_N", "T2_N", "T3_N", "T4_N"]].tolist()
    [7.0, 7.0, 7.0, 7.0]
    """
    known = as_model(model)
    table, source = as_motion(motion)
    if pretension_N is not None and not (isinstance(pretension_N, Real) and 0 <= pretension_N < inf):
        raise InputError(f"pretension_N: a tension that is not negative, N; got {pretension_N!r}")
    if out is not None:
        try_file(out, read=files_among(model, motion))
    with progress_of(progress) as report:
        of_rig = None if batch is None else as_batch(batch, within(report, 0.0, READING))
        if of_rig is None:
            like = conditions_of(known, recording)
        else:
            like = conditions_of(known, recording, of_rig.recordings, of_rig.name)
        report("simulating the motion", READING)
        try:
            simulated = simulated_motion(table, known.parameters, like, pretension_N)
        except (ModelError, ValueError) as error:
            raise InputError(f"{source}: {error}") from None
    if out is not None:
        write_channels(Path(out), simulated)
    return simulated


def check_same_rig(model: Model, batch: Batch) -> None:
    """Check that a batch can be used, and that a model of its rig's kind was given.

    Raises
    ------
    InputError
        If no recording can be used, or one of the two is a pair of cables and the other a single one.
    """
    batch._ingested.check_usable(batch.folder)
    if model.rig is None:
        return
    of_model, of_batch = (
        "a single cable" if end else "a pair of cables" for end in (model.rig.far_end, batch.recordings[0].far_end)
    )
    if of_model != of_batch:
        raise InputError(f"{batch.folder}: is of {of_batch}, and the model is of {of_model}")


def sorted_findings(batch: Batch) -> tuple[list[str], tuple[Finding, ...]]:
    """Lines on what a batch's files are refused for, and its other findings."""
    refused = [str(f) for f in batch.findings if f.is_refused]
    return refused, tuple(f for f in batch.findings if not f.is_refused)


def stated_ids(batch: Batch) -> tuple[str, ...]:
    """Ids of all recordings in a batch's file, the refused ones included."""
    return tuple(entry.id for entry in batch._file.recordings)


def files_among(*given: object) -> list[str | Path]:
    """Those of the arguments that name a file."""
    return [one for one in given if isinstance(one, str | Path)]


def as_model(given: Model | HasModel | str | Path) -> Model:
    """A model, that of a fit or a diagnosis, or the one in a file.

    Raises
    ------
    InputError
        If it is none of these, or the diagnosis has no model.
    """
    if isinstance(given, Model):
        return given
    if isinstance(given, str | Path):
        return read_model(given)
    if not isinstance(given, HasModel):
        expected = "a Model, a Fit, a Diagnosis or a model file comes first"
        raise InputError(f"model: {expected}; got {'None' if given is None else type(given).__name__}")
    if given.model is None:
        raise InputError(f"model: no model was fitted. {'; '.join(repr(given).splitlines()[:2])}")
    return given.model


def as_motion(motion: Motion, name: str = "motion", columns: Sequence[str] = MOTION) -> tuple[pd.DataFrame, str]:
    """A motion as a checked table, and what it is called in messages.

    Parameters
    ----------
    motion : DataFrame, xarray Dataset, Recording, str or Path
    name : str
        Of the argument.
    columns : sequence of str
        Time and angle.

    Raises
    ------
    InputError
        If it cannot be used.
    """
    if isinstance(motion, str | Path):
        return read_motion(existing_file(motion), columns), str(motion)
    if isinstance(motion, Recording):
        motion = replace(motion, log_start_s=0.0).to_frame()
    if isinstance(motion, xr.Dataset):
        found = [one for one in columns if one in motion]
        motion = motion[found].to_dataframe() if found else pd.DataFrame(columns=list(map(str, motion)))
    if not isinstance(motion, pd.DataFrame):
        expected = "a DataFrame, a Dataset, a Recording or a CSV file"
        raise InputError(f"{name}: {expected}; got {'None' if motion is None else type(motion).__name__}")
    if motion.index.name in columns and motion.index.name not in motion:
        motion = motion.reset_index()
    return checked_motion(motion, name, columns=columns), name
