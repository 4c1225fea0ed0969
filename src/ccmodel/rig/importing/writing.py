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
from ccmodel.rig.drafting import draft_batch
from ccmodel.rig.findings import FileError
from ccmodel.rig.imported import PROVENANCE, imported_logs, listed_files, unlisted_logs
from ccmodel.rig.importing.map import ImportMap, load_map
from ccmodel.rig.importing.recording import Built, build
from ccmodel.rig.importing.sources import Source, names_of, recordings_of
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
        Files that were left out.
    drafted : bool
        Whether a `batch.yaml` was drafted.
    unlisted : list of str
        Recordings that an earlier `batch.yaml` does not list, so that no command will use them.
    """

    folder: Path
    recordings: dict[str, Built]
    remarks: list[str] = field(default_factory=list)
    drafted: bool = False
    unlisted: list[str] = field(default_factory=list)


def import_files(files: Sequence[Path], map_file: Path, out: Path, progress: Progress = silent) -> Written:
    """Write the logs of recordings in any format to a batch folder.

    Parameters
    ----------
    files : sequence of Path
        The files as the rig wrote them; they are only read.
    map_file : Path
        What each column is made of.
    out : Path
        Folder of the batch. The result of an earlier import is replaced as a whole, and only if this import succeeds; a
        `batch.yaml` in it stays.
    progress : Progress

    Returns
    -------
    Written
        The logs and what was assumed.

    Raises
    ------
    InputError
        If the map or a file cannot be used (a line for each), `out` holds anything but an import, or a file lies in it.
    """
    out = Path(out).resolve()
    check_folder(out)
    if inside := [file for file in files if Path(file).resolve().is_relative_to(out)]:
        raise InputError(
            f"{inside[0]}: lies in {out}, which an import replaces; give the rig's own files or another folder"
        )
    map_content = _content(map_file)
    stated = load_map(map_file)
    sources, remarks = recordings_of([Path(f) for f in files], stated)
    names = names_of([file for source in sources for file in source.files.values()])
    built = _build_all(sources, stated, names, within(progress, 0.0, BUILDING))
    with new_folder(out) as fresh:
        fresh.mkdir()
        writing = each_of(built.items(), within(progress, BUILDING, 1.0), lambda one: f"writing {one[0]}")
        for id_, one in writing:
            _write_log(fresh / f"{id_}.csv.gz", one.table)
        (fresh / MAP).write_bytes(map_content)
        text = json.dumps(_provenance(fresh, sources, built, names, remarks), indent=1, ensure_ascii=False)
        (fresh / PROVENANCE).write_text(text + "\n", encoding="utf-8")
        if (out / BATCH).exists():
            shutil.copy2(out / BATCH, fresh / BATCH)
    # In its place, so that a message on a log names a file that is there.
    drafted = _draft(out)
    return Written(out, built, remarks, drafted, _unlisted(out))


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


def _unlisted(folder: Path) -> list[str]:
    """Recordings of an import that `batch.yaml` does not list; of one that cannot be read, `ccmodel check` says why."""
    try:
        return list(unlisted_logs(folder, listed_files(folder)))
    except InputError:
        return []


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
            problems.append(Problem(error.file, None, _one_line(error)))
    if problems:
        raise InputError.of(*dict.fromkeys(problems))
    return built


def _one_line(error: FileError) -> str:
    defect = error.defect
    place = [f"line {defect.row}" if defect.row is not None else None, defect.column]
    return ", ".join(p for p in place if p) + (": " if any(place) else "") + defect.text


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


def _draft(folder: Path) -> bool:
    """Draft a `batch.yaml` where there is none."""
    if (folder / BATCH).exists():
        return False
    draft_batch(folder)
    return True
