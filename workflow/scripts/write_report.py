"""Table of errors, fits, summaries of batches and studies -> the page (HTML) and what was left out (JSON)."""

from pathlib import Path

from ccmodel.jobs import logged
from ccmodel.report.page import write_report

with logged(snakemake.log[0], snakemake.threads):
    write_report(
        Path(snakemake.output.page),
        Path(snakemake.params.raw),
        snakemake.params.unusable,
        snakemake.input.summaries,
        snakemake.input.fits,
        snakemake.input.simulations,
        Path(snakemake.input.errors),
        [Path(f) for f in snakemake.input.diagnoses],
        snakemake.params.studies,
    )
