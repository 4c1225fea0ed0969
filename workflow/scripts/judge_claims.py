"""Recordings and simulations of the claims' studies -> claims with numbers (CSV, JSON) and figures (PNG and SVG)."""

from pathlib import Path

from ccmodel.config import Claims, Measuring
from ccmodel.jobs import logged
from ccmodel.stages.claims import judge_claims

with logged(snakemake.log[0]):
    variables, recordings, simulated = snakemake.params.variables, snakemake.input.recordings, snakemake.input.simulated
    out = snakemake.output
    judge_claims(
        Claims.model_validate_json(snakemake.params.claims),
        Measuring.model_validate_json(snakemake.params.measuring),
        [(v, Path(r), Path(s)) for v, r, s in zip(variables, recordings, simulated, strict=True)],
        Path(snakemake.input.fit[0]) if snakemake.input.fit else None,
        Path(out.csv),
        Path(out.json),
        [Path(out.png), Path(out.svg)],
        [Path(out.model_png), Path(out.model_svg)],
    )
