"""Where a result came from: versions and digests that files of results carry, and what a step's code consists of."""

import ast
import hashlib
import os
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import ccmodel

_ROOT = Path(ccmodel.__file__).parents[1]


def files_in(folder: Path) -> list[Path]:
    """The files of a batch's folder, at any depth; hidden ones (an editor's, a file browser's) are none of it."""
    files = (f for f in Path(folder).rglob("*") if f.is_file())
    return sorted(f for f in files if not any(part.startswith(".") for part in f.relative_to(folder).parts))


def of_inputs(paths: Iterable[Path], folder: Path = Path()) -> dict:
    """Version of the package and the digests of the files that a result was made from, by path from `folder`."""
    digests = {os.path.relpath(p, folder): hashlib.sha256(Path(p).read_bytes()).hexdigest() for p in paths}
    return {"ccmodel_version": ccmodel.__version__, "sha256": digests}


@cache
def source_digest(module: str) -> str:
    """Digest of a module of the package with all of the package that it imports, and the templates beside those.

    Snakemake sees when a script changes, not when the package behind it does; with this among a rule's params, it
    reruns what depends on an edited file, and only that. Compiled code is told from older code likewise
    (`ccmodel.kernel`).
    """
    digest = hashlib.sha256()
    for file in sorted(sources_of(module)):
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


def sources_of(module: str) -> set[Path]:
    """Files that `source_digest` takes in."""
    files, waiting, seen = set(), [module], set()
    while waiting:
        name = waiting.pop()
        if name in seen or (file := _file_of(name)) is None:
            continue
        seen.add(name)
        files |= {file, *file.parent.glob("*.j2")}
        waiting += [name.rpartition(".")[0], *_imports(file)]
    return files


def _file_of(name: str) -> Path | None:
    """File of a module or package, found without importing it; None for a name inside a module."""
    place = _ROOT.joinpath(*name.split("."))
    candidates = (place.with_suffix(".py"), place / "__init__.py")
    return next((file for file in candidates if name and file.exists()), None)


@cache
def _imports(file: Path) -> list[str]:
    """What a file imports of the package; with `from a import b`, both a and a.b, as b may be a module.

    A package that lists its folder (`iter_modules`) imports all modules in it.
    """
    names = []
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Name) and node.id == "iter_modules":
            package = ".".join(file.parent.relative_to(_ROOT).parts)
            names += [f"{package}.{module.stem}" for module in file.parent.glob("*.py")]
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return [name for name in names if name.partition(".")[0] == ccmodel.__name__]
