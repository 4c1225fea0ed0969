import numpy as np
import pytest
from virtual_runs import changed

from virtualrig.config import SlowNoise
from virtualrig.effects import SideSensors
from virtualrig.sensors import SensorRangeError, Side, current, encode, load_cell_voltage, noise, sensed


@pytest.fixture
def draw():
    return np.random.default_rng(7)


def test_counts_have_the_encoders_resolution(campaign, draw):
    encoder = campaign.sensors.encoder
    step = 2 * np.pi / encoder.counts_per_rev
    angle = np.linspace(-1, 1, 20001)
    counts = encode(angle, encoder, draw)
    assert counts.dtype.kind == "i"
    read = (counts - counts[10000]) * step
    assert np.abs(read - angle).max() <= step
    assert encoder.accuracy_rad == pytest.approx(step, rel=1e-3)


def test_current_is_proportional_to_torque(campaign, draw):
    sensor = campaign.sensors.torque
    torque = np.linspace(-0.09, 0.09, 20000)
    error = current(torque, sensor, draw) * sensor.constant_Nm_per_A - torque
    assert abs(error.mean()) <= sensor.accuracy_Nm * 1.05
    assert error.std() == pytest.approx(sensor.noise_Nm, rel=0.03)


def test_voltage_is_proportional_to_force(campaign, draw):
    cell = campaign.sensors.load_cell
    force = np.linspace(0, 40, 20000)
    error = (load_cell_voltage(force, cell, draw) - cell.zero_V) / cell.sensitivity_V_per_N - force
    assert abs(error.mean()) <= cell.accuracy_N * 1.05
    assert error.std() == pytest.approx(cell.noise_N, rel=0.03)


def test_a_quantity_outside_the_sensors_range_is_refused(campaign, draw):
    with pytest.raises(SensorRangeError, match=r"torque reaches 0.2 N m, beyond the sensor's 0.1 N m"):
        current(np.array([0.0, -0.2]), campaign.sensors.torque, draw)
    with pytest.raises(SensorRangeError, match="tension sum"):
        load_cell_voltage(np.array([50.0]), campaign.sensors.load_cell, draw)


def test_unknown_keys_are_refused(campaign):
    broken = campaign.model_dump() | {"sede": 1}
    with pytest.raises(ValueError, match="sede"):
        type(campaign).model_validate(broken)
    assert changed(campaign, seed=3).seed == 3


def test_slow_noise_is_correlated_and_white_noise_is_not(draw):
    slow = SlowNoise(ratio=2.0, lasts_samples=50.0)
    made = noise(200_000, 0.5, slow, draw)
    assert made.std() == pytest.approx(0.5 * np.sqrt(5), rel=0.05)
    lagged = np.mean(made[50:] * made[:-50]) / np.mean(made**2)
    assert lagged == pytest.approx(0.8 / np.e, abs=0.05)
    white = noise(200_000, 0.5, None, draw)
    assert abs(np.mean(white[50:] * white[:-50])) < 0.01


def test_a_sensor_without_slow_noise_draws_white_noise_only():
    plain, with_it = (np.random.default_rng(3) for _ in range(2))
    assert noise(5, 1.0, None, plain).tolist() == with_it.normal(0, 1.0, 5).tolist()
    assert plain.random() == with_it.random()


def test_encoder_runout_and_torque_curvature(campaign):
    t, angle, torque = np.linspace(0, 1, 50), np.linspace(-1, 1, 50), np.linspace(-0.1, 0.1, 50)
    faults = SideSensors(angle_runout_rad=0.02, angle_runout_phase_rad=0.5, torque_curvature_per_Nm2=10.0)
    shown = sensed(t, Side(angle, torque, np.ones(50)), campaign.rig, faults)
    np.testing.assert_allclose(shown.angle_rad, angle + 0.02 * np.sin(angle + 0.5))
    np.testing.assert_allclose(shown.torque_Nm, torque + 10 * torque**3)
    np.testing.assert_array_equal(shown.force_N, 1.0)
