"""Figures from which the diagnosis's settings were set by hand, on new practice cases of the virtual rig.

The settings marked *Practice* in `ccmodel.diagnosis.settings` separate correct from wrong candidate models. This script
draws cases with seeds of its own, diagnoses them, and prints the distributions that the settings have to separate,
with each setting beside its distribution.

    python -m benchmarks.diagnosis_settings --clean 20 --single 20 --out results/diagnosis-settings.csv
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.run import diagnose
from ccmodel.diagnosis.verdict import Judgement
from ccmodel.model.parameters import Parameters
from ccmodel.rig.ingest import ingest_batch
from proof.build import record
from proof.cases import Case, draw

FIRST_SEED = 7_000_000  # far from the seeds of tests and proofs


def judged(case: Case) -> Judgement:
    """Record a case and diagnose it."""
    with tempfile.TemporaryDirectory() as folder:
        batch = Path(folder) / case.name
        record(case, case.recordings, batch)
        ingested = ingest_batch(batch)
    return diagnose(ingested.recordings, Parameters.estimated(ingested.batch.rig)).judgement


def row(case: Case) -> dict:
    """Figures of the calibrated model, the correct candidate and the best wrong one."""
    found = judged(case)
    truth = {(t.name, t.place) for t in case.truth}
    correct = [c for c in found.candidates if set(c.hypothesis.acting) == truth]
    wrong = [c for c in found.candidates if not truth & set(c.hypothesis.acting)]
    best_wrong = min(wrong, key=lambda c: c.mean_square, default=None)
    return {
        "case": case.name,
        "truth": " + ".join(f"{name} at {place}" for name, place in sorted(truth)) or "none",
        "verdict": found.verdict,
        **figures("calibrated", found.calibrated, found),
        **(figures("correct", correct[0], found) if correct else {}),
        **(figures("wrong", best_wrong, found) if best_wrong else {}),
    }


def figures(name: str, candidate: CandidateFit, found: Judgement) -> dict[str, float]:
    """Mean square, and the lack of fit over that of the calibrated model."""
    comparison = found.comparison
    before = comparison.unexplained_mean_square(found.calibrated)
    return {
        f"{name}_mean_square": candidate.mean_square,
        f"{name}_share_left": comparison.unexplained_mean_square(candidate) / before if before else np.nan,
    }


def summary(table: pd.DataFrame) -> list[str]:
    """A line for each setting, with the figures that it separates."""
    clean, single = table[table["truth"] == "none"], table[table["truth"] != "none"]
    level = clean["calibrated_mean_square"]
    lines = [
        f"SCATTER, MISSTATED_NOISE = {settings.SCATTER}, {settings.MISSTATED_NOISE}: clean cases have"
        f" {level.mean():.3f}, {level.std(ddof=1):.3f} (n = {level.size}, largest {level.max():.2f})",
    ]
    if "correct_share_left" in single:
        correct, wrong = single["correct_share_left"], single["wrong_share_left"]
        lines.append(
            f"LEFT_BY_LAW = {settings.LEFT_BY_LAW}: correct candidates leave {correct.median():.4f} in the median and"
            f" {correct.max():.4f} at most (n = {correct.count()}); the best wrong ones {wrong.median():.2f} in the"
            f" median and {wrong.min():.4f} at least"
        )
    return lines


def main() -> None:
    """Run as a script."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clean", type=int, default=20, help="clean cases")
    parser.add_argument("--single", type=int, default=20, help="cases with one effect")
    parser.add_argument("--out", type=Path, required=True, help="CSV with a row for each case")
    asked = parser.parse_args()
    kinds = ["clean"] * asked.clean + ["single"] * asked.single
    rows = []
    for k, kind in enumerate(kinds):
        rows.append(row(draw(FIRST_SEED + k, kind)))
        print(f"{rows[-1]['case']}: {rows[-1]['truth']}, {rows[-1]['verdict']}", flush=True)
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    table = pd.DataFrame(rows)
    table.to_csv(asked.out, index=False, float_format="%.5g")
    print(*summary(table), sep="\n")


if __name__ == "__main__":
    main()
