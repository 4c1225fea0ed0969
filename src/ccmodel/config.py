"""The typed configuration of a pipeline run: which batches, what is fitted, which studies are drawn."""

from math import inf
from pathlib import Path
from typing import Literal

from pydantic import Field, model_validator

from ccmodel.identify.problem import MEASURED
from ccmodel.model.parameters import FREE, OWN
from ccmodel.rig.batch import valid_name
from ccmodel.typed import InputError, TypedModel, load_yaml_model

# What a study can vary: how the legend names a recording is in ccmodel.compare.studies.
Variable = Literal["bend", "pretension", "radius", "frequency", "load_level", "recording"]
Figure = Literal["transmission", "torque-loops", "torque-loops-apart", "drive-loops"]
EACH = "each"
ESTIMATED = "estimated"


class FreeParameter(TypedModel):
    """A parameter that a fit may change."""

    start: float | None = Field(None, description="start value in SI units; absent: the batch's own estimate")
    bounds: tuple[float, float] = Field(description="lowest and highest value, SI units")

    @model_validator(mode="after")
    def _ordered(self):
        low, high = self.bounds
        if not low < high:
            raise ValueError(f"bounds must be lowest then highest; got {low} and {high}")
        if self.start is not None and not low <= self.start <= high:
            raise ValueError(f"start {self.start} is not within the bounds {low} to {high}")
        return self


class OwnParameter(TypedModel):
    """A parameter of each recording by itself."""

    spread: float = Field(gt=0, description="standard deviation from recording to recording, SI units")
    start: float | None = Field(None, description="where it is expected, SI units; absent: the batch's own estimate")
    bounds: tuple[float, float] | None = Field(None, description="lowest and highest value, SI units; absent: any")

    @model_validator(mode="after")
    def _ordered(self):
        low, high = self.bounds or (-inf, inf)
        if not low < high:
            raise ValueError(f"bounds must be lowest then highest; got {low} and {high}")
        return self


class Fit(TypedModel):
    """A set of parameters fitted to recordings; its name is the name of the set."""

    batches: list[str] | Literal["each"] = Field(
        description="batches fitted together and then carried over to all others; or 'each': every batch by itself"
    )
    free: dict[Literal[FREE], FreeParameter] = Field(min_length=1, description="what is fitted")
    per_recording: dict[Literal[OWN], OwnParameter] = Field(
        default_factory=dict, description="what each recording has a value of its own of"
    )
    channels: list[Literal[MEASURED]] = Field(
        list(MEASURED), min_length=1, description="what is compared; those recorded are used"
    )
    allowance: float = Field(
        0.0, ge=0, description="share of a channel's peak to peak that the model may leave, besides the noise"
    )
    starts: int = Field(1, ge=1, description="starts of the search, the configured one and others about it")
    step_s: float | None = Field(None, gt=0, description="take a sample every so often, s; absent: every sample")
    profile: list[Literal[FREE]] = Field(
        default_factory=list, description="what the interval of is also taken from its profile likelihood"
    )

    @model_validator(mode="after")
    def _each_has_one_part(self):
        if both := self.free.keys() & self.per_recording.keys():
            raise ValueError(f"{', '.join(sorted(both))}: either shared (free) or each recording's own (per_recording)")
        if unknown := set(self.profile) - self.free.keys():
            raise ValueError(f"profile: {', '.join(sorted(unknown))} is not free")
        return self


class Study(TypedModel):
    """One figure: which batches, what varies among their recordings, how it is drawn."""

    batches: list[str] | Literal["each"] = Field(description="batches in the figure; 'each': one figure a batch")
    variable: Variable = Field("recording", description="what varies, and names the recordings in the legend")
    figure: Figure = Field("torque-loops", description="how it is drawn")
    parameters: str | None = Field(None, description="parameter set of the model; absent: the first fit's")
    rows: Variable | None = Field(None, description="a row of panels for each value of this")
    title: str = Field("", description="what the figure shows, in a few words")

    @model_validator(mode="after")
    def _rows_are_drawn(self):
        if self.rows is not None and self.figure not in ("torque-loops", "drive-loops"):
            raise ValueError(f"figure '{self.figure}' has no rows; leave 'rows' out")
        return self


class Config(TypedModel):
    """A pipeline run."""

    raw: str = Field("data/raw", description="folder with a folder a batch")
    results: str = Field("results", description="folder for all that the run makes")
    fits: dict[str, Fit] = Field(default_factory=dict, description="parameter sets fitted to recordings")
    studies: dict[str, Study] = Field(default_factory=dict, description="figures")

    @model_validator(mode="after")
    def _names_known(self):
        if ESTIMATED in self.fits:
            raise ValueError(f"'{ESTIMATED}' names the batches' own estimates; call the fit something else")
        for name, study in self.studies.items():
            if study.parameters is not None and study.parameters not in self.parameter_sets:
                raise ValueError(
                    f"study '{name}' asks for parameters '{study.parameters}'; there are "
                    + ", ".join(self.parameter_sets)
                )
        return self

    @property
    def parameter_sets(self) -> list[str]:
        """The batches' own estimates, then the fits."""
        return [ESTIMATED, *self.fits]

    def parameters_of(self, study: Study) -> str:
        """Name of the parameter set that a study is drawn with."""
        return study.parameters or self.parameter_sets[min(1, len(self.fits))]


def load_config(path: Path) -> Config:
    """Read and check a configuration file.

    Raises
    ------
    InputError
        With one line a problem: which file, which key, what to do.
    """
    return load_yaml_model(path, Config)


def batches_in(raw: Path) -> tuple[list[str], list[str]]:
    """Names of the batch folders in `raw`, sorted; and a line on each folder that cannot be a batch by its name.

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
    """Studies by figure name, with `batches: each` spelt out.

    Raises
    ------
    InputError
        If a study or fit names a batch that is not there.
    """
    for kind, entries in (("studies", config.studies), ("fits", config.fits)):
        for name, entry in entries.items():
            for batch in [] if entry.batches == EACH else entry.batches:
                if batch not in batches:
                    raise InputError(
                        f"{kind}.{name}: there is no batch '{batch}' in {config.raw}; there are " + ", ".join(batches)
                    )
    expanded = {}
    for name, study in config.studies.items():
        if study.batches == EACH:
            for batch in batches:
                title = f"{study.title or name}, {batch}"
                expanded[f"{name}-{batch}"] = study.model_copy(update={"batches": [batch], "title": title})
        else:
            expanded[name] = study.model_copy(update={"title": study.title or name})
    return expanded
