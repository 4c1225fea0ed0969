"""Recordings of a batch and, if any, a fit -> simulations (netCDF, SI units) and failures (JSON)."""

from pathlib import Path

from ccmodel.jobs import logged
from ccmodel.steps.simulate import simulate

with logged(snakemake.log[0], snakemake.threads) as progress:
    simulate(
        Path(snakemake.input.recordings),
        Path(snakemake.input.fit) if snakemake.input.fit else None,
        Path(snakemake.output.simulated),
        Path(snakemake.output.summary),
        progress,
    )
