"""The typed configuration of a pipeline run: which batches, what is fitted, which studies are drawn."""

from math import inf
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from ccmodel import mechanisms
from ccmodel.channels import MEASURED
from ccmodel.model.parameters import FORMER_NAMES, FREE, OWN
from ccmodel.rig.batch import valid_name
from ccmodel.typed import InputError, Positive, TypedModel, load_yaml_model

# What a study can vary: how the legend names a recording is in ccmodel.compare.studies.
Variable = Literal["bend", "pretension", "radius", "frequency", "load_level", "recording"]
Figure = Literal["transmission", "torque-loops", "torque-loops-apart", "drive-loops"]
# The figures of a simulated example; how each is drawn is in ccmodel.report.phases.
PHASE_FIGURES = ("response", "torque-loop", "profiles")
EACH = "each"
ESTIMATED = "estimated"
EXTENDED = "extended"

Share = Annotated[float, Field(ge=0, lt=0.5)]
Tolerance = Share | dict[Literal[MEASURED], Share]


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
    tolerance: Tolerance = Field(
        0.0,
        description="share of a channel's peak to peak that the model may leave, besides the noise; or by channel",
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


class PhaseExample(TypedModel):
    """The simulated example of the paper's Figs. 5 to 7: a sine on a pair with a spring load, from rest."""

    conduit_length_m: Positive = Field(description="arc length of the conduits, m")
    conduit_bend_rad: Positive = Field(description="bend angle of the conduits, even along the way, rad")
    cable_stiffness_N_per_m: Positive = Field(description="stiffness of one cable with its conduit, N/m")
    friction_coefficient: Positive = Field(description="mu between cable and conduit")
    pulley_radius_m: Positive = Field(description="radius of both pulleys, m")
    load_stiffness_Nm_per_rad: Positive = Field(description="stiffness of the load's spring, N m/rad")
    pretension_N: Positive = Field(description="initial tension all along both cables, N")
    amplitude_rad: Positive = Field(description="amplitude of the drive angle, rad")
    frequency_Hz: Positive = Field(description="frequency of the drive angle, Hz")
    samples_per_cycle: int = Field(4000, ge=8, multiple_of=4, description="samples a cycle")


class Measuring(TypedModel):
    """How loops are measured; the same for recordings and models."""

    smoothing_share: float = Field(
        0.02, ge=0, lt=0.2, description="share of a cycle that the moving mean over every channel takes"
    )
    middle_share: float = Field(
        0.1, gt=0, lt=0.5, description="width and slope: half the band about the middle, as a share of peak to peak"
    )
    moved_share: float = Field(
        0.1, gt=0, lt=0.33, description="the load follows when it has gone this share of its peak to peak since a turn"
    )
    closed_share: float = Field(
        0.05, gt=0, lt=1, description="a cycle ends where it began, to this share of the drive's peak to peak"
    )
    slack_below_N: float = Field(0.1, gt=0, description="a cable with less tension than this at both ends is slack, N")
    fewest_samples: int = Field(10, ge=3, description="samples that a line takes at least")


class ModelStudies(TypedModel):
    """Runs of the model alone, for what no recording varies; a drive that moves as a sine."""

    pretension_N: float = Field(gt=0, description="tension before the drive moves, N")
    amplitude_rad: float = Field(gt=0, description="amplitude of the drive, rad")
    cycles: int = Field(3, ge=2, description="cycles of the drive; the last one counts")
    samples_a_cycle: int = Field(1000, ge=100, description="samples a cycle")
    conduit_length_m: float = Field(gt=0, description="length of the conduit, m")
    bend_rad: float = Field(gt=0, description="bend of the one loop, rad")
    loop_radius_m: float = Field(gt=0, description="radius of the one loop where it is placed along the conduit, m")
    load_stiffness_Nm_per_rad: list[float] = Field(min_length=2, description="springs at the load, N m/rad")
    sections: list[int] = Field(min_length=2, description="sections of a cable in the paper's discretisation")
    sections_bend_rad: list[float] = Field(min_length=1, description="bends that the sections are counted for, rad")
    sections_error_percent: float = Field(gt=0, description="error that is small enough, % of peak to peak")


class Claims(TypedModel):
    """What the paper says in words, to be put in numbers."""

    bend: str = Field(description="study in which the number of loops varies")
    pretension: str = Field(description="study in which the pretension varies")
    radius: str = Field(description="study in which the loop radius varies")
    coverage: float = Field(0.9, gt=0, lt=1, description="probability that an interval holds")
    small_percent: float = Field(gt=0, description="a change below this is none to speak of, % of the mean")
    seen_percent: float = Field(1.0, gt=0, description="a phase that takes less of the cycle is not seen, %")
    model: ModelStudies = Field(description="runs of the model alone")

    @property
    def studies(self) -> dict[str, str]:
        """Name of the study that each variable varies in."""
        return {"bend": self.bend, "pretension": self.pretension, "radius": self.radius}


class Accuracy(TypedModel):
    """How near the model is to the recordings, by the measures that other fields report."""

    parameters: str | None = Field(None, description="parameter set of the model; absent: the first fit's")
    coverage: float = Field(0.9, gt=0, lt=1, description="probability that an interval holds")
    coverage_factor: float = Field(2.0, gt=0, description="standard uncertainties that an error may have")


class Diagnosing(TypedModel):
    """How finely a diagnosis looks."""

    tolerance: Tolerance = Field(
        0.0,
        description="share of a channel's peak to peak that a right model may leave besides noise; or by channel",
    )
    step_s: float | None = Field(None, gt=0, description="compare a sample every so often, s; absent: finely")
    cycles: int | None = Field(None, ge=1, description="cycles of a sine that are compared once settled; absent: all")
    forced_candidates: list[list[str]] = Field(
        default_factory=list,
        description="one or two mechanisms each, 'name at place', to fit in full whatever the screening says",
    )

    @model_validator(mode="after")
    def _suspects_known(self):
        for one in (s for suspect in self.forced_candidates for s in suspect):
            name, _, place = one.partition(" at ")
            if name not in mechanisms.names() or place not in mechanisms.get(name).places:
                raise ValueError(f"forced_candidates: there is no mechanism '{one}'; one is stated as 'name at place'")
        if any(len(suspect) not in (1, 2) for suspect in self.forced_candidates):
            raise ValueError("forced_candidates: each is a list of one mechanism or of two")
        return self


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
    phases: PhaseExample | None = Field(None, description="simulated example of the paper's Figs. 5 to 7; absent: none")
    measuring: Measuring = Field(default_factory=Measuring, description="how loops are measured")
    claims: Claims | None = Field(None, description="the paper's words in numbers; absent: not asked")
    accuracy: Accuracy | None = Field(None, description="bias, scatter and comparison errors; absent: not asked")

    @model_validator(mode="after")
    def _claims_and_accuracy_known(self):
        for variable, study in (self.claims.studies if self.claims else {}).items():
            if study not in self.studies or self.studies[study].batches == EACH:
                raise ValueError(f"claims.{variable}: '{study}' is no study of named batches")
            if self.studies[study].variable != variable:
                raise ValueError(f"claims.{variable}: study '{study}' varies {self.studies[study].variable}")
        wanted = self.accuracy.parameters if self.accuracy else None
        if wanted is not None and wanted not in self.parameter_sets:
            raise ValueError(f"accuracy asks for parameters '{wanted}'; there are " + ", ".join(self.parameter_sets))
        return self

    @model_validator(mode="after")
    def _names_known(self):
        for name, means in ((ESTIMATED, "the batches' own estimates"), (EXTENDED, "what their diagnoses found")):
            if name in self.fits:
                raise ValueError(f"'{name}' names {means}; call the fit something else")
        for name, study in self.studies.items():
            if study.parameters is not None and study.parameters not in self.parameter_sets:
                raise ValueError(
                    f"study '{name}' asks for parameters '{study.parameters}'; there are "
                    + ", ".join(self.parameter_sets)
                )
        return self

    @property
    def parameter_sets(self) -> list[str]:
        """The batches' own estimates, the fits, and, where batches are diagnosed, what their diagnoses found."""
        return [ESTIMATED, *self.fits, *([EXTENDED] if self.diagnose else [])]

    def parameters_of(self, study: Study | Accuracy) -> str:
        """Name of the parameter set that a study is drawn with, or the accuracy is that of."""
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
    diagnosed = batches if config.diagnose == EACH else config.diagnose
    for batch in diagnosed:
        if batch not in batches:
            raise InputError(f"diagnose: there is no batch '{batch}' in {config.raw}; there are " + ", ".join(batches))
    for name, study in config.studies.items():
        wanted = batches if study.batches == EACH else study.batches
        if study.parameters == EXTENDED and (aside := [b for b in wanted if b not in diagnosed]):
            raise InputError(f"studies.{name}: '{EXTENDED}' parameters of {', '.join(aside)}, which no one diagnoses")
    expanded = {}
    for name, study in config.studies.items():
        if study.batches == EACH:
            for batch in batches:
                title = f"{study.title or name}, {batch}"
                expanded[f"{name}-{batch}"] = study.model_copy(update={"batches": [batch], "title": title})
        else:
            expanded[name] = study.model_copy(update={"title": study.title or name})
    return expanded
