"""A batch's recordings and, if any, a fit -> what the model says of them (netCDF, SI units) and what failed (JSON)."""

from pathlib import Path

from ccmodel.jobs import logged
from ccmodel.stages.simulate import simulate

with logged(snakemake.log[0]):
    simulate(
        Path(snakemake.input.recordings),
        Path(snakemake.input.fit[0]) if snakemake.input.fit else None,
        Path(snakemake.output.simulated),
        Path(snakemake.output.summary),
    )
