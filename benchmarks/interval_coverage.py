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
            found[f"recording's own {name}"].append(((interval.low + interval.high) / 2 - true) / interval.sd)
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

Each batch has {len(CONDITIONS)} recordings of {round(DURATION_S * 200)} samples at 200 Hz, simulated with the exact
solver: a half loop and a whole loop, at 7 and 4 N. Stiffness, friction and load spring are drawn per batch. Drawn per
recording are

- friction (1 %), pretension (1 %) and the tension profile of each cable (5 to 40 % of what friction can hold);
- sensor zeros (uniform within the paper's accuracy) and noise (0.1 mN m, 0.05 N).

Both angles are counted (0.18 deg). The fit starts 20 % off, and estimates three parameters per batch and eight per
recording. Seeds start at {FIRST_SEED} unless stated above; no choice about the intervals was made with them.

A 90 % interval should contain the true value in 90 % of the batches. By chance a number of hits is outside the limits
once in {1 / UNLIKELY:.0f}. "mean" and "sd" are those of the error over its stated standard deviation, and should be 0
and 1. Parameters of one batch's recordings are not independent, so the limits for them are somewhat too narrow.

| parameter | intervals | hits | share | limits | mean | sd | interval is |
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
