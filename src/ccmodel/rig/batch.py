"""`batch.yaml`: the description of a batch of recordings, format 1 (`docs/rig-log-format.md`).

All keys that were added later are optional, so a file written before them keeps its meaning.
"""

import re
from collections import Counter
from collections.abc import Iterator
from datetime import UTC, datetime
from functools import reduce
from pathlib import Path, PurePath
from posixpath import normpath
from typing import Annotated, Any, Literal, NamedTuple, Self, get_args
from unicodedata import normalize

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, Field, field_validator, model_validator

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
    THETA_MOTOR,
    THETA_OUT,
    TORQUE_AT,
)
from ccmodel.geometry import ConduitPath
from ccmodel.recording import FAR_ENDS
from ccmodel.sentences import controls_in, shown
from ccmodel.typed import (
    IS_NUMBER,
    LARGEST,
    Borrowed,
    FillIn,
    Finite,
    InputError,
    Loc,
    NotNegative,
    OneOf,
    Positive,
    Problem,
    TypedModel,
    load_yaml_model,
    nearest,
)

# Columns of sensors as they are read out, by the channel that is calibrated from them. A log may have the channel
# itself in their place: a physical column, which has the channel's name.
RAW_COLUMNS = {
    THETA_IN: ("drive_encoder_counts",),
    THETA_OUT: ("load_encoder_counts",),
    TAU_IN: ("drive_torque_counts", "drive_current_A"),
    TAU_OUT: ("load_torque_counts", "load_current_A"),
    F_DRIVE: ("drive_load_cell_V",),
    F_LOAD: ("load_load_cell_V",),
    THETA_MOTOR: ("motor_encoder_counts",),
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
    "motor_encoder_counts",
    *(channel for channel in CHANNELS if channel != THETA_IN),
)
COLUMNS = ("time_s", *DRIVE_ANGLE_COLUMNS, *SENSOR_COLUMNS)

Sign = Annotated[Literal[1, -1], IS_NUMBER]
Format = Annotated[Literal[1], IS_NUMBER]
# Endings that a compressed file has beside that of its content.
_COMPRESSED = (".gz",)
# Bytes of a name in UTF-8. File systems allow 255 and netCDF 256, endings and names of studies included.
LONGEST_NAME = 150
NAMES = (
    "a name is letters, digits and -_.+=,@ only and begins with a letter, digit or _; it has at most"
    f" {LONGEST_NAME} letters (bytes in UTF-8)"
)


def valid_name(name: str) -> bool:
    """Whether a batch or recording can have this name: it becomes a folder, a file and a group of a netCDF file."""
    letters = all(c.isalnum() or c in "-_.+=,@" for c in name) and (name[:1].isalnum() or name[:1] == "_")
    return letters and len(name.encode(errors="replace")) <= LONGEST_NAME


def recording_id(file: str) -> str:
    """A valid id of a recording, from the name of its file without the ending, or both of a compressed file.

    Parameters
    ----------
    file : str
        Name of the file, with folders if these tell recordings apart.
    """
    path = PurePath(file)
    stem = path.with_suffix("") if path.suffix in _COMPRESSED else path
    name = re.sub(r"[^\w.+=,@-]+", "-", str(stem.with_suffix(""))).strip("-.") or "recording"
    name = name.encode()[: LONGEST_NAME - 1].decode(errors="ignore")
    return name if valid_name(name) else f"r{name}"


def _checked_name(name: str) -> str:
    name = one_spelling(name)
    if not valid_name(name):
        raise ValueError(NAMES)
    return name


def one_spelling(name: str) -> str:
    """A name as netCDF stores it: letters that look alike, as a composed and a decomposed é, are the same."""
    return normalize("NFC", name)


Name = Annotated[str, AfterValidator(_checked_name)]


class LoadCell(TypedModel):
    """A load cell between slide and conduit plate: force = (V - zero_V) / sensitivity_V_per_N, in N."""

    sensitivity_V_per_N: Annotated[Positive, FillIn("the sensitivity of this load cell, V/N")]
    zero_V: Annotated[Finite, FillIn("the reading of this load cell without force, V")]


class TorqueSensor(TypedModel):
    """A torque sensor logged in counts: torque = (counts - zero_counts) * Nm_per_count, in N m."""

    Nm_per_count: Annotated[Positive, FillIn("the scale of this torque sensor, N m per count")]
    zero_counts: Finite = 0.0


class Side(TypedModel):
    """Pulley and sensors at one end.

    A sign is -1 if the sensor counts against the signs of the model. If a log has torque counts and a current, the
    torque sensor is used, since the current only estimates the torque. `encoder_counts_per_rev` converts counts;
    `angle_resolution_rad` is the step of an angle that is logged in rad, 0 or absent if it has none.
    """

    pulley_radius_m: Annotated[Positive, FillIn("the radius of the {parent} pulley, m")]
    encoder_counts_per_rev: Annotated[
        Positive | None, FillIn("the counts of the {parent} encoder per revolution of its pulley")
    ] = None
    angle_resolution_rad: Annotated[
        NotNegative | None, FillIn("the step of the {parent} angle, rad, 0 if it has none")
    ] = None
    encoder_sign: Sign = 1
    encoder_accuracy_rad: Annotated[Positive | None, FillIn("the accuracy of the {parent} encoder, rad")] = None
    torque_constant_Nm_per_A: Annotated[
        Positive | None, FillIn("the torque constant of the {parent} motor at its pulley, N m/A")
    ] = None
    torque_sensor: TorqueSensor | None = None
    torque_sign: Sign = 1
    load_cell: LoadCell | None = None


class DriveSide(Side):
    """The drive end; `motor_counts_per_rev` converts the counts of an encoder at the motor, before gear and shaft."""

    motor_counts_per_rev: Annotated[
        Positive | None, FillIn("the counts of the motor's encoder per revolution of the drive pulley")
    ] = None
    motor_sign: Sign = 1


class LoadSide(Side):
    """The load end; without a spring the load is the torque or motion measured at the load pulley."""

    spring_stiffness_Nm_per_rad: Annotated[
        Positive | None, FillIn("the stiffness of the spring at the load, N m/rad, or remove the key if there is none")
    ] = None


class Cable(TypedModel):
    """Prior estimates of the cable; the stiffness is that of `length_m` of cable, so EA is their product."""

    stiffness_N_per_m: Annotated[Positive, FillIn("the stiffness of the cable, N/m")]
    length_m: Annotated[Positive, FillIn("the length of cable that has this stiffness, m")]
    friction_coefficient: Annotated[NotNegative, FillIn("the friction coefficient of the cable in its conduit")]


class Accuracy(TypedModel):
    """Accuracy of the sensors, in SI units; absent for a sensor that the rig lacks."""

    encoder_rad: Annotated[Positive, FillIn("the accuracy of the angles, rad")]
    torque_Nm: Annotated[Positive | None, FillIn("the accuracy of the torques, N m")] = None
    load_cell_N: Annotated[Positive | None, FillIn("the accuracy of the load cells, N")] = None


class End(NamedTuple):
    """One end of the rig, with its constants and the names of its channels."""

    name: str
    side: Side
    angle: str
    torque: str
    force: str
    tensions: tuple[str, ...]


class Rig(TypedModel):
    """The rig: both ends, the cable, the accuracy of the sensors and, by log column, their ranges.

    `nominal` names stated values that nobody measured, as `cable.stiffness_N_per_m`.
    """

    transmission: Literal["pull-pull", "single-cable"] = "pull-pull"
    far_end: Annotated[str, OneOf(FAR_ENDS)] | None = None
    drive: DriveSide
    load: LoadSide
    cable: Cable
    accuracy: Accuracy
    ranges: dict[Annotated[str, OneOf(SENSOR_COLUMNS)], tuple[float, float]] = Field(default_factory=dict)
    nominal: tuple[str, ...] = ()

    @property
    def ends(self) -> tuple[End, End]:
        """Drive end and load end."""
        return self._end("drive", self.drive), self._end("load", self.load)

    @property
    def in_place_of(self) -> dict[str, str]:
        """By column of a torque sensor, the motor current of the same end, which is not used beside it."""
        every = ((end, RAW_COLUMNS[end.torque]) for end in self.ends)
        return {counts: current for end, (counts, current) in every if end.side.torque_sensor}

    def _end(self, name: str, side: "Side") -> "End":
        tensions = TENSIONS_AT[name][: 1 if self.far_end else 2]
        return End(name, side, ANGLE_AT[name], TORQUE_AT[name], SUM_AT[name], tensions)

    @field_validator("ranges")
    @classmethod
    def _ranges_rise(cls, ranges: dict[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
        for column, (low, high) in ranges.items():
            if low >= high:
                raise ValueError(f"{column}: a range is [lowest, highest], found [{low}, {high}]")
        return ranges

    @field_validator("nominal")
    @classmethod
    def _nominal_keys_exist(cls, nominal: tuple[str, ...]) -> tuple[str, ...]:
        known = list(_dotted_keys(cls))
        for key in nominal:
            if key not in known:
                guess = nearest(key, known)
                advice = f"did you mean '{guess}'?" if guess else "it is a path as cable.stiffness_N_per_m"
                raise ValueError(f"there is no key '{key}' below rig; {advice}")
        return nominal

    @model_validator(mode="after")
    def _nominal_keys_are_stated(self) -> Self:
        for key in self.nominal:
            if reduce(lambda part, name: part and getattr(part, name), key.split("."), self) is None:
                raise ValueError(f"nominal names '{key}', which is not stated: state it, or take it out of nominal")
        return self

    @model_validator(mode="after")
    def _far_end_of_a_single_cable(self) -> Self:
        load, end = self.load, self.far_end
        if (self.transmission == "single-cable") != (end is not None):
            raise ValueError("far_end and transmission: single-cable are stated together or not at all")
        if end is not None and (end == "spring") != (load.spring_stiffness_Nm_per_rad is not None):
            raise ValueError("load.spring_stiffness_Nm_per_rad is stated where far_end is spring, and only there")
        return self

    @model_validator(mode="after")
    def _accuracy_of_every_sensor(self) -> Self:
        for side in (self.drive, self.load):
            if (side.torque_constant_Nm_per_A or side.torque_sensor) and self.accuracy.torque_Nm is None:
                raise ValueError("accuracy.torque_Nm is missing though the rig measures torque")
            if side.load_cell and self.accuracy.load_cell_N is None:
                raise ValueError("accuracy.load_cell_N is missing though the rig has load cells")
        return self


def _dotted_keys(model: type[BaseModel], above: str = "") -> Iterator[str]:
    """Paths of all keys of a model and of the models in it."""
    for name, field in model.model_fields.items():
        yield f"{above}{name}"
        for part in (field.annotation, *get_args(field.annotation)):
            if isinstance(part, type) and issubclass(part, BaseModel):
                yield from _dotted_keys(part, f"{above}{name}.")


class Piece(TypedModel):
    """A piece of the conduit with constant curvature."""

    length_m: Annotated[Positive, FillIn("the length of this piece of the conduit, m")]
    bend_rad: Annotated[NotNegative, FillIn("the bend of this piece of the conduit, rad, 0 if it is straight")]


Conduit = Annotated[tuple[Piece, ...], Field(min_length=1)]
# Waves whose amplitude and frequency are compared with the recording (`ccmodel.rig.consistency.parity`).
WAVES, _NOTED_NUMBERS = ("sine", "triangle"), ("amplitude_rad", "frequency_Hz")
PRETENSION = "the tension to which each cable was set before the motion, N"
CONDUIT = "the pieces of the conduit from the drive end, as [{length_m: 1.2, bend_rad: 3.14}]"


def _moment(stated: Any) -> datetime | None:
    """A date with a time of day; without an offset from UTC it is UTC."""
    try:
        if isinstance(stated, str) and not re.search("[Tt ]", stated.strip()):
            raise ValueError
        at = datetime.fromisoformat(stated) if isinstance(stated, str) else stated
        return at if at is None or at.tzinfo else at.replace(tzinfo=UTC)
    except (AttributeError, TypeError, ValueError):
        raise ValueError("must be a date with a time of day as 2026-03-31T14:05:00+02:00 (ISO 8601)") from None


Moment = Annotated[datetime | None, BeforeValidator(_moment)]


class RecordingEntry(TypedModel):
    """One recording: its log and its conditions. Samples before `settled_s` are a start-up transient.

    `started_at` is the time of the log's first sample and `tensioned_at` that of the cables' last tensioning before it.
    """

    id: Name
    file: str
    pretension_N: Annotated[Positive, FillIn(PRETENSION)]
    conduit: Annotated[Conduit, FillIn(CONDUIT)]
    excitation: dict[str, Any] = Field(default_factory=dict)
    settled_s: NotNegative = 0.0
    started_at: Moment = None
    tensioned_at: Moment = None
    note: Any = None

    @field_validator("excitation")
    @classmethod
    def _numbers_of_a_sine(cls, excitation: dict[str, Any]) -> dict[str, Any]:
        for key in _NOTED_NUMBERS if excitation.get("wave") in WAVES else ():
            number = excitation.get(key)
            if number is not None and not (type(number) in (int, float) and 0 <= number < LARGEST):
                raise ValueError(f"{key} of a {excitation['wave']} is a number that is not negative")
        return excitation

    @model_validator(mode="after")
    def _tensioned_before_it_started(self) -> Self:
        if self.started_at is not None and self.tensioned_at is not None and self.tensioned_at > self.started_at:
            late_s = (self.tensioned_at - self.started_at).total_seconds()
            raise ValueError(
                f"tensioned_at is {late_s:g} s after started_at: the cables are tensioned before the recording starts;"
                " correct one of the two, or remove tensioned_at"
            )
        return self

    @field_validator("file")
    @classmethod
    def _file_inside_the_batch(cls, file: str) -> str:
        if not file.strip():
            raise ValueError("must be the log's path, from the batch's folder")
        if controls_in(file):
            raise ValueError(f"{shown(file)}: has characters that do not show; rename the log")
        if Path(file).is_absolute() or ".." in Path(file).parts:
            raise ValueError("a log lies inside its batch's folder: give its path from there")
        if any(part.startswith(".") for part in Path(file).parts):
            # Hidden files are not among the inputs that a result names (`ccmodel.provenance.files_in`).
            raise ValueError("a log is no hidden file and lies in no hidden folder: rename it")
        return file

    @property
    def path(self) -> ConduitPath:
        """The conduit's path."""
        return ConduitPath(np.array([p.length_m for p in self.conduit]), np.array([p.bend_rad for p in self.conduit]))


class RecordingDefaults(TypedModel):
    """Conditions of all recordings that do not state them themselves, key by key."""

    pretension_N: Annotated[Positive | None, FillIn(PRETENSION)] = None
    conduit: Annotated[Conduit | None, FillIn(CONDUIT)] = None
    excitation: dict[str, Any] = Field(default_factory=dict)
    settled_s: NotNegative = 0.0
    tensioned_at: Moment = None
    note: Any = None


class Batch(TypedModel):
    """A whole `batch.yaml`; the recordings have the defaults that they do not state."""

    format: Format
    batch: Name
    origin: Literal["rig", "virtual-rig"]
    note: Any = None
    rig: Rig
    defaults: RecordingDefaults = RecordingDefaults()
    recordings: Annotated[tuple[RecordingEntry, ...], Field(min_length=1)]

    @classmethod
    def completed(cls, data: dict) -> tuple[dict, Borrowed]:
        """Recordings with the defaults that they do not state."""
        defaults, recordings = data.get("defaults"), data.get("recordings")
        if not isinstance(defaults, dict) or not isinstance(recordings, list):
            return data, {}
        known = RecordingDefaults.model_fields
        given = {key: value for key, value in defaults.items() if key in known}
        # A misspelt default is one problem, and not also a missing key of each recording.
        guesses = (nearest(key, known) for key in defaults.keys() - set(known))
        meant = {*given, *(guess for guess in guesses if guess)}
        entries = []
        borrowed: dict[Loc, Loc] = {}
        for i, entry in enumerate(recordings):
            if isinstance(entry, dict):
                borrowed |= {("recordings", i, key): ("defaults", key) for key in meant - set(entry)}
                entry = given | entry
            entries.append(entry)
        return data | {"recordings": entries}, borrowed

    @field_validator("recordings")
    @classmethod
    def _each_once(cls, recordings: tuple[RecordingEntry, ...]) -> tuple[RecordingEntry, ...]:
        # A file may be written in several ways: a.csv, ./a.csv.
        for key, values in {"id": [r.id for r in recordings], "file": [normpath(r.file) for r in recordings]}.items():
            counts = Counter(values)
            if twice := sorted(value for value, count in counts.items() if count > 1):
                raise ValueError(f"{key} '{twice[0]}' is given to {counts[twice[0]]} recordings")
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
    if not valid_name(one_spelling(folder_name)):
        text = f"{folder_name!r} cannot be a batch's name: {NAMES}; rename the folder"
        raise InputError.of(Problem(str(folder), None, text))
    batch = load_yaml_model(path, Batch)
    if batch.batch != one_spelling(folder_name):
        text = f"batch: must be the folder's name, '{folder_name}', found '{batch.batch}': rename either"
        raise InputError.of(Problem(str(path), None, text))
    return batch
