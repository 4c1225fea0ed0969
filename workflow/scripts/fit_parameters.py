"""Recordings of the batches of a fit -> fitted parameters (JSON, SI units)."""

from pathlib import Path

from ccmodel.jobs import logged
from ccmodel.steps.fit import fit_parameters
from ccmodel.steps.settings import Fit

with logged(snakemake.log[0], snakemake.threads) as progress:
    fit_parameters(
        snakemake.wildcards.parameters,
        Fit.model_validate_json(snakemake.params.problem),
        [Path(f) for f in snakemake.input.recordings],
        Path(snakemake.output[0]),
        progress,
    )
