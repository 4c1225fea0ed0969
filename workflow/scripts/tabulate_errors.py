"""All recordings and simulations -> the error table (CSV and Parquet): a row a recording, parameter set, channel."""

from pathlib import Path

from ccmodel.jobs import logged
from ccmodel.stages.tabulate import tabulate_errors

with logged(snakemake.log[0]):
    names, recordings, simulated = snakemake.params.parameters, snakemake.input.recordings, snakemake.input.simulated
    tabulate_errors(
        [(n, Path(r), Path(s)) for n, r, s in zip(names, recordings, simulated, strict=True)],
        Path(snakemake.output.csv),
        Path(snakemake.output.parquet),
    )
