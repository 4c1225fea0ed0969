"""Recordings, simulations and fits of a study -> its tables (CSV, JSON) and figures (PNG, SVG and PDF)."""

from ccmodel.jobs import logged
from ccmodel.studies.run import run_study, runs_of

with logged(snakemake.log[0], snakemake.threads) as progress:
    given, made, params = snakemake.input, snakemake.output, snakemake.params
    run_study(
        params.kind,
        params.settings,
        params.measuring,
        runs_of(params.labels, given.recordings, given.simulated, params.fits),
        [*made.csv, *made.summary],
        list(zip(made.png, made.svg, made.pdf, strict=True)),
        progress,
    )
