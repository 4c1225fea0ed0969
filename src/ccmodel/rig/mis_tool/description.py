"""The files of an imported instrument: `batch.yaml`, the logs, licence and source."""

import re
from collections.abc import Mapping
from pathlib import Path
from string import Template

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml import YAML
from scipy.optimize import minimize_scalar

from ccmodel.rig.mis_tool.trial import SETTLED_S, Trial

# The constants of all instruments, with their sources.
INSTRUMENT = Path(__file__).with_name("instrument.yaml")
# Notice of the licence, and citation with what the import changes: beside every batch that is derived of the data set.
LICENSE, SOURCE = (Path(__file__).with_name(name) for name in ("LICENSE", "SOURCE.md"))
PRETENSION_N, CONDUIT = 10.0, {"length_m": 0.5, "bend_rad": 6.2832}
LOGGED = [
    "time_s",
    "drive_encoder_counts",
    "load_encoder_counts",
    "drive_torque_counts",
    "load_torque_counts",
    "motor_encoder_counts",
]


def write_batch(folder: Path, trials: Mapping[str, Trial], signs: Mapping[str, Mapping]) -> None:
    """Write a new folder with the logs of trials, by recording id, their `batch.yaml`, licence and source."""
    folder.mkdir()
    yaml = YAML()
    yaml.width = 120
    described = yaml.load(INSTRUMENT)
    described["batch"] = folder.name
    if not any("motor_encoder_counts" in trial.samples for trial in trials.values()):
        del described["rig"]["drive"]["motor_counts_per_rev"]
    for end in signs:
        described["rig"][end] |= signs[end]
    for name, trial in trials.items():
        _write_log(folder / f"{name}.csv.gz", trial)
        described["recordings"].append(_recording(name, trial))
    yaml.dump(described, folder / "batch.yaml")
    source = next(iter(trials.values())).file.resolve().parent.name
    (folder / SOURCE.name).write_text(Template(SOURCE.read_text("utf-8")).substitute(folder=source), "utf-8")
    (folder / LICENSE.name).write_text(LICENSE.read_text("utf-8"), "utf-8")


def _write_log(path: Path, trial: Trial) -> None:
    # Without a time stamp, so that a trial always gives the same file.
    compression = {"method": "gzip", "compresslevel": 9, "mtime": 0}
    table = trial.samples.filter(LOGGED).round({"time_s": 6}).convert_dtypes()
    table.to_csv(path, index=False, compression=compression)


def _recording(name: str, trial: Trial) -> dict:
    """An entry of `recordings`: the conditions are read from the columns, as the names of the files differ in code."""
    excitation: dict[str, str | float] = {"wave": "sine", "trial": trial.file.stem}
    frequency = _frequency(*trial.settled[["time_s", "drive_encoder_counts"]].to_numpy().T)
    if frequency is not None:
        excitation["frequency_Hz"] = frequency
    if "load_command" in trial.samples:
        excitation["load_level"] = round(float(trial.settled["load_command"].median()), 3)
    if re.fullmatch(r"\d{3}", trial.file.stem):
        excitation["stop"] = int(trial.file.stem[0])
    return {
        "id": name,
        "file": f"{name}.csv.gz",
        "pretension_N": PRETENSION_N,
        "conduit": [dict(CONDUIT)],
        "excitation": excitation,
        # A trial that ends within the transient is written too; ingest refuses it.
        "settled_s": SETTLED_S,
        "note": [*trial.header, *filter(None, [trial.remark])],
    }


def _frequency(time: NDArray, angle: NDArray) -> float | None:
    """Frequency, Hz, of the least-squares sine through the drive angle; None if the drive stands still."""
    every = max(1, len(time) // 1000)
    time, angle = time[::every] - time[0], angle[::every] - angle.mean()
    if np.ptp(angle) <= 2 or time[-1] <= 0:
        return None

    def misfit(frequency: float) -> float:
        phase = 2 * np.pi * frequency * time
        basis = np.column_stack([np.sin(phase), np.cos(phase), np.ones_like(phase)])
        return float(np.sum((angle - basis @ np.linalg.solve(basis.T @ basis, basis.T @ angle)) ** 2))

    # Over few cycles the maximum of the spectrum is coarse and biased, but it brackets the minimum.
    spectrum = np.abs(np.fft.rfft(angle * np.hanning(angle.size), 8 * angle.size))
    peak = np.argmax(spectrum) / (8 * angle.size * np.median(np.diff(time)))
    width = 1.0 / time[-1]
    best = minimize_scalar(misfit, bounds=(max(peak - width, 0.3 * width), peak + width), method="bounded")
    return round(float(best.x), 3)
