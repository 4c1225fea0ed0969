"""Signs of the sensors of an instrument, from the physics of its trials.

The load follows the drive. The drive does work on the transmission, which returns none over full cycles. The torque at
the load follows the torque at the drive and does work on a passive load.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ccmodel.rig.mis_tool.trial import Trial

DRIVE_ANGLE, LOAD_ANGLE = "drive_encoder_counts", "load_encoder_counts"
MOTOR_ANGLE = "motor_encoder_counts"
DRIVE_TORQUE, LOAD_TORQUE = "drive_torque_counts", "load_torque_counts"

# A sign is in doubt if a smaller share of the trials supports it, or if the median of their strengths is lower.
CLEAR_MAJORITY, CLEAR_STRENGTH = 0.75, 0.2


def sensor_signs(trials: Sequence[Trial]) -> tuple[dict[str, dict[str, int]], list[str]]:
    """Signs by end of the rig and key of `batch.yaml`, and a text for each sign in doubt."""
    doubts: list[str] = []
    angle = _majority("load encoder", [_correlation(t, DRIVE_ANGLE, LOAD_ANGLE) for t in trials], doubts)
    drive = _majority("drive torque", [_work(t, DRIVE_TORQUE, DRIVE_ANGLE) for t in trials], doubts)
    strengths = [
        (drive * _correlation(t, DRIVE_TORQUE, LOAD_TORQUE) + angle * _work(t, LOAD_TORQUE, LOAD_ANGLE)) / 2
        for t in trials
    ]
    load = _majority("load torque", strengths, doubts)
    sides: dict[str, dict[str, int]] = {
        "drive": {"torque_sign": drive},
        "load": {"encoder_sign": angle, "torque_sign": load},
    }
    if with_motor := [t for t in trials if MOTOR_ANGLE in t.samples]:
        motor = _majority("motor encoder", [_correlation(t, DRIVE_ANGLE, MOTOR_ANGLE) for t in with_motor], doubts)
        sides["drive"]["motor_sign"] = motor
    return sides, doubts


def _correlation(trial: Trial, one: str, other: str) -> float:
    """Correlation of two columns; 0 if one of them is constant."""
    x, y = (_about_mean(trial, column) for column in (one, other))
    scale = np.sqrt((x @ x) * (y @ y))
    return float(x @ y / scale) if scale > 0 else 0.0


def _about_mean(trial: Trial, column: str) -> NDArray:
    values = trial.settled[column].to_numpy()
    return values - values.mean()


def _work(trial: Trial, torque: str, angle: str) -> float:
    """Net work over the settled part, as a share of the work exchanged in both directions."""
    torque_counts, steps = _about_mean(trial, torque), np.diff(trial.settled[angle])
    work = (torque_counts[1:] + torque_counts[:-1]) / 2 * steps
    exchanged = np.abs(work).sum()
    return float(work.sum() / exchanged) if exchanged > 0 else 0.0


def _majority(sensor: str, strengths: list[float], doubts: list[str]) -> int:
    """The sign of most strengths; a strength of 0 has no vote."""
    votes = np.sign(strengths)
    sign = 1 if votes.sum() >= 0 else -1
    agree, strength = np.mean(votes == sign), np.median(strengths) * sign
    if agree < CLEAR_MAJORITY or strength < CLEAR_STRENGTH:
        doubts.append(
            f"sign of the {sensor} is in doubt: {agree:.0%} of {len(votes)} trials support {sign:+d}, with a median"
            f" strength of {strength:.2f} out of 1; check it in batch.yaml"
        )
    return sign
