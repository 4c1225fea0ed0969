"""A batch's folder -> its usable recordings and its summary."""

from dataclasses import asdict
from pathlib import Path

from ccmodel import provenance
from ccmodel.progress import Progress, silent
from ccmodel.recording import read_recordings, write_recordings
from ccmodel.rig.batch import Batch
from ccmodel.rig.findings import Finding
from ccmodel.rig.ingest import Ingested, ingest_batch
from ccmodel.steps.files import read_json, write_json


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


def read_ingested(recordings_file: Path) -> Ingested:
    """A batch that the pipeline has read, from its recordings and the summary next to them."""
    summary = read_json(recordings_file.with_suffix(".json"))
    stated = summary["batch"]
    batch = None if stated is None else Batch.model_validate(stated, strict=False)
    return Ingested(read_recordings(recordings_file), [Finding(**f) for f in summary["findings"]], batch)
