"""`batch.yaml`: the description of a batch of recordings, format 1 (`docs/rig-log-format.md`).

All keys that were added later are optional, so a file written before them keeps its meaning.
"""

from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import AfterValidator, Field, field_validator, model_validator

from ccmodel.channels import (
    ANGLE_AT,
    CHANNELS,
    F_DRIVE,
    F_LOAD,
    SUM_AT,
    TAU_IN,
    TAU_OUT,
    TENSIONS_AT,
    THETA_IN,
    THETA_OUT,
    TORQUE_AT,
)
from ccmodel.geometry import ConduitPath
from ccmodel.recording import FAR_ENDS
from ccmodel.typed import InputError, NotNegative, Positive, Problem, TypedModel, load_yaml_model

# Columns of sensors as they are read out, by the channel that is calibrated from them. A log may have the channel
# itself in their place: a physical column, which has the channel's name.
RAW_COLUMNS = {
    THETA_IN: ("drive_encoder_counts",),
    THETA_OUT: ("load_encoder_counts",),
    TAU_IN: ("drive_torque_counts", "drive_current_A"),
    TAU_OUT: ("load_torque_counts", "load_current_A"),
    F_DRIVE: ("drive_load_cell_V",),
    F_LOAD: ("load_load_cell_V",),
}
# One of these is the input of the model.
DRIVE_ANGLE_COLUMNS = (*RAW_COLUMNS[THETA_IN], THETA_IN)
SENSOR_COLUMNS = (
    "load_encoder_counts",
    "drive_current_A",
    "load_current_A",
    "drive_torque_counts",
    "load_torque_counts",
    "drive_load_cell_V",
    "load_load_cell_V",
    *(channel for channel in CHANNELS if channel != THETA_IN),
)
COLUMNS = ("time_s", *DRIVE_ANGLE_COLUMNS, *SENSOR_COLUMNS)

Sign = Literal[1, -1]
NAMES = "a name is letters, digits and -_.+=,@ only and begins with a letter or digit"


def valid_name(name: str) -> bool:
    """Whether a batch or recording can have this name: it becomes a folder, a file and a group of a netCDF file."""
    return all(c.isalnum() or c in "-_.+=,@" for c in name) and (name[:1].isalnum() or name[:1] == "_")


def _checked_name(name: str) -> str:
    if not valid_name(name):
        raise ValueError(NAMES)
    return name


Name = Annotated[str, AfterValidator(_checked_name)]


class LoadCell(TypedModel):
    """A load cell between slide and conduit plate: force = (V - zero_V) / sensitivity_V_per_N, in N."""

    sensitivity_V_per_N: Positive
    zero_V: float


class TorqueSensor(TypedModel):
    """A torque sensor logged in counts: torque = (counts - zero_counts) * Nm_per_count, in N m."""

    Nm_per_count: Positive
    zero_counts: float = 0.0


class Side(TypedModel):
    """Pulley and sensors at one end.

    A sign is -1 if the sensor counts against the signs of the model. If a log has torque counts and a current, the
    torque sensor is used, since the current only estimates the torque. `encoder_counts_per_rev` converts counts;
    `angle_resolution_rad` is the step of an angle that is logged in rad, 0 or absent if it has none.
    """

    pulley_radius_m: Positive
    encoder_counts_per_rev: Positive | None = None
    angle_resolution_rad: NotNegative | None = None
    encoder_sign: Sign = 1
    encoder_accuracy_rad: Positive | None = None
    torque_constant_Nm_per_A: Positive | None = None
    torque_sensor: TorqueSensor | None = None
    torque_sign: Sign = 1
    load_cell: LoadCell | None = None


class LoadSide(Side):
    """The load end; without a spring the load is the torque or motion measured at the load pulley."""

    spring_stiffness_Nm_per_rad: Positive | None = None


class Cable(TypedModel):
    """Prior estimates of the cable; the stiffness is that of `length_m` of cable, so EA is their product."""

    stiffness_N_per_m: Positive
    length_m: Positive
    friction_coefficient: NotNegative


class Accuracy(TypedModel):
    """Accuracy of the sensors, in SI units; absent for a sensor that the rig lacks."""

    encoder_rad: Positive
    torque_Nm: Positive | None = None
    load_cell_N: Positive | None = None


class End(NamedTuple):
    """One end of the rig, with its constants and the names of its channels."""

    name: str
    side: Side
    angle: str
    torque: str
    force: str
    tensions: tuple[str, ...]


class Rig(TypedModel):
    """The rig: both ends, the cable, the accuracy of the sensors and, by log column, their ranges."""

    transmission: Literal["pull-pull", "single-cable"] = "pull-pull"
    far_end: Literal[FAR_ENDS] | None = None
    drive: Side
    load: LoadSide
    cable: Cable
    accuracy: Accuracy
    ranges: dict[Literal[SENSOR_COLUMNS], tuple[float, float]] = Field(default_factory=dict)

    @property
    def ends(self) -> tuple[End, End]:
        """Drive end and load end."""
        sides, cables = {"drive": self.drive, "load": self.load}, 1 if self.far_end else 2
        return tuple(
            End(n, side, ANGLE_AT[n], TORQUE_AT[n], SUM_AT[n], TENSIONS_AT[n][:cables]) for n, side in sides.items()
        )

    @field_validator("ranges")
    @classmethod
    def _ranges_rise(cls, ranges):
        for column, (low, high) in ranges.items():
            if low >= high:
                raise ValueError(f"{column}: a range is [lowest, highest], found [{low}, {high}]")
        return ranges

    @model_validator(mode="after")
    def _far_end_of_a_single_cable(self):
        load, end = self.load, self.far_end
        if (self.transmission == "single-cable") != (end is not None):
            raise ValueError("far_end and transmission: single-cable are stated together or not at all")
        if end is not None and (end == "spring") != (load.spring_stiffness_Nm_per_rad is not None):
            raise ValueError("load.spring_stiffness_Nm_per_rad is stated where far_end is spring, and only there")
        return self

    @model_validator(mode="after")
    def _accuracy_of_every_sensor(self):
        for side in (self.drive, self.load):
            if (side.torque_constant_Nm_per_A or side.torque_sensor) and self.accuracy.torque_Nm is None:
                raise ValueError("accuracy.torque_Nm is missing though the rig measures torque")
            if side.load_cell and self.accuracy.load_cell_N is None:
                raise ValueError("accuracy.load_cell_N is missing though the rig has load cells")
        return self


class Piece(TypedModel):
    """A piece of the conduit with constant curvature."""

    length_m: Positive
    bend_rad: NotNegative


class RecordingEntry(TypedModel):
    """One recording: its log and its conditions. Samples before `settled_s` are a start-up transient."""

    id: Name
    file: str
    pretension_N: Positive
    conduit: Annotated[tuple[Piece, ...], Field(min_length=1)]
    excitation: dict[str, Any] = Field(default_factory=dict)
    settled_s: NotNegative = 0.0
    note: Any = None

    @field_validator("file")
    @classmethod
    def _file_inside_the_batch(cls, file: str) -> str:
        if not file.strip():
            raise ValueError("must be the log's path, from the batch's folder")
        if Path(file).is_absolute() or ".." in Path(file).parts:
            raise ValueError("a log lies inside its batch's folder: give its path from there")
        return file

    @property
    def path(self) -> ConduitPath:
        """The conduit's path."""
        return ConduitPath([p.length_m for p in self.conduit], [p.bend_rad for p in self.conduit])


class Batch(TypedModel):
    """A whole `batch.yaml`."""

    format: Literal[1]
    batch: Name
    origin: Literal["rig", "virtual-rig"]
    note: Any = None
    rig: Rig
    recordings: Annotated[tuple[RecordingEntry, ...], Field(min_length=1)]

    @field_validator("recordings")
    @classmethod
    def _each_once(cls, recordings):
        for key in ("id", "file"):
            values = [getattr(r, key) for r in recordings]
            twice = sorted({v for v in values if values.count(v) > 1})
            if twice:
                raise ValueError(f"{key} '{twice[0]}' is given to {values.count(twice[0])} recordings")
        return recordings


def load_batch(folder: Path) -> Batch:
    """Read the `batch.yaml` of a batch.

    Parameters
    ----------
    folder : Path
        The batch's folder, anywhere on disk.

    Returns
    -------
    Batch
        Its content.

    Raises
    ------
    InputError
        If the folder's name is not valid, the file is missing or does not follow the format, or the batch is not named
        like its folder.
    """
    path = Path(folder) / "batch.yaml"
    folder_name = Path(folder).resolve().name
    if not valid_name(folder_name):
        text = f"{folder_name!r} cannot be a batch's name: {NAMES}; rename the folder"
        raise InputError.of(Problem(str(folder), None, text))
    batch = load_yaml_model(path, Batch)
    if batch.batch != folder_name:
        text = f"batch: must be the folder's name, '{folder_name}', found '{batch.batch}': rename either"
        raise InputError.of(Problem(str(path), None, text))
    return batch
