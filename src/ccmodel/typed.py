"""Typed YAML files: what every file of settings or of descriptions in this project shares.

A model derives from `TypedModel`; `load_yaml_model` reads a file into it or raises `InputError`, whose text is made
for the person who wrote the file: one line a problem, with the file, the line in it, the key, what was found and
what to do.
"""

import difflib
import json
import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, ClassVar, TypeVar, Union, get_args, get_origin

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
M = TypeVar("M", bound=BaseModel)


class TypedModel(BaseModel):
    """Base of every typed file: frozen, no key beyond those named, no silent conversions, no NaN or infinity."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)
    # Former names of keys, at any depth, which files written earlier may still have.
    renamed: ClassVar[Mapping[str, str]] = {}


@dataclass(frozen=True)
class Problem:
    """One thing wrong with a file.

    Attributes
    ----------
    file : str
        The file.
    line : int or None
        Line in it, counted from 1; None where the file could not be read at all.
    text : str
        What is wrong, in one line.
    """

    file: str
    line: int | None
    text: str

    def __str__(self) -> str:
        return f"{self.file}: {self.text}" if self.line is None else f"{self.file}, line {self.line}: {self.text}"


class InputError(Exception):
    """Something a user gave cannot be used; the text says what, where and what to do.

    Parameters
    ----------
    message : str
        Text for a person, one line a problem.
    problems : sequence of Problem
        The same, taken apart, where a file was read.
    """

    def __init__(self, message: str, problems: Sequence[Problem] = ()):
        super().__init__(message)
        self.problems = tuple(problems)


def load_yaml_model(path: Path, model: type[M]) -> M:
    """Read a YAML file into a typed model.

    Parameters
    ----------
    path : Path
        The file.
    model : type
        What it must hold.

    Returns
    -------
    model
        The file's content.

    Raises
    ------
    InputError
        If the file is missing, no YAML, gives a key twice or does not fit the model: every problem in a line.
    """
    node, data = _read_yaml(Path(path), getattr(model, "renamed", {}))
    try:
        # JSON mode: lists may become tuples and text paths or choices, while numbers stay strict.
        return model.model_validate_json(data)
    except ValidationError as error:
        problems = [Problem(str(path), _line_of(node, loc), text) for loc, text in _explain(error, model)]
        raise _input_error(problems) from error


def nearest(name: str, known: Iterable[str], cutoff: float = 0.75) -> str | None:
    """Name among `known` that `name` is most likely a misspelling of; None if none is as like it as `cutoff`."""
    by_lower = {k.lower(): k for k in known}
    matches = difflib.get_close_matches(name.lower(), by_lower, n=1, cutoff=cutoff)
    return by_lower[matches[0]] if matches else None


class _Loader(yaml.SafeLoader):
    """YAML as people write it: 5e4 is a number, a key is text as it stands, and one given twice is a mistake."""

    def construct_mapping(self, node, deep=False):
        seen = set()
        for i, (key, value) in enumerate(node.value if isinstance(node, yaml.MappingNode) else []):
            if not isinstance(key, yaml.ScalarNode):
                raise _problem_at(
                    key, "a key must be a word, found a list or a mapping (put text with brackets in quotes)"
                )
            if key.tag == "tag:yaml.org,2002:merge":
                continue
            if key.value in seen:
                raise _problem_at(key, f"key {key.value!r} is given twice: remove one")
            seen.add(key.value)
            # JSON knows no dates, numbers or nothing as keys.
            node.value[i] = (yaml.ScalarNode("tag:yaml.org,2002:str", key.value, key.start_mark, key.end_mark), value)
        return super().construct_mapping(node, deep)

    def construct_object(self, node, deep=False):
        try:
            return super().construct_object(node, deep)
        except (ValueError, TypeError, LookupError, AttributeError, OverflowError) as error:
            # What looks like a date or is tagged as a number and is none ends in whatever its constructor stumbles on.
            if not isinstance(node, yaml.ScalarNode):
                raise
            raise _problem_at(
                node, f"{node.value!r} cannot be read ({error}): if it is text, put it in quotes"
            ) from error


def _problem_at(node: yaml.Node, text: str) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=text, problem_mark=node.start_mark)


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$"), list("-+.0123456789")
)


def _read_yaml(path: Path, renamed: Mapping[str, str]) -> tuple[yaml.Node, str]:
    """The file's nodes, for finding lines, and its content as JSON, every key under its current name."""
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise _input_error([Problem(str(path), None, "there is no such file")]) from None
    except (OSError, UnicodeDecodeError) as error:
        raise _input_error([Problem(str(path), None, f"cannot be read as text ({error})")]) from error
    try:
        loader = _Loader(text)
        node = loader.get_single_node()
        data = loader.construct_document(node) if node is not None else None
        as_json = json.dumps(_under_current_names(data, renamed, path), default=str)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        what = error.problem or "it cannot be understood"
        advice = "" if "given twice" in what else "not valid YAML: "
        raise _input_error([Problem(str(path), mark.line + 1 if mark else None, advice + what)]) from error
    except yaml.YAMLError as error:
        raise _input_error([Problem(str(path), None, "not valid YAML: " + " ".join(str(error).split()))]) from error
    except (TypeError, ValueError, RecursionError) as error:
        # An alias that contains itself, brackets nested without end, an escape that is no character.
        raise _input_error(
            [Problem(str(path), None, f"holds what cannot be read as keys and values ({error})")]
        ) from error
    if not isinstance(data, dict):
        found = "nothing" if data is None else f"a {type(data).__name__}"
        raise _input_error([Problem(str(path), None, f"must hold keys and values, found {found}")])
    return node, as_json


def _under_current_names(data: Any, renamed: Mapping[str, str], path: Path) -> Any:
    if isinstance(data, list):
        return [_under_current_names(entry, renamed, path) for entry in data]
    if not isinstance(data, dict):
        return data
    for former in renamed.keys() & data.keys():
        warnings.warn(f"{path}: '{former}' is now called '{renamed[former]}'", FutureWarning, stacklevel=2)
    return {renamed.get(key, key): _under_current_names(value, renamed, path) for key, value in data.items()}


def _input_error(problems: list[Problem]) -> InputError:
    return InputError("\n".join(map(str, problems)), problems)


_EXPECTED = {
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "string_type": "must be text (put it in quotes)",
    "bool_type": "must be true or false",
    "list_type": "must be a list",
    "tuple_type": "must be a list",
    "dict_type": "must hold keys and values",
    "model_type": "must hold keys and values",
    "finite_number": "must be finite",
    "greater_than": "must be above {gt}",
    "greater_than_equal": "must be at least {ge}",
    "less_than": "must be below {lt}",
    "less_than_equal": "must be at most {le}",
    "literal_error": "must be {expected}",
    "string_too_short": "needs at least {min_length} characters",
    "too_short": "needs at least {min_length} entries, has {actual_length}",
    "too_long": "takes at most {max_length} entries, has {actual_length}",
}


def _explain(error: ValidationError, model: type[BaseModel]) -> list[tuple[tuple, str]]:
    """Where and what, for every problem; a misspelt key is one problem, not also a missing key or a short list."""
    explained, meant = [], set()
    errors = [e for e in error.errors(include_url=False) if not _is_follow_on(e)]
    for e in errors:
        if _is_unknown_key(e):
            *parent, key = (p for p in e["loc"] if p != "[key]")
            known = _keys_at(model, parent)
            guess = nearest(str(key), known)
            meant.add((*parent, guess))
            advice = f"did you mean '{guess}'?" if guess else f"known keys are {', '.join(known)}"
            explained.append(((*parent, key), f"unknown key {key!r} {_inside(parent)}; {advice}"))
    for e in errors:
        if e["type"] == "missing" and e["loc"] not in meant:
            explained.append((e["loc"], f"key '{e['loc'][-1]}' is missing {_inside(e['loc'][:-1])}"))
        elif e["type"] != "missing" and not _is_unknown_key(e):
            explained.append((e["loc"], _wrong_value(e)))
    return explained


def _is_follow_on(e: dict) -> bool:
    """A list that is too short only because pydantic does not count the entries that have problems of their own."""
    return e["type"] == "too_short" and len(e["input"]) >= e["ctx"]["min_length"]


def _is_unknown_key(e: dict) -> bool:
    return e["type"] == "extra_forbidden" or e["loc"][-1:] == ("[key]",)


def _wrong_value(e: dict) -> str:
    context = e.get("ctx", {})
    if e["type"] == "value_error":
        text = str(context["error"])
    else:
        text = _EXPECTED[e["type"]].format(**context) if e["type"] in _EXPECTED else e["msg"]
    key = _dotted(e["loc"])
    found = "" if isinstance(e["input"], dict | list) else f", found {e['input']!r}"
    return f"{key}: {text}{found}" if key else f"{text}{found}"


def _dotted(loc: Sequence) -> str:
    """The place of a key as people write it: recordings[2].pretension_N."""
    return "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in loc).lstrip(".")


def _inside(loc: Sequence) -> str:
    return f"in {_dotted(loc)}" if loc else "at the top level"


def _keys_at(annotation: Any, loc: Sequence) -> list[str]:
    """Keys that the model at `loc` knows, seen from a type: a model, a list or mapping of models, or a choice."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        if not loc:
            return list(annotation.model_fields)
        field = annotation.model_fields.get(str(loc[0]))
        return _keys_at(field.annotation, loc[1:]) if field else []
    origin, args = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _keys_at(args[0], loc)
    if origin in (list, tuple) and loc:
        return _keys_at(args[0], loc[1:])
    if origin is dict:
        return _keys_at(args[1], loc[1:]) if loc else list(get_args(args[0]))
    if origin in (Union, UnionType):
        # The place of a problem inside a choice may begin with the name of the member that was tried.
        found = [_keys_at(a, rest) for a in args for rest in (loc, loc[1:])]
        return next((keys for keys in found if keys), [])
    return []


def _line_of(node: yaml.Node, loc: Sequence) -> int:
    """Line of the key at `loc`, or of the nearest thing around it that is there."""
    line = node.start_mark.line + 1
    for place in loc:
        if isinstance(node, yaml.MappingNode):
            pair = next(((k, v) for k, v in node.value if k.value == str(place)), None)
        elif isinstance(node, yaml.SequenceNode) and isinstance(place, int):
            pair = (node.value[place], node.value[place]) if place < len(node.value) else None
        else:
            pair = None
        if pair is None:
            break
        line, node = pair[0].start_mark.line + 1, pair[1]
    return line
