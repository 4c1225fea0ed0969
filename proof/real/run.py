"""From the plan to results: the model in use, what is allowed beside it, and the diagnosis of each case."""

import json
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

from proof import conceal
from proof.build import folder_digest
from proof.real.cases import RealCase, lacking
from proof.real.plan import RealPlan
from proof.real.put_in import write_batch

MODEL, ALLOWED = "in-use.json", "allowed.json"
Tell = Callable[[str], None]


def find_model(plan: RealPlan, source: Path, out: Path, tell: Tell, sources: Path = conceal.SOURCES) -> None:
    """Find the model in use and what is allowed beside it, from the known recordings alone; kept in `out`."""
    if (out / ALLOWED).exists():
        return
    tried: dict[str, dict] = {}
    with tempfile.TemporaryDirectory(prefix="known-") as folder:
        batch = Path(folder) / "known"
        write_batch(source, plan.known, batch)
        words = [word for suspect in plan.suspects for word in ("--suspect", ", ".join(suspect))]
        said = _diagnosed(batch, out / "first", [*_finely(plan, plan.allowance), *words], None, sources)
        which = "nearest.json" if said["verdict"] == "unexplained" and said.get("nearest") else "model.json"
        shutil.copy(out / "first" / which, out / MODEL)
        tell(f"the model in use: {said['verdict']}, {which}")
        for allowance in plan.allowances:
            said = _diagnosed(batch, out / f"allowing-{allowance:g}", _held(plan, allowance), out / MODEL, sources)
            tried[f"{allowance:g}"] = {"verdict": said["verdict"], "left": said["fit"]["mean_square"]["calibrated"]}
            tell(f"beside it, allowing {allowance:g}: {said['verdict']}")
            if said["verdict"] == "agrees":
                found = {"allowance": allowance, "tried": tried, "diagnosis": conceal.digest_of(sources)}
                (out / ALLOWED).write_text(json.dumps(found, indent=1), encoding="utf-8")
                return
    raise ValueError(f"with none of the allowances {plan.allowances} does the model in use agree: {tried}")


def _diagnosed(batch: Path, out: Path, options: list[str], beside: Path | None, sources: Path) -> dict:
    """A diagnosis of untouched recordings; one that is there already is not made again."""
    if not (out / "diagnosis.json").exists():
        ran = conceal.diagnose(batch, out, (), sources, options, beside)
        if ran.code != 0 or ran.tampering:
            raise ValueError(f"{batch.name}: exit code {ran.code}: {ran.said.strip()[-500:]} {ran.tampering}")
    return json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))


def _finely(plan: RealPlan, allowance: float) -> list[str]:
    return ["--allowance", f"{allowance:g}", "--step", f"{plan.step_s:g}", "--cycles", str(plan.cycles)]


def _held(plan: RealPlan, allowance: float) -> list[str]:
    return [*_finely(plan, allowance), "--hold"]


def judge_real(
    case: RealCase,
    plan: RealPlan,
    source: Path,
    in_use: Path,
    out: Path,
    tell: Tell = print,
    sources: Path = conceal.SOURCES,
) -> dict:
    """Write a case's recordings, have them diagnosed alone, and keep what was said in `out`/result.json.

    Parameters
    ----------
    case : RealCase
    plan : RealPlan
    source : Path
        The measured batch.
    in_use : Path
        Folder of the model in use (`find_model`).
    out : Path
        Folder that gets the diagnosis with its page, and ``result.json``.
    tell : callable
        Takes a line on how it went.
    sources : Path
        The diagnosis's package.
    """
    allowance = json.loads((in_use / ALLOWED).read_text(encoding="utf-8"))["allowance"]
    model = json.loads((in_use / MODEL).read_text(encoding="utf-8"))
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="case-") as folder:
        batch, beside = Path(folder) / case.name, Path(folder) / "known.json"
        changed = write_batch(source, plan.watched, batch, case.kind, case.size)
        digest = folder_digest(batch)
        beside.write_text(json.dumps(lacking(model, case.left_out)), encoding="utf-8")
        started = conceal.core_s()
        ran = conceal.diagnose(batch, out, case.without, sources, _held(plan, allowance), beside)
    done = ran.code == 0 and not ran.tampering
    result = {
        "case": case.name,
        "number": case.number,
        "key": case.digest,
        "sources": conceal.digest_of(sources),
        "batch": digest,
        "allowance": allowance,
        "tampering": list(ran.tampering),
        "why": None if done else f"exit code {ran.code}: {ran.said.strip()[-500:]}",
        "said": _read_said(out) if done else None,
        "changed": changed,
        "took_s": round(conceal.core_s() - started, 1),
    }
    (out / "result.json").write_text(json.dumps(result, indent=1), encoding="utf-8")
    tell(f"{case.name}: {result['said']['verdict'] if done else 'no diagnosis'}, {result['took_s']:.0f} s of one core")
    return result


def _read_said(out: Path) -> dict:
    """What counts of a diagnosis: verdict, place, names with values, and what is left."""
    said = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    return {
        "verdict": said["verdict"],
        "place": (said.get("location") or {}).get("place"),
        "mechanisms": said["mechanisms"],
        "alternatives": said["alternatives"],
        "nearest": said.get("nearest"),
        "left": said["fit"]["mean_square"],
    }
