"""The map that a guess makes: a text with comments, to be corrected by a person."""

import json
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from types import MappingProxyType
from typing import NamedTuple

from ccmodel.outputs import new_file
from ccmodel.progress import Progress, each_of, silent
from ccmodel.rig import readers
from ccmodel.rig.batch import DRIVE_ANGLE_COLUMNS
from ccmodel.rig.columns import UNIT_OF
from ccmodel.rig.findings import LogError
from ccmodel.rig.importing.guess import Guess, GuessedFile, guess_file, open_questions, without_copies
from ccmodel.rig.importing.map import MAIN, FileRule, TimeSource
from ccmodel.rig.importing.names import DRIVE, LOAD, read_name
from ccmodel.rig.importing.recording import ReadFile, match_files
from ccmodel.rig.importing.sources import check_given, names_of
from ccmodel.rig.importing.writing import MAP, check_folder
from ccmodel.rig.readers.contract import SignalFile
from ccmodel.sentences import controls_in, shown
from ccmodel.typed import InputError, Problem

_HEAD = """\
# What each column of the log is made of: column = sign * gain * (signal - zero), in the unit of the column's name.
# This is a guess. Correct it; a line behind "# " is not sure and not used: take "# " away where it is right.
# Keys of a column: signal, unit, sign, gain, zero, delay_s, file, time (docs/how-to/import-logs.md).
"""
# Recordings of which a match of clocks is tried: each takes a second, and they move alike.
_TRIED = 3
# Words that YAML does not read as text.
_NO_TEXT = {"null", "true", "false", "yes", "no", "on", "off", "~"}
_PLAIN = re.compile(r"[^\W\d][\w .+*/°%-]*")


@dataclass(frozen=True)
class GuessedMap:
    """A guessed map.

    Attributes
    ----------
    file : Path
        Where it was written.
    guessed : dict of str to GuessedFile
        By role of the file.
    names : dict of str to str
        Name of the file that was looked at, by role.
    remarks : list of str
        What reading the files assumed, and what else must be said.
    """

    file: Path
    guessed: dict[str, GuessedFile]
    names: dict[str, str]
    remarks: list[str]


class Match(NamedTuple):
    """One quantity in two files of a recording.

    Attributes
    ----------
    here, there : str
        Its signal in the further file, and in the first.
    refusal : str
        Why the two do not tell the clock; "" if they do.
    """

    here: str
    there: str
    refusal: str = ""


def write_guess(files: Sequence[Path], out: Path, progress: Progress = silent) -> GuessedMap:
    """Guess a map for files and write it to a folder.

    Parameters
    ----------
    files : sequence of Path
        The files as the rig wrote them.
    out : Path
        Folder for `map.yaml`; no other file in it is touched.
    progress : Progress

    Returns
    -------
    GuessedMap
        The guess, for the terminal.

    Raises
    ------
    InputError
        If a file cannot be read (a line for each), the folder holds what no import wrote, or has a map.
    """
    out = Path(out).resolve()
    check_folder(out)
    target = out / MAP
    if target.exists():
        text = f"{target}: there is a map; use it with --map {target}, or remove it to have a new one guessed"
        raise InputError(text)
    if not files:
        raise InputError("no file to import: give the rig's logs")
    check_given(files)
    names = names_of([Path(f) for f in files])
    kinds, roles, patterns, remarks = _sorted_files(_read_all(names, progress), names)
    ends = {role: read_name(role).end if patterns else None for role in roles}
    guessed = {role: guess_file(kinds[key][0][1], ends[role]) for role, key in roles.items()}
    guessed, copies = without_copies(guessed, ends)
    matches = _tried(copies, guessed, {role: kinds[key] for role, key in roles.items()}, patterns)
    questions = tuple(open_questions([guess for one in guessed.values() for guess in one.guesses]))
    guessed = {role: replace(one, open=questions) for role, one in guessed.items()}
    looked_at = {role: names[kinds[key][0][0]] for role, key in roles.items()}
    for role, key in roles.items():
        remarks += [f"{looked_at[role]}: {remark}" for remark in kinds[key][0][1].remarks]
    with new_file(target) as fresh:
        fresh.write_text(map_text(guessed, patterns, remarks, matches), encoding="utf-8")
    return GuessedMap(target, guessed, looked_at, remarks)


def _tried(
    copies: Mapping[str, tuple[str, str]],
    guessed: Mapping[str, GuessedFile],
    files: Mapping[str, Sequence[tuple[Path, SignalFile]]],
    patterns: Mapping[str, str],
) -> dict[str, Match]:
    """Copies of a quantity, tried on a few recordings: a motion that repeats does not tell the clock."""
    first = next(iter(guessed))
    return {
        role: Match(*copy, _refusal(copy, *(_by_recording(r, guessed, files, patterns) for r in (role, first))))
        for role, copy in copies.items()
    }


def _by_recording(
    role: str,
    guessed: Mapping[str, GuessedFile],
    files: Mapping[str, Sequence[tuple[Path, SignalFile]]],
    patterns: Mapping[str, str],
) -> dict[str | None, ReadFile]:
    """Files of a role by the part of their names that the recording is called by."""
    rule, time = FileRule(pattern=patterns[role]), guessed[role].time
    return {
        rule.recording_of(Path(os.path.abspath(path))): ReadFile(role, "", file, time) for path, file in files[role]
    }


def _refusal(
    copy: tuple[str, str], further: Mapping[str | None, ReadFile], first: Mapping[str | None, ReadFile]
) -> str:
    for recording in [name for name in further if name in first][:_TRIED]:
        try:
            match_files(further[recording], first[recording], copy)
        except LogError as error:
            return error.defect.text
    return ""


def _read_all(names: Mapping[Path, str], progress: Progress) -> dict[Path, SignalFile]:
    read, problems = {}, []
    for path, name in each_of(names.items(), progress, lambda one: f"reading {one[1]}"):
        try:
            read[path] = readers.read_signals(path)
        except LogError as error:
            problems.append(Problem(name, error.defect.row, error.defect.text))
    if problems:
        raise InputError.of(*problems)
    return read


def _sorted_files(
    read: Mapping[Path, SignalFile], names: Mapping[Path, str]
) -> tuple[dict[tuple, list], dict, dict, list]:
    """Files by kind, and what `_roles` says of the kinds."""
    kinds = _kinds(read)
    by_end = _kinds_by_end(kinds)
    if not by_end:
        return kinds, *_roles(kinds, names)
    roles, patterns, _ = _roles(by_end, names)
    # One file of each end in one folder is one recording.
    roles, patterns = (roles, patterns) if patterns else _roles_in_folders(by_end, fewest=1) or ({}, {})
    if patterns:
        return by_end, roles, patterns, []
    text = "some names of files say drive and some load: if two are one recording, state by 'files' which is which"
    return kinds, *_roles(kinds, names)[:2], [text]


def _kinds_by_end(kinds: Mapping[tuple, list]) -> dict[tuple, list[tuple[Path, SignalFile]]]:
    """Files with the same signals, apart by the end that their names say; empty unless both ends occur."""
    if len(kinds) > 1:
        return {}
    ((key, files),) = kinds.items()
    ends: dict[str | None, list] = {DRIVE: [], LOAD: []}
    for path, file in files:
        reading = read_name(path.stem)
        ends.setdefault(None if reading.end_is_hint else reading.end, []).append((path, file))
    return {} if not all(ends.values()) or None in ends else {(*key, end): found for end, found in ends.items()}


def _kinds(read: Mapping[Path, SignalFile]) -> dict[tuple, list[tuple[Path, SignalFile]]]:
    """Files by the names of their signals; the kind with an angle of the drive first."""
    kinds: dict[tuple, list] = {}
    for path, file in read.items():
        kinds.setdefault((path.suffix, *(s.name for s in file.signals)), []).append((path, file))
    return dict(sorted(kinds.items(), key=lambda kind: not _has_drive_angle(kind[1][0][1])))


def _has_drive_angle(file: SignalFile) -> bool:
    return any(g.column in DRIVE_ANGLE_COLUMNS and g.sure for g in guess_file(file).guesses)


def _roles(
    kinds: Mapping[tuple, list], names: Mapping[Path, str]
) -> tuple[dict[str, tuple], dict[str, str], list[str]]:
    """Role of each kind of file, patterns of the further ones, and remarks."""
    keys = list(kinds)
    if len(keys) == 1:
        return {MAIN: keys[0]}, {}, []
    if of_folders := _roles_in_folders(kinds):
        return *of_folders, []
    stems = [[PurePath(names[path]).name for path, _ in kinds[key]] for key in keys]
    ends = [_shared_end(group, stems) for group in stems]
    recordings = [{name[: len(name) - len(end)] for name in group} for group, end in zip(stems, ends, strict=True)]
    if "" in recordings[0] or any(r != recordings[0] for r in recordings) or len(set(ends)) < len(ends):
        others = ", ".join(names[kinds[key][0][0]] for key in keys[1:])
        main = names[kinds[keys[0]][0][0]]
        text = f"{others}: other signals than {main}, and the guess is of {main} alone"
        advice = "state by 'files' how they belong together, or import them apart"
        return {MAIN: keys[0]}, {}, [f"{text}; {advice}"]
    roles, patterns = {}, {}
    for key, end in zip(keys, ends, strict=True):
        role = _role(PurePath(end).stem) or PurePath(end).suffix.strip(".") or "file"
        roles[role], patterns[role] = key, f"*{end}"
    return roles, patterns, []


def _roles_in_folders(kinds: Mapping[tuple, list], fewest: int = 2) -> tuple[dict[str, tuple], dict[str, str]] | None:
    """Roles and patterns if each folder is a recording, with a file of each kind that has the same name everywhere."""
    paths = {key: [Path(os.path.abspath(path)) for path, _ in files] for key, files in kinds.items()}
    called = {key: {path.name for path in found} for key, found in paths.items()}
    folders = [sorted(path.parent for path in found) for found in paths.values()]
    if (
        len(folders[0]) < fewest
        or any(f != folders[0] for f in folders)
        or any(len(names) > 1 for names in called.values())
    ):
        return None
    roles, patterns = {}, {}
    for key, (name,) in called.items():
        role = _role(PurePath(name).stem) or "file"
        role = role if role not in roles else PurePath(name).suffix.strip(".")
        roles[role], patterns[role] = key, f"*/{name}"
    return roles, patterns


def _role(text: str) -> str:
    role = re.sub(r"\W+", "-", text).strip("-_.")
    return role if role != MAIN else "first"


def _shared_end(group: Sequence[str], groups: Sequence[Sequence[str]]) -> str:
    """End of the names of one kind of file: what follows the part that all kinds of a recording share."""
    starts = [name for other in groups if other is not group for name in other]
    rests = set()
    for name in group:
        shared = max((_shared_start(name, start) for start in starts), key=len, default="")
        rests.add(name[len(shared) :])
    return rests.pop() if len(rests) == 1 else ""


def _shared_start(one: str, other: str) -> str:
    """The longest common beginning of two names, up to the end of a word."""
    length = next((i for i, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), min(len(one), len(other)))
    return one[:length].rstrip("-_. ")


def map_text(
    guessed: Mapping[str, GuessedFile],
    patterns: Mapping[str, str],
    remarks: Sequence[str],
    matches: Mapping[str, Match] = MappingProxyType({}),
) -> str:
    """Text of the map.

    Parameters
    ----------
    guessed : mapping of str to GuessedFile
        Guesses by role of the file.
    patterns : mapping of str to str
        Patterns of the files of one recording; empty if a recording is one file.
    remarks : sequence of str
        Written as comments.
    matches : mapping of str to Match
        By role of a further file, what may tell its clock.

    Returns
    -------
    str
        YAML with comments.
    """
    several = len(guessed) > 1
    lines = [_HEAD, *(f"# {shown(remark)}" for remark in remarks), "format: 1"]
    if not several:
        lines += _time_lines(next(iter(guessed.values())), "")
    lines += ["channels:"]
    unused = []
    for role, one in guessed.items():
        lines += [f"  {_channel_line(guess, role if several else None)}" for guess in one.guesses if guess.column]
        unused += [guess for guess in one.guesses if not guess.column]
    lines += [f"  # not used: {_quoted(guess.signal)} ({_reasons(guess)})" for guess in unused]
    if several:
        lines += ["files:"]
        for role, one in guessed.items():
            lines += [f"  {role}:", f"    pattern: {json.dumps(patterns[role])}", *_time_lines(one, "    ")]
            if role != next(iter(guessed)):
                lines.append(_clock_line(matches.get(role)))
    questions = dict.fromkeys(text for one in guessed.values() for text in one.open)
    lines += ["", "# Not in these files:", *(f"# - {shown(question)}" for question in questions)]
    return "\n".join(lines) + "\n"


def _clock_line(match: Match | None) -> str:
    if match is None:
        text = "{match: [signal here, the same quantity in the first file]}"
        return f"    # clock: {{offset_s: , drift: 0}}   # or {text}; without it, the files start together"
    clock = f"clock: {{match: [{_quoted(match.here)}, {_quoted(match.there)}]}}   # the same quantity in both"
    return f"    # {clock}, but {shown(match.refusal)}" if match.refusal else f"    {clock}"


def _time_lines(one: GuessedFile, indent: str) -> list[str]:
    if one.time is None:
        line = "" if one.time_is_sure else f"{indent}# time: {{rate_Hz: }}   "
        return [f"{line or indent}# {shown(one.time_why)}"]
    sign = "" if one.time_is_sure else "# "
    return [f"{indent}{sign}time: {time_text(one.time)}   # {shown(one.time_why)}"]


def time_text(time: TimeSource) -> str:
    """A time source as the map has it."""
    return f"{{signal: {_quoted(time.signal or '')}, unit: {_quoted(time.unit or '')}}}"


def _channel_line(guess: Guess, role: str | None) -> str:
    parts = [f"signal: {_quoted(guess.signal)}"]
    parts += [f"unit: {_quoted(guess.unit)}"] if guess.unit else []
    parts += ["sign: -1"] if guess.sign < 0 else []
    if guess.column and guess.unit and not guess.sure and guess.needs_gain:
        parts.append(f'gain: "? {UNIT_OF[guess.column]}/{guess.unit}"')
    parts += [f"time: {time_text(guess.time)}"] if guess.time else []
    parts += [f"file: {role}"] if role else []
    line = f"{'' if guess.sure else '# '}{guess.column}: {{{', '.join(parts)}}}"
    return f"{line}   # {_reasons(guess)}"


def _reasons(guess: Guess) -> str:
    """Why a signal was taken for a column, in one line; units and names are those of the file."""
    return shown("; ".join(filter(None, guess.why)))


def _quoted(text: str) -> str:
    """A text that YAML reads as this text, inside braces too."""
    plain = _PLAIN.fullmatch(text) and text == text.strip() and text.lower() not in _NO_TEXT
    return text if plain else json.dumps(text, ensure_ascii=controls_in(text))
