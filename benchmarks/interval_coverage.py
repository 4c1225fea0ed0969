"""Coverage of a fit's 90 % intervals over batches drawn at random: writes docs/coverage.md (`make coverage`).

The draws and the synthetic recordings are in tests/drawn_batches.py.
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
LEVEL = 0.01  # Significance level of the two-sided binomial test of a coverage.


def one_batch(seed: int) -> dict[str, list[float]] | str:
    """By parameter, errors over their stated standard deviations; or the message of a failed fit."""
    drawn = draw(seed, duration_s=DURATION_S)
    problem = problem_of(drawn)
    fitted = fit(problem)
    if not fitted.succeeded:
        return fitted.message
    errors = defaultdict(list)
    for name, true in drawn.shared.items():
        errors[name].append((fitted.values[name] - true) / fitted.intervals[name].sd)
    for observations, own in zip(problem.observations, drawn.own, strict=True):
        for name, true in own.items():
            interval = fitted.own_intervals[observations.name][name]
            errors[f"recording's own {name}"].append(((interval.low + interval.high) / 2 - true) / interval.sd)
    return dict(errors)


def table(found: dict[str, list[float]], half_width: float) -> list[str]:
    """One row of the page for each parameter; `half_width` is that of an interval in standard deviations."""
    lines = []
    for name, errors in found.items():
        z = np.array(errors)
        covered = int((np.abs(z) <= half_width).sum())
        low, high = binom.ppf([LEVEL / 2, 1 - LEVEL / 2], z.size, COVERAGE).astype(int)
        verdict = "calibrated" if low <= covered <= high else "too narrow" if covered < low else "too wide"
        lines.append(
            f"| {name} | {z.size} | {covered} | {covered / z.size:.3f} | {low} to {high} "
            f"| {z.mean():+.2f} | {z.std():.2f} | {verdict} |"
        )
    return lines


def report(found: dict[str, list[float]], failures: list[str], batches: int, took_s: float, command: str) -> str:
    """The page as Markdown."""
    rows = "\n".join(table(found, REACH))
    failed = "".join(f"\n- {text}" for text in failures) or " none."
    return f"""# Coverage of the fits' intervals

Made by `{command}` on {date.today().isoformat()}:
{batches} batches in {took_s / 60:.0f} minutes.

- **Batch**: {len(CONDITIONS)} synthetic recordings of {round(DURATION_S * 200)} samples at 200 Hz from the exact
  solver, with half a loop and one loop at 7 and 4 N. Stiffness, friction and load spring are drawn for the batch.
- **Recording**: friction (1 %), pretension (1 %), a tension profile in each cable (5 to 40 % of what friction can
  hold), sensor zeros (uniform within the paper's accuracy) and white noise (0.1 mN m, 0.05 N) are drawn for each
  recording. Both angles are quantised (0.18 deg).
- **Fit**: three parameters of the batch and eight of each recording, from starting values with errors of 20 %.
- **Seeds**: from {FIRST_SEED} on unless the command says otherwise. No choice about the intervals was made with them.

The nominal coverage is 90 %. "Limits" is the range of "covered" that a binomial test accepts as 90 %, at the
{100 * LEVEL:.0f} % level. "Mean" and "sd" are those of the error over its stated standard deviation, 0 and 1 for
calibrated intervals. "Recording's own" parameters have one value for each recording. Those of one batch are correlated,
so that their limits are somewhat too narrow.

| parameter | intervals | covered | coverage | limits | mean | sd | interval is |
|---|---|---|---|---|---|---|---|
{rows}

Failed fits:{failed}
"""


def main() -> None:
    """Run the batches and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--batches", type=int, default=1000)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--minutes", type=float, default=np.inf, help="stop after this time")
    parser.add_argument("--out", type=Path, default=ROOT / "docs/coverage.md")
    arguments = parser.parse_args()
    first = arguments.first_seed
    started, found, failures, done = time.perf_counter(), defaultdict(list), [], 0
    with ProcessPoolExecutor(2) as pool:
        for result in pool.map(one_batch, range(first, first + arguments.batches)):
            done += 1
            if isinstance(result, str):
                failures.append(f"seed {first + done - 1}: {result}")
            else:
                for name, errors in result.items():
                    found[name] += errors
            took = time.perf_counter() - started
            if done % 50 == 0:
                print(f"{done} batches, {took:.0f} s", flush=True)
            if took > 60 * arguments.minutes:
                pool.shutdown(wait=False, cancel_futures=True)
                break
    command = f"python benchmarks/interval_coverage.py --batches {arguments.batches} --minutes {arguments.minutes:g}"
    command += f" --first-seed {first}" if first != FIRST_SEED else ""
    text = report(found, failures, done, time.perf_counter() - started, command)
    arguments.out.write_text(text)
    print(text)


if __name__ == "__main__":
    main()
