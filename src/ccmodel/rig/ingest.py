"""Ingest: the folder of a batch is read into recordings, and into findings for everything that is wrong with it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pandas as pd

from ccmodel.progress import Progress, each_of, silent, within
from ccmodel.recording import Recording, in_order
from ccmodel.rig import limits
from ccmodel.rig.batch import Batch, RecordingEntry, load_batch
from ccmodel.rig.calibration import calibrate
from ccmodel.rig.column_checks import ColumnChecks
from ccmodel.rig.consistency import check_consistency
from ccmodel.rig.findings import Defect, Finding, LogError, Severity
from ccmodel.rig.imported import PROVENANCE, unlisted_logs
from ccmodel.rig.log import read_log
from ccmodel.rig.sensor_checks import check_sensors, drive_travel
from ccmodel.typed import InputError

T = TypeVar("T")
# Shares of the time of an ingest at which the logs are read, and at which each of them is checked by itself.
READ, CHECKED = 0.2, 0.8


@dataclass(frozen=True)
class Ingested:
    """A batch that was read.

    Attributes
    ----------
    recordings : list of Recording
        Those that can be used, in the order of `batch.yaml`.
    findings : list of Finding
        Warnings, refusals and contradictions. A refused recording has one finding, a refusal; a used one may have
        several warnings and contradictions.
    batch : Batch or None
        Content of `batch.yaml`: radii, spring, estimates of the cable. None if the batch is refused as a whole.
    parts : tuple of str
        Names of the batches, if several of one rig are taken together (`ccmodel.rig.joint`); otherwise empty.
    """

    recordings: list[Recording]
    findings: list[Finding]
    batch: Batch | None = None
    parts: tuple[str, ...] = ()

    @property
    def stated(self) -> Batch:
        """The content of `batch.yaml`; `InputError` if the batch is refused as a whole."""
        if self.batch is None:
            raise InputError("\n".join(map(str, self.findings)) or "the batch is refused")
        return self.batch

    @property
    def contradicts(self) -> bool:
        """Whether the inputs contradict one another, so that no verdict on the physics can be drawn from them."""
        return any(finding.is_inconsistent for finding in self.findings)

    def check_usable(self, source: Path | str, trust_inputs: bool = True) -> None:
        """Raise `InputError` if no model can be compared with the batch.

        Parameters
        ----------
        source : Path or str
            What was read, in the message.
        trust_inputs : bool
            Whether recordings are needed even if the inputs contradict one another.

        Raises
        ------
        InputError
            One line for each refused file.
        """
        reported = self.contradicts and not trust_inputs
        if self.batch is None or not (self.recordings or reported):
            refused = [str(f) for f in self.findings if f.is_refused]
            raise InputError("\n".join(refused) or f"{source}: no recording that can be used")


# A damaged cell or constant may be so large that its square overflows. It is named by the checks, and numpy's own lines
# name no file.
@np.errstate(over="ignore", invalid="ignore")
def ingest_batch(folder: Path, progress: Progress = silent) -> Ingested:
    """Read a batch of rig logs.

    Parameters
    ----------
    folder : Path
        Folder with `batch.yaml` and the logs, anywhere on disk; it is not changed.
    progress : Progress

    Returns
    -------
    Ingested
        Recordings, findings and the content of `batch.yaml`. Bad data never raise: they are findings.
    """
    folder = Path(folder)
    # The findings name the batch by its folder: its batch.yaml may be unreadable.
    name, batch_file = folder.resolve().name, str(folder / "batch.yaml")
    batch, refusals = _attempt(name, batch_file, load_batch, folder)
    if batch is None:
        return Ingested([], refusals)
    files = [str(folder / entry.file) for entry in batch.recordings]
    reading = each_of(files, within(progress, 0.0, READ), lambda file: f"reading {Path(file).name}")
    logs = [_attempt(name, file, read_log, Path(file), batch.rig.in_place_of) for file in reading]
    # All logs are read before any is checked: a column is judged by how many logs of the batch have it.
    tables = [log[0] if log else None for log, _ in logs]
    columns = ColumnChecks(batch.rig, tables)
    if columns.refusals:
        return Ingested([], [_finding(name, batch_file, "refused", defect) for defect in columns.refusals])
    travel = max((drive_travel(table, batch.rig) for table in tables if table is not None), default=0.0)
    findings = [_finding(name, batch_file, "warning", defect) for defect in columns.warnings]
    findings += _unlisted(name, folder, batch)
    recordings, used_files = [], []
    checking = each_of(files, within(progress, READ, CHECKED), lambda file: f"checking {Path(file).name}")
    for k, (entry, file) in enumerate(zip(batch.recordings, checking, strict=True)):
        # The table is given up, since channels take its place.
        (log, refusals), logs[k], tables[k] = logs[k], (None, []), None
        if log is not None:
            used, refusals = _attempt(name, file, _recording, batch, entry, file, log, columns, travel)
            if used is not None:
                recording, warnings = used
                recordings.append(recording)
                used_files.append(file)
                findings += warnings
        findings += refusals
        # Otherwise the last table would stay.
        log = None
    recordings = in_order(recordings)
    # What a faulty sensor reads contradicts everything else too: it is named once.
    faulty = {finding.file for finding in findings if finding.severity == "inconsistent"}
    sound = [r for r, file in zip(recordings, used_files, strict=True) if file not in faulty]
    progress("comparing the logs with one another", CHECKED)
    contradictions, errors = _attempt(name, batch_file, check_consistency, sound, batch)
    findings += [replace(f, file=str(folder / f.file)) for f in contradictions or []] + errors
    return Ingested(recordings, findings, batch)


def _unlisted(name: str, folder: Path, batch: Batch) -> list[Finding]:
    """Warnings on imported logs that `batch.yaml` does not list."""
    try:
        unlisted = unlisted_logs(folder, [entry.file for entry in batch.recordings])
    except (InputError, OSError):
        text = "cannot be read: whether batch.yaml lists all imported logs is not known"
        return [Finding(name, str(folder / PROVENANCE), None, None, "warning", text)]
    text = "not used: it was imported, and batch.yaml does not list it; add an entry for it, or remove the file"
    return [Finding(name, str(folder / file), None, None, "warning", text) for file in unlisted.values()]


def _attempt(batch: str, file: str, step: Callable[..., T], *args: Any) -> tuple[T | None, list[Finding]]:
    """Result of a step and no findings, or None and the findings that refuse the file."""
    try:
        return step(*args), []
    except InputError as error:
        return None, [_finding(batch, p.file, "refused", Defect(p.line, None, p.text)) for p in error.problems]
    except LogError as error:
        defect = error.defect
    except Exception as error:  # an error that one log causes must not stop the others
        text = f"cannot be read because of an unexpected error ({type(error).__name__}: {error})"
        defect = Defect(None, None, " ".join(text.split()))
    return None, [_finding(batch, file, "refused", defect)]


def _finding(batch: str, file: str, severity: Severity, defect: Defect) -> Finding:
    """A defect as a finding; one of a used log that contradicts is no warning."""
    if severity == "warning" and defect.contradicts:
        return Finding(batch, file, defect.row, defect.column, "inconsistent", defect.text)
    return Finding(batch, file, defect.row, defect.column, severity, defect.text, contradicts=defect.contradicts)


def _recording(
    batch: Batch,
    entry: RecordingEntry,
    file: str,
    log: tuple[pd.DataFrame, list[Defect]],
    columns: ColumnChecks,
    travel: float,
) -> tuple[Recording, list[Finding]]:
    """The recording of a log that could be read, and the findings of it.

    `log` is the table of samples and the defects that reading it has found; `travel` is the batch's largest travel of
    the drive.
    """
    table, reading_defects = log
    rare_columns = columns.check(table)
    table, faulty_sensors = check_sensors(table, batch.rig, travel)
    # A logger may count from the day before or, with a trigger, from before zero.
    start = float(table["time_s"].iloc[0])
    table = table.assign(time_s=table["time_s"] - start)
    lasts, left = table["time_s"].iloc[-1], (table["time_s"] >= entry.settled_s).sum()
    if left < limits.FEWEST_SAMPLES:
        text = f"lasts {lasts:g} s, with {left} samples after settled_s {entry.settled_s:g} s of batch.yaml: too few"
        raise LogError(None, None, text, True)
    short = []
    if entry.settled_s > limits.MOST_SETTLING * lasts:
        text = f"settled_s {entry.settled_s:g} s of batch.yaml leaves {lasts - entry.settled_s:.3g} of {lasts:.3g} s"
        short.append(Defect(None, "time_s", f"{text} to be compared"))
    calibrated = calibrate(table, batch.rig)
    unconverted = [Defect(None, column, f"not used: {why}") for column, why in calibrated.unused.items()]
    # A column whose sensor batch.yaml does not state contradicts nothing: it is not used anyway.
    faulty_sensors = [d._replace(contradicts=d.contradicts and d.column in columns.stated) for d in faulty_sensors]
    defects = [*reading_defects, *rare_columns, *short, *faulty_sensors, *unconverted]
    findings = [_finding(batch.batch, file, "warning", defect) for defect in defects]
    recording = Recording(
        batch=batch.batch,
        id=entry.id,
        origin=batch.origin,
        time_s=table["time_s"].to_numpy(),
        channels=calibrated.channels,
        derived_from=calibrated.derived_from,
        pretension_N=entry.pretension_N,
        path=entry.path,
        accuracy=calibrated.accuracy,
        encoder_step_rad=calibrated.encoder_step_rad,
        excitation=entry.excitation,
        rest_s=calibrated.rest_s,
        settled_s=entry.settled_s,
        warnings=tuple(map(str, findings)),
        far_end=batch.rig.far_end,
        started_at_s=entry.started_at.timestamp() if entry.started_at else None,
        tensioned_at_s=entry.tensioned_at.timestamp() if entry.tensioned_at else None,
        log_start_s=start,
    )
    return recording, findings
