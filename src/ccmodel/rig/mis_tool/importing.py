"""Conversion of the data set: every folder of trials to the folder of a batch."""

import json
import re
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

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


def import_mis_tool(source: Path, out: Path) -> Imported:
    """Convert every folder of trials below `source` to a batch below `out`.

    Parameters
    ----------
    source : Path
        The data set: its repository, its `data` folder or one folder of trials.
    out : Path
        Folder for the folders of the batches and `findings.json`. The result of an earlier import is replaced as a
        whole, and only if this import succeeds.

    Returns
    -------
    Imported
        Folders of the batches, and the findings.

    Raises
    ------
    InputError
        If `source` is not a folder or has no trial, or `out` has other files than those of an import.
    """
    source, out = Path(source), Path(out).resolve()
    if not source.is_dir():
        raise InputError(f"{source}: there is no such folder; give the mis-tool-characterization data set's folder")
    _check_replaceable(out)
    out.parent.mkdir(parents=True, exist_ok=True)
    # In the parent of `out`, since a folder can only be renamed within a file system.
    with tempfile.TemporaryDirectory(prefix=".import-", dir=out.parent) as work:
        fresh = Path(work) / "fresh"
        fresh.mkdir()
        names, findings = _import_into(fresh, source)
        if out.exists():
            out.rename(Path(work) / "earlier")
        fresh.rename(out)
    return Imported([out / name for name in names], findings)


def _check_replaceable(out: Path) -> None:
    """Refuse a folder that has other files than those of an earlier import."""
    if out.exists() and not out.is_dir():
        raise InputError(f"{out}: is no folder; give a new or empty one")
    for entry in sorted(out.iterdir()) if out.exists() else []:
        description = entry / "batch.yaml"
        imported = description.is_file() and DOI in description.read_text(encoding="utf-8", errors="replace")
        if not imported and entry.name != FINDINGS:
            raise InputError(
                f"{out}: would be replaced, but {entry.name} is from no import; give a new or empty folder"
            )


def _import_into(out: Path, source: Path) -> tuple[list[str], list[Finding]]:
    """Write the batches and the findings; return the names of the batches and the findings."""
    files = sorted(f for f in source.rglob("*") if f.suffix.lower() == ".txt" and f.is_file())
    names, findings, taken = [], [], set()
    for folder in sorted({f.parent for f in files}):
        name = _unique(_safe(folder.resolve().name), taken)
        trials, found = _read_folder([f for f in files if f.parent == folder], name)
        findings += found
        if trials:
            signs, doubts = sensor_signs(list(trials.values()))
            findings += [Finding(name, str(folder), None, None, "warning", text) for text in doubts]
            write_batch(out / name, trials, signs)
            names.append(name)
    if not names:
        raise InputError(
            f"{source}: no trial found in {len(files)} .TXT files below it; a trial has {FEWEST_COLUMNS} columns of"
            f" numbers or more and at least {FEWEST_ROWS} rows"
        )
    (out / FINDINGS).write_text(json.dumps([asdict(f) for f in findings], indent=1) + "\n", encoding="utf-8")
    return names, findings


def _read_folder(files: list[Path], batch: str) -> tuple[dict[str, Trial], list[Finding]]:
    """Trials of a folder by recording id, and the findings."""
    trials, findings, taken = {}, [], set()
    for file in files:
        try:
            trial = read_trial(file)
        except LogError as error:
            findings.append(Finding(batch, str(file), None, None, "refused", error.args[2]))
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
