"""The typed configuration of a pipeline run: which batches, what is fitted, which studies are made of them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from ccmodel.model.parameters import FORMER_NAMES
from ccmodel.rig.batch import NAMES, one_spelling, valid_name
from ccmodel.steps.settings import Fit
from ccmodel.studies.accuracy.settings import Accuracy
from ccmodel.studies.baseline.settings import AgainstBaseline
from ccmodel.studies.claims.settings import Claims
from ccmodel.studies.diagnosis.settings import MODEL_FILES, Diagnosing
from ccmodel.studies.loops.settings import Measuring, Study
from ccmodel.studies.phases.settings import PhaseExample
from ccmodel.studies.settings import EACH, StudySettings
from ccmodel.typed import InputError, TypedModel, load_yaml_model

ESTIMATED = "estimated"


class Config(TypedModel):
    """A pipeline run."""

    renamed: ClassVar = {"allowance": "tolerance", "suspects": "forced_candidates", **FORMER_NAMES}

    raw: str = Field("data/raw", description="folder with a folder a batch")
    results: str = Field("results", description="folder for all that the run makes")
    rigs: dict[str, list[str]] = Field(
        default_factory=dict,
        description="batches of one rig, by its name: fits of these are used for these only; a batch that is not listed"
        " is a rig of its own; absent: all batches are one rig",
    )
    diagnose: list[str] | Literal["each"] = Field(
        default_factory=list, description="batches to diagnose: what differs from the model, and why; or 'each'"
    )
    diagnose_rigs: list[str] | Literal["each"] = Field(
        default_factory=list,
        description="rigs of several batches (see 'rigs') whose batches are diagnosed together as well; or 'each'",
    )
    diagnosing: Diagnosing = Field(default_factory=Diagnosing, description="how finely these are looked at")
    diagnosing_by_batch: dict[str, Diagnosing] = Field(
        default_factory=dict,
        description="settings of a batch, or of a rig whose batches are diagnosed together, that differ from"
        " 'diagnosing'",
    )
    concealed: str | None = Field(
        None, description="file with what simulated rigs have, which the page alone reads, after all verdicts"
    )
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
    def _batches_fit(self) -> Self:
        listed = [batch for batches in self.rigs.values() for batch in batches]
        for batch in listed:
            if listed.count(batch) > 1:
                raise ValueError(f"rigs: batch '{batch}' is listed twice; a batch belongs to one rig")
        for name, fit in self.fits.items():
            if fit.batches != EACH and not all(self.same_rig(fit.batches[0], batch) for batch in fit.batches):
                raise ValueError(f"fits.{name}: {', '.join(fit.batches)} are not of one rig (see 'rigs')")
        for batch in self.diagnosing_by_batch:
            if not self.diagnosed([batch]) and batch not in self.diagnosed_rigs:
                raise ValueError(f"diagnosing_by_batch: '{batch}' is not diagnosed; name it in 'diagnose'")
        return self

    @model_validator(mode="after")
    def _rigs_can_be_diagnosed(self) -> Self:
        for rig in [] if self.diagnose_rigs == EACH else self.diagnose_rigs:
            if rig not in self.rigs:
                raise ValueError(f"diagnose_rigs: there is no rig '{rig}'; state its batches in 'rigs'")
            if len(self.rigs[rig]) == 1:
                raise ValueError(f"diagnose_rigs: rig '{rig}' has one batch; name that batch in 'diagnose'")
        for rig in self.diagnosed_rigs:
            if not valid_name(rig):
                raise ValueError(f"rigs.{rig}: cannot be a folder of results; {NAMES}")
        return self

    @model_validator(mode="after")
    def _names_known(self) -> Self:
        means = {ESTIMATED: "the batches' own estimates"} | dict.fromkeys(MODEL_FILES, "models of the diagnoses")
        for name in self.fits:
            if name in means:
                raise ValueError(f"fits.{name}: '{name}' names {means[name]}; call the fit something else")
        for key, named in (("fits", self.fits), ("studies", self.studies)):
            for name in named:
                if not valid_name(name):
                    raise ValueError(f"{key}.{name}: becomes the name of a file; {NAMES}")
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
        """All parameter sets; not every batch has each (`sets_of`)."""
        return [ESTIMATED, *self.fits, *(MODEL_FILES if self.diagnose else [])]

    def sets_of(self, batch: str) -> list[str]:
        """Parameter sets of a batch: its own estimates, the fits of its rig and the models of its diagnosis."""
        fits = [n for n, f in self.fits.items() if f.batches == EACH or any(self.same_rig(batch, b) for b in f.batches)]
        return [ESTIMATED, *fits, *(MODEL_FILES if self.diagnosed([batch]) else [])]

    def parameters_of(self, wanted: str | None, batch: str) -> str:
        """Name of the parameter set that a study takes for a batch, if it wants this one, or any.

        Any is the first fit of the batch's rig, or the calibrated model of its diagnosis, or its estimates.
        """
        return wanted or self.sets_of(batch)[:2][-1]

    def same_rig(self, one: str, other: str) -> bool:
        """Whether two batches were recorded on the same rig."""
        return not self.rigs or one == other or any({one, other} <= set(batches) for batches in self.rigs.values())

    def diagnosed(self, batches: list[str]) -> list[str]:
        """Batches that are diagnosed, out of these."""
        return [batch for batch in batches if self.diagnose == EACH or batch in self.diagnose]

    @property
    def diagnosed_rigs(self) -> dict[str, list[str]]:
        """Batches of each rig whose batches are diagnosed together, by the rig's name."""
        several = {rig: batches for rig, batches in self.rigs.items() if len(batches) > 1}
        return {rig: of for rig, of in several.items() if self.diagnose_rigs == EACH or rig in self.diagnose_rigs}

    def diagnosing_of(self, batch: str) -> Diagnosing:
        """Settings of the diagnosis of a batch, or of a rig."""
        own = self.diagnosing_by_batch.get(batch, Diagnosing())
        return self.diagnosing.model_copy(update={name: getattr(own, name) for name in own.model_fields_set})


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
    usable = [name for name in names if valid_name(one_spelling(name))]
    if not usable:
        raise InputError(f"{raw}: no batch here; a batch is a folder with a batch.yaml and its logs")
    return usable, [f"{raw / name}: {NAMES}: rename the folder" for name in names if name not in usable]


def expand_studies(config: Config, batches: list[str]) -> dict[str, Study]:
    """Studies by the name of their figure, with a study a batch for ``batches: each``.

    Raises
    ------
    InputError
        If a study or another section names a batch that is not there, or a study a parameter set that one of its
        batches does not have.
    """
    stated = {f"studies.{name}": study.batches for name, study in config.studies.items()}
    stated |= {f"fits.{name}": fit.batches for name, fit in config.fits.items()}
    stated |= {f"rigs.{name}": named for name, named in config.rigs.items()}
    of_batches = [name for name in config.diagnosing_by_batch if name not in config.diagnosed_rigs]
    stated |= {"diagnose": config.diagnose, "diagnosing_by_batch": of_batches}
    for where, named in stated.items():
        for batch in [] if named == EACH else named:
            if batch not in batches:
                raise InputError(
                    f"{where}: there is no batch '{batch}' in {config.raw}; there are {', '.join(batches)}"
                )
    if taken := config.diagnosed_rigs.keys() & set(batches):
        raise InputError(f"rigs.{min(taken)}: is the name of a batch too; give the rig another one to diagnose it")
    expanded: dict[str, Study] = {}
    for name, study in config.studies.items():
        wanted = batches if study.batches == EACH else study.batches
        if missing := [
            batch for batch in wanted if config.parameters_of(study.parameters, batch) not in config.sets_of(batch)
        ]:
            why = "not diagnosed" if study.parameters in MODEL_FILES else "of another rig than the fit's"
            raise InputError(
                f"studies.{name}: there are no '{study.parameters}' parameters of {', '.join(missing)}: {why}"
            )
        title = study.title or name
        copies: dict[str, dict[str, Any]] = {name: {"title": title}}
        if study.batches == EACH:
            copies = {f"{name}-{batch}": {"batches": [batch], "title": f"{title}, {batch}"} for batch in batches}
        if taken := expanded.keys() & copies.keys():
            raise InputError(f"studies.{name}: '{min(taken)}' is the name of another study; call it something else")
        expanded |= {figure: study.model_copy(update=update) for figure, update in copies.items()}
    _check_figures(expanded | config.judgements)
    return expanded


def _check_figures(studies: Mapping[str, StudySettings]) -> None:
    """Refuse two studies that would make one figure."""
    made_by: dict[str, str] = {}
    for name, study in studies.items():
        for figure in (stem.format(name=name) for stem in study.figures):
            if figure in made_by:
                raise InputError(
                    f"studies: '{made_by[figure]}' and '{name}' both make the figure {figure}; call one something else"
                )
            made_by[figure] = name
