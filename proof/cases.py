"""A concealed case, all of it drawn from one seed."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.random import Generator

from proof.plan import Plan, PlannedRecording, Protocol, SensorsPlan, read_plan
from virtualrig.config import (
    Cable,
    Campaign,
    Encoder,
    Estimates,
    Load,
    LoadCell,
    Numerics,
    Piece,
    RecordingPlan,
    Rig,
    Sensors,
    SlowNoise,
    TorqueSensor,
)
from virtualrig.effects import TWINS, Effects, merged
from virtualrig.effects.contract import Twin
from virtualrig.motion import Excitation, Triangle, WanderingSine

CLEAN = "none"
SEVERITIES = 3


@dataclass(frozen=True)
class Truth:
    """One effect of a case.

    Attributes
    ----------
    name, place : str
        As in the effects' list; an effect outside the list has a name that begins with "unlisted-".
    strength : float
        Where in its range, on a logarithmic scale, its size was drawn: 0 is hardly seen, 1 is plain.
    severity : int
        The strength in thirds, 1 to 3.
    size : float
    unit : str
    values : dict
        Under the names of the list, as far as they mean the same there and in the rig.
    """

    name: str
    place: str
    strength: float
    severity: int
    size: float
    unit: str
    values: dict[str, float]


@dataclass(frozen=True)
class Case:
    """A rig, what is recorded on it, and what is hidden in it.

    Attributes
    ----------
    name : str
        Says nothing.
    seed : int
    asked : dict
        Kind and effect that were asked for, None where they were drawn.
    kind : str
        clean, single, pair, unlisted, removed or poor.
    protocol : str
        Name of the protocol in the plan.
    truth : tuple of Truth
        What is hidden; empty for a clean case.
    without : tuple of str
        Names that the diagnosis is told to do without.
    campaign : Campaign
        The rig; it holds no batches.
    recordings, kept_back : tuple of RecordingPlan
    """

    name: str
    seed: int
    asked: dict[str, str | None]
    kind: str
    protocol: str
    truth: tuple[Truth, ...]
    without: tuple[str, ...]
    campaign: Campaign
    recordings: tuple[RecordingPlan, ...]
    kept_back: tuple[RecordingPlan, ...]

    @property
    def key(self) -> dict:
        """The answer, as the scorer takes it."""
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
        """What the builder leaves of the answer."""
        return hashlib.sha256(json.dumps(self.key, sort_keys=True).encode()).hexdigest()


def draw(seed: int, kind: str | None = None, effect: str | None = None) -> Case:
    """Draw a case.

    Parameters
    ----------
    seed : int
    kind : str, optional
        One of the plan's kinds; drawn by their shares where none is given.
    effect : str, optional
        The effect of a single or removed case, by its name in the list; drawn where none is given.
    """
    plan = read_plan()
    asked = {"kind": kind, "effect": effect}
    random = np.random.default_rng(np.random.SeedSequence([seed, 0xCA5E]))
    kind = kind or _one_of(plan.kinds, random)
    protocol_name = _protocol_of(kind, plan, random)
    protocol = plan.protocols[protocol_name]
    spring = log_uniform(plan.rig.load_stiffness_Nm_per_rad, random)
    hidden = [_effect(*chosen, spring, random) for chosen in _chosen(kind, effect, plan, random)]
    truth = tuple(t for t, _ in hidden)
    campaign = _campaign(seed, plan, spring, Effects.model_validate(merged([e for _, e in hidden])), random)
    truth = tuple(_in_rig(t, campaign) for t in truth)
    pretension_N = random.uniform(*plan.rig.pretension_N)
    bend_rad = random.uniform(*(protocol.bend_rad or plan.rig.bend_rad))
    length_m = campaign.rig.cable.length_m
    without: tuple[str, ...] = ()
    if kind == "removed":
        without = tuple(t.name for t in truth)
        truth = tuple(Truth(**asdict(t) | {"name": f"unlisted-{t.name}"}) for t in truth)
    return Case(
        name=_name(seed, kind, effect),
        seed=seed,
        asked=asked,
        kind=kind,
        protocol=protocol_name,
        truth=truth,
        without=without,
        campaign=campaign,
        recordings=_recordings(protocol, plan, pretension_N, bend_rad, length_m, random),
        kept_back=_kept_back(protocol, plan, pretension_N, bend_rad, length_m, random),
    )


def log_uniform(between: tuple[float, float], random: Generator) -> float:
    """A number that is uniform in its logarithm."""
    return float(np.exp(random.uniform(*np.log(between))))


def _name(seed: int, kind: str, effect: str | None) -> str:
    return "case-" + hashlib.sha256(f"name {seed} {kind} {effect}".encode()).hexdigest()[:10]


def _one_of(shares: dict[str, float], random: Generator) -> str:
    return str(random.choice(list(shares), p=list(shares.values())))


def _protocol_of(kind: str, plan: Plan, random: Generator) -> str:
    if kind == "poor":
        return str(random.choice([name for name, protocol in plan.protocols.items() if protocol.poor]))
    return _one_of(plan.protocol_shares, random)


def _chosen(kind: str, effect: str | None, plan: Plan, random: Generator) -> list[tuple[Twin, float]]:
    """The effects of a case and their strengths."""
    if kind == "clean":
        return []
    if kind == "unlisted":
        name = effect or str(random.choice(list(plan.unlisted)))
        return [(plan.unlisted[name], random.uniform())]
    if kind == "pair":
        both = random.choice(list(plan.effects), 2, replace=False)
        return [(plan.effects[name], random.uniform(*plan.pair_strength)) for name in both]
    name = effect or str(random.choice(list(plan.effects)))
    return [(plan.effects[name], random.uniform())]


def _effect(twin: Twin, strength: float, spring: float, random: Generator) -> tuple[Truth, dict]:
    low, high = twin.size
    size = float(low * (high / low) ** strength)
    if twin.signed and random.uniform() < 0.5:
        size = -size
    also = {key: log_uniform(between, random) for key, between in twin.also.items()}
    also["phase"] = random.uniform(-np.pi, np.pi)
    place = str(random.choice(twin.places))
    settings, values = twin.seed(size, also, place, spring)
    severity = min(int(strength * SEVERITIES) + 1, SEVERITIES)
    return Truth(twin.name, place, float(strength), severity, size, twin.unit, values), settings


def _in_rig(truth: Truth, campaign: Campaign) -> Truth:
    """With what else in this rig has the same law, which no recording separates from the effect."""
    in_rig = TWINS[truth.name].in_rig
    return replace(truth, values=in_rig(truth.values, campaign)) if in_rig else truth


def _campaign(seed: int, plan: Plan, spring: float, effects: Effects, random: Generator) -> Campaign:
    rig, numerics = plan.rig, plan.numerics.model_dump()
    limit = numerics.pop("first_tension_limit_N")
    length_m = round(random.uniform(*rig.length_m), 4)
    stiffness = log_uniform(rig.stiffness_N_per_m, random)
    friction = random.uniform(*rig.friction_coefficient)
    return Campaign(
        seed=seed,
        rig=Rig(
            pulley_radius_m=rig.pulley_radius_m,
            cable=Cable(
                stiffness_N_per_m=stiffness,
                length_m=length_m,
                friction_coefficient=friction,
                density_kg_per_m=rig.density_kg_per_m,
            ),
            estimates=Estimates(
                stiffness_N_per_m=_rounded(stiffness * _off_by(plan, random)),
                length_m=length_m,
                friction_coefficient=_rounded(friction * _off_by(plan, random)),
            ),
            load=Load(
                spring_stiffness_Nm_per_rad=_rounded(spring, 5),
                inertia_kg_m2=rig.load_inertia_kg_m2,
                damping_Nms_per_rad=rig.load_damping_Nms_per_rad,
            ),
            effects=effects,
        ),
        sensors=_sensors(plan.sensors, random),
        repeatability=plan.repeatability,
        numerics=Numerics(**numerics, tension_limit_N=limit),
        batches={},
    )


def _off_by(plan: Plan, random: Generator) -> float:
    """Estimate over truth."""
    far = random.uniform() < plan.estimates.far_share
    factor = 1 + random.uniform(*(plan.estimates.far if far else plan.estimates.near))
    return factor if random.uniform() < 0.5 else 1 / factor


def _rounded(value: float, digits: int = 3) -> float:
    return float(f"{value:.{digits}g}")


def _sensors(plan: SensorsPlan, random: Generator) -> Sensors:
    noise = random.uniform(*plan.noise_factor)
    slow = SlowNoise(
        ratio=random.uniform(*plan.slow_ratio),
        lasts_samples=log_uniform(plan.slow_s, random) * plan.sample_rate_Hz,
    )
    return Sensors(
        sample_rate_Hz=plan.sample_rate_Hz,
        encoder=Encoder(counts_per_rev=plan.counts_per_rev, accuracy_rad=_rounded(2 * np.pi / plan.counts_per_rev)),
        torque=TorqueSensor(
            constant_Nm_per_A=plan.constant_Nm_per_A,
            accuracy_Nm=plan.torque_accuracy_Nm,
            noise_Nm=plan.torque_noise_Nm * noise,
            range_Nm=plan.torque_range_Nm,
            slow_noise=slow,
        ),
        load_cell=LoadCell(
            sensitivity_V_per_N=plan.sensitivity_V_per_N,
            zero_V=plan.zero_V,
            accuracy_N=plan.load_cell_accuracy_N,
            noise_N=plan.load_cell_noise_N * noise,
            range_N=plan.load_cell_range_N,
            slow_noise=slow,
        ),
    )


def _recording(id_: str, pretension_N: float, bend_rad: float, length_m: float, motion: Excitation) -> RecordingPlan:
    return RecordingPlan(
        id=id_,
        pretension_N=_rounded(pretension_N, 4),
        conduit=(Piece(length_m=length_m, bend_rad=_rounded(bend_rad, 5)),),
        excitation=motion,
    )


def _recordings(
    protocol: Protocol, plan: Plan, pretension_N: float, bend_rad: float, length_m: float, random: Generator
) -> tuple[RecordingPlan, ...]:
    made: dict[str, RecordingPlan] = {}
    for one in protocol.recordings:
        motion = made[one.again].excitation if one.again else _varied(one, plan, random)
        made[one.id] = _recording(one.id, one.pretension * pretension_N, one.bend * bend_rad, length_m, motion)
    return tuple(made.values())


def _varied(one: PlannedRecording, plan: Plan, random: Generator) -> Excitation:
    """A planned motion as it is carried out: rest, start-up, size and speed differ from case to case."""
    spread = plan.motion
    by = {
        "rest_s": lambda _: random.uniform(*spread.rest_s),
        "start_up_cycles": lambda _: random.uniform(*spread.start_up_cycles),
        "amplitude_rad": lambda value: value * random.uniform(*spread.amplitude_factor),
        "frequency_Hz": lambda value: value * random.uniform(*spread.frequency_factor),
        "angles_rad": lambda values: tuple(v * random.uniform(*spread.amplitude_factor) for v in values),
    }
    changed = {key: change(getattr(one.motion, key)) for key, change in by.items() if hasattr(one.motion, key)}
    changed = {key: _three_digits(value) for key, value in changed.items()}
    return type(one.motion).model_validate(one.motion.model_dump() | changed)


def _three_digits(value: float | Sequence[float]) -> float | tuple[float, ...]:
    return _rounded(value) if isinstance(value, float) else tuple(_rounded(v) for v in value)


def _kept_back(
    protocol: Protocol, plan: Plan, pretension_N: float, bend_rad: float, length_m: float, random: Generator
) -> tuple[RecordingPlan, ...]:
    return tuple(
        _recording(
            f"back-{i + 1}",
            pretension_N * random.uniform(*protocol.kept_back.pretension),
            bend_rad * random.uniform(*protocol.kept_back.bend),
            length_m,
            _kept_back_motion(plan, random),
        )
        for i in range(plan.kept_back.recordings)
    )


def _kept_back_motion(plan: Plan, random: Generator) -> Excitation:
    kept = plan.kept_back
    shape = {
        "amplitude_rad": _rounded(random.uniform(*kept.amplitude_rad)),
        "frequency_Hz": _rounded(random.uniform(*kept.frequency_Hz)),
        "rest_s": _rounded(random.uniform(*plan.motion.rest_s)),
        "cycles": kept.cycles,
    }
    if random.uniform() < kept.wandering_share:
        return WanderingSine(
            wave="wandering-sine",
            **shape,
            spread=random.uniform(*kept.spread),
            seed=int(random.integers(2**31)),
            start_up_cycles=random.uniform(*plan.motion.start_up_cycles),
        )
    return Triangle(wave="triangle", **shape, turn_share=kept.turn_share)
