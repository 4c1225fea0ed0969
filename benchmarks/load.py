"""Memory and time of many recordings and of one long log: ``python -m benchmarks.load --out DIR``.

A rig without a missing effect is simulated under ten conditions. Batches of 10, 100 and 1,000 recordings are logs of
these runs, each with noise, instants and a load angle of its own: otherwise some logs of a run have the same counts,
and are taken for copies. The pipeline runs on each of them: ingest, fit, simulation, study, diagnosis and page. The
long log repeats one run until it has ten million samples; `ccmodel check` reads it.

Memory is the highest that a process and its children had resident together, sampled every 50 ms. A page that several
of them share counts once (proportional set size).
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import fields
from itertools import islice
from pathlib import Path

import numpy as np
import psutil
import yaml
from numpy.random import Generator

from proof.build import simulate
from proof.cases import draw
from virtualrig.campaign import as_yaml, compress, description, log_name, prepare, recording_generator
from virtualrig.sensors import DECIMALS, log
from virtualrig.trajectory import Trajectory

ROOT = Path(__file__).parents[1]
SEED, CONDITIONS, SIZES, LONG_SAMPLES = 91000, 10, (10, 100, 1000), 10_000_000
SAMPLED_EVERY_S = 0.05
# Relative standard deviation of the load's strokes from run to run.
RUN_TO_RUN = 2e-3


def measured(command: Sequence[str], out: Path) -> dict:
    """Exit code, wall-clock time (s) and highest resident memory (MB) of a command; what it says goes to a file."""
    start, highest = time.monotonic(), 0
    with open(out, "w", encoding="utf-8") as said:
        process = psutil.Popen(command, cwd=ROOT, stdout=said, stderr=subprocess.STDOUT, env=dict(os.environ))
        while process.poll() is None:
            highest = max(highest, resident_bytes(process))
            time.sleep(SAMPLED_EVERY_S)
    return {"exit": process.returncode, "took_s": time.monotonic() - start, "memory_MB": highest / 1e6}


def resident_bytes(process: psutil.Process) -> int:
    """Resident memory of a process and all its children."""
    total = 0
    with suppress(psutil.NoSuchProcess):
        for one in (process, *process.children(recursive=True)):
            # One that has ended meanwhile has no memory.
            with suppress(psutil.NoSuchProcess, psutil.AccessDenied):
                total += one.memory_full_info().pss
    return total


def write_batches(raw: Path, sizes: Sequence[int]) -> None:
    """A batch of each size, in a folder of raw data of its own."""
    case = draw(SEED, "clean")
    campaign, plans = case.campaign, case.recordings[:CONDITIONS]
    random = recording_generator(SEED, case.name, "load")
    runs = [(plan, simulate(campaign, plan, prepare(campaign, plan, random))) for plan in plans]
    for size in sizes:
        folder = raw / str(size) / f"runs-{size}"
        folder.mkdir(parents=True, exist_ok=True)
        named = []
        for k in range(size):
            plan, trajectory = runs[k % len(runs)]
            named.append(plan.model_copy(update={"id": f"run-{k + 1:04d}"}))
            if not (folder / log_name(named[-1])).exists():
                read = log(repeated(trajectory, random), campaign.sensors, campaign.rig, random)
                (folder / log_name(named[-1])).write_bytes(compress(read))
        note = "recordings of a simulated rig, repeated with other noise"
        described = as_yaml(description(campaign, folder.name, note, named))
        (folder / "batch.yaml").write_text(described, encoding="utf-8")


def repeated(trajectory: Trajectory, random: Generator) -> Trajectory:
    """A run as it comes once more: the load's strokes differ by `RUN_TO_RUN`, and the clock by part of a sample."""
    share, (up, down) = random.uniform(), 1 + RUN_TO_RUN * random.normal(size=2)
    values = {f.name: getattr(trajectory, f.name) for f in fields(trajectory)}
    between = {name: (1 - share) * of[:-1] + share * of[1:] for name, of in values.items()}
    scale = np.where(between["theta_out_rad"] > 0, up, down)
    between |= {"time_s": trajectory.time_s[:-1], "theta_out_rad": scale * between["theta_out_rad"]}
    return Trajectory(**between)


def write_long_log(folder: Path) -> None:
    """A batch of one log with `LONG_SAMPLES`: the same cycles again and again, each time with other noise."""
    case = draw(SEED, "clean")
    plan, campaign = case.recordings[0], case.campaign
    random = recording_generator(SEED, case.name, "long")
    trajectory = simulate(campaign, plan, prepare(campaign, plan, random))
    folder.mkdir(parents=True, exist_ok=True)
    if not (folder / f"{plan.id}.csv").exists():
        formats = ",".join(f"%.{decimals}f" for decimals in DECIMALS.values())
        with open(folder / f"{plan.id}.csv", "w", encoding="utf-8") as file:
            file.write(",".join(DECIMALS) + "\n")
            for rows in islice(_rows(trajectory, campaign, random), 0, None):
                np.savetxt(file, rows, formats)
    described = yaml.safe_load(as_yaml(description(campaign, folder.name, "one long recording", [plan])))
    described["recordings"][0] |= {"file": f"{plan.id}.csv", "excitation": {}}
    (folder / "batch.yaml").write_text(yaml.safe_dump(described), encoding="utf-8")


def _rows(trajectory, campaign, random):
    """Tables of samples, forwards and backwards in turn so that nothing jumps."""
    made, step = 0, 1 / campaign.sensors.sample_rate_Hz
    read = log(trajectory, campaign.sensors, campaign.rig, random)
    columns = np.column_stack([read[name] for name in DECIMALS])
    noisy = [i for i, name in enumerate(DECIMALS) if name.endswith(("_A", "_V"))]
    scales = [10.0 ** -DECIMALS[name] for name in DECIMALS if name.endswith(("_A", "_V"))]
    while made < LONG_SAMPLES:
        table = columns[: LONG_SAMPLES - made].copy()
        table[:, 0] = (made + np.arange(len(table))) * step
        table[:, noisy] += random.normal(size=(len(table), len(noisy))) * scales
        yield table
        made, columns = made + len(table), columns[::-1]


def configuration(raw: Path, results: Path, batch: str) -> str:
    """A configuration of the pipeline: a fit, a study and a diagnosis of one batch."""
    config = {
        "raw": str(raw),
        "results": str(results),
        "fits": {
            "fitted": {
                "batches": [batch],
                "free": {
                    "stiffness_N_per_m": {"bounds": [1e3, 1e5]},
                    "friction_coefficient": {"bounds": [0.01, 0.6]},
                },
            }
        },
        "diagnose": "each",
        "studies": {"all": {"title": "all recordings", "batches": [batch], "rows": "recording"}},
        "accuracy": {},
    }
    return yaml.safe_dump(config, sort_keys=False)


def pipeline(raw: Path, out: Path, size: int, cores: int) -> dict:
    """The pipeline on a batch of some recordings."""
    results = out / "results" / str(size)
    results.mkdir(parents=True, exist_ok=True)
    file = out / f"config-{size}.yaml"
    file.write_text(configuration(raw / str(size), results, f"runs-{size}"), encoding="utf-8")
    snakemake = [sys.executable, "-m", "snakemake", "--cores", str(cores), "--forceall", "--configfile", str(file)]
    found = measured([sys.executable, "workflow/run.py", str(results), *snakemake], out / f"run-{size}.txt")
    return {"what": f"pipeline, {size} recordings", **found, "s_per_recording": found["took_s"] / size}


def main() -> None:
    """Measure what is asked for, and add it to DIR/load.json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--sizes", type=int, nargs="*", default=SIZES)
    parser.add_argument("--no-long-log", action="store_true")
    asked = parser.parse_args()
    out = asked.out.resolve()
    rows = []
    write_batches(out / "raw", asked.sizes)
    for size in asked.sizes:
        rows.append(pipeline(out / "raw", out, size, asked.cores))
        print(json.dumps(rows[-1]), flush=True)
    if not asked.no_long_log:
        write_long_log(out / "long")
        command = [sys.executable, "-m", "ccmodel.cli", "check", str(out / "long")]
        rows.append({"what": "check, ten million samples", **measured(command, out / "long.txt")})
        print(json.dumps(rows[-1]), flush=True)
    (out / "load.json").write_text(json.dumps(rows, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
