"""Recordings and simulations of a study -> its figure (PNG and SVG)."""

from pathlib import Path

from ccmodel.config import Study
from ccmodel.jobs import logged
from ccmodel.stages.draw import draw_study

with logged(snakemake.log[0]):
    draw_study(
        Study.model_validate_json(snakemake.params.study),
        [(Path(r), Path(s)) for r, s in zip(snakemake.input.recordings, snakemake.input.simulated, strict=True)],
        [Path(snakemake.output.png), Path(snakemake.output.svg)],
    )
