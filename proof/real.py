"""Measured recordings with something put into them, diagnosed where nothing else is in reach.

A model in use is found from some of a real instrument's recordings, as its owner would. Others, which it has not seen,
are diagnosed beside it: untouched, with one thing put into their channels, and beside a model that something was taken
out of. What is put in is drawn from a seed; names say nothing of it, and no answer is on disk while the diagnosis runs.
"""

import hashlib
import json
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Literal, Self

import numpy as np
import pandas as pd
import yaml
from pydantic import Field, PositiveFloat, PositiveInt, model_validator

from proof import conceal
from proof.build import folder_digest
from proof.put_in import KINDS, angle_rad, described, torque_Nm, write_batch
from virtualrig.strict import Share, Strict

PLAN = Path(__file__).with_name("real.yaml")
MODEL, ALLOWED, STANDING = "in-use.json", "allowed.json", "as-it-stands.json"
Range = tuple[PositiveFloat, PositiveFloat]
Group = Literal["untouched", "put in", "taken out", "paper"]


class PutInPlan(Strict):
    """How large a thing that is put in can be, and what a diagnosis may be asked about it (`real.yaml`)."""

    size: Range
    unit: str
    signed: bool = False
    called: str | None = None
    parameter: str | None = None
    inverse: bool = False
    same: tuple[str, ...] = ()
    into: str | None = None
    place: str | None = None


class RealPlan(Strict):
    """All of `real.yaml`."""

    seed: PositiveInt
    batch: str
    known: tuple[str, ...] = Field(min_length=2)
    watched: tuple[str, ...] = Field(min_length=2)
    step_s: PositiveFloat
    cycles: PositiveInt
    allowance: Share
    suspects: tuple[tuple[str, ...], ...]
    allowances: tuple[Share, ...] = Field(min_length=1)
    repeats: PositiveInt
    put_in: dict[str, PutInPlan]

    @model_validator(mode="after")
    def _can_be_put_in(self) -> Self:
        if unknown := set(self.put_in) - set(KINDS):
            raise ValueError(f"put_in: there is no {', '.join(sorted(unknown))}; there are {', '.join(KINDS)}")
        if both := set(self.known) & set(self.watched):
            raise ValueError(f"known and watched share {', '.join(sorted(both))}")
        return self


@cache
def read_real_plan(path: Path = PLAN) -> RealPlan:
    """Read and check the plan."""
    return RealPlan.model_validate(yaml.safe_load(path.read_text(encoding="utf-8")))


@dataclass(frozen=True)
class RealCase:
    """One diagnosis of the watched recordings.

    Attributes
    ----------
    seed, number : int
        Of the plan, and among its cases: the answer is made again from them.
    group : {"untouched", "put in", "taken out", "paper"}
        Whether something is in the recordings, or out of the model in use, or the paper's model is in question.
    kind : str or None
        What is put in, of `proof.put_in.KINDS`.
    size : float
        In the kind's unit.
    left_out : str or None
        "name at place" of what is taken out of the model in use.
    without : tuple of str
        What is taken off the diagnosis's list.
    """

    seed: int
    number: int
    group: Group
    kind: str | None = None
    size: float = 0.0
    left_out: str | None = None
    without: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Says nothing of what it is."""
        return "case-" + hashlib.sha256(f"{self.seed} real {self.number}".encode()).hexdigest()[:10]

    @property
    def digest(self) -> str:
        """Digest of the answer."""
        return hashlib.sha256(json.dumps(asdict(self)).encode()).hexdigest()


def cases_of(plan: RealPlan, model: dict) -> list[RealCase]:
    """All cases, in the order in which they are run; `model` is the content of the model file in use."""
    cases: list[dict] = [{"group": "untouched"}]
    cases += [_drawn(plan, kind, 0) for kind in plan.put_in]
    in_use = [f"{m['name']} at {m['place']}" for m in model["mechanisms"]]
    for acting in in_use:
        cases.append({"group": "taken out", "left_out": acting})
        cases.append({"group": "taken out", "left_out": acting, "without": (_name(acting),)})
    names = tuple(dict.fromkeys(map(_name, in_use)))
    for without in dict.fromkeys([(), *((name,) for name in names), names]):
        cases.append({"group": "paper", "without": without})
    cases += [_drawn(plan, kind, repeat) for repeat in range(1, plan.repeats) for kind in plan.put_in]
    return [RealCase(plan.seed, number, **case) for number, case in enumerate(cases)]


def _drawn(plan: RealPlan, kind: str, repeat: int) -> dict:
    # A generator of its own, so that a kind more or a repeat more leaves the sizes of the others as they are.
    random = np.random.default_rng([plan.seed, repeat, *kind.encode()])
    low, high = plan.put_in[kind].size
    size = float(np.exp(random.uniform(np.log(low), np.log(high))))
    sign = random.choice([-1, 1]) if plan.put_in[kind].signed else 1
    return {"group": "put in", "kind": kind, "size": sign * size}


def find_model(plan: RealPlan, source: Path, out: Path, tell: Callable[[str], None], sources: Path) -> None:
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
            again = out / f"allowing-{allowance:g}"
            said = _diagnosed(batch, again, _finely(plan, allowance), out / MODEL, sources)
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


def judge_real(
    case: RealCase,
    plan: RealPlan,
    source: Path,
    in_use: Path,
    out: Path,
    sources: Path = conceal.SOURCES,
    tell: Callable[[str], None] = print,
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
    sources : Path
        The diagnosis's package.
    tell : callable
        Takes a line on how it went.
    """
    allowance = json.loads((in_use / ALLOWED).read_text(encoding="utf-8"))["allowance"]
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="case-") as folder:
        batch, beside = Path(folder) / case.name, None
        changed = write_batch(source, plan.watched, batch, case.kind, case.size)
        digest = folder_digest(batch)
        options = _finely(plan, allowance)
        if case.group == "paper":
            asked = [s for s in plan.suspects if not {_name(one) for one in s} & set(case.without)]
            options += [word for suspect in asked for word in ("--suspect", ", ".join(suspect))]
        else:
            beside = Path(folder) / "known.json"
            model = json.loads((in_use / MODEL).read_text(encoding="utf-8"))
            beside.write_text(json.dumps(lacking(model, case.left_out)), encoding="utf-8")
        started = conceal.core_s()
        ran = conceal.diagnose(batch, out, case.without, sources, options, beside)
    done = ran.code == 0 and not ran.tampering
    result = {
        "case": case.name,
        "number": case.number,
        "key": case.digest,
        "batch": digest,
        "allowance": allowance,
        "tampering": list(ran.tampering),
        "why": None if done else f"exit code {ran.code}: {ran.said.strip()[-500:]}",
        "said": read_said(out) if done else None,
        "changed": changed,
        "took_s": round(conceal.core_s() - started, 1),
    }
    (out / "result.json").write_text(json.dumps(result, indent=1), encoding="utf-8")
    tell(f"{case.name}: {result['said']['verdict'] if done else 'no diagnosis'}, {result['took_s']:.0f} s of one core")
    return result


def as_it_stands(
    case: RealCase, plan: RealPlan, source: Path, in_use: Path, out: Path, sources: Path = conceal.SOURCES
) -> None:
    """What the model in use, nothing of it fitted anew, predicts of a case's recordings less what they show.

    `out`/as-it-stands.json gets the root mean square by channel, the mean of each recording taken off: a sensor's zero
    may be another from day to day.
    """
    squares: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory(prefix="case-") as folder:
        batch, predicted = Path(folder) / case.name, Path(folder) / "predicted"
        write_batch(source, plan.watched, batch, case.kind, case.size)
        ran = conceal.predict(batch, in_use / MODEL, predicted, sources)
        stated = described(batch)
        for recording in stated["recordings"] if ran.code == 0 and not ran.tampering else []:
            log = pd.read_csv(batch / recording["file"])
            said = pd.read_csv(predicted / f"{recording['id']}.csv")
            judged = (log["time_s"] >= recording.get("settled_s", 0.0)).to_numpy()
            measured = {
                "theta_out_rad": angle_rad(log, stated["rig"], "load"),
                "tau_in_Nm": torque_Nm(log, stated["rig"], "drive"),
            }
            for channel, values in measured.items():
                off = np.interp(log["time_s"], said["time_s"], said[channel]) - values
                squares.setdefault(channel, []).append(float(np.var(off[judged])))
    errors = {channel: float(np.sqrt(np.mean(values))) for channel, values in squares.items()}
    (out / STANDING).write_text(json.dumps(errors, indent=1), encoding="utf-8")


def lacking(model: dict, left_out: str | None) -> dict:
    """A model file's content without one of its mechanisms."""
    acting = [m for m in model["mechanisms"] if f"{m['name']} at {m['place']}" != left_out]
    return model | {"mechanisms": acting}


def read_said(out: Path) -> dict:
    """What counts of a diagnosis: verdict, place, names with values, what is left, and the recalibrated values."""
    said = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    model = json.loads((out / "calibrated.json").read_text(encoding="utf-8"))
    calibrated = {name: model["parameters"][name] for name in said["fit"]["calibrated"] if name in model["parameters"]}
    for m in model["mechanisms"]:
        calibrated |= {f"{m['name']}/{m['place']}/{p}": value for p, value in m["values"].items()}
    return {
        "verdict": said["verdict"],
        "place": (said.get("location") or {}).get("place"),
        "mechanisms": said["mechanisms"],
        "alternatives": said["alternatives"],
        "nearest": said.get("nearest"),
        "left": said["fit"]["mean_square"],
        "calibrated": calibrated,
    }


def _name(acting: str) -> str:
    return acting.partition(" at ")[0]
