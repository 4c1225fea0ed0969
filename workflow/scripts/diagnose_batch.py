"""Recordings of a batch -> diagnosis.json, its page (HTML), the calibrated and the extended model (JSON)."""

from pathlib import Path

from ccmodel.config import Diagnosing
from ccmodel.jobs import logged
from ccmodel.stages.diagnose import diagnose_recordings

judged = Diagnosing.model_validate_json(snakemake.params.judged)
with logged(snakemake.log[0]):
    diagnose_recordings(Path(snakemake.input.recordings), Path(snakemake.output[0]).parent, judged)
