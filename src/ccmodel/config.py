"""The typed configuration of a pipeline run: which batches, what is fitted, which studies are made of them."""

from pathlib import Path
from typing import ClassVar, Literal

from pydantic import Field, model_validator

from ccmodel.model.parameters import FORMER_NAMES
from ccmodel.rig.batch import valid_name
from ccmodel.steps.settings import Fit
from ccmodel.studies.accuracy.settings import Accuracy
from ccmodel.studies.baseline.settings import AgainstBaseline
from ccmodel.studies.claims.settings import Claims
from ccmodel.studies.diagnosis.settings import Diagnosing
from ccmodel.studies.loops.settings import Measuring, Study
from ccmodel.studies.phases.settings import PhaseExample
from ccmodel.studies.settings import EACH, StudySettings
from ccmodel.typed import InputError, TypedModel, load_yaml_model

ESTIMATED = "estimated"
EXTENDED = "extended"


class Config(TypedModel):
    """A pipeline run."""

    renamed: ClassVar = {"allowance": "tolerance", "suspects": "forced_candidates", **FORMER_NAMES}

    raw: str = Field("data/raw", description="folder with a folder a batch")
    results: str = Field("results", description="folder for all that the run makes")
    diagnose: list[str] | Literal["each"] = Field(
        default_factory=list, description="batches to diagnose: what differs from the model, and why; or 'each'"
    )
    diagnosing: Diagnosing = Field(default_factory=Diagnosing, description="how finely these are looked at")
    fits: dict[str, Fit] = Field(default_factory=dict, description="parameter sets fitted to recordings")
    studies: dict[str, Study] = Field(default_factory=dict, description="figures")
    measuring: Measuring = Field(default_factory=Measuring, description="how loops are measured")
    baseline: AgainstBaseline | None = Field(
        None, description="accuracy against the accepted one, and over past commits; absent: not compared"
    )
    claims: Claims | None = Field(None, description="the paper's words in numbers; absent: not asked")
    accuracy: Accuracy | None = Field(None, description="bias, scatter and comparison errors; absent: not asked")
    phases: PhaseExample | None = Field(None, description="simulated example of the paper's Figs. 5 to 7; absent: none")

    @model_validator(mode="after")
    def _names_known(self):
        for name, means in ((ESTIMATED, "the batches' own estimates"), (EXTENDED, "the models of the diagnoses")):
            if name in self.fits:
                raise ValueError(f"'{name}' names {means}; call the fit something else")
        if taken := self.studies.keys() & self.judgements.keys():
            raise ValueError(f"studies.{min(taken)}: that is the name of another study; call it something else")
        named = {f"study '{name}'": study for name, study in self.studies.items()}
        for where, study in (named | self.judgements).items():
            study.check(where, self)
        return self

    @property
    def judgements(self) -> dict[str, StudySettings]:
        """Studies that have a key of their own, by that key."""
        values = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: value for name, value in values.items() if isinstance(value, StudySettings)}

    @property
    def parameter_sets(self) -> list[str]:
        """The batches' own estimates, the fits, and, where batches are diagnosed, the models of their diagnoses."""
        return [ESTIMATED, *self.fits, *([EXTENDED] if self.diagnose else [])]

    def parameters_of(self, study: StudySettings) -> str:
        """Name of the parameter set that a study is made with: its own or, without one, the first fit's."""
        return study.parameters or self.parameter_sets[min(1, len(self.fits))]

    def diagnosed(self, batches: list[str]) -> list[str]:
        """Batches that are diagnosed, out of all."""
        return batches if self.diagnose == EACH else self.diagnose


def load_config(path: Path) -> Config:
    """Read and check a configuration file.

    Raises
    ------
    InputError
        With one line a problem: the file, the key, what to do.
    """
    return load_yaml_model(path, Config)


def batches_in(raw: Path) -> tuple[list[str], list[str]]:
    """Names of the batch folders in `raw`, sorted; and a line on each folder whose name no batch can have.

    Raises
    ------
    InputError
        If there is no such folder or no batch in it.
    """
    names = sorted(p.name for p in raw.glob("*") if p.is_dir() and not p.name.startswith("."))
    usable = [name for name in names if valid_name(name)]
    if not usable:
        raise InputError(f"{raw}: no batch here; a batch is a folder with a batch.yaml and its logs")
    advice = "a batch's name is letters, digits and -_.+=,@ only: rename the folder"
    return usable, [f"{raw / name}: {advice}" for name in names if name not in usable]


def expand_studies(config: Config, batches: list[str]) -> dict[str, Study]:
    """Studies by the name of their figure, with a study a batch for ``batches: each``.

    Raises
    ------
    InputError
        If a study, a fit or the list of diagnoses names a batch that is not there.
    """
    stated = {f"studies.{name}": study.batches for name, study in config.studies.items()}
    stated |= {f"fits.{name}": fit.batches for name, fit in config.fits.items()}
    for where, named in (stated | {"diagnose": config.diagnose}).items():
        for batch in [] if named == EACH else named:
            if batch not in batches:
                raise InputError(
                    f"{where}: there is no batch '{batch}' in {config.raw}; there are {', '.join(batches)}"
                )
    diagnosed, expanded = config.diagnosed(batches), {}
    for name, study in config.studies.items():
        wanted = batches if study.batches == EACH else study.batches
        if study.parameters == EXTENDED and (missing := [b for b in wanted if b not in diagnosed]):
            raise InputError(f"studies.{name}: '{EXTENDED}' parameters of {', '.join(missing)}, which no one diagnoses")
        title = study.title or name
        copies = {name: {"title": title}}
        if study.batches == EACH:
            copies = {f"{name}-{batch}": {"batches": [batch], "title": f"{title}, {batch}"} for batch in batches}
        expanded |= {figure: study.model_copy(update=update) for figure, update in copies.items()}
    return expanded
