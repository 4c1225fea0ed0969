"""Typed YAML files: settings and descriptions read into pydantic models, with errors for the person who wrote the file.

A model derives from `TypedModel`; `load_yaml_model` reads a YAML 1.2 file into it or raises `InputError`, one line a
problem: the file, the line in it, the key, the value found and the remedy.
"""

import difflib
import json
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, ClassVar, Literal, Self, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, GetCoreSchemaHandler, ValidationError
from pydantic.fields import FieldInfo
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap
from ruamel.yaml.composer import Composer
from ruamel.yaml.constructor import DuplicateKeyError, RoundTripConstructor
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode
from ruamel.yaml.tag import Tag

from ccmodel import inputs

# No value of a rig in SI units comes near; the square of a larger one overflows in places.
LARGEST = 1e30
Positive = Annotated[float, Field(gt=0, lt=LARGEST)]
NotNegative = Annotated[float, Field(ge=0, lt=LARGEST)]
Finite = Annotated[float, Field(gt=-LARGEST, lt=LARGEST)]
M = TypeVar("M", bound=BaseModel)


def _no_truth(value: Any) -> Any:
    if isinstance(value, bool):
        raise ValueError("must be a number")
    return value


# Before a choice among numbers, since true equals 1 for Python.
IS_NUMBER = BeforeValidator(_no_truth)
# Path of a value: keys and indices from the top of a file. `Borrowed` gives the file's own path of a value.
Loc = tuple[str | int, ...]
Borrowed = Mapping[Loc, Loc]
# An entry of `ValidationError.errors()`.
ErrorEntry = Mapping[str, Any]

# Lists and mappings within each other that a file may hold; our own formats need 6.
MAX_DEPTH = 50
# Keys and values that a file may hold, those that aliases repeat included; a recording has 20 to 30. To read so many
# takes 7 s.
MAX_VALUES = 75_000
TOO_MANY = f"holds more than {MAX_VALUES} values, repeated ones counted each time: write less"
# Letters of a value in a message.
MOST_SHOWN = 100


@dataclass(frozen=True)
class FillIn:
    """Marks a key that must not be left without a value in a file, even if it may be left out.

    Attributes
    ----------
    meaning : str
        What it is, with its unit, in words that follow "fill in"; "{parent}" stands for the name of the key above.
    """

    meaning: str


@dataclass(frozen=True)
class OneOf:
    """Restricts text to names that are made in the code; a `Literal` takes only names that are written out."""

    names: tuple[str, ...]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        return handler.generate_schema(Literal[self.names])


class TypedModel(BaseModel):
    """Base of every typed file: frozen, no unknown keys, no silent conversions, no NaN or infinity."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)
    # Current name of every key that was renamed, at any depth; files may still have the former name.
    renamed: ClassVar[Mapping[str, str]] = {}

    @classmethod
    def completed(cls, data: dict) -> tuple[dict, "Borrowed"]:
        """Content of a file with what it states once for many places, and where each such value is in the file."""
        return data, {}


@dataclass(frozen=True)
class Problem:
    """One error in a file.

    Attributes
    ----------
    file : str
        The file.
    line : int or None
        Line in it, counted from 1; None if the error concerns the whole file.
    text : str
        The error and its remedy, in one line.
    """

    file: str
    line: int | None
    text: str

    def __str__(self) -> str:
        return f"{self.file}: {self.text}" if self.line is None else f"{self.file}, line {self.line}: {self.text}"


class InputError(Exception):
    """A file, folder or value given by the user cannot be used; the text says which, where, why and what to do.

    Parameters
    ----------
    message : str
        Text for the user, one line a problem.
    problems : sequence of Problem
        The same problems with file and line, if a file was read.
    """

    def __init__(self, message: str, problems: Sequence[Problem] = ()):
        super().__init__(message)
        self.problems = tuple(problems)

    @classmethod
    def of(cls, *problems: Problem) -> Self:
        """The error whose message is one line for each problem."""
        return cls("\n".join(map(str, problems)), problems)


def load_yaml_model(path: Path, model: type[M]) -> M:
    """Read a YAML file into a typed model.

    Parameters
    ----------
    path : Path
        The file.
    model : type
        Model of its content.

    Returns
    -------
    model
        The file's content.

    Raises
    ------
    InputError
        If the file is missing, is not YAML, has a key twice or does not fit the model: one line for every problem.
        A key without a value, where the model says what to fill in, is a problem even if it is optional.
    """
    content = _read_yaml(Path(path))
    data = _with_current_names(content, getattr(model, "renamed", {}), path)
    gaps = {loc: f"{_dotted(loc)}: fill in {meaning}" for loc in _empty(data) if (meaning := meaning_at(model, loc))}
    data, borrowed = model.completed(_filled(data)) if issubclass(model, TypedModel) else (_filled(data), {})
    problems, cause = list(gaps.items()), None
    try:
        # JSON mode accepts a list for a tuple and text for a path or a choice, but stays strict on numbers.
        read = model.model_validate_json(json.dumps(data, default=str))
    except ValidationError as error:
        problems, cause = problems + _explain(_located(error, borrowed, gaps), model), error
    if problems:
        raise InputError.of(*(Problem(str(path), _line_of(content, loc), text) for loc, text in problems)) from cause
    return read


def load_json_model(path: Path, model: type[M], wrote: str) -> M:
    """Read a JSON file that this program wrote, perhaps another version of it, into a typed model.

    Parameters
    ----------
    path : Path
    model : type
        Model of what is needed of its content.
    wrote : str
        What writes such a file, in the message.

    Raises
    ------
    InputError
        In one line, if the file cannot be read or does not fit.
    """
    try:
        inputs.check_file(Path(path), inputs.LOG)
        return model.model_validate_json(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        reason = error.strerror
    except UnicodeDecodeError:
        reason = "it is no text"
    except ValidationError as error:
        first = error.errors()[0]
        reason = ": ".join(filter(None, (_dotted(first["loc"]), first["msg"])))
    raise InputError(f"{path}: is not what {wrote} wrote ({reason})") from None


def meaning_at(model: type[BaseModel], loc: Sequence) -> str | None:
    """What a key is, with its unit, in words that follow "fill in"; None where its model does not say so."""
    *parents, key = loc
    field = _fields_at(model, parents).get(key)
    meaning = next((m.meaning for m in (field.metadata if field else ()) if isinstance(m, FillIn)), None)
    return meaning and meaning.replace("{parent}", str(parents[-1]) if parents else "")


def nearest(name: str, known: Iterable[str], cutoff: float = 0.75) -> str | None:
    """The known name that `name` most likely misspells; None if no similarity (`difflib`) reaches `cutoff`."""
    by_lower = {k.lower(): k for k in known}
    matches = difflib.get_close_matches(name.lower(), by_lower, n=1, cutoff=cutoff)
    return by_lower[matches[0]] if matches else None


def advice(name: str, known: Iterable[str]) -> str:
    """What to state in place of an unknown name: the known one it misspells, otherwise the known ones."""
    names = list(known)
    guess = nearest(name, names)
    return f"did you mean '{guess}'?" if guess else f"there is {', '.join(names) or 'none'}"


class _Empty:
    """The value of a key that has none; `null` is a value."""


_EMPTY = _Empty()


def _empty(data: Any, loc: Loc = ()) -> Iterator[Loc]:
    """Paths of the keys without a value."""
    if data is _EMPTY:
        yield loc
    for key, value in data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ():
        yield from _empty(value, (*loc, key))


def _filled(data: Any) -> Any:
    """The same with None for keys without a value."""
    if isinstance(data, dict):
        return {key: _filled(value) for key, value in data.items()}
    if isinstance(data, list):
        return [_filled(value) for value in data]
    return None if data is _EMPTY else data


class _TextKeys(Composer):
    """Reads every key as text, also one that looks like a number or a date: JSON has no other keys.

    A file of too many values is not read to its end.
    """

    nodes = 0

    def compose_node(self, parent: Node | None, index: Any) -> Node:
        node = super().compose_node(parent, index)
        self.nodes += 1
        if self.nodes > MAX_VALUES:
            raise _error_at(node, TOO_MANY)
        if isinstance(parent, MappingNode) and index is None:
            if not isinstance(node, ScalarNode):
                raise _error_at(
                    node, "a key must be a word, found a list or a mapping (put text with brackets in quotes)"
                )
            if node.tag != "tag:yaml.org,2002:merge":
                node.ctag = Tag(suffix="tag:yaml.org,2002:str")
        return node


class _ValuesWithLines(RoundTripConstructor):
    """Gives the line of every value that cannot be read, and does not repeat values without end."""

    def construct_document(self, node: Node) -> Any:
        if _size(node, {}) > MAX_VALUES:
            raise _error_at(node, TOO_MANY)
        return super().construct_document(node)

    def construct_object(self, node: Node, deep: bool = False) -> Any:
        if node in self.recursive_objects:
            raise _error_at(node, "holds what cannot be read as keys and values: an alias of itself")
        if isinstance(node, ScalarNode) and node.tag == "tag:yaml.org,2002:null" and not node.value:
            return _EMPTY
        try:
            return super().construct_object(node, deep)
        except (ValueError, TypeError, LookupError, AttributeError, OverflowError) as error:
            # The constructors of dates and of tagged values do not check their text.
            text = f"{node.value!r} cannot be read ({error}): if it is text, put it in quotes"
            raise _error_at(node, text) from error


def _size(node: Node, known: dict[int, int]) -> int:
    """Number of nodes from a node on, counted again at each alias; one within itself counts once."""
    if id(node) not in known:
        known[id(node)] = 1
        inner = [] if isinstance(node, ScalarNode) else node.value
        parts = (part for entry in inner for part in (entry if isinstance(entry, tuple) else (entry,)))
        known[id(node)] = 1 + sum(_size(part, known) for part in parts)
    return known[id(node)]


def _error_at(node: Node, text: str) -> MarkedYAMLError:
    return MarkedYAMLError(problem=text, problem_mark=node.start_mark)


def _read_yaml(path: Path) -> CommentedMap:
    """Keys and values of a YAML file; `.lc` has their lines."""
    reader = YAML(typ="rt", pure=True)
    reader.Composer, reader.Constructor, reader.max_depth = _TextKeys, _ValuesWithLines, MAX_DEPTH
    line = None
    try:
        inputs.check_file(path, inputs.DOCUMENT)
        content = reader.load(path.read_text(encoding="utf-8"))
        if isinstance(content, CommentedMap):
            return content
        text = f"must hold keys and values, found {_kind(content)}"
    except FileNotFoundError:
        text = "there is no such file"
    except UnicodeDecodeError:
        text = "is not text in UTF-8: save it in this encoding"
    except OSError as error:
        text = f"cannot be read ({error.strerror})"
    except DuplicateKeyError as error:
        line, text = error.problem_mark.line + 1, error.problem.partition(" with value")[0] + ": remove one"
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = mark.line + 1 if mark else None
        what = error.problem or "it cannot be understood"
        text = "not valid YAML: " + what.partition(", if necessary")[0]  # without advice to programmers
    except (YAMLError, ValueError) as error:  # a control character, or an escape that is no character
        text = "not valid YAML: " + " ".join(str(error).split())
    raise InputError.of(Problem(str(path), line, text))


def _kind(content: Any) -> str:
    if content is None or content is _EMPTY:
        return "nothing"
    return "a list" if isinstance(content, list) else f"a {type(content).__name__}"


def _with_current_names(data: Any, renamed: Mapping[str, str], path: Path) -> Any:
    if isinstance(data, list):
        return [_with_current_names(entry, renamed, path) for entry in data]
    if not isinstance(data, dict):
        return data
    for former in renamed.keys() & data.keys():
        warnings.warn(f"{path}: '{former}' is now called '{renamed[former]}'", FutureWarning, stacklevel=2)
    return {renamed.get(key, key): _with_current_names(value, renamed, path) for key, value in data.items()}


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


def _located(error: ValidationError, borrowed: Borrowed, gaps: Iterable[Loc]) -> Sequence[ErrorEntry]:
    """Errors where the file has their values, without those that follow from a gap."""
    located = []
    for e in error.errors(include_url=False):
        ends = range(len(e["loc"]), 0, -1)
        part = next((part for n in ends if (part := tuple(e["loc"][:n])) in borrowed), ())
        e["loc"] = (*borrowed.get(part, ()), *e["loc"][len(part) :])
        if not any(gap[: len(e["loc"])] == e["loc"] for gap in gaps) and not _is_follow_on(e):
            located.append(e)
    return located


def _explain(errors: Sequence[ErrorEntry], model: type[BaseModel]) -> list[tuple[tuple, str]]:
    """Place and text of every problem; a misspelt key is one problem, not also a missing key or a short list."""
    explained, meant = [], set()
    for e in errors:
        if _is_unknown_key(e):
            *parent, key = (p for p in e["loc"] if p != "[key]")
            known = list(_fields_at(model, parent))
            guess = nearest(str(key), known)
            meant.add((*parent, guess))
            advice = f"did you mean '{guess}'?" if guess else f"known keys are {', '.join(known)}"
            explained.append(((*parent, key), f"unknown key {key!r} {_inside(parent)}; {advice}"))
    for e in errors:
        if e["type"] == "missing" and e["loc"] not in meant:
            explained.append((e["loc"], f"key '{e['loc'][-1]}' is missing {_inside(e['loc'][:-1])}"))
        elif e["type"] != "missing" and not _is_unknown_key(e):
            explained.append((e["loc"], _wrong_value(e)))
    # A value that many places borrow is one problem.
    return list(dict.fromkeys(explained))


def _is_follow_on(e: ErrorEntry) -> bool:
    """Whether a list is too short only because pydantic does not count the entries that have problems themselves."""
    return e["type"] == "too_short" and len(e["input"]) >= e["ctx"]["min_length"]


def _is_unknown_key(e: ErrorEntry) -> bool:
    return e["type"] == "extra_forbidden" or e["loc"][-1:] == ("[key]",)


def _wrong_value(e: ErrorEntry) -> str:
    context = e.get("ctx", {})
    if e["type"] == "value_error":
        text = str(context["error"])
    else:
        text = _EXPECTED[e["type"]].format(**context) if e["type"] in _EXPECTED else e["msg"]
    key = _dotted(e["loc"])
    found = "" if isinstance(e["input"], dict | list) else f", found {_shown(e['input'])}"
    return f"{key}: {text}{found}" if key else f"{text}{found}"


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= MOST_SHOWN else f"{text[: MOST_SHOWN - 3]}..."


def _dotted(loc: Sequence) -> str:
    """The path of a key as people write it: recordings[2].pretension_N."""
    return "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in loc).lstrip(".")


def _inside(loc: Sequence) -> str:
    return f"in {_dotted(loc)}" if loc else "at the top level"


def _fields_at(annotation: Any, loc: Sequence) -> Mapping[str, FieldInfo | None]:
    """Keys of the model at `loc` within a type: a model, a list or mapping of models, or a union."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        if not loc:
            return annotation.model_fields
        field = annotation.model_fields.get(str(loc[0]))
        return _fields_at(field.annotation, loc[1:]) if field else {}
    origin, args = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _fields_at(args[0], loc)
    if origin in (list, tuple) and loc:
        return _fields_at(args[0], loc[1:])
    if origin is dict:
        return _fields_at(args[1], loc[1:]) if loc else dict.fromkeys(_choices(args[0]))
    if origin in (Union, UnionType):
        # pydantic begins the path of a problem within a union with the name of the member that it tried.
        found = [_fields_at(a, rest) for a in args for rest in (loc, loc[1:])]
        return next((keys for keys in found if keys), {})
    return {}


def _choices(annotation: Any) -> Iterable[str]:
    """Names that a key must be one of; none if it may be any."""
    if get_origin(annotation) is Annotated:
        return next((one.names for one in annotation.__metadata__ if isinstance(one, OneOf)), ())
    return get_args(annotation)


def _line_of(content: Any, loc: Sequence) -> int:
    """Line of the key at `loc`, or of the nearest enclosing key that the file has."""
    line = content.lc.line
    for key in loc:
        try:
            line, content = content.lc.data[key][0], content[key]
        except (AttributeError, LookupError, TypeError):  # a single value, or a key that is missing
            break
    return line + 1
