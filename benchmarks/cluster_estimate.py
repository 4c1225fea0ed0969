"""Work out, from measured costs of jobs, how long the proof would take on a cluster: nothing runs on one here.

Costs of cases are those of the committed results (``took_s``, seconds of one core). A job of the cluster starts
Snakemake, runs the cases of its group two at a time, and is noticed as ended when the states are next asked for.

    .venv/bin/python -m benchmarks.cluster_estimate
"""

import gzip
import heapq
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean

import numpy as np

ARCHIVE = Path(__file__).parents[1] / "docs/proof-results.jsonl.gz"
CASES = 1000
NODES = (1, 10, 100)
GROUPS = (1, 4, 8, 16)
DRAWS = 20


@dataclass(frozen=True)
class Cluster:
    """Equal nodes with two cores each, s.

    Attributes
    ----------
    nodes : int
    start_s : float
        From the submission of a job to its first case on an idle node.
    poll_s : float
        Between two questions for the states of all jobs.
    submitted : int
        Most jobs that are queued or running at a time.
    """

    nodes: int
    start_s: float = 25.0
    poll_s: float = 20.0
    submitted: int = 100


def costs() -> np.ndarray:
    """Processor time of each committed case, s of one core."""
    lines = gzip.decompress(ARCHIVE.read_bytes()).decode().splitlines()
    return np.array([json.loads(line)["took_s"] for line in lines])


def two_at_a_time(cases_s: Sequence[float]) -> float:
    """Time of a group's cases on two cores, s."""
    cores = [0.0, 0.0]
    for case_s in cases_s:
        heapq.heapreplace(cores, cores[0] + case_s)
    return max(cores)


def makespan(groups_s: Sequence[float], cluster: Cluster, slots: int) -> float:
    """Time until the last group is noticed as ended, s.

    Parameters
    ----------
    groups_s : sequence of float
        Time of each group without its start.
    cluster : Cluster
    slots : int
        Groups that run on the cluster at a time.
    """
    free = [0.0] * min(slots, cluster.submitted)
    # If more jobs wait at Slurm than run, the next one starts at once; otherwise only after the end was noticed.
    waits_at_slurm = cluster.submitted > slots
    ended = 0.0
    for group_s in groups_s:
        done = free[0] + cluster.start_s + group_s
        noticed = np.ceil(done / cluster.poll_s) * cluster.poll_s
        heapq.heapreplace(free, done if waits_at_slurm else noticed)
        ended = max(ended, noticed)
    return ended


def estimate(case_s: np.ndarray, cluster: Cluster, size: int) -> float:
    """Time of the full proof in groups of `size` cases, s; the mean over draws of the cases' costs."""
    slots = cluster.nodes * (2 if size == 1 else 1)
    times = []
    for seed in range(DRAWS):
        drawn = np.random.default_rng(seed).choice(case_s, CASES)
        groups = [drawn[i : i + size] for i in range(0, CASES, size)]
        times.append(makespan([two_at_a_time(group) for group in groups], cluster, slots))
    return fmean(times)


def main() -> None:
    """Print a table of Markdown: a row a number of nodes, a column a size of the groups."""
    case_s = costs()
    alone_h = CASES * case_s.mean() / 2 / 3600
    print(f"{len(case_s)} cases, {case_s.mean():.0f} s of one core each; {CASES} on two cores: {alone_h:.1f} h\n")
    print("| nodes | " + " | ".join(f"groups of {size}" for size in GROUPS) + " |")
    print("|---" * (len(GROUPS) + 1) + "|")
    for nodes in NODES:
        hours = [estimate(case_s, Cluster(nodes), size) / 3600 for size in GROUPS]
        print(f"| {nodes} | " + " | ".join(f"{60 * h:.0f} min ({alone_h / h:.1f} x)" for h in hours) + " |")


if __name__ == "__main__":
    main()
