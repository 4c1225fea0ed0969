"""Batches: a folder of recordings that was read."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ccmodel import provenance
from ccmodel.api.options import progress_of
from ccmodel.api.recordings import Recordings, counted
from ccmodel.channels import THETA_IN
from ccmodel.paths import BATCH_FILE, batch_folder
from ccmodel.progress import Progress, silent, within
from ccmodel.recording import ORIGIN, Recording
from ccmodel.rig.batch import Batch as BatchFile
from ccmodel.rig.findings import WORD, Finding
from ccmodel.rig.ingest import Ingested, ingest_batch
from ccmodel.rig.joint import together
from ccmodel.typed import InputError

# Findings that a short form shows.
SHOWN_FINDINGS = 5


@dataclass(frozen=True, eq=False, repr=False)
class Batch(Recordings):
    """Recordings of one rig, as `load` reads them from a folder; or several batches that are diagnosed together.

    Attributes
    ----------
    folder : Path
        Of several batches, the first one's.
    recordings : tuple of Recording
        Those that can be used, in the order of ``batch.yaml``; ``batch["id"]`` is one of them.
    findings : tuple of Finding
        Warnings, refused files and contradictions; ``str(finding)`` says where and what.
    provenance : mapping
        Version of ccmodel, and digests of the folder's files as they were read.
    """

    folder: Path
    recordings: tuple[Recording, ...]
    findings: tuple[Finding, ...]
    provenance: Mapping[str, Any]
    # Content of batch.yaml.
    _file: BatchFile
    # Names of several batches.
    _parts: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the batch, which is its folder's; of several batches, their names."""
        return self._file.batch

    @property
    def origin(self) -> str:
        """Origin of the recordings: "rig" (measured) or "virtual-rig" (a simulated rig)."""
        return self._file.origin

    @property
    def contradicts(self) -> bool:
        """Whether the inputs contradict one another, so that no verdict on the physics can be drawn from them."""
        return self._ingested.contradicts

    @property
    def _ingested(self) -> Ingested:
        """The batch as the functions below this interface take it."""
        return Ingested(list(self.recordings), list(self.findings), self._file, self._parts)

    @property
    def summary(self) -> pd.DataFrame:
        """A row for each recording, by its id.

        Columns ``samples``, ``rate_Hz``, ``duration_s``, ``rest_s`` (the rest at the start), ``stroke_rad`` (peak to
        peak of the drive angle), ``pretension_N``, ``channels`` and ``warnings`` (numbers of them).
        """
        rows = {
            r.id: {
                "samples": r.time_s.size,
                "rate_Hz": r.rate_Hz,
                "duration_s": float(np.ptp(r.time_s)),
                "rest_s": r.rest_s,
                "stroke_rad": float(np.ptp(r[THETA_IN])),
                "pretension_N": r.pretension_N,
                "channels": len(r.channels),
                "warnings": len(r.warnings),
            }
            for r in self.recordings
        }
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("recording")

    def __repr__(self) -> str:
        return "\n".join([self._title, *([_table(self.summary)] if len(self) else []), *self._shown_findings])

    def _repr_html_(self) -> str:
        table = self.summary.to_html(float_format=_number, border=0) if len(self) else ""
        findings = "".join(f"<li>{escape(line)}</li>" for line in self._shown_findings)
        return f"<p>{escape(self._title)}</p>{table}{f'<ul>{findings}</ul>' if findings else ''}"

    @property
    def _title(self) -> str:
        findings = counted(len(self.findings), "finding") if self.findings else "no findings"
        return f"Batch {self.name}, {ORIGIN[self.origin]}: {counted(len(self))}, {findings}"

    @property
    def _shown_findings(self) -> list[str]:
        """A line for each of the first findings, the gravest first."""
        grave = sorted(self.findings, key=lambda f: (f.severity == "warning", -f.confidence))
        lines = [f"{WORD[f.severity]}: {f.place}: {f.text}" for f in grave[:SHOWN_FINDINGS]]
        more = len(grave) - len(lines)
        return [*lines, *([f"and {more} more in .findings"] if more else [])]


def load(folder: str | Path, *, progress: bool | Progress = False) -> Batch:
    """Read a folder of recordings.

    Parameters
    ----------
    folder : str or Path
        Folder with a ``batch.yaml`` and the logs that it names (docs/rig-log-format.md), or that file; nothing in it is
        changed.
    progress : bool or callable
        True shows progress; a callable gets ``(text, share of the work done)``.

    Returns
    -------
    Batch
        A log that cannot be used, or contradicts another, is one of its findings.

    Raises
    ------
    InputError
        If there is no such folder, or nothing in it can be used: one line for each problem.

    Examples
    --------
    >>> import ccmodel as cc
    >>> batch = cc.load("data/raw/half-loop")
    >>> batch.summary[["samples", "rate_Hz", "pretension_N"]]
                      samples  rate_Hz  pretension_N
    recording
    half-loop-7.3N-a     4801    500.0           7.3
    half-loop-7.3N-b     4801    500.0           7.3
    >>> float(batch["half-loop-7.3N-a"].to_frame()["tau_in_Nm"].max().round(4))
    0.0988
    """
    folder = batch_folder(folder)
    with progress_of(progress) as report:
        ingested = ingest_batch(folder, report)
    ingested.check_usable(folder, trust_inputs=False)
    inputs = provenance.of_inputs(provenance.files_in(folder), folder)
    return Batch(folder, tuple(ingested.recordings), tuple(ingested.findings), inputs, ingested.stated)


def as_batch(batch: Batch | str | Path, progress: Progress = silent) -> Batch:
    """A batch, or the one in a folder.

    Raises
    ------
    InputError
        If it is neither, or the folder cannot be used.
    """
    if isinstance(batch, Batch):
        return batch
    if isinstance(batch, str | Path):
        return load(batch, progress=progress)
    what = "a Recording alone" if isinstance(batch, Recording) else type(batch).__name__
    raise InputError(f"batch: a Batch or its folder; got {'None' if batch is None else what}")


def joint_batch(batches: Sequence[Batch | str | Path], progress: Progress = silent) -> Batch:
    """Batches of one rig, or their folders, as one batch; one of them as it is.

    Raises
    ------
    InputError
        If there are none, one of them cannot be used, or they are not of one rig.
    """
    if not batches:
        raise InputError("batch: a Batch or its folder, or a list of those of one rig; got an empty list")
    shares = [k / len(batches) for k in range(len(batches) + 1)]
    parts = zip(batches, shares[:-1], shares[1:], strict=True)
    every = [as_batch(batch, within(progress, low, high)) for batch, low, high in parts]
    if len(every) == 1:
        return every[0]
    found = together([(str(batch.folder / BATCH_FILE), batch._ingested) for batch in every])
    digests = {f"{b.name}/{file}": digest for b in every for file, digest in b.provenance["sha256"].items()}
    inputs = {**every[0].provenance, "sha256": digests}
    return Batch(
        every[0].folder, tuple(found.recordings), tuple(found.findings), inputs, found.stated, tuple(found.parts)
    )


def check_consistent(batch: Batch, trust_inputs: bool, option: str = "trust_inputs=True") -> None:
    """Raise `InputError` if a batch's inputs contradict one another and are not trusted; `option` is how to."""
    if batch.contradicts and not trust_inputs:
        lines = [str(f) for f in batch.findings if f.is_inconsistent]
        raise InputError("\n".join([*lines, f"if these inputs are right, state {option}"]))


def _table(frame: pd.DataFrame) -> str:
    """A table as text, at most four digits of a number."""
    return frame.reset_index().to_string(index=False, float_format=_number)


def _number(value: float) -> str:
    return f"{value:.4g}"
