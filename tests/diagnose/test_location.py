"""The place of a mismatch that no mechanism accounts for."""

from dataclasses import replace

import numpy as np
import pytest

from ccmodel.diagnose.comparison import Judgement
from ccmodel.diagnose.location import _sticking_out, location
from ccmodel.diagnose.whitening import weigh
from ccmodel.model.general.run import Active
from made_observations import NOISE, PARAMETERS, batch, calibrated


def wave(said, channel):
    """What no spring, cable or friction does: a ripple of the drive angle."""
    return {channel: 10 * NOISE[channel] * np.sin(25 * said["theta_in_rad"])}


@pytest.mark.parametrize(
    "channel, place",
    [
        ("theta_out_rad", "load-sensor"),
        ("tau_in_Nm", "drive-pulley"),
        ("tau_out_Nm", "load-sensor"),
        ("F_drive_N", "drive-sensor"),
        ("F_load_N", "load-sensor"),
    ],
)
def test_a_channel_that_is_off_alone_gives_its_place_away(channel, place):
    recordings = batch(lambda said: wave(said, channel))
    base = calibrated(recordings)
    found = location(Judgement("unexplained", base, base, [], [], 1.0, [], {}, recordings))
    assert found["place"] == place
    assert found["channels"][0] == channel.rsplit("_", 1)[0]


def test_a_load_of_another_law_leaves_cables_right_that_are_driven_by_its_torque():
    stiff = Active("load-stiffening", "load", {"K3": 0.1})
    recordings = batch(truth=replace(PARAMETERS, mechanisms=(stiff,)))
    base = calibrated(recordings)
    assert location(Judgement("unexplained", base, base, [], [], 1.0, [], {}, recordings))["place"] == "load"


def test_a_ripple_of_both_torques_sits_in_between():
    recordings = batch(lambda said: wave(said, "tau_in_Nm") | wave(said, "tau_out_Nm") | wave(said, "theta_out_rad"))
    base = calibrated(recordings)
    assert location(Judgement("unexplained", base, base, [], [], 1.0, [], {}, recordings))["place"] == "conduit"


def test_the_only_channel_there_is_gives_a_place_all_the_same():
    one = [only(w.observations, "tau_in_Nm") for w in batch(lambda said: wave(said, "tau_in_Nm"))]
    recordings = [weigh(e, PARAMETERS) for e in one]
    base = calibrated(recordings)
    found = location(Judgement("unexplained", base, base, [], [], 1.0, [], {}, recordings))
    assert (found["place"], found["channels"]) == ("drive-pulley", ["tau_in"])


def only(observations, channel):
    for other in set(observations.channels) - {channel}:
        observations = observations.without(other)
    return observations


def test_what_noise_leaves_anyway_makes_no_channel_stick_out():
    """Beside an angle that is off by twice its noise, channels at 1.2 times theirs are as good as right."""
    square = {"theta_out": 2.1**2, "tau_in": 1.15**2, "tau_out": 1.3**2, "F_drive": 0.9**2}
    assert _sticking_out(square, 0.35) == ["theta_out", "tau_out"]
    assert _sticking_out({"theta_out": 0.9, "tau_in": 0.8}, 0.35) == ["theta_out"]
