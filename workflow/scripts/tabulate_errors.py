"""All recordings and simulations -> the table of errors (CSV and Parquet)."""

from pathlib import Path

from ccmodel.jobs import logged
from ccmodel.report.tables import tabulate_errors

with logged(snakemake.log[0], snakemake.threads) as progress:
    tabulate_errors(
        zip(
            snakemake.params.parameters,
            map(Path, snakemake.input.recordings),
            map(Path, snakemake.input.simulated),
            strict=True,
        ),
        Path(snakemake.output.csv),
        Path(snakemake.output.parquet),
        progress,
    )
