"""Random draws of a case's recordings: those of the protocol and those that are held out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from proof.plan import Plan, PlannedRecording, Protocol
from proof.rig_draw import rounded
from virtualrig.config import Piece, RecordingPlan
from virtualrig.motion import Excitation, Triangle, WanderingSine


@dataclass(frozen=True)
class Conditions:
    """A case's own pretension, conduit bend and conduit length, which a protocol scales."""

    pretension_N: float
    bend_rad: float
    length_m: float

    def recording(self, id_: str, pretension: float, bend: float, motion: Excitation) -> RecordingPlan:
        """A recording at `pretension` and `bend` times the case's own."""
        return RecordingPlan(
            id=id_,
            pretension_N=rounded(pretension * self.pretension_N, 4),
            conduit=(Piece(length_m=self.length_m, bend_rad=rounded(bend * self.bend_rad, 5)),),
            excitation=motion,
        )


def draw_recordings(
    protocol: Protocol, plan: Plan, conditions: Conditions, random: Generator
) -> tuple[RecordingPlan, ...]:
    """The recordings of a protocol; a repeat has the motion of the recording that it repeats."""
    made: dict[str, RecordingPlan] = {}
    for planned in protocol.recordings:
        motion = made[planned.again].excitation if planned.again else _varied_motion(planned, plan, random)
        made[planned.id] = conditions.recording(planned.id, planned.pretension, planned.bend, motion)
    places = np.linspace(-0.5, 0.5, len(made)).tolist() if len(made) > 1 else [0.0]
    return tuple(one.model_copy(update={"position": place}) for one, place in zip(made.values(), places, strict=True))


def _varied_motion(planned: PlannedRecording, plan: Plan, random: Generator) -> Excitation:
    """A planned motion with rest, start-up, amplitude and frequency drawn for this case."""
    spread = plan.motion
    draws = {
        "rest_s": lambda _: random.uniform(*spread.rest_s),
        "start_up_cycles": lambda _: random.uniform(*spread.start_up_cycles),
        "amplitude_rad": lambda value: value * random.uniform(*spread.amplitude_factor),
        "frequency_Hz": lambda value: value * random.uniform(*spread.frequency_factor),
        "angles_rad": lambda values: tuple(v * random.uniform(*spread.amplitude_factor) for v in values),
    }
    drawn = {key: draw(getattr(planned.motion, key)) for key, draw in draws.items() if hasattr(planned.motion, key)}
    drawn = {key: _three_digits(value) for key, value in drawn.items()}
    return type(planned.motion).model_validate(planned.motion.model_dump() | drawn)


def _three_digits(value: float | Sequence[float]) -> float | tuple[float, ...]:
    return rounded(value) if isinstance(value, float) else tuple(rounded(v) for v in value)


def draw_held_out(
    protocol: Protocol, plan: Plan, conditions: Conditions, random: Generator
) -> tuple[RecordingPlan, ...]:
    """The recordings that only the scorer reads, under the conditions that the protocol states for them."""
    return tuple(
        conditions.recording(
            f"back-{i + 1}",
            random.uniform(*protocol.kept_back.pretension),
            random.uniform(*protocol.kept_back.bend),
            _held_out_motion(plan, random),
        )
        for i in range(plan.kept_back.recordings)
    )


def _held_out_motion(plan: Plan, random: Generator) -> Excitation:
    held_out = plan.kept_back
    shape = {
        "amplitude_rad": rounded(random.uniform(*held_out.amplitude_rad)),
        "frequency_Hz": rounded(random.uniform(*held_out.frequency_Hz)),
        "rest_s": rounded(random.uniform(*plan.motion.rest_s)),
        "cycles": held_out.cycles,
    }
    if random.uniform() < held_out.wandering_share:
        return WanderingSine(
            wave="wandering-sine",
            **shape,
            spread=random.uniform(*held_out.spread),
            seed=int(random.integers(2**31)),
            start_up_cycles=random.uniform(*plan.motion.start_up_cycles),
        )
    return Triangle(wave="triangle", **shape, turn_share=held_out.turn_share)
