import json

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_up_batch import COUNTS, KT, SENSITIVITY, ZERO, R, description

from ccmodel.rig.batch import Batch
from ccmodel.rig.calibration import calibrate

STEP = 2 * np.pi / COUNTS


def rig(**drive):
    described = description()
    described["rig"]["drive"] |= drive
    return Batch.model_validate_json(json.dumps(described)).rig


def log(drive, load=None, dt=0.01, **columns):
    n = len(drive)
    data = {"time_s": dt * np.arange(n), "drive_encoder_counts": np.asarray(drive, float)}
    if load is not None:
        data["load_encoder_counts"] = np.asarray(load, float)
    return pd.DataFrame(data | {name: np.asarray(values, float) for name, values in columns.items()})


def test_formulas_by_hand():
    result = calibrate(
        log(
            [5, 15],
            [-3, 5],
            drive_current_A=[0.0, 1.0],
            load_current_A=[0.0, 0.5],
            drive_load_cell_V=[0.95, 1.25],
            load_load_cell_V=[0.85, 0.95],
        ),
        rig(),
    )
    channels = {name: values[1] for name, values in result.channels.items()}
    assert channels == pytest.approx(
        {
            "theta_in_rad": 10 * np.pi / 1000,
            "theta_out_rad": 8 * np.pi / 1000,
            "tau_in_Nm": 0.0234,
            "tau_out_Nm": 0.0117,
            "F_drive_N": 10.0,
            "F_load_N": 7.0,
            # (10 ± 0.0234 / 0.006) / 2 and (7 ± 0.0117 / 0.006) / 2
            "T1_N": 6.95,
            "T3_N": 3.05,
            "T2_N": 4.475,
            "T4_N": 2.525,
        }
    )
    assert result.accuracy["T1_N"] == pytest.approx(np.hypot(0.1, 0.0001 / 0.006) / 2)
    assert result.derived_from["T3_N"] == "(F_drive_N - tau_in_Nm / 0.006 m) / 2"
    assert result.derived_from["F_drive_N"] == "(drive_load_cell_V - 0.25 V) / 0.1 V/N"
    assert set(result.derived_from) == set(result.accuracy) == set(result.channels)


def test_signs_torque_sensor_and_own_accuracy():
    side = rig(
        encoder_sign=-1,
        torque_sign=-1,
        encoder_accuracy_rad=0.001,
        torque_sensor={"Nm_per_count": 4e-5, "zero_counts": 100},
    )
    result = calibrate(log([0, 10], drive_torque_counts=[100, 600], drive_current_A=[9, 9]), side)
    assert result.channels["theta_in_rad"][1] == pytest.approx(-10 * STEP)
    assert result.channels["tau_in_Nm"] == pytest.approx([0.0, -0.02])
    assert result.accuracy["theta_in_rad"] == 0.001
    assert "theta_out_rad" not in result.channels
    assert not {"T1_N", "T3_N"} & set(result.channels)


@pytest.mark.parametrize(
    ("drive", "load", "rest_s"),
    [
        ([7] * 40 + list(range(8, 28)), [0] * 60, 0.39),
        # Dither of one count is rest, and the mean of it is zero.
        ([7, 8] * 20 + list(range(9, 29)), [0] * 60, 0.38),
        # The first count of the motion is not rest, however long it takes to the second.
        ([7] * 40 + [8] * 10 + list(range(9, 19)), [0] * 60, 0.39),
        ([7] * 9 + list(range(8, 59)), [0] * 60, 0.0),
        ([7] * 40 + list(range(8, 28)), list(range(60)), 0.0),
    ],
)
def test_rest(drive, load, rest_s):
    result = calibrate(log(drive, load), rig())
    assert result.rest_s == pytest.approx(rest_s)
    theta = result.channels["theta_in_rad"]
    resting = np.arange(60) * 0.01 <= rest_s + 1e-9
    assert theta[resting].mean() == pytest.approx(0, abs=STEP / 20)
    assert abs(theta[resting]).max() <= STEP


def test_a_rest_is_as_long_on_a_clock_that_does_not_begin_at_zero():
    for still, rest_s in ((9, 0.0), (40, 100.39)):
        table = log([7] * still + list(range(8, 68 - still)), [0] * 60)
        assert calibrate(table.assign(time_s=table.time_s + 100.0), rig()).rest_s == pytest.approx(rest_s)


def test_the_motors_angle_is_zero_at_the_mean_of_its_rest():
    table = log([7] * 40 + list(range(8, 28)), motor_encoder_counts=[100, 104] * 20 + [102 + 10 * k for k in range(20)])
    motor = calibrate(table, rig(motor_counts_per_rev=1000)).channels["theta_motor_rad"]
    # About 102 counts: 2 counts of 1000 to either side, and 190 at the end.
    assert motor[[0, 1, -1]] == pytest.approx(2 * np.pi * np.array([-0.002, 0.002, 0.19]))


@given(
    theta=st.lists(st.floats(-10, 10), min_size=2, max_size=20),
    tension_1=st.lists(st.floats(0, 50), min_size=20, max_size=20),
    tension_3=st.lists(st.floats(0, 50), min_size=20, max_size=20),
    sign=st.sampled_from([1, -1]),
)
def test_calibration_inverts_the_sensors_within_their_resolution(theta, tension_1, tension_3, sign):
    theta, t1, t3 = (np.array(x[: len(theta)]) for x in (theta, tension_1, tension_3))
    counts = np.round(sign * theta / STEP)
    current = (sign * (t1 - t3) * R / KT).round(5)
    volts = ((t1 + t3) * SENSITIVITY + ZERO).round(5)
    result = calibrate(
        log(counts, drive_current_A=current, drive_load_cell_V=volts), rig(encoder_sign=sign, torque_sign=sign)
    )
    assert np.abs(result.channels["theta_in_rad"] - (theta - theta[0])).max() <= STEP * 1.001
    # Half of what rounding leaves of the sum, and of the torque over the radius.
    quantum = 0.5e-5 / SENSITIVITY / 2 + 0.5e-5 * KT / R / 2
    assert np.abs(result.channels["T1_N"] - t1).max() <= 1.01 * quantum
    assert np.abs(result.channels["T3_N"] - t3).max() <= 1.01 * quantum
