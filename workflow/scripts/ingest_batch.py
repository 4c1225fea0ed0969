"""A batch's raw logs -> its recordings (netCDF, SI units) and what was found in them (JSON)."""

from pathlib import Path

from ccmodel.jobs import logged
from ccmodel.stages.ingest import ingest

with logged(snakemake.log[0]):
    ingest(Path(snakemake.params.folder), Path(snakemake.output.recordings), Path(snakemake.output.summary))
