"""A batch's folder -> its usable recordings and its summary."""

from dataclasses import asdict
from pathlib import Path

from ccmodel import provenance
from ccmodel.progress import Progress, silent
from ccmodel.recording import write_recordings
from ccmodel.rig.ingest import ingest_batch
from ccmodel.steps.files import write_json


def ingest(folder: Path, recordings_file: Path, summary_file: Path, progress: Progress = silent) -> None:
    """Read a batch folder; write its recordings (netCDF) and its summary (JSON): batch.yaml, recordings, findings."""
    ingested = ingest_batch(folder, progress)
    write_recordings(recordings_file, ingested.recordings, provenance.of_inputs(provenance.files_in(folder), folder))
    summary = {
        "folder": str(folder),
        "batch": ingested.batch.model_dump(mode="json") if ingested.batch else None,
        "recordings": [r.id for r in ingested.recordings],
        "findings": [asdict(f) for f in ingested.findings],
    }
    write_json(summary_file, summary)
