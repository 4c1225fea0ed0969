"""The same bytes under other circumstances: ``python -m benchmarks.same_bytes``, or ``make same-bytes``.

The pipeline and the diagnoses of small batches with different verdicts run again and again: with another number of
cores, of threads of BLAS, another seed of hashes, locale, time zone and folder. All files are compared with those of
the first run, but for times. One diagnosis reaches its limit on model runs. None has a time limit to speak of,
since otherwise the clock decides.

A run that has ended is not made again as long as the sources are the same. Exits with 1 if a file differs, or if a
batch has not the verdict that it stands for.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import yaml

from benchmarks.compared_files import differing, files_in
from ccmodel.provenance import source_digest
from proof.build import record
from proof.cases import draw

ROOT = Path(__file__).parents[1]
TUTORIAL = ROOT / "docs/tutorial"
PIPELINE = "pipeline"
# Verdicts, with the batches that have them.
VERDICTS = ("agrees", "explained", "undecided", "learned", "unexplained")
# Seed of a rig of the proof whose motor cogs, which is on no list, and how many of its recordings are enough.
COGGING, ENOUGH = 60003, 4
# A batch of the repository whose diagnosis reaches this limit on model runs.
LIMITED, RUN_LIMIT = "rich", "9000"
JOBS = (PIPELINE, *VERDICTS, LIMITED)
# Currents of a bearing that rubs at the drive: one too small to be told from others in a single recording, and one
# whose mechanism is not on the list and whose law is not tried.
RUBBING_A = {"undecided": 0.04, "unexplained": 0.17}
WITHOUT_LAWS = ("--without", "pulley-friction", "--run-limit", "3000")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
BASE = dict.fromkeys(THREADS, "1") | {"PYTHONHASHSEED": "0", "LC_ALL": "C.UTF-8", "TZ": "UTC"}
GERMAN = "de_DE.UTF-8"


@dataclass(frozen=True)
class Variant:
    """Circumstances of a run.

    Attributes
    ----------
    environment : dict of str to str
        What is set beside `BASE`.
    cores : int
        Cores that the processes see and that the pipeline is given.
    folder : str
        Working folder, relative to that of all runs.
    """

    environment: dict[str, str] = field(default_factory=dict)
    cores: int = 1
    folder: str = "work"


REFERENCE = "reference"
VARIANTS = {
    REFERENCE: Variant(),
    "the same again": Variant(),
    "two cores": Variant(cores=2),
    "2 threads of BLAS": Variant(dict.fromkeys(THREADS, "2")),
    "4 threads of BLAS": Variant(dict.fromkeys(THREADS, "4")),
    "hash seed 1": Variant({"PYTHONHASHSEED": "1"}),
    "hash seed random": Variant({"PYTHONHASHSEED": "random"}),
    "decimal comma": Variant({"LC_ALL": GERMAN}),
    "time zone of Kolkata": Variant({"TZ": "Asia/Kolkata"}),
    "time zone of St John's": Variant({"TZ": "America/St_Johns"}),
    "another folder": Variant(folder="another/ folder"),
}


def rubbing(table: pd.DataFrame, current_A: float) -> pd.DataFrame:
    """A bearing at the drive: a torque against the motion, which the cables know nothing of."""
    turn = np.diff(table["drive_encoder_counts"], prepend=table["drive_encoder_counts"].iloc[0])
    way = pd.Series(np.sign(turn)).replace(0, np.nan).ffill().fillna(0)
    table["drive_current_A"] += current_A * way
    return table


def record_cogging(folder: Path) -> None:
    """Record the batch in which a law is learned, as batch `folder.name`."""
    case = draw(COGGING, "unlisted", "unlisted-cogging-motor", 0.95)
    record(case, case.recordings[:ENOUGH], folder)
    file = folder / "batch.yaml"
    file.write_text(
        yaml.safe_dump(yaml.safe_load(file.read_text(encoding="utf-8")) | {"batch": folder.name}), encoding="utf-8"
    )


def prepare(folder: Path) -> None:
    """Write the inputs of all jobs but that of the learned law."""
    # The small batches of the tests, which belong to no package.
    sys.path.insert(0, str(ROOT / "tests"))
    from builders import spoil, write_batch

    write_batch(folder / "data/raw/tiny")
    studies = {"pretension": {"batches": ["tiny"], "variable": "pretension"}}
    config = {"studies": studies, "baseline": {"file": "config/baseline.json", "history": "config/history.csv"}}
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    write_batch(folder / "agrees")
    for name, pretensions in (("undecided", (7.0,)), ("unexplained", (7.0, 6.0, 5.0))):
        spoil(write_batch(folder / name, pretensions=pretensions), partial(rubbing, current_A=RUBBING_A[name]))
    logs = [str(log) for log in sorted((TUTORIAL / "logs").glob("*.csv"))]
    line = ["-m", "ccmodel.cli", "import", *logs, "--map", str(TUTORIAL / "map.yaml"), "--out", "explained", "--quiet"]
    subprocess.run([sys.executable, *line], cwd=folder, check=True, capture_output=True)
    stated = (TUTORIAL / "batch.yaml").read_text(encoding="utf-8").replace("batch: first", "batch: explained")
    (folder / "explained/batch.yaml").write_text(stated, encoding="utf-8")
    shutil.copytree(ROOT / "data/raw" / LIMITED, folder / LIMITED)


def line_of(job: str, cores: int) -> list[str]:
    """Command line of a job, without the interpreter."""
    if job == PIPELINE:
        snakemake = ["-m", "snakemake", "--snakefile", str(ROOT / "Snakefile"), "--configfile", "config.yaml"]
        return [*snakemake, "--cores", str(cores)]
    limits = ["--time-limit", "100000", *(["--run-limit", RUN_LIMIT] if job == LIMITED else [])]
    if job == "unexplained":
        limits += WITHOUT_LAWS
    return ["-m", "ccmodel.cli", "diagnose", job, "--out", "results", *limits, "--quiet"]


def made(variant: Variant, job: str, inputs: Path, out: Path, kept: Path) -> None:
    """Run a job, and keep its results."""
    work = out / variant.folder
    shutil.rmtree(work, ignore_errors=True)
    shutil.copytree(inputs, work)
    cores = sorted(os.sched_getaffinity(0))[-variant.cores :]
    subprocess.run(
        [sys.executable, *line_of(job, variant.cores)],
        cwd=work,
        env=os.environ | BASE | variant.environment,
        preexec_fn=partial(os.sched_setaffinity, 0, cores),
        check=True,
        capture_output=True,
    )
    kept.parent.mkdir(parents=True, exist_ok=True)
    (work / "results").rename(kept)


def compared(name: str, job: str, inputs: Path, out: Path) -> list[str]:
    """Files of a job that are not as those of the reference; a run that there is already is not repeated."""
    kept, first = out / name / job, out / REFERENCE / job
    if not kept.exists():
        try:
            made(VARIANTS[name], job, inputs, out, kept)
        except subprocess.CalledProcessError as error:
            return [f"the run failed: {error.stderr[-500:].decode()}"]
    wrong = differing(files_in(kept, ["."]), files_in(first, ["."]))
    if job == PIPELINE:
        return wrong
    said = json.loads((kept / "diagnosis.json").read_text())
    if job in VERDICTS and said["verdict"] != job:
        wrong.append(f"the verdict is {said['verdict']}")
    if job == LIMITED and not any("model runs" in one["why"] for one in said["not_judged"]):
        wrong.append("the limit is not reached")
    return wrong


def missing(name: str) -> str:
    """Why a variant cannot run here, or ""."""
    variant = VARIANTS[name]
    if variant.cores > len(os.sched_getaffinity(0)):
        return f"{variant.cores} cores are not there"
    known = subprocess.run(["locale", "-a"], capture_output=True, text=True, check=False).stdout.lower()
    german = GERMAN.lower().replace("-", "")
    if variant.environment.get("LC_ALL") == GERMAN and german not in known.replace("-", ""):
        return f"the locale {GERMAN} is not there: localedef -i de_DE -f UTF-8 {GERMAN}"
    return ""


def rows(names: list[str], jobs: list[str], inputs: Path, out: Path) -> Iterator[dict]:
    """Results of all variants and jobs."""
    for name in dict.fromkeys([REFERENCE, *names]):
        if why := missing(name):
            yield {"variant": name, "job": "all", "why": f"not run: {why}"}
            continue
        for job in jobs:
            started = time.monotonic()
            wrong = compared(name, job, inputs, out)
            yield {"variant": name, "job": job, "took_s": round(time.monotonic() - started), "why": ", ".join(wrong)}


def main() -> int:
    """Run as a script; 1 if a file differs or a variant could not run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results/same-bytes"))
    parser.add_argument("--only", choices=VARIANTS, action="append", help="a variant; may be repeated")
    parser.add_argument("--job", choices=JOBS, action="append", help="a job; may be repeated")
    asked = parser.parse_args()
    out = asked.out.resolve() / source_digest("ccmodel.cli.__init__")
    inputs = out / "inputs"
    if not (inputs / "learned/batch.yaml").exists():
        shutil.rmtree(inputs, ignore_errors=True)
        prepare(inputs)
        record_cogging(inputs / "learned")
    found = []
    for row in rows(asked.only or [*VARIANTS], asked.job or [*JOBS], inputs, out):
        found.append(row)
        print(json.dumps(row), flush=True)
    wrong = [row for row in found if row["why"]]
    print(f"{len(found) - len(wrong)} of {len(found)} runs have the bytes of the reference")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
