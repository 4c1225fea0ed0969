"""Recordings of the batches of a fit -> fitted values (JSON, SI units)."""

from pathlib import Path

from ccmodel.config import Config
from ccmodel.jobs import logged
from ccmodel.stages import fit_parameters

with logged(snakemake.log[0]):
    fit_parameters(
        snakemake.wildcards.parameters,
        Config.model_validate_json(snakemake.params.config),
        [Path(f) for f in snakemake.input.recordings],
        Path(snakemake.output[0]),
    )
