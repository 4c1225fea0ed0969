"""Importer for the public recordings of da Vinci instruments: MRDLab/mis-tool-characterization.

J. J. O'Neill, T. K. Stephens, T. M. Kowalewski, "Evaluation of Torque Measurement Surrogates as Applied to Grip
Torque and Jaw Angle Estimation of Robotic Surgical Tools", IEEE RA-L 3(4), 3027-3034, 2018,
doi 10.1109/LRA.2018.2849862; data under the Open Database License 1.0.

Every folder of trials becomes a batch of the rig log format. The spindle is the drive pulley, the jaw the load
pulley; angle and torque were measured at both, nothing in between. The files' headers were edited by hand: the columns
are trusted, the header is carried along as a note. What the trials were made under is read from the columns where
possible, because file names are coded differently from folder to folder.
"""

import json
import re
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from ccmodel.rig.findings import Finding
from ccmodel.typed import InputError, Positive, TypedModel


class Nominal(TypedModel):
    """Values that the data set does not publish and a batch must state.

    Only products are determined by angles and torques at the two pulleys: the stiffness as seen from them k R^2, the
    friction mu phi and the pretension as a torque T0 R. Radius, length and bend are therefore chosen, to be of an
    instrument's size, and stiffness, friction and pretension are where a fit may start from. Lengths in m, stiffness
    of the whole length in N/m, bend in rad, pretension in N.
    """

    pulley_radius_m: Positive = 0.005
    cable_length_m: Positive = 0.5
    bend_rad: Positive = 6.2832
    stiffness_N_per_m: Positive = 5.0e4
    friction_coefficient: Positive = 0.15
    pretension_N: Positive = 10.0


@dataclass(frozen=True)
class Imported:
    """What an import wrote and what it passed over.

    Attributes
    ----------
    batches : list of Path
        Folders of the batches written.
    findings : list of Finding
        Files left out, rows dropped and signs that the data leave in doubt.
    """

    batches: list[Path]
    findings: list[Finding]


DOI = "10.1109/LRA.2018.2849862"
SOURCE = (
    "Measured on a da Vinci instrument; data set MRDLab/mis-tool-characterization. Cite: J. J. O'Neill, T. K. Stephens,"
    ' T. M. Kowalewski, "Evaluation of Torque Measurement Surrogates as Applied to Grip Torque and Jaw Angle Estimation'
    f' of Robotic Surgical Tools", IEEE RA-L 3(4), 3027-3034, 2018, doi {DOI}. Licence: Open Database License 1.0'
    " (https://opendatacommons.org/licenses/odbl/1-0/), contents under the Database Contents License 1.0."
)
# The data set's own description.
DRIVE_COUNTS_PER_REV = 8192
LOAD_COUNTS_PER_REV = 4000
NM_PER_COUNT = 3.9811e-5
# Its page: the first seconds are a start-up transient.
SETTLED_S = 4.0
# The torque sensors' noise is a few counts.
TORQUE_NOISE_COUNTS = 4

FINDINGS = "findings.json"

# Columns of a trial, from the left; further ones (back-end command, motor encoder, target) are not used.
TIME, DRIVE_ANGLE, DRIVE_TORQUE, LOAD_ANGLE, LOAD_TORQUE, LOAD_COMMAND = 0, 1, 2, 4, 5, 6
FEWEST_COLUMNS = LOAD_TORQUE + 1
# Half a second at 1 kHz; fewer rows of numbers in a text file are no trial.
FEWEST_ROWS = 500
# Fewer trials agreeing, or a weaker relation in the typical one, leave a sign in doubt.
CLEAR_MAJORITY, CLEAR_STRENGTH = 0.75, 0.2


@dataclass(frozen=True)
class _Trial:
    id: str
    file: Path
    header: list[str]
    samples: NDArray
    remarks: list[str]

    @property
    def settled(self) -> NDArray:
        time = self.samples[:, TIME]
        settled = self.samples[time >= SETTLED_S]
        return settled if len(settled) >= FEWEST_ROWS else self.samples


def import_mis_tool(source: Path, out: Path, nominal: Nominal | None = None) -> Imported:
    """Turn every folder of trials below `source` into a batch below `out`.

    Parameters
    ----------
    source : Path
        The data set: its repository, its `data` folder or one folder of trials.
    out : Path
        Folder for the batches' folders and `findings.json`. One of an earlier import is replaced as a whole, and only
        if this one succeeds.
    nominal : Nominal, optional
        What is stated for the values that are not published.

    Returns
    -------
    Imported
        The batches' folders and what was found.

    Raises
    ------
    InputError
        If `source` is no folder or holds no trial at all, or `out` holds what no import has written.
    """
    source, out = Path(source), Path(out).resolve()
    if not source.is_dir():
        raise InputError(f"{source}: there is no such folder; give the mis-tool-characterization data set's folder")
    _check_replaceable(out)
    out.parent.mkdir(parents=True, exist_ok=True)
    # Beside `out`, for a folder can only be renamed on its own disk.
    with tempfile.TemporaryDirectory(prefix=".import-", dir=out.parent) as work:
        fresh = Path(work) / "fresh"
        fresh.mkdir()
        names, findings = _import_into(fresh, source, nominal or Nominal())
        if out.exists():
            out.rename(Path(work) / "earlier")
        fresh.rename(out)
    return Imported([out / name for name in names], findings)


def _check_replaceable(out: Path) -> None:
    """An import replaces what an earlier one wrote, and nothing else."""
    if out.exists() and not out.is_dir():
        raise InputError(f"{out}: is no folder; give a new or empty one")
    for entry in sorted(out.iterdir()) if out.exists() else []:
        description = entry / "batch.yaml"
        imported = description.is_file() and DOI in description.read_text(encoding="utf-8", errors="replace")
        if not imported and entry.name != FINDINGS:
            raise InputError(
                f"{out}: would be replaced, but {entry.name} is from no import; give a new or empty folder"
            )


def _import_into(out: Path, source: Path, nominal: Nominal) -> tuple[list[str], list[Finding]]:
    """Write the batches and the findings; the batches' names and the findings."""
    files = sorted(f for f in source.rglob("*") if f.suffix.lower() == ".txt" and f.is_file())
    folders = sorted({f.parent for f in files})
    names, findings, taken = [], [], set()
    for folder in folders:
        name = _unique(_safe(folder.resolve().name), taken)
        trials, found = _read_folder([f for f in files if f.parent == folder], name)
        findings += found
        if trials:
            signs, doubts = _signs(trials)
            findings += [Finding(name, str(folder), None, None, "warning", text) for text in doubts]
            _write_batch(out / name, trials, signs, nominal)
            names.append(name)
    if not names:
        raise InputError(
            f"{source}: no trial found in {len(files)} .TXT files below it; a trial has {FEWEST_COLUMNS} columns of"
            f" numbers or more and at least {FEWEST_ROWS} rows"
        )
    (out / FINDINGS).write_text(json.dumps([asdict(f) for f in findings], indent=1) + "\n", encoding="utf-8")
    return names, findings


def _read_folder(files: list[Path], batch: str) -> tuple[list[_Trial], list[Finding]]:
    trials, findings, taken = [], [], set()
    for file in files:
        header, samples, remarks = _read_trial(file)
        if samples is None and not remarks:
            continue
        if samples is None:
            findings.append(Finding(batch, str(file), None, None, "refused", remarks[-1]))
            continue
        findings += [Finding(batch, str(file), None, None, "warning", text) for text in remarks]
        trials.append(_Trial(_unique(f"trial-{_safe(file.stem)}", taken), file, header, samples, remarks))
    return trials, findings


def _read_trial(file: Path) -> tuple[list[str], NDArray | None, list[str]]:
    """Header lines, samples of shape (n, columns) with time in s, and remarks.

    There are no samples where it is no usable trial, and no remarks either where it never was one.
    """
    lines = file.read_bytes().decode("utf-8", errors="replace").splitlines()
    header = [line.strip() for line in lines if _is_header(line)]
    rows = {row: line for row, line in enumerate(lines, start=1) if line.strip() and not _is_header(line)}
    if len(rows) < FEWEST_ROWS:
        if _is_prose(lines):
            return header, None, []
        return header, None, [f"no trial: {len(rows)} rows that begin with a number; not imported"]
    samples, bad, width = _table(list(rows.values()))
    if width < FEWEST_COLUMNS or len(samples) < FEWEST_ROWS:
        return header, None, [f"no trial: {len(samples)} rows of {width} numbers; not imported"]
    remarks = []
    if bad:
        first = list(rows)[bad[0]]
        cut = " (the last line is cut)" if first == len(lines) else ""
        remarks.append(f"{len(bad)} rows that are no samples dropped, the first is row {first}{cut}")
    # The header says ms, the values are seconds; the trials were sampled at 1 kHz.
    if np.median(np.diff(samples[:, TIME])) > 0.1:
        samples[:, TIME] /= 1000.0
    return header, samples, remarks


def _is_prose(lines: list[str]) -> bool:
    """A text for people, such as a README: words, neither a row of numbers nor the header of a trial."""
    written = [line.strip() for line in lines if line.strip()]
    cells = [re.split(r"[,;\s]+", line) for line in written]
    rows_of_numbers = any(len(row) > 1 and _numbers(row) for row in cells)
    return bool(written) and not rows_of_numbers and not any(line.startswith("%") for line in written)


def _is_header(line: str) -> bool:
    """Anything that does not begin like a number: the leading % is sometimes forgotten."""
    return line.lstrip()[:1] not in set("+-.0123456789")


def _table(rows: list[str]) -> tuple[NDArray, list[int], int]:
    """Samples of the rows that have as many numbers as most, the other rows' places, and that many."""
    separator = next((s for s in ",;\t" if s in rows[0]), None)
    try:
        samples = np.loadtxt(rows, delimiter=separator, comments=None, ndmin=2)
        if np.isfinite(samples).all():
            return samples, [], samples.shape[1]
    except ValueError:
        # Not every row is what the first one is: take them one by one.
        pass
    cells = [row.rstrip(" \t,;").split(separator) for row in rows]
    widths = [len(c) for c in cells]
    width = max(set(widths), key=widths.count)
    numbers = [_numbers(c) if len(c) == width else None for c in cells]
    samples = np.array([n for n in numbers if n is not None]).reshape(-1, width)
    return samples, [i for i, n in enumerate(numbers) if n is None], width


def _numbers(cells: list[str]) -> list[float] | None:
    try:
        numbers = [float(c) for c in cells]
    except ValueError:
        return None
    return numbers if np.isfinite(numbers).all() else None


def _signs(trials: list[_Trial]) -> tuple[dict[str, dict[str, int]], list[str]]:
    """Signs of the sensors under which the trials make sense, and doubts.

    The load follows the drive; the drive does work on the transmission, which gives none back over full cycles; the
    torque at the load goes with that at the drive, and does work on a load that is passive.
    """
    doubts: list[str] = []
    angle = _majority("load encoder", [_likeness(t, DRIVE_ANGLE, LOAD_ANGLE) for t in trials], doubts)
    drive = _majority("drive torque", [_work(t, DRIVE_TORQUE, DRIVE_ANGLE) for t in trials], doubts)
    strengths = [
        (drive * _likeness(t, DRIVE_TORQUE, LOAD_TORQUE) + angle * _work(t, LOAD_TORQUE, LOAD_ANGLE)) / 2
        for t in trials
    ]
    load = _majority("load torque", strengths, doubts)
    return {"drive": {"torque_sign": drive}, "load": {"encoder_sign": angle, "torque_sign": load}}, doubts


def _likeness(trial: _Trial, one: int, other: int) -> float:
    """Correlation of two columns, 0 where one of them is constant."""
    x, y = (trial.settled[:, c] - trial.settled[:, c].mean() for c in (one, other))
    scale = np.sqrt((x @ x) * (y @ y))
    return float(x @ y / scale) if scale > 0 else 0.0


def _work(trial: _Trial, torque: int, angle: int) -> float:
    """Net work over the settled part, as a share of the work that is moved to and fro."""
    torque, angle = trial.settled[:, torque] - trial.settled[:, torque].mean(), trial.settled[:, angle]
    power = (torque[1:] + torque[:-1]) / 2 * np.diff(angle)
    moved = np.abs(power).sum()
    return float(power.sum() / moved) if moved > 0 else 0.0


def _majority(what: str, strengths: list[float], doubts: list[str]) -> int:
    """The sign that most trials call for; a trial that calls for none weighs nothing."""
    votes = np.sign(strengths)
    sign = 1 if votes.sum() >= 0 else -1
    agree, strength = np.mean(votes == sign), np.median(strengths) * sign
    if agree < CLEAR_MAJORITY or strength < CLEAR_STRENGTH:
        doubts.append(
            f"sign of the {what} is in doubt: {agree:.0%} of {len(votes)} trials call for {sign:+d}, by {strength:.2f}"
            " of 1 in the typical one; check it in batch.yaml"
        )
    return sign


def _write_batch(folder: Path, trials: list[_Trial], signs: dict, nominal: Nominal) -> None:
    folder.mkdir()
    for trial in trials:
        _write_log(folder / f"{trial.id}.csv.gz", trial.samples)
    text = yaml.safe_dump(_describe(folder.name, trials, signs, nominal), sort_keys=False, width=120)
    (folder / "batch.yaml").write_text(text, encoding="utf-8")


def _write_log(path: Path, samples: NDArray) -> None:
    columns = {
        "drive_encoder_counts": DRIVE_ANGLE,
        "load_encoder_counts": LOAD_ANGLE,
        "drive_torque_counts": DRIVE_TORQUE,
        "load_torque_counts": LOAD_TORQUE,
    }
    table = {"time_s": samples[:, TIME].round(6)}
    for name, column in columns.items():
        values = samples[:, column]
        table[name] = values.astype(int) if (values == values.round()).all() else values
    # No time stamp, so that the same trial gives the same file; little compression, so that it takes little time.
    compression = {"method": "gzip", "compresslevel": 1, "mtime": 0}
    pd.DataFrame(table).to_csv(path, index=False, compression=compression)


def _describe(name: str, trials: list[_Trial], signs: dict, nominal: Nominal) -> dict[str, Any]:
    def side(counts_per_rev, signs):
        return {
            "pulley_radius_m": nominal.pulley_radius_m,
            "encoder_counts_per_rev": counts_per_rev,
            "encoder_accuracy_rad": round(2 * np.pi / counts_per_rev, 6),
            "torque_sensor": {"Nm_per_count": NM_PER_COUNT, "zero_counts": 0.0},
            **signs,
        }

    return {
        "format": 1,
        "batch": name,
        "origin": "rig",
        "note": (
            f"{SOURCE} Radii, length, bend, stiffness, friction and pretension are nominal, not published:"
            " only k R^2, mu phi and T0 R are determined. Zeros of the torque sensors are not known."
        ),
        "rig": {
            "drive": side(DRIVE_COUNTS_PER_REV, signs["drive"]),
            "load": side(LOAD_COUNTS_PER_REV, signs["load"]),
            "cable": {
                "stiffness_N_per_m": nominal.stiffness_N_per_m,
                "length_m": nominal.cable_length_m,
                "friction_coefficient": nominal.friction_coefficient,
            },
            "accuracy": {
                # The coarser of the two, for whoever asks for one number.
                "encoder_rad": round(2 * np.pi / LOAD_COUNTS_PER_REV, 6),
                "torque_Nm": round(TORQUE_NOISE_COUNTS * NM_PER_COUNT, 6),
            },
        },
        "recordings": [_describe_trial(trial, nominal) for trial in trials],
    }


def _describe_trial(trial: _Trial, nominal: Nominal) -> dict[str, Any]:
    excitation = {"wave": "sine", "trial": trial.file.stem}
    frequency = _frequency(trial.settled[:, TIME], trial.settled[:, DRIVE_ANGLE])
    if frequency is not None:
        excitation["frequency_Hz"] = frequency
    if trial.samples.shape[1] > LOAD_COMMAND:
        excitation["load_level"] = round(float(np.median(trial.settled[:, LOAD_COMMAND])), 3)
    if re.fullmatch(r"\d{3}", trial.file.stem):
        excitation["stop"] = int(trial.file.stem[0])
    return {
        "id": trial.id,
        "file": f"{trial.id}.csv.gz",
        "pretension_N": nominal.pretension_N,
        "conduit": [{"length_m": nominal.cable_length_m, "bend_rad": nominal.bend_rad}],
        "excitation": excitation,
        # A trial that stops during start-up is written as it is: it is the reader who refuses it.
        "settled_s": SETTLED_S,
        "note": [*trial.header, *trial.remarks],
    }


def _frequency(time: NDArray, angle: NDArray) -> float | None:
    """Frequency of the sine that fits the drive angle best, Hz; None if the drive stands still."""
    every = max(1, len(time) // 1000)
    time, angle = time[::every] - time[0], angle[::every] - angle.mean()
    if np.ptp(angle) <= 2 or time[-1] <= 0:
        return None

    def misfit(frequency):
        phase = 2 * np.pi * frequency * time
        basis = np.column_stack([np.sin(phase), np.cos(phase), np.ones_like(phase)])
        return np.sum((angle - basis @ np.linalg.solve(basis.T @ basis, basis.T @ angle)) ** 2)

    # Over few cycles the spectrum's maximum is coarse and biased; it only tells where to look.
    spectrum = np.abs(np.fft.rfft(angle * np.hanning(angle.size), 8 * angle.size))
    peak = np.argmax(spectrum) / (8 * angle.size * np.median(np.diff(time)))
    width = 1.0 / time[-1]
    best = minimize_scalar(misfit, bounds=(max(peak - width, 0.3 * width), peak + width), method="bounded")
    return round(float(best.x), 3)


def _safe(name: str) -> str:
    """A name fit for files and groups."""
    return re.sub(r"[^A-Za-z0-9_-]+", "-", name).strip("-") or "data"


def _unique(name: str, taken: set[str]) -> str:
    """`name`, numbered if it is taken already; capitals make no difference to some file systems."""
    free, n = name, 2
    while free.lower() in taken:
        free, n = f"{name}-{n}", n + 1
    taken.add(free.lower())
    return free
