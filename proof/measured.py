"""Raw logs in SI units, and the error of a prediction. It shares no code with the package under test."""

from pathlib import Path

import numpy as np
import pandas as pd
import yaml

# Every motion rests at least this long before it begins.
REST_S = 0.3
CHANNELS = ("theta_out_rad", "tau_in_Nm", "tau_out_Nm", "F_drive_N", "F_load_N")


def error_squares(batch: Path, recording: str, prediction: Path) -> list[float]:
    """Mean square of prediction minus measurement, one value for each of `CHANNELS`, in the channel's unit squared.

    The zero of the load's encoder is taken from the rest.

    Raises
    ------
    ValueError
        If a prediction is not finite.
    """
    measured = in_si(batch, recording)
    predicted = pd.read_csv(prediction)
    errors = [np.interp(measured["time_s"], predicted["time_s"], predicted[c]) - measured[c] for c in CHANNELS]
    errors[0] = errors[0] - errors[0][measured["time_s"] < REST_S].mean()
    means = [float(np.mean(values**2)) for values in errors]
    if not np.all(np.isfinite(means)):
        raise ValueError(f"{prediction} is not finite")
    return means


def in_si(batch: Path, recording: str) -> dict[str, np.ndarray]:
    """A raw log in SI units, converted with the constants in its batch's ``batch.yaml``; each of shape (samples,)."""
    rig = yaml.safe_load((batch / "batch.yaml").read_text(encoding="utf-8"))["rig"]
    log = pd.read_csv(batch / f"{recording}.csv.gz")
    step = 2 * np.pi / rig["load"]["encoder_counts_per_rev"]
    columns = {"time_s": log["time_s"], "theta_out_rad": log["load_encoder_counts"] * step}
    for end, torque, force in (("drive", "tau_in_Nm", "F_drive_N"), ("load", "tau_out_Nm", "F_load_N")):
        side, cell = rig[end], rig[end]["load_cell"]
        columns[torque] = log[f"{end}_current_A"] * side["torque_constant_Nm_per_A"]
        columns[force] = (log[f"{end}_load_cell_V"] - cell["zero_V"]) / cell["sensitivity_V_per_N"]
    return {name: values.to_numpy() for name, values in columns.items()}
