"""Raw logs of a batch -> its recordings (netCDF, SI units) and its summary (JSON)."""

from pathlib import Path

from ccmodel.jobs import logged
from ccmodel.steps.ingest import ingest

with logged(snakemake.log[0], snakemake.threads) as progress:
    ingest(Path(snakemake.params.folder), Path(snakemake.output.recordings), Path(snakemake.output.summary), progress)
