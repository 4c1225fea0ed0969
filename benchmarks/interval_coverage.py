"""How often the 90 % intervals of a fit hold the truth, over batches drawn at random: writes docs/coverage.md.

Run by `make coverage`. What is drawn, and how it is recorded, stands in tests/drawn_batches.py.
"""

import argparse
import sys
import time
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from datetime import date
from pathlib import Path

import numpy as np
from scipy.stats import binom

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from ccmodel.inference.fit import fit  # noqa: E402
from ccmodel.inference.intervals import COVERAGE, REACH  # noqa: E402
from drawn_batches import CONDITIONS, draw, problem_of  # noqa: E402

FIRST_SEED = 20_000
DURATION_S = 2.4
UNLIKELY = 0.01  # A count outside limits that chance would leave so seldom counts as wrong.


def one_batch(seed: int) -> dict[str, list[float]] | str:
    """By parameter, errors over their standard deviation; or why there is no fit."""
    drawn = draw(seed, duration_s=DURATION_S)
    problem = problem_of(drawn)
    said = fit(problem)
    if not said.succeeded:
        return said.message
    found = defaultdict(list)
    for name, true in drawn.shared.items():
        found[name].append((said.values[name] - true) / said.intervals[name].sd)
    for e, own in zip(problem.observations, drawn.own, strict=True):
        for name, true in own.items():
            interval = said.own_intervals[e.name][name]
            found[f"own {name}"].append(((interval.low + interval.high) / 2 - true) / interval.sd)
    return dict(found)


def table(found: dict[str, list[float]], reach: float) -> list[str]:
    """A line of the report for each parameter."""
    lines = []
    for name, errors in found.items():
        z = np.array(errors)
        held = int((np.abs(z) <= reach).sum())
        low, high = binom.ppf([UNLIKELY / 2, 1 - UNLIKELY / 2], z.size, COVERAGE).astype(int)
        verdict = "as stated" if low <= held <= high else "too narrow" if held < low else "too wide"
        lines.append(
            f"| {name} | {z.size} | {held} | {held / z.size:.3f} | {low} to {high} | {z.mean():+.2f} | {z.std():.2f} "
            f"| {verdict} |"
        )
    return lines


def report(found, refused: list[str], batches: int, took_s: float, command: str) -> str:
    """The page."""
    rows = "\n".join(table(found, REACH))
    failed = "".join(f"\n- {text}" for text in refused) or " none."
    return f"""# Coverage of the fits' intervals

Made by `{command}` on {date.today().isoformat()}: 
{batches} batches in {took_s / 60:.0f} minutes.

Each batch is {len(CONDITIONS)} recordings of {round(DURATION_S * 200)} samples at 200 Hz, made with the exact solver:
a half loop and a whole one at 7 and 4 N, with stiffness, friction and load spring drawn for the batch. Each recording
has its own friction (1 %), pretension (1 %), tension profile in each cable (5 to 40 % of what friction holds), sensor
zeros (anywhere within the paper's accuracy) and noise (0.1 mN m, 0.05 N), and both angles are counted (0.18 deg). The
fit starts a fifth off and finds three values for the batch and eight for each recording. Seeds from {FIRST_SEED} on
unless said otherwise above; nothing about the intervals was chosen by them.

A 90 % interval should hold the truth in 90 % of the batches: by chance a count lies outside the limits once in
{1 / UNLIKELY:.0f}.
"mean" and "sd" are of the error over its stated standard deviation, which should be 0 and 1. Values of a recording's
own are not independent within a batch, so that the limits are somewhat too narrow for them.

| parameter | intervals | held | share | limits | mean | sd | interval is |
|---|---|---|---|---|---|---|---|
{rows}

Refused fits:{failed}
"""


def main() -> None:
    """Count and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--batches", type=int, default=1000)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--minutes", type=float, default=np.inf, help="stop earlier after so long, and say so")
    parser.add_argument("--out", type=Path, default=ROOT / "docs/coverage.md")
    arguments = parser.parse_args()
    first = arguments.first_seed
    began, found, refused, done = time.perf_counter(), defaultdict(list), [], 0
    with ProcessPoolExecutor(2) as pool:
        for result in pool.map(one_batch, range(first, first + arguments.batches)):
            done += 1
            if isinstance(result, str):
                refused.append(f"seed {first + done - 1}: {result}")
            else:
                for name, errors in result.items():
                    found[name] += errors
            took = time.perf_counter() - began
            if done % 50 == 0:
                print(f"{done} batches, {took:.0f} s", flush=True)
            if took > 60 * arguments.minutes:
                pool.shutdown(wait=False, cancel_futures=True)
                break
    command = f"python benchmarks/interval_coverage.py --batches {arguments.batches} --minutes {arguments.minutes:g}"
    command += f" --first-seed {first}" if first != FIRST_SEED else ""
    text = report(found, refused, done, time.perf_counter() - began, command)
    arguments.out.write_text(text)
    print(text)


if __name__ == "__main__":
    main()
