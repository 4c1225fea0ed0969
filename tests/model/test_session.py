"""A recording within its session: drift by its time or place, and states that follow from stated times."""

from dataclasses import replace

import numpy as np
import pytest

from builders import recording
from ccmodel.mechanisms.relaxation import relaxed_after
from ccmodel.model.files import Model, RigConditions, model_as_dict
from ccmodel.model.general import Active
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import ModelInput, simulate
from ccmodel.model.session import known_states, of_recording, position_of, with_session
from ccmodel.recording import in_order, read_recordings, write_recordings

PARAMETERS = Parameters(9000.0, 1.2, 0.15, 0.006, 0.006, 0.05)
FRICTION = Active("friction-drift", "conduit", {"change": 0.2})
STIFFNESS = Active("stiffness-drift", "cable", {"change": -0.1})
ZERO = Active("zero-drift", "load-sensor", {"change": 0.6})
RELAXATION = Active("relaxation", "cable", {"r": 0.1, "tau": 20.0, "relaxed": 0.5})


def started(*minutes):
    return [replace(recording(id=f"r{k}"), started_at_s=60.0 * m) for k, m in enumerate(minutes)]


def test_without_times_a_recordings_place_is_its_order():
    assert [r.position for r in in_order([recording()] * 5)] == [-0.5, -0.25, 0.0, 0.25, 0.5]
    assert in_order([recording()])[0].position == 0.0
    assert in_order([]) == []
    assert recording().position == 0.0


def test_batches_that_are_taken_together_are_a_session_each():
    """Which of them was recorded first is not known, and no drift goes on from one to the next."""
    joint = [recording(id=name) for name in ("a/1", "a/2", "b/1", "b/2", "b/3", "c/1")]
    assert [r.position for r in in_order(joint)] == [-0.5, 0.5, -0.5, 0.0, 0.5, 0.0]


def test_a_drift_moves_only_recordings_of_the_session_that_the_model_was_fitted_to():
    fitted = in_order([recording(id=f"r{k}") for k in range(2)])
    drifting = replace(PARAMETERS, mechanisms=(FRICTION,))
    model = Model(drifting, RigConditions.of(fitted))
    later = in_order([recording(id=name) for name in ("later-1", "later-2")])
    placed = model.placed([*fitted, *later])
    frictions = [of_recording(drifting, r).friction for r in placed]
    assert frictions == pytest.approx([0.9 * 0.15, 1.1 * 0.15, 0.15, 0.15])
    joint = Model(drifting, RigConditions.of([replace(r, batch="a + b", id=f"{r.batch}/{r.id}") for r in fitted]))
    assert [r.position for r in joint.placed([*fitted, *later])] == [-0.5, 0.5, 0.0, 0.0]
    session = with_session(drifting, started(0, 60))
    timed = replace(model, parameters=session)
    (hour_later,) = timed.placed(started(90))
    assert position_of(hour_later, session) == 1.0


def test_with_times_it_is_the_elapsed_time_and_goes_on_after_the_session():
    every = in_order(started(0, 10, 40))
    session = with_session(PARAMETERS, every)
    assert [position_of(r, session) for r in every] == pytest.approx([-0.5, -0.25, 0.5])
    later = started(50, 500)
    assert [position_of(r, session) for r in later] == pytest.approx([0.75, 1.0])
    assert position_of(recording(), session) == 0.0


def test_one_recording_without_a_time_leaves_the_order():
    every = in_order([*started(0, 10), recording()])
    assert with_session(PARAMETERS, every).session_start_s is None
    assert [position_of(r, with_session(PARAMETERS, every)) for r in every] == [-0.5, 0.0, 0.5]


@pytest.mark.parametrize(
    ("active", "name", "factor"),
    [(FRICTION, "friction_coefficient", 1.1), (STIFFNESS, "stiffness_N_per_m", 0.95)],
)
def test_a_drift_is_another_value_of_the_parameter(active, name, factor):
    """Bit for bit: the drifted model is the paper's with that value, on the paper's solver."""
    last = replace(recording(), position=0.5)
    given = ModelInput.of(last)
    drifted = simulate(given, replace(PARAMETERS, mechanisms=(active,)))
    plain = simulate(given, replace(PARAMETERS, **{name: factor * getattr(PARAMETERS, name)}))
    middle = simulate(ModelInput.of(recording()), replace(PARAMETERS, mechanisms=(active,)))
    paper = simulate(ModelInput.of(recording()), PARAMETERS)
    for channel in plain.channels:
        assert drifted[channel] == pytest.approx(plain[channel], rel=1e-12, abs=1e-12), channel
        assert (middle[channel] == paper[channel]).all(), channel
    assert np.abs(drifted["tau_in_Nm"] - paper["tau_in_Nm"]).max() > 1e-4


def test_two_drifts_act_together():
    both = of_recording(replace(PARAMETERS, mechanisms=(FRICTION, STIFFNESS)), replace(recording(), position=-0.5))
    assert (both.friction, both.stiffness_N_per_m) == pytest.approx((0.9 * 0.15, 1.05 * 9000.0))
    assert both.mechanisms == ()


def test_a_drifting_zero_is_an_offset_of_the_same_cell_in_each_recording():
    """Bit for bit; the cell of the other end, and every other sensor, reads what it read."""
    last = ModelInput.of(replace(recording(), position=0.5))
    offset = replace(ZERO, name="load-cell-offset", values={"offset": 0.3})
    drifted, plain = (simulate(last, replace(PARAMETERS, mechanisms=(one,))) for one in (ZERO, offset))
    for channel in plain.channels:
        assert (drifted[channel] == plain[channel]).all(), channel
    paper = simulate(last, PARAMETERS)
    assert drifted["F_load_N"] - drifted["F_drive_N"] == pytest.approx(paper["F_load_N"] - paper["F_drive_N"] + 0.3)
    middle = of_recording(replace(PARAMETERS, mechanisms=(ZERO,)), recording())
    assert middle.mechanisms == (replace(offset, values={"offset": 0.0}),)


def test_a_drifting_zero_and_an_offset_add_up():
    parts = (replace(ZERO, name="load-cell-offset", values={"offset": 0.5}), ZERO)
    for mechanisms in (parts, parts[::-1]):
        (found,) = of_recording(
            replace(PARAMETERS, mechanisms=mechanisms), replace(recording(), position=-0.5)
        ).mechanisms
        assert (found.name, found.place) == ("load-cell-offset", "load-sensor")
        assert found.values["offset"] == pytest.approx(0.2)
    elsewhere = (replace(parts[0], place="drive-sensor"), ZERO)
    both = of_recording(replace(PARAMETERS, mechanisms=elsewhere), replace(recording(), position=-0.5)).mechanisms
    assert [(m.place, m.values["offset"]) for m in both] == [("drive-sensor", 0.5), ("load-sensor", -0.3)]


def test_a_state_follows_from_stated_times():
    known = replace(recording(), started_at_s=130.0, tensioned_at_s=100.0)
    relaxing = replace(PARAMETERS, mechanisms=(RELAXATION,))
    assert known_states(known, relaxing) == {"relaxation/cable/relaxed": relaxed_after(30.0, 0.1, 20.0)}
    assert known_states(replace(known, tensioned_at_s=None), relaxing) == {}
    stated = simulate(ModelInput.of(known), relaxing)
    own = relaxing.with_values({"relaxation/cable/relaxed": relaxed_after(30.0, 0.1, 20.0)})
    assert (stated["tau_in_Nm"] == simulate(ModelInput.of(recording()), own)["tau_in_Nm"]).all()


def test_a_model_file_has_its_session_only_where_it_is_known():
    assert "session_start_s" not in model_as_dict(PARAMETERS, {})["parameters"]
    stated = model_as_dict(with_session(PARAMETERS, started(1, 2)), {})["parameters"]
    assert (stated["session_start_s"], stated["session_end_s"]) == (60.0, 120.0)


def test_the_place_in_the_session_is_kept_in_a_file(tmp_path):
    every = in_order([recording(id=f"r{k}") for k in range(3)])
    write_recordings(tmp_path / "b.nc", every, {})
    assert [r.position for r in read_recordings(tmp_path / "b.nc")] == [-0.5, 0.0, 0.5]


def test_a_state_that_is_not_stated_follows_from_stated_times():
    bare = Active("relaxation", "cable", {"r": 0.1, "tau": 20.0})
    timed = replace(recording(), started_at_s=100.0, tensioned_at_s=80.0)
    (found,) = of_recording(replace(PARAMETERS, mechanisms=(bare,)), timed).mechanisms
    (stated,) = of_recording(replace(PARAMETERS, mechanisms=(RELAXATION,)), timed).mechanisms
    assert found.values["relaxed"] == stated.values["relaxed"] > 0.3
