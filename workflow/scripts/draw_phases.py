"""The simulated example of the configuration -> the paper's Figs. 5 to 7 (PNG and SVG)."""

from pathlib import Path

from ccmodel.config import PhaseExample
from ccmodel.jobs import logged
from ccmodel.stages.phases import draw_phases

with logged(snakemake.log[0]):
    draw_phases(PhaseExample.model_validate_json(snakemake.params.example), [Path(f) for f in snakemake.output])
