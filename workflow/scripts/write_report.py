"""Error table, fits, what was found in the batches, figures -> the page (HTML) and what was left out (JSON)."""

from pathlib import Path

from ccmodel.config import Config, Study
from ccmodel.jobs import logged
from ccmodel.stages.report import write_report

with logged(snakemake.log[0]):
    write_report(
        Config.model_validate_json(snakemake.params.config),
        {name: Study.model_validate_json(study) for name, study in snakemake.params.studies.items()},
        Path(snakemake.input.errors),
        [Path(f) for f in snakemake.input.fits],
        [Path(f) for f in snakemake.input.summaries],
        [Path(f) for f in snakemake.input.simulations],
        [Path(f) for f in snakemake.input.diagnoses],
        list(snakemake.params.unusable),
        [Path(f) for f in (*snakemake.input.claims, *snakemake.input.accuracy)],
        Path(snakemake.output.page),
    )
