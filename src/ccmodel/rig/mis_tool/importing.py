"""Conversion of the data set, or of one of its folders: a folder of trials becomes the folder of a batch."""

import json
import re
from dataclasses import asdict, dataclass
from pathlib import Path

from ccmodel.outputs import new_folder
from ccmodel.progress import Progress, each_of, silent
from ccmodel.rig.batch import NAMES, valid_name
from ccmodel.rig.findings import Finding, LogError
from ccmodel.rig.mis_tool.description import write_batch
from ccmodel.rig.mis_tool.signs import sensor_signs
from ccmodel.rig.mis_tool.trial import FEWEST_COLUMNS, FEWEST_ROWS, Trial, read_trial
from ccmodel.typed import InputError

FINDINGS = "findings.json"
DOI = "10.1109/LRA.2018.2849862"  # in every `batch.yaml` of an import


@dataclass(frozen=True)
class Imported:
    """Result of an import.

    Attributes
    ----------
    batches : list of Path
        Folders of the batches.
    findings : list of Finding
        Files that were not imported, rows that were dropped and signs in doubt.
    """

    batches: list[Path]
    findings: list[Finding]


def import_mis_tool(source: Path, out: Path, progress: Progress = silent) -> Imported:
    """Convert every folder of trials below `source` to a batch below `out`.

    Parameters
    ----------
    source : Path
        The data set: its repository, its `data` folder or one folder of trials.
    out : Path
        Folder for the folders of the batches and `findings.json`. The result of an earlier import is replaced as a
        whole, and only if this import succeeds.
    progress : Progress

    Returns
    -------
    Imported
        Folders of the batches, and the findings.

    Raises
    ------
    InputError
        If `source` is not a folder or has no trial, or `out` has other files than those of an import.
    """
    out = Path(out).resolve()
    if out.exists() and not out.is_dir():
        raise InputError(f"{out}: is no folder; give a new or empty one")
    for entry in sorted(out.iterdir()) if out.exists() else []:
        if not _is_imported(entry) and entry.name != FINDINGS:
            raise InputError(
                f"{out}: would be replaced, but {entry.name} is from no import; give a new or empty folder"
            )
    files = _text_files(source)
    with new_folder(out) as fresh:
        fresh.mkdir()
        names, findings = _import_into(fresh, files, progress)
        if not names:
            raise _no_trial(source, files)
        (fresh / FINDINGS).write_text(json.dumps([asdict(f) for f in findings], indent=1) + "\n", encoding="utf-8")
    return Imported([out / name for name in names], findings)


def import_batch(source: Path, out: Path) -> Imported:
    """Convert one folder of trials to the batch folder `out`; what else is beside it stays.

    Parameters
    ----------
    source : Path
        One folder of trials of the data set.
    out : Path
        Folder of the batch. The result of an earlier import is replaced, and only if this import succeeds.

    Returns
    -------
    Imported
        The batch's folder, and the findings.

    Raises
    ------
    InputError
        If `source` is not a folder, has no trial or has folders of trials in it, or `out` is no imported batch.
    """
    out = Path(out).resolve()
    if not valid_name(out.name):
        raise InputError(f"{out.name}: {NAMES}")
    if out.exists() and not _is_imported(out):
        raise InputError(f"{out}: would be replaced, but is from no import; choose another name for the batch")
    files = _text_files(source)
    if inner := {f.parent for f in files} - {Path(source)}:
        raise InputError(f"{source}: has trials in {min(inner).name}; a batch is made of one folder of trials, name it")
    with new_folder(out) as fresh:
        findings = _import_folder(files, fresh, out.name)
        if not fresh.exists():
            raise _no_trial(source, files)
    return Imported([out], findings)


def _is_imported(folder: Path) -> bool:
    """Whether a folder is a batch that an import wrote."""
    description = folder / "batch.yaml"
    return description.is_file() and DOI in description.read_text(encoding="utf-8", errors="replace")


def _text_files(source: Path) -> list[Path]:
    """All .TXT files below a folder."""
    if not Path(source).is_dir():
        raise InputError(f"{source}: there is no such folder; give the mis-tool-characterization data set's folder")
    return sorted(f for f in Path(source).rglob("*") if f.suffix.lower() == ".txt" and f.is_file())


def _no_trial(source: Path, files: list[Path]) -> InputError:
    return InputError(
        f"{source}: no trial found in {len(files)} .TXT files below it; a trial has {FEWEST_COLUMNS} columns of"
        f" numbers or more and at least {FEWEST_ROWS} rows"
    )


def _import_into(out: Path, files: list[Path], progress: Progress) -> tuple[list[str], list[Finding]]:
    """Write the batches; return their names and the findings."""
    names, findings = [], []
    taken: set[str] = set()
    folders = sorted({f.parent for f in files})
    for folder in each_of(folders, progress, lambda one: f"converting {one.name}"):
        name = _unique(_safe(folder.resolve().name), taken)
        findings += _import_folder([f for f in files if f.parent == folder], out / name, name)
        if (out / name).exists():
            names.append(name)
    return names, findings


def _import_folder(files: list[Path], out: Path, batch: str) -> list[Finding]:
    """Write the batch of one folder of trials, if it has any; return the findings."""
    trials, findings = _read_folder(files, batch)
    if trials:
        signs, doubts = sensor_signs(list(trials.values()))
        findings += [Finding(batch, str(files[0].parent), None, None, "warning", text) for text in doubts]
        write_batch(out, trials, signs)
    return findings


def _read_folder(files: list[Path], batch: str) -> tuple[dict[str, Trial], list[Finding]]:
    """Trials of a folder by recording id, and the findings."""
    trials, findings = {}, []
    taken: set[str] = set()
    for file in files:
        try:
            trial = read_trial(file)
        except LogError as error:
            findings.append(Finding(batch, str(file), None, None, "refused", error.defect.text))
            continue
        if trial is not None:
            trials[_unique(f"trial-{_safe(file.stem)}", taken)] = trial
            if trial.remark:
                findings.append(Finding(batch, str(file), None, None, "warning", trial.remark))
    return trials, findings


def _safe(name: str) -> str:
    """A valid name of a batch, recording and file."""
    return re.sub(r"[^A-Za-z0-9_-]+", "-", name).strip("-") or "data"


def _unique(name: str, taken: set[str]) -> str:
    """`name`, with a number if it is taken; some file systems ignore case."""
    free, n = name, 2
    while free.lower() in taken:
        free, n = f"{name}-{n}", n + 1
    taken.add(free.lower())
    return free
