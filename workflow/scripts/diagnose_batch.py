"""Recordings of a batch, or of all batches of a rig -> diagnosis.json, its page (HTML), the calibrated, best and
nearest model (JSON).
"""

from pathlib import Path

from ccmodel.jobs import logged
from ccmodel.studies.diagnosis.run import diagnose_recordings
from ccmodel.studies.diagnosis.settings import Diagnosing

with logged(snakemake.log[0], snakemake.threads) as progress:
    diagnose_recordings(
        [Path(file) for file in snakemake.input.recordings],
        Path(snakemake.output[0]).parent,
        Diagnosing.model_validate_json(snakemake.params.settings),
        progress,
    )
