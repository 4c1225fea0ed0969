"""A model as a file: parameters, mechanisms and the rig's conditions, as JSON (docs/diagnosis.md, Model files)."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, Field, ValidationError

from ccmodel import inputs
from ccmodel import mechanisms as registry
from ccmodel.geometry import ConduitPath
from ccmodel.model.active import Active
from ccmodel.model.parameters import FORMER_NAMES, Parameters
from ccmodel.outputs import new_file
from ccmodel.recording import FAR_ENDS, ORIGIN, Recording
from ccmodel.typed import InputError, NotNegative, OneOf, Positive, TypedModel, advice

FORMAT = 1

# Parameters that a file may state, must state, and may state as null.
_KNOWN = {f.name: f for f in fields(Parameters) if f.name not in ("mechanisms", "refinement")}
_REQUIRED = [name for name, f in _KNOWN.items() if f.default is MISSING]
_SESSION = ("session_start_s", "session_end_s")  # not in a file where they are not known
_OPTIONAL = [name for name, f in _KNOWN.items() if "None" in str(f.type)]
# Limits of parameters in SI units: what is beyond them overflows, or can be no part of a rig.
LARGEST_PARAMETER = 1e15
LEAST = {"stiffness_N_per_m": 0.0, "reference_length_m": 0.0, "drive_radius_m": 1e-9, "load_radius_m": 1e-9}


class _ActiveEntry(TypedModel):
    name: str
    place: str
    values: dict[str, float]


class _PieceEntry(TypedModel):
    length_m: Positive
    bend_rad: NotNegative


class _ConditionEntry(TypedModel):
    recording: str
    pretension_N: NotNegative
    conduit: list[_PieceEntry] = Field(min_length=1)


class _RigEntry(TypedModel):
    batch: str
    origin: Literal["rig", "virtual-rig"]
    far_end: Annotated[str, OneOf(FAR_ENDS)] | None = None
    conditions: list[_ConditionEntry] = Field(min_length=1)


class _IntervalEntry(TypedModel):
    low: float | None
    high: float | None
    sd: float | None


class _ModelFile(TypedModel):
    format: int = Field(ge=FORMAT, le=FORMAT)
    parameters: dict[str, float | None]
    mechanisms: list[_ActiveEntry] = Field(default_factory=list)
    rig: _RigEntry | None = None
    intervals: dict[str, _IntervalEntry] = Field(default_factory=dict)
    fit: dict[str, Any] = Field(default_factory=dict)
    provenance: dict[str, Any] = Field(default_factory=dict)


class _Diagnosis(BaseModel):
    """The key by which diagnosis.json is known; it lies in the same folder as the models."""

    verdict: str | None


class _NoModel(TypedModel):
    """What stands in a model file of a diagnosis without such a model."""

    succeeded: Literal[False]
    message: str


@dataclass(frozen=True, eq=False)
class Condition:
    """Conditions of a recording that a model was fitted to.

    Attributes
    ----------
    recording : str
        Its id.
    pretension_N : float
        Nominal tension of the cables, N.
    path : ConduitPath
        Path of the conduits.
    """

    recording: str
    pretension_N: float
    path: ConduitPath


@dataclass(frozen=True, eq=False)
class RigConditions:
    """What a model knows of its rig besides parameters: enough to simulate a motion without the batch.

    Attributes
    ----------
    batch : str
        Batch that the model was fitted to.
    origin : str
        Origin of its recordings: "rig" (measured) or "virtual-rig" (a simulated rig).
    far_end : str or None
        What holds the far end of a single cable; None for a pull-pull pair.
    conditions : tuple of Condition
        Of each of its recordings, in their order.
    """

    batch: str
    origin: str
    far_end: str | None
    conditions: tuple[Condition, ...]

    @classmethod
    def of(cls, recordings: Iterable[Recording]) -> "RigConditions | None":
        """The conditions of a batch's recordings; None without recordings."""
        every = list(recordings)
        if not every:
            return None
        conditions = tuple(Condition(r.id, r.pretension_N, r.path) for r in every)
        return cls(every[0].batch, every[0].origin, every[0].far_end, conditions)

    def recording(self, name: str | None = None) -> Recording:
        """A recording without samples that has the conditions of the one with this id, or of the first.

        Raises
        ------
        InputError
            If there is no such recording.
        """
        found = {c.recording: c for c in self.conditions}
        if name is not None and name not in found:
            raise InputError(f"recording: the model knows {', '.join(found)}; got {name}")
        of = self.conditions[0] if name is None else found[name]
        return Recording(
            self.batch, of.recording, self.origin, np.empty(0), {}, {}, of.pretension_N, of.path, far_end=self.far_end
        )

    def as_dict(self) -> dict:
        """Content of the key `rig` of a model file."""
        conditions = [
            {
                "recording": c.recording,
                "pretension_N": c.pretension_N,
                "conduit": [
                    {"length_m": length, "bend_rad": bend}
                    for length, bend in zip(c.path.piece_length_m.tolist(), c.path.piece_bend_rad.tolist(), strict=True)
                ],
            }
            for c in self.conditions
        ]
        return {"batch": self.batch, "origin": self.origin, "far_end": self.far_end, "conditions": conditions}


@dataclass(frozen=True, eq=False, repr=False)
class Model:
    """A model of a rig, as a diagnosis or a fit finds it and as a file holds it.

    Attributes
    ----------
    parameters : Parameters
        Values of the paper's model, with the mechanisms that act beside it.
    rig : RigConditions or None
        Conduits and pretensions of the recordings that it was fitted to; None in files written before it was added.
    intervals : mapping of str to {"low", "high", "sd"}
        The 90 % interval and the standard deviation of each fitted parameter, SI units; None for an infinite one.
        Empty where the file states none.
    provenance : mapping
        Version and digests of the inputs.
    """

    parameters: Parameters
    rig: RigConditions | None = None
    intervals: Mapping[str, Mapping[str, float | None]] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        p = self.parameters
        acting = " + ".join(f"{m.name} at {m.place}" for m in p.mechanisms)
        fitted = f", fitted to {self.rig.batch}, {ORIGIN[self.rig.origin]}" if self.rig else ""
        values = {"k": f"{p.stiffness_N_per_m:.5g} N/m", "μ": f"{p.friction_coefficient:.4g}"}
        if p.load_stiffness_Nm_per_rad is not None:
            values["K_e"] = f"{p.load_stiffness_Nm_per_rad:.4g} N m/rad"
        stated = ", ".join(f"{symbol} = {value}" for symbol, value in values.items())
        return f"Model: {stated}; {acting or 'no mechanism beyond the paper'}{fitted}"

    @property
    def mechanisms(self) -> tuple[Active, ...]:
        """Mechanisms that act beside the paper's model: `name`, `place` and `values` of each."""
        return self.parameters.mechanisms

    def without(self, *names: str) -> "Model":
        """The same model without the mechanisms of these names.

        Raises
        ------
        InputError
            If it has no such mechanism.
        """
        acting = {m.name for m in self.mechanisms}
        if unknown := [name for name in names if name not in acting]:
            raise InputError(f"the model has no mechanism '{unknown[0]}'; {advice(unknown[0], sorted(acting))}")
        left = tuple(m for m in self.mechanisms if m.name not in names)
        return replace(self, parameters=replace(self.parameters, mechanisms=left))

    def placed(self, recordings: Iterable[Recording]) -> list[Recording]:
        """Recordings with a place in the session only where the model was fitted to them.

        The order of others says nothing of that session; what drifts is at its middle, unless their times are stated.
        """
        every = list(recordings)
        if self.rig is None:
            return every
        fitted = {name for c in self.rig.conditions for name in (c.recording, f"{self.rig.batch}/{c.recording}")}
        return [r if f"{r.batch}/{r.id}" in fitted else replace(r, position=0.0) for r in every]

    def as_dict(self) -> dict:
        """Content of its file, plain data."""
        content = model_as_dict(self.parameters, dict(self.provenance))
        provenance = content.pop("provenance")
        if self.rig is not None:
            content["rig"] = self.rig.as_dict()
        if self.intervals:
            content["intervals"] = {name: dict(one) for name, one in self.intervals.items()}
        return content | {"provenance": provenance}

    def save(self, file: Path | str) -> None:
        """Write the model file (JSON), which `ccmodel.read_model` and the commands of ``ccmodel`` read.

        Missing folders above it are made.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        with new_file(file) as path:
            path.write_text(json.dumps(self.as_dict(), indent=1) + "\n")


def model_as_dict(parameters: Parameters, provenance: dict) -> dict:
    """Content of a model file without a rig: the parameters without the solver's refinement."""
    numbers = asdict(parameters)
    active = numbers.pop("mechanisms")
    del numbers["refinement"]
    numbers = {name: value for name, value in numbers.items() if value is not None or name not in _SESSION}
    in_file = {name: former for former, name in FORMER_NAMES.items()}
    numbers = {in_file.get(name, name): value for name, value in numbers.items()}
    return {"format": FORMAT, "parameters": numbers, "mechanisms": active, "provenance": provenance}


def _reason_for_none(text: str) -> str | None:
    """What a diagnosis or a fit without a model wrote in its place; None for any other text."""
    try:
        return _NoModel.model_validate_json(text).message
    except ValidationError:
        return None


def _is_diagnosis(text: str) -> bool:
    try:
        _Diagnosis.model_validate_json(text)
    except ValidationError:
        return False
    return True


def read_model_file(path: Path) -> Model:
    """A model from its file.

    Raises
    ------
    InputError
        With one line on the file's fault.
    """
    try:
        inputs.check_file(Path(path), inputs.MODEL)
        text = Path(path).read_text(encoding="utf-8")
        stated = _ModelFile.model_validate_json(text)
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no text"
        raise InputError(f"{path}: cannot be read ({reason})") from None
    except ValidationError as error:
        if (reason := _reason_for_none(text)) is not None:
            raise InputError(f"{path}: holds no model: {reason}") from None
        if _is_diagnosis(text):
            model = Path(path).with_name("model.json")
            raise InputError(f"{path}: is a diagnosis, not a model; use {model} beside it") from None
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the file"
        raise InputError(f"{path}: {where}: {first['msg']}; a model file is what a diagnosis or a fit wrote") from None
    intervals = {name: dict(one) for name, one in stated.intervals.items()}
    return Model(_parameters(path, stated), _rig(stated.rig), intervals, stated.provenance)


def _parameters(path: Path, stated: _ModelFile) -> Parameters:
    for active in stated.mechanisms:
        if active.name not in (*registry.names(), *registry.laws()):
            raise InputError(f"{path}: no mechanism is called {active.name!r}; there are {', '.join(registry.names())}")
    mechanisms = tuple(
        Active(m.name, m.place, registry.get(m.name).default | dict(m.values)) for m in stated.mechanisms
    )
    values: dict[str, Any] = {FORMER_NAMES.get(name, name): value for name, value in stated.parameters.items()}
    for name, value in values.items():
        if name not in _KNOWN:
            raise InputError(f"{path}: parameters: no parameter is called '{name}'; {advice(name, _KNOWN)}")
        if value is None and name not in _OPTIONAL:
            raise InputError(f"{path}: parameters.{name}: null; a number is needed")
        if value is not None and not LEAST.get(name, -LARGEST_PARAMETER) < value < LARGEST_PARAMETER:
            raise InputError(f"{path}: parameters.{name}: {value:g} is no value of a rig")
    if missing := [name for name in _REQUIRED if name not in values]:
        raise InputError(f"{path}: parameters: no {', '.join(missing)}; a model needs it")
    return Parameters(**values, mechanisms=mechanisms)


def _rig(stated: _RigEntry | None) -> RigConditions | None:
    if stated is None:
        return None
    conditions = tuple(
        Condition(
            c.recording,
            c.pretension_N,
            ConduitPath(np.array([p.length_m for p in c.conduit]), np.array([p.bend_rad for p in c.conduit])),
        )
        for c in stated.conditions
    )
    return RigConditions(stated.batch, stated.origin, stated.far_end, conditions)
