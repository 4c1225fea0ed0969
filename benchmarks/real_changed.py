"""What has changed since, with all that a model in use says held: a diagnosis that recalibrates nothing but zeros.

`python -m proof real` has everything fitted anew beside the model in use, and that absorbs much of what is put in. Here
only the zeros of the two torques are, in every candidate; a candidate is a mechanism at a place, with its own numbers,
or one number of the model in use that may have changed. They are screened by one run at each probe and the leading ones
fitted. What is allowed is what the model in use leaves of the recordings that it was found from, so that one is left
there. Answers are known to this script, which is no proof: it asks what could be told from such recordings at all.

    python benchmarks/real_changed.py results/real/raw/Tool_4_Maryland_L_2 results/proof/real/model/in-use.json
"""

import argparse
import json
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ccmodel import mechanisms as registry
from ccmodel.diagnose.diagnosis import calibration, first_cycles
from ccmodel.diagnose.evidence import Weighed, weigh
from ccmodel.diagnose.hypothesis import Hypothesis, singles
from ccmodel.diagnose.trial import errors, scaled
from ccmodel.failure import ModelError
from ccmodel.identify.problem import Evidence, each
from ccmodel.model.files import read_model
from ccmodel.model.general.run import Active
from ccmodel.model.parameters import Parameters, mechanism_key
from ccmodel.model.sensitivity import size_of
from ccmodel.rig.ingest import ingest_batch
from proof.put_in import write_batch
from proof.real import RealPlan, cases_of, read_real_plan

ZEROS = ("tau_in_zero_Nm", "tau_out_zero_Nm")
ZERO_STEP_NM = 1e-4
# By which share a number of the model in use is changed to see what that does.
CHANGE = 0.02
FITTED, EVALUATIONS, TOLERANCE = 6, 8, 1e-3


@dataclass(frozen=True)
class Candidate:
    """What may have changed: a model, which of its numbers are its own, and values to start from."""

    name: str
    model: Parameters
    start: Mapping[str, float]


def recordings_of(source: Path, names: Sequence[str], plan: RealPlan, put_in=(None, 0.0), allowance=0.02):
    """Evidence from some of a batch's recordings, with something put into them or not."""
    with tempfile.TemporaryDirectory() as folder:
        write_batch(source, names, Path(folder) / "batch", *put_in)
        ingested = ingest_batch(Path(folder) / "batch")
    estimates = Parameters.estimated(ingested.batch.rig)
    short = [first_cycles(r, plan.cycles) for r in ingested.recordings]
    return [Evidence.of(r, estimates, step_s=plan.step_s, allowance=allowance) for r in short], estimates


def in_place(model: Parameters, estimates: Parameters, evidence: Sequence[Evidence]) -> Parameters:
    """The model in use for these recordings: all that a calibration would leave free is as it says."""
    known = {name: model.value_of(name) for name in calibration(estimates, evidence)}
    return replace(estimates.with_values(known), mechanisms=model.mechanisms)


def left(weighed: Sequence[Weighed], model: Parameters, values: Mapping[str, float]) -> NDArray:
    """Whitened errors of all recordings, each counting alike; their sum of squares is the mean square."""
    acting = [w.acting(model) for w in weighed]
    count = len(weighed)
    return np.concatenate(each(acting, lambda i, w: errors(w, values) / np.sqrt(w.evidence.measured.size * count)))


def fitted(weighed: Sequence[Weighed], candidate: Candidate) -> tuple[float, dict[str, float]]:
    """What a candidate leaves with its numbers and the zeros fitted, and these numbers."""
    names = [*candidate.start, *ZEROS]
    x0 = np.array([*candidate.start.values(), *(candidate.model.value_of(z) for z in ZEROS)])
    found = least_squares(
        lambda x: left(weighed, candidate.model, dict(zip(names, x.tolist(), strict=True))),
        x0,
        x_scale=np.maximum(np.abs(x0), 1e-6),
        diff_step=TOLERANCE,
        max_nfev=EVALUATIONS,
        ftol=TOLERANCE,
    )
    return 2 * float(found.cost), dict(zip(names, found.x.tolist(), strict=True))


def candidates(weighed: Sequence[Weighed], model: Parameters) -> list[Candidate]:
    """All that may have changed, by what it takes off after the zeros took their share; the most first."""
    base = left(weighed, model, {})
    moved = [left(weighed, model, {z: model.value_of(z) + ZERO_STEP_NM}) - base for z in ZEROS]
    Q, _ = np.linalg.qr(np.stack(moved, axis=1))
    beyond = base - Q @ (Q.T @ base)
    scored = []
    for candidate, values, hypothesis in _probed(weighed, model):
        try:
            d = left(weighed, candidate.model, values) - base
        except ModelError:
            continue
        d = d - Q @ (Q.T @ d)
        size = float(d @ d)
        strength = -float(d @ beyond) / size if size > 1e-12 else 0.0
        if hypothesis is None:
            ((key, value),) = values.items()
            before = model.value_of(key)
            start = {key: before + 0.5 * strength * (value - before)}
        else:
            start = scaled(hypothesis, values, strength)
        if start is not None and strength:
            scored.append((strength * strength * size, replace(candidate, start=start)))
    best: dict[str, tuple[float, Candidate]] = {}
    for gain, candidate in scored:
        if gain > best.get(candidate.name, (0.0,))[0]:
            best[candidate.name] = gain, candidate
    return [candidate for _, candidate in sorted(best.values(), key=lambda item: -item[0])]


def _probed(weighed, model: Parameters) -> Iterator[tuple[Candidate, dict[str, float], Hypothesis | None]]:
    numbers = [n for n in calibration(weighed[0].evidence.parameters, [w.evidence for w in weighed]) if n not in ZEROS]
    numbers += [mechanism_key(m.name, m.place, n) for m in model.mechanisms for n in m.values]
    for name in numbers:
        value = model.value_of(name)
        yield Candidate(f"{name}, changed", model, {}), {name: value + CHANGE * size_of(name, value)}, None
    known = Hypothesis(beside=tuple((m.name, m.place) for m in model.mechanisms))
    for hypothesis in singles((), known):
        ((name, place),) = hypothesis.acting
        acting = replace(model, mechanisms=(*model.mechanisms, Active(name, place, registry.get(name).start)))
        for probe in hypothesis.probes():
            yield Candidate(str(hypothesis), acting, {}), probe, hypothesis


def changed(source: Path, model: Parameters, plan: RealPlan, allowance: float, put_in) -> dict:
    """What the model in use leaves of the watched recordings, and what the leading candidates do."""
    evidence, estimates = recordings_of(source, plan.watched, plan, put_in, allowance)
    held = in_place(model, estimates, evidence)
    weighed = each(evidence, lambda i, e: weigh(e, held))
    zeroed, zeros = fitted(weighed, Candidate("nothing", held, {}))
    now = held.with_values(zeros)
    trials = []
    for candidate in candidates(weighed, now)[:FITTED]:
        try:
            trials.append((candidate.name, *fitted(weighed, candidate)))
        except (ModelError, ValueError) as error:
            trials.append((candidate.name, float("inf"), {"why": str(error)}))
    trials.sort(key=lambda t: t[1])
    as_it_stands = float(np.sum(left(weighed, held, {}) ** 2))
    return {"as it stands": as_it_stands, "zeros": zeroed, "trials": trials}


def allowed(source: Path, model: Parameters, plan: RealPlan) -> float:
    """The allowance with which the model in use leaves one of the recordings that it was found from."""
    evidence, estimates = recordings_of(source, plan.known, plan, allowance=plan.allowance)
    held = in_place(model, estimates, evidence)
    weighed = each(evidence, lambda i, e: weigh(e, held))
    return plan.allowance * float(np.sqrt(np.sum(left(weighed, held, {}) ** 2)))


def main() -> None:
    """Print a line a case, and a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("batch", type=Path, help="the measured batch")
    parser.add_argument("model", type=Path, help="the model in use")
    parser.add_argument("--numbers", help="only these cases, by comma")
    given = parser.parse_args()
    plan, model = read_real_plan(), read_model(given.model)
    cases = cases_of(plan, json.loads(given.model.read_text(encoding="utf-8")))
    wanted = [int(n) for n in given.numbers.split(",")] if given.numbers else range(len(cases))
    allowance = allowed(given.batch, model, plan)
    print(f"{100 * allowance:.2f} % of peak to peak allowed\n")
    print("| put in | size | as it stands | zeros anew | best | leaves | second | leaves |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for case in (cases[n] for n in wanted):
        if case.group not in ("untouched", "put in"):
            continue
        found = changed(given.batch, model, plan, allowance, (case.kind, case.size))
        cells = [case.kind or "nothing", f"{case.size:.3g}", f"{found['as it stands']:.2f}", f"{found['zeros']:.2f}"]
        for name, leaves, values in found["trials"][:2]:
            own = ", ".join(f"{n.rpartition('/')[2]} {v:.3g}" for n, v in values.items() if n not in ZEROS)
            cells += [f"{name} ({own})", f"{leaves:.2f}"]
        print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
