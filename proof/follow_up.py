"""A further experiment on the rig of an open case: the one that its diagnosis proposes, or one drawn at random.

A diagnosis that ends with `undecided` or `unexplained` says what to record next. That recording is made on the same rig
and added to the batch, which is diagnosed again. As a control the same is done with an experiment drawn at random from
motions, tensions and bends within the batch.
"""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.random import Generator

from proof.build import record
from proof.cases import Case
from virtualrig.config import Piece, RecordingPlan
from virtualrig.motion import GrowingSine, Sine, StepAndHold

OPEN = ("undecided", "unexplained")
PROPOSED, RANDOM = "proposed", "random"
# Length of a recording of a cycle or more, s, its rest, s, and the most that are made of one experiment.
DURATION_S, REST_S, MOST_RECORDINGS = 10.0, 0.5, 3
START_UP_CYCLES = 0.25
# Final amplitude of nested reversals over the first; a sine of none is no motion.
SMALLEST_SHARE = 0.02
# What the random experiment is drawn from: shares of the batch's largest amplitude and highest pretension, frequencies
# (Hz) and durations of holds (s).
SIZES, FREQUENCIES_HZ, HOLDS_S, MOVE_S = (1.0, 0.4), (0.1, 0.4, 1.2), (1.0, 3.0, 8.0), 0.5
STREAM = 0xF0110

# Diagnoses a batch again: its folder and a folder for the result to what the result says.
Diagnose = Callable[[Path, Path], dict | None]


def follow_ups(case: Case, diagnosis: Path, recorded: Path, folder: Path, diagnose: Diagnose) -> dict[str, dict]:
    """Diagnoses of a case with a further experiment, by `PROPOSED` and `RANDOM`; empty if none was proposed.

    Parameters
    ----------
    case : Case
    diagnosis : Path
        The diagnosis.json of the case.
    recorded : Path
        Its batch.
    folder : Path
        Where batches and results are written.
    diagnose : callable
    """
    content = json.loads(diagnosis.read_text(encoding="utf-8"))
    asked = (content.get("next_experiment") or {}).get("recording")
    if content["verdict"] not in OPEN or not asked:
        return {}
    drawn = random_experiment(case, asked["recordings"], np.random.default_rng([case.seed, STREAM]))
    found = {}
    for which, experiment in ((PROPOSED, asked), (RANDOM, drawn)):
        batch = folder / which / case.name
        record(case, [*case.recordings, *plans_of(case, experiment)], batch, recorded)
        found[which] = {"experiment": experiment, "diagnosis": diagnose(batch, folder / f"{which}-out")}
    return found


def random_experiment(case: Case, count: int, random: Generator) -> dict:
    """An experiment in the form of a proposal, drawn from motions, tensions and bends within the batch."""
    amplitude = float(random.choice(SIZES)) * max(_amplitude(plan) for plan in case.recordings)
    wave = str(random.choice(["sine", "step-and-hold", "growing-sine"]))
    motions = {
        "sine": {"amplitude_rad": amplitude, "frequency_Hz": float(random.choice(FREQUENCIES_HZ))},
        "step-and-hold": {
            "angles_rad": [amplitude, 0.0, -amplitude, 0.0],
            "move_s": MOVE_S,
            "hold_s": float(random.choice(HOLDS_S)),
        },
        "growing-sine": {"first_amplitude_rad": amplitude, "amplitude_rad": 0.0, "frequency_Hz": 0.5},
    }
    bends = [sum(piece.bend_rad for piece in plan.conduit) for plan in case.recordings]
    return {
        "excitation": {"wave": wave} | motions[wave],
        "pretension_N": float(random.choice(SIZES)) * max(plan.pretension_N for plan in case.recordings),
        "bend_rad": float(random.choice([min(bends), max(bends)])),
        "recordings": count,
    }


def _amplitude(plan: RecordingPlan) -> float:
    angle, _ = plan.excitation.angle_and_rate(np.arange(0.0, plan.excitation.duration_s, 0.01))
    return float(np.ptp(angle) / 2)


def plans_of(case: Case, experiment: dict) -> Sequence[RecordingPlan]:
    """The recordings of an experiment on a case's rig, after its session: a drift goes on at its rate."""
    step = 1 / max(len(case.recordings) - 1, 1)
    length_m = sum(piece.length_m for piece in case.recordings[0].conduit)
    motion = _motion(**experiment["excitation"])
    return [
        RecordingPlan(
            id=f"experiment-{k + 1}",
            pretension_N=experiment["pretension_N"],
            conduit=(Piece(length_m=length_m, bend_rad=experiment["bend_rad"]),),
            excitation=motion,
            position=0.5 + (k + 1) * step,
        )
        for k in range(min(experiment["recordings"], MOST_RECORDINGS))
    ]


def _motion(wave: str, **numbers: float | Sequence[float]) -> Sine | StepAndHold | GrowingSine:
    """A motion from the numbers of a proposal, of `DURATION_S` or, if that is longer, of one cycle."""
    if wave == "step-and-hold":
        angles, move_s, hold_s = numbers["angles_rad"], float(numbers["move_s"]), float(numbers["hold_s"])
        count = max(1, int((DURATION_S - REST_S) / (move_s + hold_s)))
        repeated = tuple(float(angles[k % len(angles)]) for k in range(count))
        return StepAndHold(wave=wave, angles_rad=repeated, move_s=move_s, hold_s=hold_s, rest_s=REST_S)
    frequency_Hz = float(numbers["frequency_Hz"])
    cycles = max(1.0, (DURATION_S - REST_S) * frequency_Hz - START_UP_CYCLES)
    shape = {"frequency_Hz": frequency_Hz, "rest_s": REST_S, "start_up_cycles": START_UP_CYCLES, "cycles": cycles}
    if wave == "growing-sine":
        first = float(numbers["first_amplitude_rad"])
        last = max(float(numbers["amplitude_rad"]), SMALLEST_SHARE * first)
        return GrowingSine(wave=wave, first_amplitude_rad=first, amplitude_rad=last, **shape)
    return Sine(wave=wave, amplitude_rad=float(numbers["amplitude_rad"]), **shape)
