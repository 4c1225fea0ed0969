"""Recordings of the batches of a fit -> fitted values (JSON, SI units)."""

from pathlib import Path

from ccmodel.config import Fit
from ccmodel.jobs import logged
from ccmodel.stages.fit import fit_parameters

with logged(snakemake.log[0]):
    fit_parameters(
        snakemake.wildcards.parameters,
        Fit.model_validate_json(snakemake.params.problem),
        [Path(f) for f in snakemake.input.recordings],
        Path(snakemake.output[0]),
    )
