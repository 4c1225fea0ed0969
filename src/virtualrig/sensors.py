"""From true quantities to the log of the sensors: counts, currents and voltages."""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.signal import lfilter

from virtualrig.config import Encoder, LoadCell, Rig, Sensors, SlowNoise, TorqueSensor
from virtualrig.effects import TWINS, SideSensors
from virtualrig.effects.contract import Side
from virtualrig.trajectory import Trajectory

# Columns of a log in the order of the format, with decimals that keep rounding far below the noise.
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
    """A quantity is outside the range of its sensor."""


def log(trajectory: Trajectory, sensors: Sensors, rig: Rig, draw: Generator) -> dict[str, NDArray]:
    """Log of the sensors at both ends.

    Returns
    -------
    dict of str to ndarray, each of shape (samples,)
        The columns of a log by name.

    Raises
    ------
    SensorRangeError
        If a torque or a tension sum is outside the sensor's range.
    """
    drive, load = sensed_sides(trajectory, rig)
    return {
        "time_s": trajectory.time_s,
        "drive_encoder_counts": encode(drive.angle_rad, sensors.encoder, draw),
        "load_encoder_counts": encode(load.angle_rad, sensors.encoder, draw),
        "drive_current_A": current(drive.torque_Nm, sensors.torque, draw),
        "load_current_A": current(load.torque_Nm, sensors.torque, draw),
        "drive_load_cell_V": load_cell_voltage(drive.force_N, sensors.load_cell, draw),
        "load_load_cell_V": load_cell_voltage(load.force_N, sensors.load_cell, draw),
    }


def sensed_sides(trajectory: Trajectory, rig: Rig) -> tuple[Side, Side]:
    """What the sensors of the drive's and of the load's side read, without noise."""
    t = trajectory
    drive = sensed(t.time_s, Side(t.theta_in_rad, t.tau_in_Nm, t.T1_N + t.T3_N), rig, rig.effects.drive_sensors)
    load = sensed(t.time_s, Side(t.theta_out_rad, t.tau_out_Nm, t.T2_N + t.T4_N), rig, rig.effects.load_sensors)
    return drive, load


def sensed(time_s: NDArray, truth: Side, rig: Rig, faults: SideSensors) -> Side:
    """Quantities as one side's sensors read them, without noise; without faults the truth itself, bit for bit."""
    if faults == SideSensors():
        return truth
    reading = truth
    for read in filter(None, (twin.read for twin in TWINS.values())):
        reading = read(reading, truth, faults, time_s, rig.pulley_radius_m)
    return reading


def encode(angle_rad: NDArray, encoder: Encoder, draw: Generator) -> NDArray:
    """Counts of an incremental encoder whose zero is uniform within a revolution."""
    index = draw.uniform(-encoder.counts_per_rev / 2, encoder.counts_per_rev / 2)
    return np.floor(angle_rad * encoder.counts_per_rev / (2 * np.pi) + index).astype(int)


def current(torque_Nm: NDArray, sensor: TorqueSensor, draw: Generator) -> NDArray:
    """Measured current (A) of a torque (N m), with noise and a zero error uniform within the accuracy."""
    _check_range("torque", torque_Nm, sensor.range_Nm, "N m")
    zero_Nm = draw.uniform(-sensor.accuracy_Nm, sensor.accuracy_Nm)
    read_Nm = torque_Nm + zero_Nm + noise(torque_Nm.size, sensor.noise_Nm, sensor.slow_noise, draw)
    return read_Nm / sensor.constant_Nm_per_A


def load_cell_voltage(force_N: NDArray, cell: LoadCell, draw: Generator) -> NDArray:
    """Measured voltage (V) of a tension sum (N), with noise and a zero error uniform within the accuracy."""
    _check_range("tension sum", force_N, cell.range_N, "N")
    zero_N = draw.uniform(-cell.accuracy_N, cell.accuracy_N)
    read_N = force_N + zero_N + noise(force_N.size, cell.noise_N, cell.slow_noise, draw)
    return cell.zero_V + cell.sensitivity_V_per_N * read_N


def noise(samples: int, deviation: float, slow: SlowNoise | None, draw: Generator) -> NDArray:
    """White noise of a standard deviation, plus slow noise if given; shape (samples,), in the unit of `deviation`."""
    white = draw.normal(0, deviation, samples)
    if slow is None:
        return white
    keep = np.exp(-1 / slow.lasts_samples)
    kicks = draw.normal(0, slow.ratio * deviation, samples)
    # Scaled so that the process is stationary from the first sample on.
    kicks[1:] *= np.sqrt(1 - keep**2)
    return white + lfilter([1.0], [1.0, -keep], kicks)


def _check_range(name: str, values: NDArray, limit: float, unit: str) -> None:
    peak = np.abs(values).max()
    if peak > limit:
        raise SensorRangeError(f"{name} reaches {peak:.4g} {unit}, beyond the sensor's {limit:.4g} {unit}")
