"""A late side: a constant delay, a filter, or both."""

import numpy as np
import pytest

from builders import recording
from ccmodel.mechanisms.contract import Sensing
from ccmodel.mechanisms.delayed import before_filter, through_filter
from ccmodel.model.active import Active
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import ModelInput, simulate

PARAMETERS = Parameters(9000.0, 1.2, 0.15, 0.006, 0.006, 0.05)
LOAD = ("theta_out_rad", "tau_out_Nm", "F_load_N")
DRIVE = ("tau_in_Nm", "F_drive_N")
UNEVEN = np.cumsum(np.random.default_rng(1).uniform(0.5e-3, 1.5e-3, 4000))


def sensing(time_s, values):
    return Sensing(time_s, dict.fromkeys(("theta_in_rad", *LOAD, *DRIVE), values), 0.006, 0.006)


def skewed(place, delay, filtered):
    mechanisms = (Active("time-skew", place, {"delay": delay, "filtered": filtered}),)
    return Parameters(**vars(PARAMETERS) | {"mechanisms": mechanisms})


@pytest.mark.parametrize(("place", "changed"), [("drive-sensor", ("theta_in_rad", *DRIVE)), ("load-sensor", LOAD)])
def test_a_filter_passes_on_what_its_equation_says(place, changed):
    """1 / sqrt(1 + (w T)^2) of a sine, late by atan(w T) / w, at times that are not even."""
    T, w = 0.03, 20.0
    found = through_filter(sensing(UNEVEN, np.sin(w * UNEVEN)), place, T)
    assert found.keys() == set(changed)
    settled = UNEVEN > 10 * T
    wanted = np.sin(w * UNEVEN - np.arctan(w * T)) / np.hypot(1, w * T)
    assert found[changed[0]][settled] == pytest.approx(wanted[settled], abs=2e-4)
    assert found[changed[0]][0] == np.sin(w * UNEVEN[0])


def test_a_filter_without_a_time_constant_changes_nothing():
    values = np.sin(UNEVEN)
    assert through_filter(sensing(UNEVEN, values), "load-sensor", 0.0) == {}
    assert before_filter(values, UNEVEN, 0.0) is values
    assert before_filter(values[:1], UNEVEN[:1], 0.1) == values[:1]


def test_what_a_filter_was_given_follows_from_what_it_passed_on():
    values = np.sin(20 * UNEVEN)
    passed = through_filter(sensing(UNEVEN, values), "load-sensor", 0.03)["tau_out_Nm"]
    assert before_filter(passed, UNEVEN, 0.03)[5:-5] == pytest.approx(values[5:-5], abs=2e-3)


@pytest.mark.parametrize("filtered", [0.0, 0.4, 1.0])
def test_a_late_side_is_one_or_the_other_against_the_true_motion(filtered):
    """What the sensors of a late side read of a known motion, from a model that is given the readings alone."""
    time_s, T = np.linspace(0.0, 4.0, 2001), 0.03
    motion = 0.3 * np.sin(3.0 * time_s) ** 3
    like = recording()
    true = simulate(ModelInput.prescribed(like, time_s, motion, 7.0), PARAMETERS)

    def shown(values):
        late = np.interp(time_s - (1 - filtered) * T, time_s, values)
        return through_filter(sensing(time_s, late), "load-sensor", filtered * T).get("tau_out_Nm", late)

    late_load = simulate(ModelInput.prescribed(like, time_s, motion, 7.0), skewed("load-sensor", T, filtered))
    on_late_clock = ModelInput.prescribed(like, time_s, shown(motion), 7.0)
    late_drive = simulate(on_late_clock, skewed("drive-sensor", T, filtered))
    ignored = simulate(on_late_clock, PARAMETERS)
    inside = slice(100, -100)
    for channel in (*LOAD, *DRIVE):
        span, by_load, by_drive = np.ptp(true[channel]), shown(true[channel]), true[channel]
        if channel in DRIVE:
            by_load, by_drive = true[channel], shown(true[channel])
        assert late_load[channel][inside] == pytest.approx(by_load[inside], abs=2e-3 * span), channel
        assert late_drive[channel][inside] == pytest.approx(by_drive[inside], abs=4e-3 * span), channel
        if channel in LOAD:
            assert np.abs(ignored[channel] - true[channel])[inside].max() > 0.02 * span, channel
