"""How often the 90 % band of a learned law holds the true law, on rigs with laws that are on no list.

Each rig of the virtual rig has one law of the family `unlisted` of the proof. Of the laws of the true slot and
argument, the one with the highest evidence about the calibrated model is fitted to its recordings by itself. The share
of its knots at which the band holds the true law is then that of the band alone, not of the choice among laws. As in a
diagnosis, it is fitted again with the covariance linearised about it.

    python -m benchmarks.law_bands --first 320000 --count 12 --cores 2 --out results/law-bands.csv
"""

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from math import inf
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.form_errors import about_itself, calibration_of
from ccmodel.deadline import Deadline
from ccmodel.diagnosis.candidate import CandidateFit, fit
from ccmodel.diagnosis.law_report import curve_of
from ccmodel.diagnosis.laws import Proposal, first_laws, proposals
from ccmodel.diagnosis.run import Calibration
from ccmodel.mechanisms.learned import Law
from proof.cases import Case, Truth, draw
from proof.families import family
from proof.laws import share_inside
from proof.outcome import same_place

FIRST_SEED, COUNT = 320_000, 12  # far from the seeds of tests, proofs and other benchmarks


def row(case: Case) -> dict:
    """Mean squares before and after the true law was fitted, and how its band holds the true curve.

    The width of the band is its mean over the range of the true curve.
    """
    (truth,) = case.truth
    calibrated = calibration_of(case)
    law, proposal = most_probable(calibrated.fit, truth)
    found = fitted(calibrated, proposal)
    x, y, (low, high) = curve_of(found, law)
    stated = {"slot": truth.slot, "argument": truth.argument, "curve": truth.curve}
    return {
        "seed": case.seed,
        "effect": truth.name,
        "law": law.name,
        "mean_square_before": calibrated.fit.mean_square,
        "mean_square_after": found.mean_square,
        "share_inside": share_inside(list(zip(x, y, low, high, strict=True)), stated, case.key["rig"]["Ke"]),
        "width": float(np.mean(high - low) / np.ptp(np.array(truth.curve)[:, 1])),
    }


def most_probable(base: CandidateFit, truth: Truth) -> tuple[Law, Proposal]:
    """The law of the true slot and argument with the highest evidence about a calibrated model, and its proposal."""
    some = [
        law
        for law in first_laws()
        if (law.slot, law.argument.name) == (truth.slot, truth.argument) and same_place(law.place, truth.place)
    ]
    some += [finer for law in some if (finer := law.finer()) and finer not in some]
    best = proposals(base, some, Deadline.after(inf, inf))[0]
    ((name, _),) = best.hypothesis.acting
    return next(law for law in some if law.name == name), best


def fitted(calibrated: Calibration, proposal: Proposal) -> CandidateFit:
    """The law by itself, from the coefficients that are most probable to first order, and again about itself."""
    start, free = calibrated.fit.values | proposal.values, calibrated.tested.free
    found = fit(calibrated.whitened, proposal.hypothesis, free, start)
    return fit(about_itself(found), proposal.hypothesis, free, found.values)


def main(arguments: Sequence[str] | None = None) -> None:
    """Fit the true law of each rig, and write a row for each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="seed of the first rig")
    parser.add_argument("--count", type=int, default=COUNT, help="number of rigs")
    parser.add_argument("--strength", type=float, help="of every effect, 0 to 1; that of the family if not given")
    parser.add_argument("--cores", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args(arguments)
    cases = [case for case in family("unlisted", options.first, options.count) if case.truth[0].curve]
    if options.strength is not None:
        cases = [draw(case.seed, case.kind, case.truth[0].name, options.strength) for case in cases]
    with ProcessPoolExecutor(options.cores) as pool:
        table = pd.DataFrame(list(pool.map(row, cases)))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    table.to_csv(options.out, index=False)
    print(table.to_string(index=False))
    print(f"Of the knots, on average {table['share_inside'].mean():.0%} are inside the band, in {len(table)} rigs.")
    print(f"The band's mean width is {table['width'].median():.1%} of the curve's range in the median.")


if __name__ == "__main__":
    main()
