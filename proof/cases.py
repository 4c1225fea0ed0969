"""A concealed case, drawn as a whole from one seed."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.random import Generator

from proof.plan import Plan, read_plan
from proof.recording_draw import Conditions, draw_held_out, draw_recordings
from proof.rig_draw import draw_campaign, log_uniform
from virtualrig.config import Campaign, RecordingPlan
from virtualrig.effects import TWINS, Effects, merged
from virtualrig.effects.contract import Twin

CLEAN = "none"
SEVERITIES = 3
# Kinds of cases with several effects, and their number.
SEVERAL = {"pair": 2, "triple": 3, "many": 8}


@dataclass(frozen=True)
class Truth:
    """One concealed effect of a case. The field names are those of the answer, whose digest results hold.

    Attributes
    ----------
    name, place : str
        As in the diagnosis's candidates. The name of an effect outside the candidates begins with "unlisted-".
    strength : float
        Position of the size in its range on a logarithmic scale: 0 is barely visible, 1 is large.
    severity : int
        The third of the range that the strength lies in, 1 to 3.
    size : float
        The drawn size, in `unit`.
    unit : str
    values : dict of str to float
        True parameter values under the mechanism's names, for parameters defined alike in the rig and the mechanism.
    law : str
        Empty if the rig's law of the effect is that of the mechanism, otherwise the name of another published law
        (`Twin.other_laws`).
    slot, argument : str
        Slot of the rig in which the effect is a law of one quantity, and this quantity, as the diagnosis format names
        them; empty for an effect that is none.
    curve : tuple of (float, float)
        The law as a table: arguments and values (`virtualrig.effects.contract.TrueLaw`).
    channel : str
        The channel that a law of the slot of sensor maps is added to.
    """

    name: str
    place: str
    strength: float
    severity: int
    size: float
    unit: str
    values: dict[str, float]
    law: str = ""
    slot: str = ""
    argument: str = ""
    curve: tuple[tuple[float, float], ...] = ()
    channel: str = ""


@dataclass(frozen=True)
class Case:
    """A rig, its concealed effects and its recordings.

    Attributes
    ----------
    name : str
        A hash, which reveals neither the kind nor the effects.
    seed : int
    requested : dict
        Requested kind and effect; None where they were drawn. Of a case of a family also its strength, and where it
        has only some of its effects, which.
    kind : str
        clean, single, pair, triple, many, unlisted, removed or poor.
    protocol : str
        Name of the protocol in the plan.
    truth : tuple of Truth
        The concealed effects; empty for a clean case.
    without : tuple of str
        Mechanisms removed from the diagnosis's candidates.
    campaign : Campaign
        The rig and its sensors, without batches.
    recordings : tuple of RecordingPlan
        The batch that is diagnosed.
    kept_back : tuple of RecordingPlan
        Held-out recordings, made after the diagnosis has ended.
    effects : tuple of Effects
        Each concealed effect as a rig has it that has no other.
    """

    name: str
    seed: int
    requested: dict[str, Any]
    kind: str
    protocol: str
    truth: tuple[Truth, ...]
    without: tuple[str, ...]
    campaign: Campaign
    recordings: tuple[RecordingPlan, ...]
    kept_back: tuple[RecordingPlan, ...]
    effects: tuple[Effects, ...] = ()

    def having(self, which: Sequence[int]) -> "Case":
        """The same rig and recordings with these of the concealed effects only."""
        effects = tuple(self.effects[k] for k in which)
        together = Effects.model_validate(merged([e.model_dump(exclude_unset=True) for e in effects]))
        campaign = self.campaign.model_copy(update={"rig": self.campaign.rig.model_copy(update={"effects": together})})
        name = "-".join([self.name, *map(str, which)])
        truth = tuple(self.truth[k] for k in which)
        requested = self.requested | {"having": list(which)}
        return replace(self, name=name, requested=requested, truth=truth, campaign=campaign, effects=effects)

    @property
    def key(self) -> dict:
        """The answer: the true effects and the rig, in the form that the scorer reads."""
        poor = read_plan().protocols[self.protocol].poor
        rig = self.campaign.rig
        return {
            "case": self.name,
            "kind": self.kind,
            "protocol": "single" if poor else self.protocol,
            "recorded": self.protocol,
            "without": list(self.without),
            "truth": [asdict(t) for t in self.truth] or [{"name": CLEAN, "place": None, "severity": 0}],
            "rig": {
                "length": rig.cable.length_m,
                "k": rig.cable.stiffness_N_per_m,
                "mu": rig.cable.friction_coefficient,
                "R": rig.pulley_radius_m,
                "Ke": rig.load.spring_stiffness_Nm_per_rad,
            },
        }

    @property
    def digest(self) -> str:
        """SHA-256 of the answer, the only trace of it in a result."""
        return hashlib.sha256(json.dumps(self.key, sort_keys=True).encode()).hexdigest()


def draw(
    seed: int,
    kind: str | None = None,
    effect: str | None = None,
    strength: float | None = None,
    having: Sequence[int] | None = None,
) -> Case:
    """Draw a case.

    Parameters
    ----------
    seed : int
    kind : str, optional
        One of the plan's kinds; drawn by their shares if not given.
    effect : str, optional
        Name of the effect of a single, removed, poor or unlisted case; drawn if not given.
    strength : float, optional
        Strength of that effect, 0 to 1; drawn if not given.
    having : sequence of int, optional
        Which of its effects the rig has; all of them if not given.
    """
    plan = read_plan()
    requested: dict[str, Any] = {"kind": kind, "effect": effect}
    if strength is not None:
        requested |= {"strength": strength}
    random = np.random.default_rng(np.random.SeedSequence([seed, 0xCA5E]))
    kind = kind or _one_of(plan.kinds, random)
    protocol_name = _protocol_of(kind, plan, random)
    protocol = plan.protocols[protocol_name]
    spring = log_uniform(plan.rig.load_stiffness_Nm_per_rad, random)
    chosen = _chosen(kind, effect, plan, random)
    if len(protocol.recordings) == 1 and any(twin.between_recordings for twin, _ in chosen):
        protocol_name = next(name for name, p in plan.protocols.items() if p.poor and len(p.recordings) > 1)
        protocol = plan.protocols[protocol_name]
    if strength is not None:
        chosen = [(twin, strength) for twin, _ in chosen]
    drawn = [_effect(*one, spring, plan.other_law_share, random) for one in chosen]
    truth = tuple(t for t, _ in drawn)
    campaign = draw_campaign(seed, plan, spring, Effects.model_validate(merged([e for _, e in drawn])), random)
    truth = tuple(_in_rig(t, campaign) for t in truth)
    conditions = Conditions(
        pretension_N=random.uniform(*plan.rig.pretension_N),
        bend_rad=random.uniform(*(protocol.bend_rad or plan.rig.bend_rad)),
        length_m=campaign.rig.cable.length_m,
    )
    without: tuple[str, ...] = ()
    if kind == "removed":
        without = tuple(t.name for t in truth)
        truth = tuple(Truth(**asdict(t) | {"name": f"unlisted-{t.name}"}) for t in truth)
    case = Case(
        name=_name(seed, kind, effect, strength),
        seed=seed,
        requested=requested,
        kind=kind,
        protocol=protocol_name,
        truth=truth,
        without=without,
        campaign=campaign,
        recordings=draw_recordings(protocol, plan, conditions, random),
        kept_back=draw_held_out(protocol, plan, conditions, random),
        effects=tuple(Effects.model_validate(merged([e])) for _, e in drawn),
    )
    return case if having is None else case.having(having)


def _name(seed: int, kind: str, effect: str | None, strength: float | None) -> str:
    of_family = "" if strength is None else f" {strength}"
    return "case-" + hashlib.sha256(f"name {seed} {kind} {effect}{of_family}".encode()).hexdigest()[:10]


def _one_of(shares: dict[str, float], random: Generator) -> str:
    return str(random.choice(list(shares), p=list(shares.values())))


def _protocol_of(kind: str, plan: Plan, random: Generator) -> str:
    if kind == "poor":
        return str(random.choice([name for name, protocol in plan.protocols.items() if protocol.poor]))
    return _one_of(plan.protocol_shares, random)


def _chosen(kind: str, effect: str | None, plan: Plan, random: Generator) -> list[tuple[Twin, float]]:
    """Effects of a case, and their strengths (`Truth.strength`)."""
    if kind == "clean":
        return []
    if kind == "unlisted":
        name = effect or str(random.choice(list(plan.unlisted)))
        return [(plan.unlisted[name], _strength(plan, random))]
    if kind in SEVERAL:
        several = random.choice(list(plan.effects), SEVERAL[kind], replace=False)
        return [(plan.effects[name], random.uniform(*plan.pair_strength)) for name in several]
    name = effect or str(random.choice(list(plan.effects)))
    return [(plan.effects[name], _strength(plan, random))]


def _strength(plan: Plan, random: Generator) -> float:
    return float(random.uniform() ** plan.strength_power)


def _effect(twin: Twin, strength: float, spring: float, other: float, random: Generator) -> tuple[Truth, dict]:
    """An effect of a given strength as its truth and its settings of the rig; `spring` is the load's, N m/rad.

    `other` is the share of laws that the mechanism does not have, among effects that have such laws.
    """
    low, high = twin.size
    size = float(low * (high / low) ** strength)
    if twin.signed and random.uniform() < 0.5:
        size = -size
    also = {key: log_uniform(between, random) for key, between in twin.also.items()}
    also["phase"] = random.uniform(-np.pi, np.pi)
    place = str(random.choice(twin.places))
    law = str(random.choice(list(twin.other_laws))) if twin.other_laws and random.uniform() < other else ""
    seed = twin.other_laws[law] if law else twin.seed
    settings, values = seed(size, also, place, spring)
    severity = min(int(strength * SEVERITIES) + 1, SEVERITIES)
    return Truth(twin.name, place, float(strength), severity, size, twin.unit, values, law), settings


def _in_rig(truth: Truth, campaign: Campaign) -> Truth:
    """The true values, including what follows the same law in this rig and no recording separates; and the law."""
    twin = TWINS[truth.name]
    if twin.in_rig:
        truth = replace(truth, values=twin.in_rig(truth.values, campaign))
    if twin.law is None:
        return truth
    law = twin.law(campaign.rig, truth.place)
    curve = tuple(zip(law.x.tolist(), law.y.tolist(), strict=True))
    return replace(truth, slot=law.slot, argument=law.argument, curve=curve, channel=law.channel)
