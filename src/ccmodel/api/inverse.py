"""Models in use from the drive's side: the load that a drive feels, and the drive's motion for a wanted one."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from html import escape
from math import inf
from numbers import Real
from pathlib import Path

import numpy as np
import pandas as pd

from ccmodel.api.batch import Batch, as_batch
from ccmodel.api.model import (
    HasModel,
    Motion,
    as_model,
    as_motion,
    check_same_rig,
    files_among,
    sorted_findings,
    stated_ids,
)
from ccmodel.api.options import progress_of
from ccmodel.api.recordings import counted
from ccmodel.channels import TAU_IN, TAU_OUT, THETA_IN, THETA_OUT, unit_of
from ccmodel.failure import ModelError
from ccmodel.inverse.compensate import WANTED, Limits, compensated
from ccmodel.inverse.estimate import HALF_WIDTH, VISIBLE, Estimated, estimated
from ccmodel.model.files import Model
from ccmodel.model.parameters import Parameters
from ccmodel.outputs import new_file, new_files
from ccmodel.paths import try_file, try_folder
from ccmodel.progress import Progress, each_of, within
from ccmodel.rig.findings import Finding
from ccmodel.steps.files import write_table
from ccmodel.steps.predict import READING, conditions_of
from ccmodel.typed import InputError, advice

WANTED_MOTION = ["time_s", THETA_OUT]
# Parameters of `estimated` by channel.
_TOLERANCES = {TAU_IN: "tolerance", THETA_OUT: "angle_tolerance"}


@dataclass(frozen=True, eq=False, repr=False)
class Estimate(Mapping[str, pd.DataFrame]):
    """Torque and angle of the load of a batch's recordings, estimated from the drive's side.

    ``estimate["id"]`` is the table of one recording, with a row for each sample: index ``time_s``; ``theta_out_rad``
    and ``tau_out_Nm``, the ends of their 90 % intervals (``theta_out_rad_low``, ``theta_out_rad_high`` and so on), and
    ``load_is_visible``: whether the drive torque responds to the load there.

    Attributes
    ----------
    errors : DataFrame
        For recordings with sensors at the load, a row for each channel: ``bias`` and ``rms`` of estimated minus
        recorded in ``unit``, and ``share_within``, the share of recorded values within the interval; after the rest
        and the start-up.
    left_out : tuple of str
        A line on each recording without an estimate.
    notes : tuple of str
        A line on each part of the model that an estimate cannot have.
    findings : tuple of Finding
        Faults and contradictions of the batch, which is used all the same; ``str(finding)`` says where and what.
    """

    errors: pd.DataFrame
    left_out: tuple[str, ...]
    notes: tuple[str, ...]
    findings: tuple[Finding, ...]
    _tables: Mapping[str, pd.DataFrame]
    # Ids of all recordings of the batch.
    _stated: tuple[str, ...]

    def __getitem__(self, id: str) -> pd.DataFrame:
        """The table of the recording with this id.

        Raises
        ------
        InputError
            If there is none.
        """
        if id not in self._tables:
            raise InputError(f"no recording '{id}'; {advice(str(id), self._tables)}")
        return self._tables[id]

    def __iter__(self) -> Iterator[str]:
        return iter(self._tables)

    def __len__(self) -> int:
        return len(self._tables)

    @property
    def visible_share(self) -> pd.Series:
        """Share of the samples of each recording at which the drive torque responds to the load."""
        return pd.Series({id: float(table[VISIBLE].mean()) for id, table in self._tables.items()}, dtype=float)

    def save(self, folder: str | Path) -> None:
        """Write a CSV for each recording, as ``ccmodel estimate --out`` does.

        An earlier one of a recording that has no estimate now is removed.

        Raises
        ------
        InputError
            If the folder cannot be made or written to.
        """
        with new_files(folder, without=[f"{id}.csv" for id in self._stated]) as path:
            for id, table in self._tables.items():
                write_table(path / f"{id}.csv", table.reset_index().astype({VISIBLE: int}), digits=9)

    def __repr__(self) -> str:
        return "\n".join([self._title, self.errors.to_string(index=False), *self.notes, *self.left_out])

    def _repr_html_(self) -> str:
        lines = "".join(f"<li>{escape(line)}</li>" for line in (*self.notes, *self.left_out))
        table = self.errors.to_html(index=False, border=0)
        return f"<p>{self._title}</p>{table}{f'<ul>{lines}</ul>' if lines else ''}"

    @property
    def _title(self) -> str:
        return f"Estimate of the load of {counted(len(self))} from the drive's side"


def estimate(
    model: Model | HasModel | str | Path,
    batch: Batch | str | Path,
    out: str | Path | None = None,
    *,
    unknown_load: bool = False,
    tolerance: float | Mapping[str, float] | None = None,
    progress: bool | Progress = False,
) -> Estimate:
    """Estimate the load's torque and angle from the drive's angle and torque, causally, sample by sample.

    The intervals contain the noise and zero of the torque sensor, the count of the drive's encoder, friction and
    tension that repeat to 1 %, the model's intervals, and the model discrepancy. They widen where friction hides the
    load from the drive.

    Parameters
    ----------
    model : Model, Fit, Diagnosis, str or Path
        A model, what has one, or its file.
    batch : Batch, str or Path
        A batch, or its folder. Of its recordings, sensors at the load are used for `Estimate.errors` alone.
    out : str or Path, optional
        Folder for the estimates, a CSV for each recording; `Estimate.save` writes them later.
    unknown_load : bool
        Whether the load is unknown, though the model has the law of a spring.
    tolerance : float or mapping of str to float, optional
        Standard deviation of the model discrepancy, as a share of peak to peak so far: of the drive torque, or by
        channel of ``tau_in_Nm`` (0.005 if not stated) and ``theta_out_rad`` (0). The peak to peak of the torque counts
        as no less than the sum of the tensions at the drive times its radius.
    progress : bool or callable
        True shows progress; a callable gets ``(text, share of the work done)``.

    Returns
    -------
    Estimate

    Raises
    ------
    InputError
        If the model file or the batch cannot be used, or `out` cannot be written.

    Examples
    --------
    >>> import ccmodel as cc
    >>> batch = cc.load("data/raw/half-loop")
    >>> estimate = cc.estimate(cc.fit(batch).model, batch)
    >>> list(estimate["half-loop-7.3N-a"])
    ['theta_out_rad', 'theta_out_rad_low', 'theta_out_rad_high', 'tau_out_Nm', 'tau_out_Nm_low', 'tau_out_Nm_high', \
'load_is_visible']
    """
    known = as_model(model)
    shares = _shares(tolerance)
    if out is not None:
        try_folder(out)
    sds, unknown = _standard_deviations(known.intervals)
    tables: dict[str, pd.DataFrame] = {}
    text = "{}: the model's interval is infinite, and its value is taken as exact"
    notes = dict.fromkeys(map(text.format, unknown))
    left_out, rows = [], []
    with progress_of(progress) as report:
        batch = as_batch(batch, within(report, 0.0, READING))
        check_same_rig(known, batch)
        texts = within(report, READING, 1.0)
        placed = known.placed(batch.recordings)
        for recording in each_of(placed, texts, lambda one: f"estimating the load of {one.batch}/{one.id}"):
            try:
                found = estimated(recording, known.parameters, sds, not unknown_load, **shares)
            except (ModelError, ValueError) as error:
                left_out.append(f"{recording.batch}/{recording.id}: {error}")
                continue
            tables[recording.id] = found.table
            notes |= dict.fromkeys(found.notes)
            rows += _errors(found, known.parameters)
    refused, others = sorted_findings(batch)
    columns = ["recording", "channel", "unit", "bias", "rms", "share_within", "samples"]
    errors, lines = pd.DataFrame(rows, columns=columns), (*refused, *left_out)
    result = Estimate(errors, lines, tuple(notes), others, tables, stated_ids(batch))
    if out is not None:
        result.save(out)
    return result


def _standard_deviations(intervals: Mapping[str, Mapping[str, float | None]]) -> tuple[dict[str, float], list[str]]:
    """Standard deviations of normal distributions with these 90 % intervals, and names of those that are infinite.

    Of a fit to few recordings, an interval is wider than its standard deviation tells.
    """
    known = {
        name: (high - low) / (2 * HALF_WIDTH)
        for name, one in intervals.items()
        if (low := one["low"]) is not None and (high := one["high"]) is not None
    }
    return known, [name for name in intervals if name not in known]


def _shares(tolerance: float | Mapping[str, float] | None) -> dict[str, float]:
    """Tolerances as `estimated` takes them.

    Raises
    ------
    InputError
        If one is no share, or of a channel that has none.
    """
    if tolerance is None:
        return {}
    stated = tolerance if isinstance(tolerance, Mapping) else {TAU_IN: tolerance}
    if other := [repr(name) for name in stated if name not in _TOLERANCES]:
        raise InputError(f"tolerance: an estimate has those of {' and '.join(_TOLERANCES)}; got {', '.join(other)}")
    return {_TOLERANCES[n]: _positive(x, "tolerance", "a share of peak to peak") for n, x in stated.items()}


def _errors(found: Estimated, parameters: Parameters) -> list[tuple]:
    """Rows of `Estimate.errors` of one recording."""
    recording, table, rows = found.recording, found.table, []
    judged = recording.time_s >= max(recording.rest_s, recording.settled_s)
    zero = {TAU_OUT: parameters.tau_out_zero_Nm, THETA_OUT: 0.0}
    for channel in (THETA_OUT, TAU_OUT):
        if channel not in recording or not judged.any():
            continue
        recorded = recording[channel][judged] - zero[channel]
        low, middle, high = (table[f"{channel}{end}"].to_numpy()[judged] for end in ("_low", "", "_high"))
        if channel == THETA_OUT and recording.rest_s == 0:
            # Without a rest the encoder has no zero that the estimate could know.
            shift = float(np.mean(recorded - middle))
            low, middle, high = low + shift, middle + shift, high + shift
        error = middle - recorded
        inside = float(np.mean((low <= recorded) & (recorded <= high)))
        rms = float(np.sqrt(np.mean(error**2)))
        rows.append((recording.id, channel, unit_of(channel), float(error.mean()), rms, inside, int(judged.sum())))
    return rows


@dataclass(frozen=True, eq=False, repr=False)
class Compensation:
    """The drive's motion that makes the load follow a wanted one, by a model.

    Attributes
    ----------
    table : DataFrame
        ``time_s``, ``theta_in_rad``, ``theta_out_rad`` (the load by the model) and ``theta_wanted_rad``.
    lost_motion_rad, straight_lost_motion_rad : float
        Root mean square of the load's angle less the wanted one, by the model: with this motion of the drive, and if
        the drive makes the wanted motion itself.
    notes : tuple of str
        Where the motion exceeds the drive's limits: at its start, if the wanted motion begins without a rest.
    """

    table: pd.DataFrame
    lost_motion_rad: float
    straight_lost_motion_rad: float
    notes: tuple[str, ...] = ()

    @property
    def largest_speed_rad_per_s(self) -> float:
        """Largest speed of the drive from sample to sample; to the first one it comes from rest, at zero."""
        theta, steps = self.table[THETA_IN].to_numpy(), np.diff(self.table["time_s"])
        return float(np.abs(np.diff(theta, prepend=0.0) / np.concatenate([steps[:1], steps])).max(initial=0.0))

    def save(self, file: str | Path) -> None:
        """Write the table as CSV, which ``ccmodel simulate`` reads as a motion.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        with new_file(file) as path:
            write_table(path, self.table, digits=9)

    def __repr__(self) -> str:
        before, after = 1e3 * self.straight_lost_motion_rad, 1e3 * self.lost_motion_rad
        return (
            f"Motion of the drive, {counted(len(self.table), 'sample')}: rms error of the load's angle, by the model:"
            f" {after:.3g} mrad; {before:.3g} mrad if the drive makes the wanted motion itself; drive speed up to"
            f" {self.largest_speed_rad_per_s:.3g} rad/s"
        )


def compensate(
    model: Model | HasModel | str | Path,
    wanted: Motion,
    *,
    max_speed_rad_per_s: float | None = None,
    max_acceleration_rad_per_s2: float | None = None,
    recording: str | None = None,
    batch: Batch | str | Path | None = None,
    pretension_N: float | None = None,
    out: str | Path | None = None,
    progress: bool | Progress = False,
) -> Compensation:
    """Find the drive's motion that makes the load follow a wanted motion, by a model.

    At each reversal of the load the drive has to cross the lost motion while the load rests. Without limits it does so
    from one sample to the next. With a limit of its speed it begins early and ends late by half of the time that this
    takes; a limit of its acceleration rounds the corners.

    Parameters
    ----------
    model : Model, Fit, Diagnosis, str or Path
        A model, what has one, or its file. The load of the rig has to be a spring.
    wanted : DataFrame, xarray Dataset, Recording, str or Path
        ``time_s`` (s, increasing) and ``theta_out_rad`` (rad, from the load's angle at rest); or a CSV with these
        columns. It begins best with a rest.
    max_speed_rad_per_s, max_acceleration_rad_per_s2 : float, optional
        Limits of the drive. One of the acceleration needs one of the speed.
    recording : str, optional
        Recording whose conduits are used; else the first that the model was fitted to.
    batch : Batch, str or Path, optional
        A batch of the rig, for a model file that does not know its conduits.
    pretension_N : float, optional
        Pretension of both cables; else that recording's.
    out : str or Path, optional
        File for the motion, CSV.
    progress : bool or callable
        True shows progress; a callable gets ``(text, share of the work done)``.

    Returns
    -------
    Compensation

    Raises
    ------
    InputError
        If an input cannot be used, the drive cannot make the load follow, or `out` cannot be written.

    Examples
    --------
    >>> import ccmodel as cc
    >>> import numpy as np, pandas as pd
    >>> time_s = np.arange(0, 2, 0.004)
    >>> wanted = pd.DataFrame({"time_s": time_s, "theta_out_rad": 0.3 * np.sin(np.pi * time_s) ** 2})
    >>> motion = cc.compensate(cc.fit("data/raw/half-loop").model, wanted)
    >>> motion.lost_motion_rad < 0.01 * motion.straight_lost_motion_rad
    True
    """
    known = as_model(model)
    table, source = as_motion(wanted, "wanted", WANTED_MOTION)
    limits = _limits(max_speed_rad_per_s, max_acceleration_rad_per_s2)
    if pretension_N is not None and not (isinstance(pretension_N, Real) and 0 <= pretension_N < inf):
        raise InputError(f"pretension_N: a tension that is not negative, N; got {pretension_N!r}")
    if out is not None:
        try_file(out, read=files_among(model, wanted))
    with progress_of(progress) as report:
        of_rig = None if batch is None else as_batch(batch, within(report, 0.0, READING))
        given = () if of_rig is None else (of_rig.recordings, of_rig.name)
        like = conditions_of(known, recording, *given)
        report("finding the drive's motion", READING)
        try:
            found = compensated(table, known.parameters, like, limits, pretension_N)
        except (ModelError, ValueError) as error:
            raise InputError(f"{source}: {error}") from None
    lost, straight = (
        float(np.sqrt(np.mean((angle - found.table[WANTED]) ** 2)))
        for angle in (found.table[THETA_OUT], found.straight_rad)
    )
    result = Compensation(found.table, lost, straight, found.notes)
    if out is not None:
        result.save(out)
    return result


def _limits(speed: float | None, acceleration: float | None) -> Limits:
    if acceleration is not None and speed is None:
        raise InputError("max_acceleration_rad_per_s2: needs max_speed_rad_per_s too")
    limits = Limits()
    if speed is not None:
        limits = replace(limits, speed_rad_per_s=_positive(speed, "max_speed_rad_per_s", "a speed, rad/s"))
    if acceleration is not None:
        most = _positive(acceleration, "max_acceleration_rad_per_s2", "an acceleration, rad/s^2")
        limits = replace(limits, acceleration_rad_per_s2=most)
    return limits


def _positive(value: float, name: str, what: str) -> float:
    if not isinstance(value, Real) or not 0 < value < inf:
        raise InputError(f"{name}: {what}, above zero; got {value!r}")
    return float(value)
