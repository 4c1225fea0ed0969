"""The cases: what is put into the watched recordings, or taken out of the model in use, one thing at a time."""

import hashlib
import json
from dataclasses import asdict, dataclass

import numpy as np

from proof.real.plan import RealPlan


@dataclass(frozen=True)
class RealCase:
    """One diagnosis of the watched recordings; with neither a kind nor anything left out they are untouched.

    Attributes
    ----------
    seed, number : int
        Of the plan, and among its cases: the answer is made again from them.
    kind : str or None
        What is put in, of `proof.real.put_in.KINDS`.
    size : float
        In the kind's unit.
    left_out : str or None
        "name at place" of what is taken out of the model in use.
    without : tuple of str
        What is taken off the diagnosis's list.
    """

    seed: int
    number: int
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
    cases: list[dict] = [{}, *(_drawn(plan, kind, 0) for kind in plan.put_in)]
    for left_out in map(acting_of, model["mechanisms"]):
        cases += [{"left_out": left_out, "without": without} for without in ((), (name_of(left_out),))]
    cases += [_drawn(plan, kind, repeat) for repeat in range(1, plan.repeats) for kind in plan.put_in]
    return [RealCase(plan.seed, number, **case) for number, case in enumerate(cases)]


def _drawn(plan: RealPlan, kind: str, repeat: int) -> dict:
    # A generator of its own, so that a kind more or a repeat more leaves the sizes of the others as they are.
    random = np.random.default_rng([plan.seed, repeat, *kind.encode()])
    low, high = plan.put_in[kind].size
    size = float(np.exp(random.uniform(np.log(low), np.log(high))))
    sign = random.choice([-1, 1]) if plan.put_in[kind].signed else 1
    return {"kind": kind, "size": sign * size}


def lacking(model: dict, left_out: str | None) -> dict:
    """A model file's content without one of its mechanisms."""
    return model | {"mechanisms": [m for m in model["mechanisms"] if acting_of(m) != left_out]}


def acting_of(mechanism: dict) -> str:
    """A mechanism of a model file or a diagnosis as "name at place"."""
    return f"{mechanism['name']} at {mechanism['place']}"


def name_of(acting: str) -> str:
    """The name in "name at place"."""
    return acting.partition(" at ")[0]


def place_of(acting: str) -> str:
    """The place in "name at place"."""
    return acting.partition(" at ")[2]
