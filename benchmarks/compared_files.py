"""Files of two runs, compared byte for byte without their times and dates."""

import re
from collections.abc import Iterable, Mapping
from fnmatch import fnmatch
from pathlib import Path

# Files by their path, with their content.
Files = Mapping[str, bytes]
# How long each step of the pipeline took, and when.
TIMES = ("*/benchmarks/*", "*/logs/*")
# The moment at which an accuracy was accepted, in the files that state it.
DATED = {"*baseline.json": rb'"date": "[^"]*"', "*history.csv": rb"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\+00:00"}


def files_in(folder: Path, places: Iterable[str]) -> dict[str, bytes]:
    """All files at some places of a folder, hidden ones included, without times and dates.

    Parameters
    ----------
    folder : Path
    places : iterable of str
        Names of files and folders in it; those that are not there have no file.

    Returns
    -------
    dict of str to bytes
        Content by path relative to the folder.
    """
    found = [file for place in places for file in [folder / place, *(folder / place).rglob("*")] if file.is_file()]
    named = {file.relative_to(folder).as_posix(): file for file in found}
    kept = {name: file for name, file in named.items() if not any(fnmatch(f"/{name}", times) for times in TIMES)}
    return {name: undated(name, file.read_bytes()) for name, file in sorted(kept.items())}


def undated(name: str, content: bytes) -> bytes:
    """Content of a file, with a word in the place of each date that it states."""
    for pattern, date in DATED.items():
        if fnmatch(name, pattern):
            content = re.sub(date, b"DATE", content)
    return content


def differing(one: Files, other: Files) -> list[str]:
    """Names of the files that only one of two runs has, or whose content differs."""
    return sorted(name for name in {*one, *other} if one.get(name) != other.get(name))
