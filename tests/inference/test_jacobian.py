"""Derivatives of model runs: against closed forms, and against differences of the fourth order."""

from dataclasses import replace

import numpy as np
import pytest

from builders import recording
from ccmodel.geometry import ConduitPath
from ccmodel.inference.jacobian import STEP, jacobian, size_of
from ccmodel.model.general.run import Active
from ccmodel.model.run import ModelInput, simulate
from model_runs import PULLED

PRESLIDING = Active("presliding", "conduit", {"z0": 3e-5})
CHANNELS = ("T1_N", "T2_N", "T3_N", "T4_N", "theta_out_rad", "tau_in_Nm")


@pytest.fixture
def given():
    r = recording(id="sine", theta_in_rad=lambda t: 0.6 * np.sin(2 * np.pi * t))
    return ModelInput.of(r)


def sensitivities(given, parameters, names):
    """Derivatives of all channels by some parameters: by parameter, then channel."""
    x = np.array([parameters.value_of(name) for name in names])
    steps = np.array([STEP * size_of(name, value) for name, value in zip(names, x, strict=True)])

    def run(at):
        channels = simulate(given, parameters.with_values(dict(zip(names, at, strict=True)))).channels
        return np.stack(list(channels.values()))

    found = jacobian(run, x, steps, run(x))
    channels = list(simulate(given, parameters).channels)
    return {name: dict(zip(channels, found[..., k], strict=True)) for k, name in enumerate(names)}


def careful(given, parameters, name, step=2e-4):
    """Two central differences, extrapolated: an error of the fourth order."""

    def difference(h):
        p = parameters.value_of(name)
        up, down = (simulate(given, parameters.with_values({name: p * (1 + s * h)})) for s in (1, -1))
        return {c: (up[c] - down[c]) / (2 * h * p) for c in CHANNELS}

    fine, coarse = difference(step / 2), difference(step)
    return {c: (4 * fine[c] - coarse[c]) / 3 for c in CHANNELS}


@pytest.mark.parametrize(
    "mechanisms, names",
    [
        ((), ("stiffness_N_per_m", "friction_coefficient", "load_stiffness_Nm_per_rad", "pretension_N")),
        ((PRESLIDING,), ("stiffness_N_per_m", "friction_coefficient", "presliding/conduit/z0")),
    ],
)
def test_right_to_a_ten_thousandth(given, mechanisms, names):
    parameters = replace(PULLED, mechanisms=mechanisms)
    found = sensitivities(given, parameters, names)
    for name in names:
        expected = careful(given, parameters, name)
        for channel in CHANNELS:
            error = found[name][channel] - expected[channel]
            assert np.sqrt(np.mean(error**2)) <= 1e-4 * np.sqrt(np.mean(expected[channel] ** 2)), (name, channel)


def test_a_zero_of_the_torque_sensor_adds_itself(given):
    found = sensitivities(given, PULLED, ["tau_in_zero_Nm"])["tau_in_zero_Nm"]
    assert found["tau_in_Nm"] == pytest.approx(1.0, rel=1e-6)
    assert found["T1_N"] == pytest.approx(0.5 / 0.006, rel=1e-6)
    assert (found["F_drive_N"] == 0).all()


def test_full_slip_answers_to_friction_as_the_capstan_does():
    """Pulled on and on against a spring both cables slip: ln(T1/T2) = mu phi, so its derivative by mu is phi."""
    path = ConduitPath([1.2], [np.pi])
    ramp = recording(duration=1.0, theta_in_rad=lambda t: 2.0 * t)
    found = sensitivities(ModelInput.of(ramp), PULLED, ["friction_coefficient"])["friction_coefficient"]
    said = simulate(ModelInput.of(ramp), PULLED)
    slope = found["T1_N"] / said["T1_N"] - found["T2_N"] / said["T2_N"]
    assert slope[-1] == pytest.approx(path.bend_rad, rel=1e-4)


def test_a_number_of_a_mechanism_that_does_not_act_is_refused(given):
    with pytest.raises(ValueError, match="no z0 of presliding"):
        PULLED.with_values({"presliding/conduit/z0": 1e-5})


def test_a_value_that_is_all_but_zero_has_the_size_of_its_range():
    """A share of 1e-12 may as well be zero, where a step of 1e-17 would be lost in rounding."""
    share = "pulley-friction/load-pulley/share"
    assert size_of(share, 1e-12) == size_of(share, 0.0) == pytest.approx(0.1)
    assert size_of(share, 0.7) == 0.7
    assert size_of("pulley-friction/load-pulley/friction_torque", 1e-4) == 1e-4
