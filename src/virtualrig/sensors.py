"""From what truly happened to what the rig logs: counts, currents and voltages."""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from virtualrig.config import Encoder, LoadCell, Sensors, TorqueSensor
from virtualrig.dynamics import Trajectory

# Columns of a log in the order of the format, each with as many decimals as leave rounding far below the noise.
DECIMALS = {
    "time_s": 4,
    "drive_encoder_counts": 0,
    "load_encoder_counts": 0,
    "drive_current_A": 5,
    "load_current_A": 5,
    "drive_load_cell_V": 4,
    "load_load_cell_V": 4,
}


class SensorRangeError(ValueError):
    """A quantity left the range of the sensor that was to record it."""


def log(trajectory: Trajectory, sensors: Sensors, pulley_radius_m: float, draw: Generator) -> dict[str, NDArray]:
    """What the sensors at both ends make of a trajectory.

    Returns
    -------
    dict of str to ndarray, each of shape (samples,)
        The columns of a log by name.

    Raises
    ------
    SensorRangeError
        If a torque or a tension sum is beyond the sensor's range.
    """
    t = trajectory
    tau_in, tau_out = pulley_radius_m * (t.T1_N - t.T3_N), pulley_radius_m * (t.T2_N - t.T4_N)
    return {
        "time_s": t.time_s,
        "drive_encoder_counts": encode(t.theta_in_rad, sensors.encoder, draw),
        "load_encoder_counts": encode(t.theta_out_rad, sensors.encoder, draw),
        "drive_current_A": current(tau_in, sensors.torque, draw),
        "load_current_A": current(tau_out, sensors.torque, draw),
        "drive_load_cell_V": load_cell_voltage(t.T1_N + t.T3_N, sensors.load_cell, draw),
        "load_load_cell_V": load_cell_voltage(t.T2_N + t.T4_N, sensors.load_cell, draw),
    }


def encode(angle_rad: NDArray, encoder: Encoder, draw: Generator) -> NDArray:
    """Counts of an incremental encoder that was switched on anywhere within a turn."""
    index = draw.uniform(-encoder.counts_per_rev / 2, encoder.counts_per_rev / 2)
    return np.floor(angle_rad * encoder.counts_per_rev / (2 * np.pi) + index).astype(int)


def current(torque_Nm: NDArray, sensor: TorqueSensor, draw: Generator) -> NDArray:
    """Current (A) that is read for a torque (N m): noise, and a zero that is off within the accuracy."""
    _check_range("torque", torque_Nm, sensor.range_Nm, "N m")
    zero_Nm = draw.uniform(-sensor.accuracy_Nm, sensor.accuracy_Nm)
    read_Nm = torque_Nm + zero_Nm + draw.normal(0, sensor.noise_Nm, torque_Nm.shape)
    return read_Nm / sensor.constant_Nm_per_A


def load_cell_voltage(force_N: NDArray, cell: LoadCell, draw: Generator) -> NDArray:
    """Voltage (V) that is read for a tension sum (N): noise, and a zero that is off within the accuracy."""
    _check_range("tension sum", force_N, cell.range_N, "N")
    zero_N = draw.uniform(-cell.accuracy_N, cell.accuracy_N)
    read_N = force_N + zero_N + draw.normal(0, cell.noise_N, force_N.shape)
    return cell.zero_V + cell.sensitivity_V_per_N * read_N


def _check_range(name: str, values: NDArray, limit: float, unit: str) -> None:
    peak = np.abs(values).max()
    if peak > limit:
        raise SensorRangeError(f"{name} reaches {peak:.4g} {unit}, beyond the sensor's {limit:.4g} {unit}")
