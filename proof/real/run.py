"""From the plan to results: the baseline model, its tolerance, and the diagnosis of each case."""

import hashlib
import json
import shutil
import tempfile
from collections.abc import Callable
from itertools import chain
from pathlib import Path

from proof import conceal
from proof.build import folder_digest
from proof.judge import write_result
from proof.outcome import INCONSISTENT
from proof.real.cases import RealCase, without_mechanism
from proof.real.faults import write_batch
from proof.real.plan import RealPlan

BASELINE, TOLERANCE = "baseline.json", "tolerance.json"
# Files that determine a case and its result, beside the plan.
BUILDER = ("cases.py", "faults.py", "run.py")
Report = Callable[[str], None]


def made_by(plan: RealPlan, baseline: Path | None = None, sources: Path = conceal.SOURCES) -> dict[str, str]:
    """Digests of the diagnosis, of plan and faults, and of a baseline, under their keys in a result."""
    code = [Path(__file__).with_name(name).read_bytes() for name in BUILDER]
    made = {"sources": conceal.digest_of(sources), "builder": _digest(plan.model_dump_json().encode(), *code)}
    if baseline is not None:
        made["baseline"] = _digest(*((baseline / name).read_bytes() for name in (BASELINE, TOLERANCE)))
    return made


def _digest(*parts: bytes) -> str:
    return hashlib.sha256(b"\0".join(parts)).hexdigest()[:16]


def find_baseline(plan: RealPlan, source: Path, out: Path, report: Report, sources: Path = conceal.SOURCES) -> None:
    """Identify the baseline and its tolerance from the training recordings alone.

    What an earlier run left in `out` is kept if it was `made_by` the same, and otherwise removed.

    Raises
    ------
    ValueError
        If the frozen baseline agrees with the training recordings for none of the plan's tolerances.
    """
    made = made_by(plan, sources=sources)
    found = json.loads((out / TOLERANCE).read_text(encoding="utf-8")) if (out / TOLERANCE).exists() else {}
    if made.items() <= found.items() and "tolerance_factor" in found:
        return
    if out.exists() and not made.items() <= found.items():
        shutil.rmtree(out)
    out.mkdir(parents=True, exist_ok=True)
    # Written first, so that an interrupted run goes on with its own diagnoses only.
    (out / TOLERANCE).write_text(json.dumps(made), encoding="utf-8")
    tried: dict[str, dict] = {}
    with tempfile.TemporaryDirectory(prefix="training-") as folder:
        batch = Path(folder) / "known"
        write_batch(source, plan.training, batch)
        options = [*_options(plan, 1.0), "--run-limit", str(plan.run_limit)]
        diagnosis = _diagnosed(batch, out / "first", options, None, sources)
        which = "nearest.json" if diagnosis["verdict"] == "unexplained" and diagnosis.get("nearest") else "model.json"
        shutil.copy(out / "first" / which, out / BASELINE)
        report(f"baseline: {diagnosis['verdict']}, {which}")
        for factor in plan.tolerance_factors:
            to = out / f"tolerance-{factor:g}"
            diagnosis = _diagnosed(batch, to, _frozen(plan, factor), out / BASELINE, sources)
            mean_square = diagnosis["fit"]["mean_square"]["calibrated"]
            tried[f"{factor:g}"] = {"verdict": diagnosis["verdict"], "mean_square": mean_square}
            report(f"frozen baseline, {factor:g} times the tolerance: {diagnosis['verdict']}")
            if diagnosis["verdict"] == "agrees":
                found = {"tolerance_factor": factor, "tried": tried, **made}
                (out / TOLERANCE).write_text(json.dumps(found, indent=1), encoding="utf-8")
                return
    raise ValueError(f"the baseline agrees with none of the tolerances {plan.tolerance_factors}: {tried}")


def _diagnosed(batch: Path, out: Path, options: list[str], baseline: Path | None, sources: Path) -> dict:
    """A diagnosis of unchanged recordings; an existing one is kept."""
    if not (out / "diagnosis.json").exists():
        completed = conceal.diagnose(batch, out, (), sources, options, baseline)
        if not completed.is_usable:
            raise ValueError(f"{batch.name}: {completed.failure} {completed.tampering}")
    diagnosis = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    if diagnosis["verdict"] == INCONSISTENT:
        raise ValueError(diagnosis["headline"])
    return diagnosis


def _options(plan: RealPlan, factor: float) -> list[str]:
    tolerances = (("--tolerance", f"{channel}={factor * share:g}") for channel, share in plan.tolerance.items())
    return [*chain.from_iterable(tolerances), "--step", f"{plan.step_s:g}", "--cycles", str(plan.cycles)]


def _frozen(plan: RealPlan, factor: float) -> list[str]:
    return [*_options(plan, factor), "--freeze"]


def judge_real(
    case: RealCase,
    plan: RealPlan,
    source: Path,
    baseline: Path,
    out: Path,
    report: Report = print,
) -> dict:
    """Write a case's recordings, have them diagnosed in isolation, and write ``result.json``.

    Parameters
    ----------
    case : RealCase
    plan : RealPlan
    source : Path
        The measured batch.
    baseline : Path
        Folder of the baseline (`find_baseline`).
    out : Path
        Folder that gets the diagnosis with its page, and ``result.json``.
    report : callable
        Called with one line on the outcome.
    """
    factor = json.loads((baseline / TOLERANCE).read_text(encoding="utf-8"))["tolerance_factor"]
    model = json.loads((baseline / BASELINE).read_text(encoding="utf-8"))
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="case-") as folder:
        batch, known = Path(folder) / case.name, Path(folder) / "baseline.json"
        changed = write_batch(source, case.recordings or plan.test, batch, case.fault, case.size)
        digest = folder_digest(batch)
        known.write_text(json.dumps(without_mechanism(model, case.removed)), encoding="utf-8")
        started = conceal.core_s()
        options = _frozen(plan, factor)
        completed = conceal.diagnose(batch, out, case.without, options=options, baseline=known)
    result = {
        "case": case.name,
        "number": case.number,
        "key": case.digest,
        **made_by(plan, baseline),
        "batch": digest,
        "tolerance_factor": factor,
        "tampering": list(completed.tampering),
        "failure": None if completed.is_usable else completed.failure,
        "diagnosis": _read_diagnosis(out) if completed.is_usable else None,
        "changed": changed,
        "took_s": round(conceal.core_s() - started, 1),
    }
    write_result(result, out, report)
    return result


def _read_diagnosis(out: Path) -> dict:
    """The scored part of a diagnosis: verdict, place, mechanisms with values, laws, and residual mean squares."""
    content = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    return {
        "verdict": content["verdict"],
        "place": (content.get("location") or {}).get("place"),
        "mechanisms": content["mechanisms"],
        "alternatives": content["alternatives"],
        "laws": [
            {key: law[key] for key in ("place", "slot", "arguments", "confidence")} for law in content.get("laws", [])
        ],
        "nearest": content.get("nearest"),
        "mean_square": content["fit"]["mean_square"],
    }
