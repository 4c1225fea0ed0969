"""A model as a file: parameters and mechanisms, as JSON."""

from dataclasses import asdict
from pathlib import Path
from typing import Literal

from pydantic import Field, ValidationError

from ccmodel import mechanisms as registry
from ccmodel.model.general.run import Active
from ccmodel.model.parameters import FORMER_NAMES, Parameters
from ccmodel.typed import InputError, TypedModel

FORMAT = 1


class _ActiveEntry(TypedModel):
    name: str
    place: str
    values: dict[str, float]


class _ModelFile(TypedModel):
    format: int = Field(ge=FORMAT, le=FORMAT)
    parameters: dict[str, float | None]
    mechanisms: list[_ActiveEntry] = Field(default_factory=list)
    provenance: dict = Field(default_factory=dict)


class _NoModel(TypedModel):
    """What stands in a model file of a diagnosis without such a model."""

    succeeded: Literal[False]
    message: str


def model_as_dict(parameters: Parameters, provenance: dict) -> dict:
    """Content of a model file: the parameters without the solver's refinement."""
    numbers = asdict(parameters)
    active = numbers.pop("mechanisms")
    del numbers["refinement"]
    in_file = {name: former for former, name in FORMER_NAMES.items()}
    numbers = {in_file.get(name, name): value for name, value in numbers.items()}
    return {"format": FORMAT, "parameters": numbers, "mechanisms": active, "provenance": provenance}


def _reason_for_none(text: str) -> str | None:
    """What a diagnosis or a fit without a model wrote in its place; None for any other text."""
    try:
        return _NoModel.model_validate_json(text).message
    except ValidationError:
        return None


def read_model(path: Path) -> Parameters:
    """Parameters from a model file.

    Raises
    ------
    InputError
        With one line on the file's fault.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
        stated = _ModelFile.model_validate_json(text)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    except ValidationError as error:
        if (reason := _reason_for_none(text)) is not None:
            raise InputError(f"{path}: holds no model: {reason}") from None
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the file"
        raise InputError(f"{path}: {where}: {first['msg']}; a model file is what a diagnosis or a fit wrote") from None
    for active in stated.mechanisms:
        if active.name not in registry.names():
            raise InputError(f"{path}: no mechanism is called {active.name!r}; there are {', '.join(registry.names())}")
    mechanisms = tuple(
        Active(m.name, m.place, registry.get(m.name).default | dict(m.values)) for m in stated.mechanisms
    )
    try:
        parameters = {FORMER_NAMES.get(name, name): value for name, value in stated.parameters.items()}
        return Parameters(**parameters, mechanisms=mechanisms)
    except TypeError as error:
        raise InputError(f"{path}: {error}") from None
