"""All recordings, simulations and fits -> bias, scatter, comparison errors (CSV, JSON) and figures (PNG and SVG)."""

from pathlib import Path

from ccmodel.config import Accuracy, Measuring
from ccmodel.jobs import logged
from ccmodel.stages.accuracy import judge_accuracy

with logged(snakemake.log[0]):
    recordings, simulated, fits = snakemake.input.recordings, snakemake.input.simulated, snakemake.params.fit_of_batch
    out = snakemake.output
    judge_accuracy(
        Accuracy.model_validate_json(snakemake.params.accuracy),
        Measuring.model_validate_json(snakemake.params.measuring),
        [(Path(r), Path(s), Path(f) if f else None) for r, s, f in zip(recordings, simulated, fits, strict=True)],
        Path(out.csv),
        Path(out.by_recording),
        Path(out.json),
        [Path(out.png), Path(out.svg)],
        [Path(out.ratio_png), Path(out.ratio_svg)],
    )
