"""A lab's recording, made up, under the names, units and signs of that lab."""

from pathlib import Path

import numpy as np

RATE_HZ, RADIUS_M, SPRING = 500.0, 0.006, 0.05


def recording(seed=0, seconds=6.0, rate_hz=RATE_HZ) -> dict[str, np.ndarray]:
    """SI values by channel: a drive that rests and swings, a load that follows with lost motion."""
    noise = np.random.default_rng(seed).normal(0, 1, (6, round(seconds * rate_hz)))
    time = np.arange(noise.shape[1]) / rate_hz
    theta_in = 0.6 * np.sin(np.pi * np.maximum(time - 0.5, 0))
    theta_out = _with_lost_motion(theta_in, 0.08)
    tau_out = SPRING * theta_out
    tau_in = tau_out + 0.006 * np.tanh(5 * np.gradient(theta_in, time)) + 1e-4 * noise[0]
    f_drive, f_load = 7 + 0.05 * noise[1], 6.5 + 0.05 * noise[2]
    difference_in, difference_out = tau_in / RADIUS_M, tau_out / RADIUS_M
    return {
        "time_s": time,
        "theta_in_rad": theta_in,
        "theta_out_rad": theta_out + 1e-5 * noise[3],
        "tau_in_Nm": tau_in,
        "tau_out_Nm": tau_out + 1e-4 * noise[4],
        "F_drive_N": f_drive,
        "F_load_N": f_load,
        "T1_N": 9 + difference_in / 2,
        "T3_N": 9 - difference_in / 2,
        "T2_N": 9 + difference_out / 2,
        "T4_N": 9 - difference_out / 2,
    }


def counts(angle: np.ndarray, per_rev=2000) -> np.ndarray:
    return np.round(angle * per_rev / 2 / np.pi)


def _with_lost_motion(angle: np.ndarray, gap: float) -> np.ndarray:
    follower, result = 0.0, []
    for value in angle:
        follower = min(max(follower, value - gap), value + gap)
        result.append(follower)
    return np.array(result)


def write_text(
    path: Path, columns: dict[str, np.ndarray], separator=",", decimal=".", units=None, head=(), encoding="utf-8"
) -> Path:
    """A text file with a row a sample; `units` is a line below the names."""
    lines = [*head, separator.join(columns), *([separator.join(units)] if units else [])]
    for row in zip(*columns.values(), strict=True):
        lines.append(separator.join("" if np.isnan(v) else repr(float(v)).replace(".", decimal) for v in row))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(("\n".join(lines) + "\n").encode(encoding))
    return path
