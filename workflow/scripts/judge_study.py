"""Recordings, simulations and fits of a study -> its tables (CSV, JSON) and figures (PNG and SVG)."""

from ccmodel.jobs import logged
from ccmodel.studies.run import run_study, runs_of

with logged(snakemake.log[0], snakemake.threads):
    given, made, params = snakemake.input, snakemake.output, snakemake.params
    run_study(
        params.kind,
        params.settings,
        params.measuring,
        runs_of(params.labels, given.recordings, given.simulated, params.fits),
        made.tables,
        list(zip(made.png, made.svg, strict=True)),
    )
