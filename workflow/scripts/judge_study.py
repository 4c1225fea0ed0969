"""Recordings, simulations and fits of a study -> its tables (CSV, JSON) and figures (PNG and SVG)."""

from pathlib import Path

from ccmodel.jobs import logged
from ccmodel.studies.run import run_study, runs_of

with logged(snakemake.log[0], snakemake.threads):
    run_study(
        snakemake.params.kind,
        snakemake.params.name,
        snakemake.params.settings,
        snakemake.params.measuring,
        runs_of(snakemake.params.labels, snakemake.input.recordings, snakemake.input.simulated, snakemake.params.fits),
        Path(snakemake.params.results),
    )
