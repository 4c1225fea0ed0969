"""Ingest: a batch's folder -> its recordings, and what was found wrong with it."""

from dataclasses import dataclass
from pathlib import Path

from ccmodel.recording import Recording
from ccmodel.rig.batch import Batch, RecordingEntry, load_batch
from ccmodel.rig.calibration import calibrate
from ccmodel.rig.checks import check_sensors
from ccmodel.rig.columns import check_columns
from ccmodel.rig.findings import LIMITS, Finding, Limits
from ccmodel.rig.logs import Log, read_log
from ccmodel.typed import InputError


@dataclass(frozen=True)
class Ingested:
    """A batch that was read.

    Attributes
    ----------
    recordings : list of Recording
        Those that can be used, in the batch's order.
    findings : list of Finding
        Everything found wrong, a line each; a recording that is refused has exactly one.
    batch : Batch or None
        What `batch.yaml` says: radii, spring, estimates of the cable. None if the batch is refused as a whole.
    """

    recordings: list[Recording]
    findings: list[Finding]
    batch: Batch | None = None


def ingest_batch(folder: Path, limits: Limits = LIMITS) -> Ingested:
    """Read a batch of rig logs.

    Parameters
    ----------
    folder : Path
        The batch's folder with its `batch.yaml` and logs, anywhere on disk; it is not changed.
    limits : Limits
        How much may be wrong with a log that is still used.

    Returns
    -------
    Ingested
        Recordings, findings and the batch's description. Bad data never raise: they are findings.
    """
    folder = Path(folder)
    name = folder.resolve().name
    try:
        batch = load_batch(folder)
    except InputError as error:
        return Ingested([], [Finding(name, p.file, p.line, None, "refused", p.text) for p in error.problems])
    except Exception as error:  # whatever is odd about one batch must not take the others with it
        return Ingested([], [_unforeseen(name, folder / "batch.yaml", error)])
    logs = [_read_log(folder / entry.file, batch.batch, limits) for entry in batch.recordings]
    files = [str(folder / entry.file) for entry in batch.recordings]
    findings, of_logs = check_columns(batch, str(folder / "batch.yaml"), files, logs)
    recordings = []
    for entry, log, of_columns in zip(batch.recordings, logs, of_logs, strict=True):
        recording, found = _recording_or_finding(folder, batch, entry, log, of_columns, limits)
        findings += found
        if recording is not None:
            recordings.append(recording)
    return Ingested(recordings, findings, batch)


def _unforeseen(batch: str, file: Path, error: Exception) -> Finding:
    text = " ".join(f"cannot be read, for a reason that nobody thought of ({type(error).__name__}: {error})".split())
    return Finding(batch, str(file), None, None, "refused", text)


def _read_log(path: Path, batch: str, limits: Limits) -> Log:
    try:
        return read_log(path, batch, limits)
    except Exception as error:  # whatever is odd about one log must not take the others with it
        return Log((), None, [_unforeseen(batch, path, error)])


def _recording_or_finding(
    folder: Path, batch: Batch, entry: RecordingEntry, log: Log, of_columns: list[Finding], limits: Limits
) -> tuple[Recording | None, list[Finding]]:
    try:
        return _recording(folder, batch, entry, log, of_columns, limits)
    except Exception as error:  # as above
        return None, [_unforeseen(batch.batch, folder / entry.file, error)]


def _recording(
    folder: Path, batch: Batch, entry: RecordingEntry, log: Log, of_columns: list[Finding], limits: Limits
) -> tuple[Recording | None, list[Finding]]:
    file = str(folder / entry.file)

    def finding(row, column, severity, text):
        return Finding(batch.batch, file, row, column, severity, text)

    if log.table is None:
        return None, log.findings
    if any(f.severity == "refused" for f in of_columns):
        return None, of_columns
    table, found = check_sensors(log.table, batch.rig, batch.batch, file, limits)
    if table is None:
        return None, found
    last = table["time_s"].iloc[-1]
    if entry.settled_s >= last:
        text = f"ends at {last:g} s, before settled_s {entry.settled_s:g} s of batch.yaml: nothing left to judge"
        return None, [finding(None, None, "refused", text)]
    calibrated = calibrate(table, batch.rig, limits)
    found = log.findings + of_columns + found
    found += [
        finding(None, column, "warning", f"not used: batch.yaml has no {key} to make sense of it")
        for column, key in calibrated.missing.items()
    ]
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
        warnings=tuple(str(f) for f in found),
        far_end=batch.rig.far_end,
    )
    return recording, found
