import numpy as np
import pytest
from virtual_runs import changed

from virtualrig.sensors import SensorRangeError, current, encode, load_cell_voltage


@pytest.fixture
def draw():
    return np.random.default_rng(7)


def test_counts_step_once_an_encoder_step(campaign, draw):
    encoder = campaign.sensors.encoder
    step = 2 * np.pi / encoder.counts_per_rev
    angle = np.linspace(-1, 1, 20001)
    counts = encode(angle, encoder, draw)
    assert counts.dtype.kind == "i"
    read = (counts - counts[10000]) * step
    assert np.abs(read - angle).max() <= step
    assert encoder.accuracy_rad == pytest.approx(step, rel=1e-3)


def test_current_reads_back_as_torque(campaign, draw):
    sensor = campaign.sensors.torque
    torque = np.linspace(-0.09, 0.09, 20000)
    error = current(torque, sensor, draw) * sensor.constant_Nm_per_A - torque
    assert abs(error.mean()) <= sensor.accuracy_Nm * 1.05
    assert error.std() == pytest.approx(sensor.noise_Nm, rel=0.03)


def test_voltage_reads_back_as_force(campaign, draw):
    cell = campaign.sensors.load_cell
    force = np.linspace(0, 40, 20000)
    error = (load_cell_voltage(force, cell, draw) - cell.zero_V) / cell.sensitivity_V_per_N - force
    assert abs(error.mean()) <= cell.accuracy_N * 1.05
    assert error.std() == pytest.approx(cell.noise_N, rel=0.03)


def test_what_a_sensor_cannot_hold_is_refused(campaign, draw):
    with pytest.raises(SensorRangeError, match=r"torque reaches 0.2 N m, beyond the sensor's 0.1 N m"):
        current(np.array([0.0, -0.2]), campaign.sensors.torque, draw)
    with pytest.raises(SensorRangeError, match="tension sum"):
        load_cell_voltage(np.array([50.0]), campaign.sensors.load_cell, draw)


def test_unknown_keys_are_refused(campaign):
    broken = campaign.model_dump() | {"sede": 1}
    with pytest.raises(ValueError, match="sede"):
        type(campaign).model_validate(broken)
    assert changed(campaign, seed=3).seed == 3
