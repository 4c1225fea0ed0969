"""Which recordings of a large batch a diagnosis compares."""

from collections import Counter

import numpy as np
import pytest

import made_observations
from builders import recording
from ccmodel.diagnosis import observations as stage
from ccmodel.diagnosis.observations import observations_of, spread_over_conditions
from ccmodel.failure import ModelError


def batch(counts):
    """Recordings named by their condition and number, in turns, with so many of each pretension."""
    return [
        recording(id=f"{tension:g}N-{k}", pretension_N=tension)
        for k in range(max(counts.values()))
        for tension, count in counts.items()
        if k < count
    ]


def chosen(counts, most):
    return [r.id for r in spread_over_conditions(batch(counts), most)]


def test_a_small_batch_is_compared_whole():
    assert chosen({7.0: 2, 5.0: 1}, 3) == ["7N-0", "5N-0", "7N-1"]


@pytest.mark.parametrize(
    ("counts", "most", "share"),
    [
        ({7.0: 10, 5.0: 10}, 8, {"7N": 4, "5N": 4}),
        ({7.0: 30, 5.0: 2, 3.0: 1}, 9, {"7N": 6, "5N": 2, "3N": 1}),
        ({7.0: 5, 5.0: 5, 3.0: 5}, 4, {"7N": 2, "5N": 1, "3N": 1}),
    ],
)
def test_of_a_large_one_each_condition_has_an_equal_number(counts, most, share):
    found = chosen(counts, most)
    assert len(set(found)) == most
    assert Counter(one.split("-")[0] for one in found) == share


def test_of_more_conditions_than_are_compared_some_are_taken_over_the_whole_sequence():
    assert chosen({float(tension): 1 for tension in range(1, 10)}, 3) == ["1N-0", "5N-0", "9N-0"]


def test_recordings_of_a_condition_are_taken_over_the_whole_sequence():
    found = [int(one.split("-")[1]) for one in chosen({7.0: 101}, 5)]
    assert found == [0, 25, 50, 75, 100]


def test_no_recording_that_can_be_compared_is_an_error_with_the_last_reason():
    drive_alone = recording(theta_in_rad=np.sin)
    with pytest.raises(ModelError, match="none of the recordings can be compared with the model: .*b/r"):
        observations_of([drive_alone], made_observations.PARAMETERS)


def test_what_is_left_out_is_said(monkeypatch):
    monkeypatch.setattr(stage.settings, "MOST_RECORDINGS", 2)
    recordings = [w.observations.given.recording for w in made_observations.batch()]
    observations, not_judged = observations_of(recordings, made_observations.PARAMETERS)
    # The first two have one pretension, and no motion is stated: of three conditions, the first and the last.
    assert [o.given.recording.id for o in observations] == ["r0", "r3"]
    assert not_judged[0]["what"] == "2 of 4 recordings"
    assert "at most 2" in not_judged[0]["why"]
