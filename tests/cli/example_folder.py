"""A folder in which every example of the help can be run: small batches, a lab's logs, results of a run."""

import gzip
import json
import lzma
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from pydantic import TypeAdapter

from builders import write_batch
from ccmodel.accuracy.baseline import read_baseline
from ccmodel.accuracy.measure import Batches

ROOT = Path(__file__).parents[2]
# Standard deviations of the sensors' noise, in the units of a log.
NOISE = {"drive_current_A": 0.004, "load_current_A": 0.004, "drive_load_cell_V": 0.005, "load_load_cell_V": 0.005}


def prepare(folder: Path) -> Path:
    """Write everything that the examples read, except what they make themselves."""
    raw = folder / "data/raw"
    for seed, name in enumerate(("loops", "later")):
        noisy_batch(raw / name, seed)
    (raw / "bench").mkdir()
    for log in (raw / "loops").glob("*.csv.gz"):
        shutil.copy(log, raw / "bench")
    _write_measurements(folder / "measurements")
    time = np.arange(250) / 250
    pd.DataFrame({"time_s": time, "theta_in_rad": 0.5 * np.sin(2 * np.pi * time)}).to_csv(folder / "motion.csv")
    wanted = pd.DataFrame({"time_s": time, "theta_out_rad": 0.2 * np.sin(np.pi * time) ** 2})
    wanted.to_csv(folder / "wanted.csv", index=False)
    _write_results(folder)
    _write_table_one(folder / "config/table-one.yaml")
    trial = next((ROOT / "tests/rig/data").glob("*/*.xz"))
    folder_of_trial = folder / "path/to/mis-tool-characterization/data" / trial.parent.name
    folder_of_trial.mkdir(parents=True)
    (folder_of_trial / "113.TXT").write_bytes(lzma.decompress(trial.read_bytes()))
    return folder


def noisy_batch(folder: Path, seed: int = 0, pretensions=(7.0, 6.0, 5.0)) -> Path:
    """A batch of the paper's model with the noise of a rig's sensors."""
    write_batch(folder, pretensions)
    draw = np.random.default_rng(seed)
    for file in sorted(folder.glob("*.csv.gz")):
        log = pd.read_csv(file)
        for column, sd in NOISE.items():
            log[column] += draw.normal(0, sd, len(log))
        with gzip.open(file, "wt") as f:
            log.to_csv(f, index=False)
    return folder


def _write_measurements(folder: Path) -> None:
    """Logs of a lab, with names and units of its own."""
    folder.mkdir()
    time = np.arange(0, 4, 0.002)
    for name, frequency in (("slow", 0.5), ("fast", 1.0)):
        angle = 0.6 * np.sin(2 * np.pi * frequency * np.maximum(time - 0.5, 0))
        force = 7 + 2 * np.tanh(3 * np.gradient(angle, time))
        log = {"Time [ms]": 1e3 * time, "Motor [deg]": np.rad2deg(angle), "F_drive [N]": force}
        pd.DataFrame(log).to_csv(folder / f"{name}.csv", index=False)


def _write_results(folder: Path) -> None:
    """A run whose accuracy is the accepted one, and which left nothing out."""
    shutil.copytree(ROOT / "config", folder / "config", ignore=shutil.ignore_patterns("*.md"))
    baseline = "config/accuracy-baseline.json"
    measured = TypeAdapter(Batches).dump_python(read_baseline(folder / baseline).batches, mode="json")
    settings = {
        "coverage": 0.95, "reproducibility": 0.01, "file": baseline, "history": "config/accuracy-history.csv"
    }  # fmt: skip
    (folder / "results/tables").mkdir(parents=True)
    (folder / "results/tables/baseline.json").write_text(json.dumps({"settings": settings, "measured": measured}))
    (folder / "results/left-out.json").write_text(json.dumps({"left_out": [], "inconsistent": [], "warnings": []}))


def _write_table_one(file: Path) -> None:
    """The study of Table I at a few cases."""
    settings = yaml.safe_load(file.read_text())
    open_ = {"load_stiffness_Nm_per_rad": [0.05], "amplitude_rad": [1.0], "frequency_Hz": [1.0], "rigs": ["measured"]}
    settings["not_stated"] |= open_ | {"fit_over": ["rms"]}
    settings["grid"] |= {"strengths": 2, "finer": 1, "beyond": 1.0, "shapes": [0.5], "set_up_differences": [0.1]}
    settings["rig"]["motion"] = {"cycles": 2, "samples_per_cycle": 40}
    settings["pairs"] = {"singles": 1, "shares": [1.0], "not_stated": open_ | {"fit_over": ["rms"]}}
    file.write_text(yaml.safe_dump(settings))
