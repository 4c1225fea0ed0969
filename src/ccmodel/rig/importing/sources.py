"""Which of the given files make up which recording."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath

from ccmodel.rig.batch import recording_id
from ccmodel.rig.importing.map import MAIN, ImportMap
from ccmodel.sentences import controls_in, shown
from ccmodel.typed import InputError, Problem


@dataclass(frozen=True)
class Source:
    """The files of a recording.

    Attributes
    ----------
    id : str
        The recording.
    files : dict of str to Path
        Its files by role ("main" or a key of the map's `files`). The first has the clock of the log.
    """

    id: str
    files: dict[str, Path]


def check_given(files: Sequence[Path]) -> None:
    """Check that files are there, before their common folder is taken off their names.

    Raises
    ------
    InputError
        A line for each file that is not there, by its path as it was given.
    """
    absent = [str(file) for file in files if not os.path.lexists(file)]
    if absent:
        raise InputError.of(*(Problem(shown(file), None, "there is no such file") for file in absent))


def names_of(files: Sequence[Path]) -> dict[Path, str]:
    """Names of files for people and for provenance: their paths below the folder that they share."""
    resolved = {file: _absolute(file) for file in files}
    shared = os.path.commonpath([path.parent for path in resolved.values()])
    names = {file: path.relative_to(shared).as_posix() for file, path in resolved.items()}
    if odd := [name for name in names.values() if controls_in(name)]:
        raise InputError(f"{shown(odd[0])}: has characters that do not show; rename the file")
    return names


def recordings_of(files: Sequence[Path], stated: ImportMap) -> tuple[list[Source], list[str]]:
    """Sort files into recordings.

    Parameters
    ----------
    files : sequence of Path
        The files given.
    stated : ImportMap
        Its `recordings`, or else its `files`, say which belong together.

    Returns
    -------
    recordings : list of Source
        In the order of the map, or else of the files.
    remarks : list of str
        Files that are left out.

    Raises
    ------
    InputError
        If a file that a recording needs was not given, or two files have the same place in a recording.
    """
    if not files:
        raise InputError("no file to import: give the rig's logs")
    names = names_of(list(dict.fromkeys(files)))
    return _as_listed(names, stated) if stated.recordings else (_by_name(names, stated), [])


def _as_listed(names: dict[Path, str], stated: ImportMap) -> tuple[list[Source], list[str]]:
    sources, used = [], set()
    for entry in stated.recordings:
        found = [_given(listed, names, entry.id) for listed in entry.files]
        used |= set(found)
        sources.append(Source(entry.id, _by_role(found, stated, entry.id)))
    left = [name for file, name in names.items() if file not in used]
    return sources, [f"{name}: left out, no recording of the map has it" for name in left]


def _given(listed: str, names: dict[Path, str], recording: str) -> Path:
    wanted = PurePath(listed).parts
    fitting = [file for file, name in names.items() if PurePath(name).parts[-len(wanted) :] == wanted]
    if len(fitting) == 1:
        return fitting[0]
    if fitting:
        raise InputError(f"recording '{recording}': {len(fitting)} files are called '{listed}': add their folder")
    raise InputError(f"recording '{recording}': '{listed}' is not among the files given: give it too")


def _by_name(names: dict[Path, str], stated: ImportMap) -> list[Source]:
    """A recording for each main file; the further files are those whose star stands for the same name."""
    named = {file: _recording_of(file, name, stated) for file, name in names.items()}
    ids = {id_ for id_ in named.values() if id_}
    groups: dict[str, list[Path]] = {}
    for file, name in names.items():
        folder = _id_in(name, 2, _absolute(file).parent.name)
        own = folder if folder in ids and _by_folder(stated) else recording_id(name)
        groups.setdefault(named[file] or own, []).append(file)
    return [Source(id_, _by_role(found, stated, id_)) for id_, found in groups.items()]


def _recording_of(file: Path, name: str, stated: ImportMap) -> str | None:
    fits = ((rule, rule.recording_of(_absolute(file))) for rule in stated.files.values())
    return next((_id_in(name, rule.depth, part) for rule, part in fits if part), None)


def _id_in(name: str, depth: int, part: str) -> str:
    """Id of a recording that `part` names, below the folders above the last `depth` names of a path."""
    return recording_id("/".join((*PurePath(name).parts[:-depth], f"{part}.log")))


def _by_folder(stated: ImportMap) -> bool:
    return any(rule.depth > 1 for rule in stated.files.values())


def _star_of(file: Path, stated: ImportMap) -> str:
    """What the star of a pattern stands for in the recording of a file: of a main file its name without endings."""
    parts = (rule.recording_of(_absolute(file)) for rule in stated.files.values())
    return next((part for part in parts if part), file.name.partition(".")[0])


def _absolute(file: Path) -> Path:
    return Path(os.path.abspath(file))


def _by_role(found: list[Path], stated: ImportMap, recording: str) -> dict[str, Path]:
    roles: dict[str, Path] = {}
    for file in found:
        role = next((r for r, rule in stated.files.items() if rule.recording_of(_absolute(file))), MAIN)
        if role in roles:
            both = f"{roles[role].name} and {file.name} would both be its '{role}' file"
            advice = "state in the map by 'files' which is which, or by 'recordings' that they are two recordings"
            raise InputError(f"recording '{recording}': {both}: {advice}")
        roles[role] = file
    missing = [role for role in stated.files if role not in roles]
    if missing:
        pattern = stated.files[missing[0]].pattern.replace("*", _star_of(found[0], stated))
        text = f"beside {found[0].name} there is no {pattern} ('{missing[0]}')"
        raise InputError(f"recording '{recording}': {text}: give that file too")
    order = [role for role in (MAIN, *stated.files) if role in roles]
    return {role: roles[role] for role in order}
