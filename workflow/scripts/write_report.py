"""Recordings, simulations, diagnoses, studies, errors -> the page (HTML) and what was left out (JSON)."""

from pathlib import Path

from ccmodel.jobs import logged
from ccmodel.report.page import write_report

with logged(snakemake.log[0], snakemake.threads) as progress:
    write_report(
        Path(snakemake.output.page),
        dict(snakemake.input.items()),
        snakemake.params.parameters,
        snakemake.params.studies,
        Path(snakemake.params.raw),
        snakemake.params.unusable,
        progress,
    )
