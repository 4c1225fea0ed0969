"""The place of a mismatch that no mechanism explains."""

from dataclasses import replace

import numpy as np
import pytest

from builders import recording
from ccmodel.deadline import Deadline
from ccmodel.diagnosis.comparison import Comparison
from ccmodel.diagnosis.discrepancy import Evidence
from ccmodel.diagnosis.location import PHASES, location, phases_of, prominent
from ccmodel.diagnosis.result import report
from ccmodel.diagnosis.verdict import Judgement
from ccmodel.diagnosis.whitening import whiten
from ccmodel.model.general.run import Active
from ccmodel.model.run import ModelInput
from made_observations import NOISE, PARAMETERS, batch, calibrated


def unexplained(recordings):
    base = calibrated(recordings)
    return Judgement("unexplained", base, Comparison(recordings, base, [], {}), [], [], [])


def located(recordings):
    found = unexplained(recordings)
    return location(found, found.calibrated)


def wave(simulated, channel):
    """A ripple of the drive angle, which no spring, cable or friction causes."""
    return {channel: 10 * NOISE[channel] * np.sin(25 * simulated["theta_in_rad"])}


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
def test_an_error_in_one_channel_is_located_at_its_sensor(channel, place):
    recordings = batch(lambda simulated: wave(simulated, channel))
    found = located(recordings)
    assert found["place"] == place
    assert found["channels"][0] == channel.rsplit("_", 1)[0]


def test_a_load_of_another_law_is_located_at_the_load():
    stiff = Active("load-stiffening", "load", {"K3": 0.1})
    recordings = batch(truth=replace(PARAMETERS, mechanisms=(stiff,)))
    assert located(recordings)["place"] == "load"


def test_errors_at_both_ends_are_located_between_them():
    def ripples(simulated):
        return {c: wave(simulated, c)[c] for c in ("tau_in_Nm", "tau_out_Nm", "theta_out_rad")}

    recordings = batch(
        lambda simulated: (
            wave(simulated, "tau_in_Nm") | wave(simulated, "tau_out_Nm") | wave(simulated, "theta_out_rad")
        )
    )
    assert located(recordings)["place"] == "conduit"


def test_a_place_that_there_was_no_time_to_isolate_is_said():
    recordings = batch(lambda simulated: wave(simulated, "tau_in_Nm"))
    found = unexplained(recordings)
    past = Evidence(-500.0, -500.0, -10.0, {"tau_in_Nm": -500.0}, 0.0, 0.01)
    found = replace(found, comparison=replace(found.comparison, evidence={found.calibrated.hypothesis: past}))
    said = report("b", found, found.calibrated, PARAMETERS, [], deadline=Deadline(at_s=0.0))
    assert said["location"]["place"] == "conduit"
    assert (said["location"]["is_found"], said["location"]["places"]) == (False, [])
    assert said["location"]["text"].startswith("The place was not looked for: a limit was reached before.")
    assert said["not_judged"][0]["what"] == "the place of the mismatch"
    in_time = report("b", found, found.calibrated, PARAMETERS, [])
    assert in_time["location"]["place"] == "drive-pulley"
    assert in_time["location"]["is_found"]
    assert not in_time["not_judged"]


def test_a_single_channel_gives_a_place():
    one = [only(w.observations, "tau_in_Nm") for w in batch(lambda simulated: wave(simulated, "tau_in_Nm"))]
    recordings = [whiten(e, PARAMETERS) for e in one]
    found = located(recordings)
    assert (found["place"], found["channels"]) == ("drive-pulley", ["tau_in"])


def only(observations, channel):
    for other in set(observations.channels) - {channel}:
        observations = observations.without(other)
    return observations


def test_noise_makes_no_channel_prominent():
    """The angle is off by twice its noise; a channel at 1.15 times its noise is not named with it."""
    square = {"theta_out": 2.1**2, "tau_in": 1.15**2, "tau_out": 1.3**2, "F_drive": 0.9**2}
    assert prominent(square, 0.35) == ["theta_out", "tau_out"]
    assert prominent({"theta_out": 0.9, "tau_in": 0.8}, 0.35) == ["theta_out"]


def test_phases_of_a_rest_and_a_triangle_by_hand():
    """Rest of 1 s, up by 1 rad, down by 1 rad; the neighbourhood of a reversal is a quarter of the stroke."""
    time_s = np.arange(0.0, 5.0, 0.01)
    theta = np.interp(time_s, [0.0, 1.0, 3.0, 5.0], [0.0, 0.0, 1.0, 0.0])
    phase = phases_of(ModelInput.prescribed(recording(), time_s, theta, 5.0))

    def at(second):
        return PHASES[phase[round(100 * second)]]

    assert {at(second) for second in (0.1, 0.5, 0.9)} == {"at rest"}
    assert {at(second) for second in (1.1, 1.4, 3.1, 3.4)} == {"after a reversal"}
    assert {at(second) for second in (1.6, 2.9, 3.6, 4.9)} == {"under way"}
