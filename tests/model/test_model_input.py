from dataclasses import replace

import numpy as np
import pytest

from builders import recording
from ccmodel.model import sensors
from ccmodel.model.general import Active
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import ModelInput, simulate


def test_the_drive_motion_comes_with_likely_deviations():
    step = np.pi / 1000
    counted = replace(
        recording(theta_in_rad=lambda t: np.floor(np.sin(2 * np.pi * t) / step) * step),
        encoder_step_rad={"theta_in_rad": step},
    )
    whole, some = ModelInput.of(counted), ModelInput.of(counted, step_s=0.02)
    assert some.theta_in == pytest.approx(whole.theta_in[::2], abs=0)
    assert some.drive_deviations == pytest.approx(whole.drive_deviations[:, ::2], abs=0)
    assert 0 < np.sqrt(np.mean(some.drive_deviations**2)) < step


def test_where_the_drive_rests_shifts_all_that_follows():
    step, t = np.pi / 1000, np.arange(0, 3 + 1e-9, 0.01)
    moving = 0.3 * (1 - np.cos(np.pi * np.clip(t - 0.5, 0, None)))
    counted = replace(
        recording(theta_in_rad=lambda _: np.floor(moving / step + 0.3) * step),
        encoder_step_rad={"theta_in_rad": step},
        rest_s=0.5,
    )
    given = ModelInput.of(counted)
    parameters = Parameters(7750.0, 1.2, 0.156, 0.006, 0.006, load_stiffness_Nm_per_rad=0.05, pretension_N=7.0)
    shift = simulate(given, replace(parameters, drive_encoder_offset=2.0))["theta_in_rad"] - given.theta_in
    assert shift == pytest.approx(2 * given.drive_encoder_offset)
    assert shift[t < 0.4] == pytest.approx(0, abs=1e-3 * step)
    later = given.drive_encoder_offset[t > 1]
    assert later == pytest.approx(later[0], rel=0.02)
    assert 0 < abs(later[0]) < step / np.sqrt(12) * 1.01
    # Once that is known, less is unknown.
    assert (given.deviations_given_offset**2).mean() < (given.drive_deviations**2).mean()


def test_a_drive_that_was_not_counted_is_taken_as_it_is():
    given = ModelInput.of(recording())
    assert given.drive_deviations.shape[0] == 0
    assert (given.theta_in == given.recording["theta_in_rad"]).all()


def test_the_rest_ends_when_the_drive_moves_not_when_its_count_does():
    step, t = np.pi / 1000, np.arange(0, 3 + 1e-9, 0.01)
    moving = 0.3 * (1 - np.cos(np.pi * np.clip(t - 0.5, 0, None)))
    counts = np.floor(moving / step + 0.5)
    first_count = t[np.argmax(counts != counts[0])]
    counted = replace(
        recording(theta_in_rad=lambda _: counts * step, tau_in_Nm=lambda _: 0.6 * moving),
        encoder_step_rad={"theta_in_rad": step},
        rest_s=float(first_count),
    )
    given = ModelInput.of(counted)
    assert given.resting["tau_in_Nm"].size < first_count / 0.01
    assert np.ptp(given.resting["tau_in_Nm"]) < 0.1 * 0.6 * step


FAULTS = [
    ("load-cell-scale", {"gain": 0.05}),
    ("load-cell-offset", {"offset": 1.0}),
    ("load-cell-drift", {"rate": 0.2}),
]


@pytest.mark.parametrize("place", ["drive-sensor", "load-sensor"])
@pytest.mark.parametrize(("name", "values"), FAULTS)
def test_tensions_at_rest_are_the_true_ones_whatever_is_wrong_with_a_load_cell(name, values, place):
    """A model with a faulty sensor, given its own readings at rest, reproduces its own recording."""
    pull = recording(theta_in_rad=lambda t: 0.4 * np.sin(2 * np.pi * np.clip(t - 0.3, 0, None)))
    rig = Parameters(
        7750.0, 1.2, 0.156, 0.006, 0.006, load_stiffness_Nm_per_rad=0.05, pretension_N=7.0,
        mechanisms=(Active(name, place, values),),
    )  # fmt: skip
    recorded = replace(simulate(ModelInput.of(pull), rig), origin="virtual-rig", rest_s=0.3)
    again = simulate(ModelInput.of(recorded), replace(rig, pretension_N=None))
    for channel in ("theta_out_rad", "tau_in_Nm", "tau_out_Nm", "F_drive_N", "F_load_N"):
        assert again[channel] == pytest.approx(recorded[channel], abs=1e-3 * np.ptp(recorded[channel])), channel


@pytest.mark.parametrize(
    "faults",
    [
        [("load-cell-crosstalk", "drive-sensor", {"crosstalk": 0.1})],
        [("torque-scale", "load-sensor", {"gain": -0.3})],
        [("time-skew", "load-sensor", {"delay": 0.01})],
        [("torque-scale", "drive-sensor", {"gain": 0.1}), ("load-cell-crosstalk", "drive-sensor", {"crosstalk": 0.1})],
        [("load-cell-drift", "load-sensor", {"rate": 0.2}), ("load-cell-scale", "load-sensor", {"gain": 0.1})],
    ],
)
def test_what_sensors_would_have_read_without_their_faults(faults):
    active = [Active(*fault) for fault in faults]
    true = {"theta_in_rad": 0.0, "theta_out_rad": 0.0, "tau_in_Nm": 0.02, "tau_out_Nm": -0.01}
    true |= {"F_drive_N": 14.0, "F_load_N": 12.0}
    radii = 0.006, 0.005
    steady = {c: np.full(2, value) for c, value in true.items()}
    read = {c: float(v[1]) for c, v in sensors.read_by_sensors(active, np.array([0.0, 0.4]), steady, radii).items()}
    assert (read != true) == (faults[0][0] != "time-skew")
    assert sensors.true_at(active, 0.4, read, radii) == pytest.approx(true, rel=1e-4)
