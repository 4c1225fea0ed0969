"""Provenance of a result: versions and digests that result files carry, and the source files of a pipeline step."""

import ast
import hashlib
import json
import os
from collections.abc import Iterable, Iterator
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ccmodel.version import __version__

_PACKAGE = Path(__file__).parent
_ROOT = _PACKAGE.parent
# Endings of templates, styles, scripts and tables that modules read.
READ_BY_MODULES = (".j2", ".css", ".js", ".txt")


def files_in(folder: Path) -> list[Path]:
    """The files of a folder, at any depth and behind links, without the hidden ones of editors and file browsers."""
    found, entered = [], set()
    for here, folders, names in os.walk(folder, followlinks=True):
        # A link to a folder above would be walked for ever.
        is_new = os.path.realpath(here) not in entered
        entered.add(os.path.realpath(here))
        folders[:] = [name for name in folders if is_new and not name.startswith(".")]
        files = (Path(here) / name for name in names if is_new and not name.startswith("."))
        found += [file for file in files if file.is_file()]
    return sorted(found)


def of_inputs(paths: Iterable[Path], folder: Path = Path()) -> dict:
    """Version of the package and digests of the input files of a result, by path relative to `folder`."""
    digests = {os.path.relpath(p, folder): file_digest(p) for p in paths}
    return {"ccmodel_version": __version__, "sha256": digests}


def folder_digest(folder: Path) -> str:
    """Digest of the names and contents of a folder's files (`files_in`), whatever their dates."""
    return content_digest(of_inputs(files_in(folder), folder)["sha256"])[:16]


def file_digest(path: Path) -> str:
    """SHA-256 of a file, which need not fit into the memory."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def stamp(module: str, *inputs: Any) -> str:
    """A line on a figure: version, and short digests of its inputs (`content_digest`) and of its module's sources."""
    return f"ccmodel {__version__}, inputs {content_digest(*inputs)[:8]}, sources {source_digest(module)[:8]}"


def content_digest(*values: Any) -> str:
    """Digest of values, of plain data, arrays and dataclasses, whatever files they were read from."""
    return hashlib.sha256(json.dumps(values, sort_keys=True, default=_plain).encode()).hexdigest()


def _plain(value: Any) -> Any:
    """An array or a dataclass as plain data, for a digest."""
    if isinstance(value, np.ndarray):
        return [value.dtype.str, value.shape, hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()]
    if is_dataclass(value):
        return {field.name: getattr(value, field.name) for field in fields(value)}
    raise TypeError(f"no digest of a {type(value).__name__}")


@cache
def source_digest(module: str, discovered: bool = True) -> str:
    """Digest of the source files of a module (`sources_of`).

    Snakemake notices a change of a script, not of the package behind it. With this digest among the params of a rule,
    an edited file reruns the steps that use it and no others. The cache of compiled code is keyed by it too
    (`ccmodel.kernel`).
    """
    digest = hashlib.sha256()
    for file in sorted(sources_of(module, discovered)):
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


def sources_of(module: str, discovered: bool = True) -> set[Path]:
    """Source files of a module: its own, all of the package that it imports, and the parts of pages in their folders.

    Parameters
    ----------
    module : str
        Name of the module.
    discovered : bool
        Whether a package that discovers its modules (`pkgutil.iter_modules`) includes all of them where it is imported
        itself. A kernel calls only what its module imports by name.
    """
    files, waiting, seen = set(), [module], set()
    while waiting:
        name = waiting.pop()
        if name in seen or (file := _file_of(name)) is None:
            continue
        seen.add(name)
        files |= {file, *(part for ending in READ_BY_MODULES for part in file.parent.glob(f"*{ending}"))}
        waiting += [f"{name.rpartition('.')[0]}.__init__", *_imports(file)]
        if discovered and not name.endswith("__init__") and "iter_modules(__path__)" in file.read_text():
            waiting += [f"{name}.{found.stem}" for found in file.parent.glob("*.py")]
    return files


def _file_of(name: str) -> Path | None:
    """File of a module or package, without importing it; None for a name inside a module."""
    place = _ROOT.joinpath(*name.split("."))
    candidates = (place.with_suffix(".py"), place / "__init__.py")
    return next((file for file in candidates if file.exists()), None)


@cache
def _imports(file: Path) -> list[str]:
    """Modules that a file imports from the package; `from a import b` gives a.b if this is a module, else a."""
    names = []
    for node in _run(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            inner = {f"{node.module}.{alias.name}" for alias in node.names}
            names += [name if _file_of(name) else name.rpartition(".")[0] for name in inner]
    return [name for name in names if name.partition(".")[0] == _PACKAGE.name]


def _run(block: ast.AST) -> Iterator[ast.AST]:
    """The statements of a block at any depth, without what only a type checker reads."""
    # Walking through expressions too would take most of the time that the package takes to import.
    for part in ("body", "orelse", "handlers", "finalbody", "cases"):
        for statement in getattr(block, part, ()):
            yield statement
            if not _is_for_type_checkers(statement):
                yield from _run(statement)


def _is_for_type_checkers(statement: ast.AST) -> bool:
    return (
        isinstance(statement, ast.If) and isinstance(statement.test, ast.Name) and statement.test.id == "TYPE_CHECKING"
    )
