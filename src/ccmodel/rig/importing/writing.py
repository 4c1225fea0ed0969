"""The result of an import: a folder with a log for each recording, the map, and where all of it is from."""

import hashlib
import json
import shutil
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
import pandas as pd

from ccmodel import inputs
from ccmodel.outputs import new_folder
from ccmodel.paths import try_batch_folder
from ccmodel.progress import Progress, each_of, silent, within
from ccmodel.provenance import file_digest
from ccmodel.rig.batch import NAMES, valid_name
from ccmodel.rig.columns import TIME
from ccmodel.rig.drafting import draft_and_refuse, in_words
from ccmodel.rig.findings import FileError, LogError
from ccmodel.rig.imported import PROVENANCE, Import, earlier_import, imported_logs, listed_files, unlisted_logs
from ccmodel.rig.importing.map import ImportMap, load_map
from ccmodel.rig.importing.recording import Built, build
from ccmodel.rig.importing.sources import Source, check_given, names_of, recordings_of
from ccmodel.rig.log import read_log
from ccmodel.typed import InputError, Problem
from ccmodel.version import __version__

MAP, BATCH = "map.yaml", "batch.yaml"
FORMAT = 1
# Share of reading the files in the time of an import; the logs are then written.
BUILDING = 0.5
# Libraries whose versions can change what is read. Those that are not installed are left out.
LIBRARIES = ("numpy", "pandas", "scipy", "pint", "asammdf", "npTDMS", "h5py", "pyarrow", "rosbags")
# Significant digits of a value: more than any converter or encoder has.
_DIGITS = 12


@dataclass(frozen=True)
class Written:
    """Result of an import.

    Attributes
    ----------
    folder : Path
        The folder that was written.
    recordings : dict of str to Built
        Logs by id of the recording.
    remarks : list of str
        Files that were left out, and logs that no batch can use, with the reason.
    drafted : bool
        Whether a `batch.yaml` was drafted.
    unlisted : list of str
        Recordings that an earlier `batch.yaml` does not list, so that no command will use them. Those that no batch can
        use are not among them.
    changed : list of str
        Recordings whose logs differ from those of the import before, for which an earlier `batch.yaml` was written.
    """

    folder: Path
    recordings: dict[str, Built]
    remarks: list[str] = field(default_factory=list)
    drafted: bool = False
    unlisted: list[str] = field(default_factory=list)
    changed: list[str] = field(default_factory=list)


def import_files(files: Sequence[Path], map_file: Path, out: Path, progress: Progress = silent) -> Written:
    """Write the logs of recordings in any format to a batch folder.

    Parameters
    ----------
    files : sequence of Path
        The files as the rig wrote them; they are only read.
    map_file : Path
        What each column is made of.
    out : Path
        Folder of the batch. The result of an earlier import is replaced as a whole, and only if this import succeeds. A
        `batch.yaml` in it stays, unless it is the draft of an earlier import that nobody has edited.
    progress : Progress

    Returns
    -------
    Written
        The logs and what was assumed.

    Raises
    ------
    InputError
        If the map or a file cannot be used (a line for each), no recording makes a log that a batch can use, `out`
        holds anything but an import, or a file lies in it.
    """
    out = Path(out).resolve()
    check_folder(out)
    if inside := [file for file in files if Path(file).resolve().is_relative_to(out)]:
        raise InputError(
            f"{inside[0]}: lies in {out}, which an import replaces; give the rig's own files or another folder"
        )
    check_given(files)
    map_content = _content(map_file)
    stated = load_map(map_file)
    sources, remarks = recordings_of([Path(f) for f in files], stated)
    names = names_of([file for source in sources for file in source.files.values()])
    built = _build_all(sources, stated, names, within(progress, 0.0, BUILDING))
    earlier = earlier_import(out)
    drafts = _is_to_be_drafted(out, earlier)
    with new_folder(out) as fresh:
        fresh.mkdir()
        writing = each_of(built.items(), within(progress, BUILDING, 1.0), lambda one: f"writing {one[0]}")
        for id_, one in writing:
            _write_log(fresh / f"{id_}.csv.gz", one.table)
        (fresh / MAP).write_bytes(map_content)
        if drafts:
            unusable = _draft(fresh, sources, names)
        else:
            shutil.copy2(out / BATCH, fresh / BATCH)
        draft_sha256 = _sha256(fresh / BATCH) if drafts else earlier and earlier.draft_sha256
        provenance = _provenance(fresh, sources, built, names, remarks) | {"draft_sha256": draft_sha256}
        text = json.dumps(provenance, indent=1, ensure_ascii=False)
        (fresh / PROVENANCE).write_text(text + "\n", encoding="utf-8")
    left, changed = [], []
    if not drafts:
        unlisted = _unlisted(out)
        unusable = _unusable(out, unlisted)
        left = [id_ for id_, file in unlisted.items() if file not in unusable]
        changed = _changed({one["id"]: one["sha256"] for one in provenance["recordings"]}, earlier)
    remarks = remarks + [f"{file}: not used: {text}" for file, text in unusable.items()]
    return Written(out, built, remarks, drafts, left, changed)


def check_folder(out: Path) -> None:
    """Check that a folder may take an import.

    Raises
    ------
    InputError
        If its name is no batch's, it holds files that no import wrote, or no folder can be made beside it.
    """
    if not valid_name(out.name):
        raise InputError(f"{out}: its name becomes the batch's, and {NAMES}: choose another folder")
    try_batch_folder(out.parent)
    if not out.exists():
        return
    if not out.is_dir():
        raise InputError(f"{out}: is no folder; give a new or empty one")
    own = {MAP, BATCH, PROVENANCE, ".DS_Store", *_files_of_import(out)}
    if foreign := sorted(entry.name for entry in out.iterdir() if entry.name not in own):
        raise InputError(f"{out}: would be replaced, but {foreign[0]} is from no import; give a new or empty folder")


def _files_of_import(folder: Path) -> list[str]:
    """Names of the logs that an earlier import wrote to a folder."""
    try:
        return list(imported_logs(folder).values())
    except InputError as error:
        raise InputError(f"{error}; give a new or empty folder") from None


def _unlisted(folder: Path) -> dict[str, str]:
    """Logs of an import that `batch.yaml` does not list, by id; none of a file that `ccmodel check` refuses."""
    try:
        return unlisted_logs(folder, listed_files(folder))
    except InputError:
        return {}


def _unusable(folder: Path, unlisted: dict[str, str]) -> dict[str, str]:
    """Why no batch can use a log, by the file of the log."""
    reasons = {}
    for file in unlisted.values():
        try:
            read_log(folder / file)
        except LogError as error:
            reasons[file] = in_words(error.defect)
    return reasons


def _changed(digests: dict[str, str], earlier: Import | None) -> list[str]:
    """Recordings whose logs are not those of the import before, from the digests of the logs by id."""
    before = {log.id: log.sha256 for log in earlier.recordings if log.sha256} if earlier else {}
    return [id_ for id_, digest in digests.items() if before.get(id_, digest) != digest]


def _content(file: Path) -> bytes:
    try:
        inputs.check_file(Path(file), inputs.DOCUMENT)
        return Path(file).read_bytes()
    except FileNotFoundError:
        raise InputError(f"{file}: there is no such map; leave --map out and one is written to begin with") from None
    except OSError as error:
        raise InputError(f"{file}: the map cannot be read ({error.strerror})") from None


def _build_all(
    sources: Sequence[Source], stated: ImportMap, names: dict[Path, str], progress: Progress
) -> dict[str, Built]:
    built, problems = {}, []
    for source in each_of(sources, progress, lambda one: f"reading {one.id}"):
        try:
            built[source.id] = build(source, stated, names)
        except FileError as error:
            row, column, text, _ = error.defect
            place = error.file if row is None else f"{error.file}, row {row}"
            problems.append(Problem(place, None, f"{column}: {text}" if column else text))
    if problems:
        raise InputError.of(*dict.fromkeys(problems))
    return built


def _write_log(path: Path, table: pd.DataFrame) -> None:
    """Write a log; equal tables give equal bytes, since the stream has no time stamp."""
    text = pd.DataFrame({name: _cells(values.to_numpy(), name) for name, values in table.items()})
    compression = {"method": "gzip", "compresslevel": 9, "mtime": 0}
    text.to_csv(path, index=False, compression=compression, lineterminator="\n")


def _cells(values: np.ndarray, name: str) -> np.ndarray:
    """Cells of a column: the shortest text of a number rounded to more digits than a sensor has."""
    if name == TIME:
        return np.array([f"{value:.9f}".rstrip("0").rstrip(".") for value in values], dtype=object)
    return np.array(["" if np.isnan(v) else f"{v:.{_DIGITS}g}" for v in values], dtype=object)


def _provenance(
    folder: Path, sources: Sequence[Source], built: dict[str, Built], names: dict[Path, str], remarks: list[str]
) -> dict:
    return {
        "format": FORMAT,
        "ccmodel_version": __version__,
        "libraries": {name: found for name in LIBRARIES if (found := _version(name))},
        "map": {"file": MAP, "sha256": _sha256(folder / MAP)},
        "remarks": remarks,
        "recordings": [_recorded(folder, source, built[source.id], names) for source in sources],
    }


def _recorded(folder: Path, source: Source, one: Built, names: dict[Path, str]) -> dict:
    file = f"{source.id}.csv.gz"
    return {
        "id": source.id,
        "file": file,
        "sha256": _sha256(folder / file),
        "samples": len(one.table),
        "started_s": one.started_s,
        "sources": [
            {"role": role, "file": names[path], "sha256": _sha256(path), "bytes": path.stat().st_size}
            for role, path in source.files.items()
        ],
        "columns": one.formulas,
        "cut_s": list(one.cut_s),
        "joined": [asdict(cost) for cost in one.costs],
        "remarks": one.remarks,
    }


def _version(library: str) -> str | None:
    try:
        return version(library)
    except PackageNotFoundError:
        return None


def _sha256(path: Path) -> str:
    """Digest of a file; of a folder (a ROS 2 bag), of its files' names and digests."""
    if path.is_dir():
        inner = [f"{f.relative_to(path).as_posix()} {_sha256(f)}" for f in sorted(path.rglob("*")) if f.is_file()]
        return hashlib.sha256("\n".join(inner).encode()).hexdigest()
    return file_digest(path)


def _is_to_be_drafted(folder: Path, earlier: Import | None) -> bool:
    """Whether a folder has no `batch.yaml`, or the draft of an import as it was drafted."""
    file = folder / BATCH
    return not file.exists() or (earlier is not None and earlier.draft_sha256 == _sha256(file))


def _draft(fresh: Path, sources: Sequence[Source], names: dict[Path, str]) -> dict[str, str]:
    """Draft a `batch.yaml`, and say which logs no batch can use, and why.

    Raises
    ------
    InputError
        On the files of the recordings, if no log can be used.
    """
    try:
        return draft_and_refuse(fresh)[1]
    except InputError as error:
        given = {f"{source.id}.csv.gz": names[next(iter(source.files.values()))] for source in sources}
        problems = [(given.get(Path(p.file).name), p.text) for p in error.problems]
        if not problems or not all(file for file, _ in problems):
            raise
        texts = [Problem(str(file), None, f"its log could not be used: {text}") for file, text in problems]
        raise InputError.of(*texts) from None
