"""The cases: one seeded fault each, or one mechanism removed from the baseline model."""

import hashlib
import json
from dataclasses import asdict, dataclass

import numpy as np

from proof.real.plan import RealPlan


@dataclass(frozen=True)
class RealCase:
    """One diagnosis of the test recordings. Without a fault and with a complete baseline it is the control.

    Attributes
    ----------
    seed, number : int
        Seed of the plan and number among its cases. The answer is made again from them.
    fault : str or None
        The seeded fault, a key of `proof.real.faults.FAULTS`.
    size : float
        In the fault's unit.
    removed : str or None
        "name at place" of the mechanism that the baseline lacks.
    without : tuple of str
        Mechanisms removed from the diagnosis's candidates.
    recordings : tuple of str
        The test recordings of a control; empty for all.
    """

    seed: int
    number: int
    fault: str | None = None
    size: float = 0.0
    removed: str | None = None
    without: tuple[str, ...] = ()
    recordings: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """A hash, which reveals neither fault nor size."""
        return "case-" + hashlib.sha256(f"{self.seed} real {self.number}".encode()).hexdigest()[:10]

    @property
    def digest(self) -> str:
        """SHA-256 of the answer."""
        return hashlib.sha256(json.dumps(asdict(self)).encode()).hexdigest()

    @property
    def is_control(self) -> bool:
        """Whether recordings and baseline are unchanged."""
        return self.fault is None and self.removed is None


def cases_of(plan: RealPlan, model: dict) -> list[RealCase]:
    """All cases, in the order in which they are run; `model` is the content of the baseline's model file."""
    cases: list[dict] = [{}, *(_draw(plan, fault, 0) for fault in plan.faults)]
    for removed in map(label, model["mechanisms"]):
        cases += [{"removed": removed, "without": without} for without in ((), (name_of(removed),))]
    cases += [{"recordings": control} for control in plan.controls]
    cases += [_draw(plan, fault, repeat) for repeat in range(1, plan.repeats) for fault in plan.faults]
    return [RealCase(plan.seed, number, **case) for number, case in enumerate(cases)]


def _draw(plan: RealPlan, fault: str, repeat: int) -> dict:
    # Each size has its own generator, so that adding a fault or a repeat does not change the others.
    random = np.random.default_rng([plan.seed, repeat, *fault.encode()])
    low, high = plan.faults[fault].size
    size = float(np.exp(random.uniform(np.log(low), np.log(high))))
    sign = random.choice([-1, 1]) if plan.faults[fault].signed else 1
    return {"fault": fault, "size": sign * size}


def without_mechanism(model: dict, removed: str | None) -> dict:
    """Content of a model file without one of its mechanisms."""
    return model | {"mechanisms": [m for m in model["mechanisms"] if label(m) != removed]}


def label(mechanism: dict) -> str:
    """A mechanism of a model file or a diagnosis as "name at place"."""
    return f"{mechanism['name']} at {mechanism['place']}"


def name_of(label: str) -> str:
    """The name in "name at place"."""
    return label.partition(" at ")[0]


def place_of(label: str) -> str:
    """The place in "name at place"."""
    return label.partition(" at ")[2]
