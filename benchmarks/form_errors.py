"""Model-form error of each mechanism: the share of its effect that its equation misses on rigs of other forms.

Each rig of the virtual rig has one strong effect, by the mechanism's law or by another published one. The mechanism is
fitted to its recordings, with the covariance linearised about it, as a diagnosis fits it. Of the calibrated model's
leave-one-out mean square above that of noise, what the fit leaves is the model-form error. `settings.LEFT_BY_LAW` rests
on it.

    python -m benchmarks.form_errors --rigs 2 --cores 2 --out results/form-errors.csv
"""

import argparse
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from itertools import count
from pathlib import Path

import pandas as pd

from ccmodel.diagnosis.candidate import CandidateFit, fit
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.repeatability import estimated
from ccmodel.diagnosis.run import Calibration, calibrate
from ccmodel.diagnosis.screening import screen
from ccmodel.diagnosis.whitening import Whitened, relinearised
from ccmodel.inference.pool import set_threads
from ccmodel.model.parameters import Parameters
from ccmodel.rig.ingest import ingest_batch
from proof.build import record
from proof.cases import Case, draw
from proof.plan import read_plan
from virtualrig.effects import TWINS

FIRST_SEED = 9_000_000  # far from the seeds of tests, proofs and other benchmarks
# Least strength of an effect (`proof.cases.Truth`): of a weak one the noise hides what an equation misses.
LEAST_STRENGTH = 0.6


def rigs(effect: str, number: int) -> list[Case]:
    """Cases with one strong effect, recorded as advised: so many of each law."""
    drawn = (draw(seed, "single", effect) for seed in count(FIRST_SEED))
    strong = (c for c in drawn if c.truth[0].strength >= LEAST_STRENGTH and c.protocol == "rich")
    found: dict[str, list[Case]] = {law: [] for law in ("", *TWINS[effect].other_laws)}
    for case in strong:
        of_law = found[case.truth[0].law]
        if len(of_law) < number:
            of_law.append(case)
        if all(len(cases) == number for cases in found.values()):
            break
    return [case for cases in found.values() for case in cases]


def calibration_of(case: Case) -> Calibration:
    """The calibrated model of a case's recordings; on one thread, as each process has a case of its own."""
    set_threads(1)
    with tempfile.TemporaryDirectory() as folder:
        batch = Path(folder) / case.name
        record(case, case.recordings, batch)
        ingested = ingest_batch(batch)
    return calibrate(ingested.recordings, Parameters.estimated(ingested.stated.rig))


def row(case: Case) -> dict:
    """Mean squares of the calibrated model and of the true mechanism, and the share of the excess that is left."""
    (truth,) = case.truth
    calibrated = calibration_of(case)
    found = fitted(calibrated, Hypothesis(((truth.name, truth.place),)))
    before, after = calibrated.fit.mean_square, found.mean_square
    share = (after - 1.0) / (before - 1.0)
    return {
        "effect": truth.name,
        "law": truth.law or "that of the mechanism",
        "strength": round(truth.strength, 3),
        "calibrated_mean_square": before,
        "mean_square": after,
        "share_left": share,
    }


def fitted(calibrated: Calibration, hypothesis: Hypothesis) -> CandidateFit:
    """A mechanism fitted as in a diagnosis: from its screening score, and again about itself."""
    base, free = calibrated.fit, calibrated.tested.free
    (score,) = screen(base, [hypothesis]).singles()
    found = fit(calibrated.whitened, hypothesis, free, base.values | (score.values or hypothesis.start))
    return fit(about_itself(found), hypothesis, free, found.values)


def about_itself(found: CandidateFit) -> list[Whitened]:
    """The observations of a candidate with their covariance linearised about it."""
    spreads = estimated(found.whitened, found.residuals)
    return [relinearised(w, found.model(w.observations.parameters, w.session), spreads) for w in found.whitened]


def rows(effects: Sequence[str], number: int, cores: int) -> Iterator[dict]:
    """A row for each rig, in the order in which they are done."""
    with ProcessPoolExecutor(cores) as pool:
        cases = [case for effect in effects for case in rigs(effect, number)]
        for done in as_completed(pool.submit(row, case) for case in cases):
            yield done.result()


def main() -> None:
    """Run as a script."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rigs", type=int, default=2, help="rigs with each law of an effect")
    parser.add_argument("--effect", nargs="+", default=list(read_plan().effects), help="effects; default: all")
    parser.add_argument("--cores", type=int, default=1, help="processes")
    parser.add_argument("--out", type=Path, required=True, help="CSV with a row for each rig")
    asked = parser.parse_args()
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    found: list[dict] = []
    for one in rows(asked.effect, asked.rigs, asked.cores):
        found.append(one)
        print(" ".join(f"{k}={v:.4g}" if isinstance(v, float) else f"{k}={v}" for k, v in one.items()), flush=True)
        # An interrupted run leaves what it has.
        pd.DataFrame(found).to_csv(asked.out, index=False, float_format="%.5g")
    table = pd.DataFrame(found).groupby(["effect", "law"])["share_left"].agg(["min", "median", "max", "count"])
    print(table.to_string(float_format="%.4f"))


if __name__ == "__main__":
    main()
