"""Where the checks of sensors begin to speak, on both sides of each limit."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from made_up_batch import description, table

from ccmodel.rig import limits
from ccmodel.rig.angle import angle_of
from ccmodel.rig.batch import Rig
from ccmodel.rig.consistency.runs import _bend_for
from ccmodel.rig.sensor_checks import _frozen, _is_moved, _lost_samples, _saturated, _standstills

RIG = Rig.model_validate_json(json.dumps(description()["rig"]))
CURRENT = "drive_current_A"


def angles(log):
    return tuple(angle_of(log, end) for end in RIG.ends)


def held(samples, value=None, n=800):
    """A log whose drive current keeps one value for so many samples while the drive moves."""
    log = table(n=n)
    first = log.index[300]
    log.loc[first : first + samples - 1, CURRENT] = log[CURRENT].iloc[300] if value is None else value
    return log


@pytest.mark.parametrize("samples, said", [(limits.FLAT_SAMPLES - 1, 0), (limits.FLAT_SAMPLES, 1)])
def test_a_noisy_channel_is_flat_from_so_many_samples_on(samples, said):
    log = held(samples, value=table(n=800)[CURRENT].max() + 1.0)
    found = _saturated(log, CURRENT, angles(log)[0], None)
    assert len(found) == said
    assert all(f"{samples} in a row from here: saturated" in one.text for one in found)


@pytest.mark.parametrize("samples, said", [(60, 0), (124, 0), (130, 1)])
def test_a_channel_stands_still_after_half_a_second_and_not_before(samples, said):
    log = held(samples)
    assert len(_standstills(log, log[CURRENT].to_numpy())) == said
    found = _frozen(log, CURRENT, angles(log)[0])
    assert len(found) == said and all("sensor frozen" in one.text and one.contradicts for one in found)


def test_few_samples_are_no_standstill_however_long_they_last():
    log = held(15).assign(time_s=0.1 * np.arange(800))
    assert _standstills(log, log[CURRENT].to_numpy()) == []


def test_a_coarse_channel_that_repeats_most_values_is_not_frozen():
    log = held(130)
    log[CURRENT] = log[CURRENT].iloc[(np.arange(800) // 4) * 4].to_numpy()
    assert _standstills(log, log[CURRENT].to_numpy())
    assert _frozen(log, CURRENT, angles(log)[0]) == []


def locked(torque_A):
    log = table(n=800).assign(load_encoder_counts=7, load_current_A=torque_A)
    return _is_moved(log, angles(log)[1], RIG)


def test_a_load_is_moved_by_a_torque_that_turns_it_several_counts_against_its_spring():
    sweep = np.sin(np.linspace(0.0, 12.0, 800))
    # Counts of the load for 1 A, over the 5 to 95 % range of the sweep.
    counts = 2 * 0.988 * RIG.load.torque_constant_Nm_per_A / RIG.load.spring_stiffness_Nm_per_rad / (2 * np.pi / 2000)
    assert locked(1.3 * limits.MOVED_GRAINS / counts * sweep)
    assert not locked(0.7 * limits.MOVED_GRAINS / counts * sweep)


def test_noise_of_a_torque_moves_no_load():
    assert not locked(np.random.default_rng(1).normal(0.0, 1.0, 800))


def jumped(at, late=0):
    log = table(n=800)
    for k in at:
        log.loc[log.index[k] :, "drive_encoder_counts"] += 200
        log.loc[log.index[k + late] :, "load_encoder_counts"] += 200
    return _lost_samples(log, *angles(log))


@pytest.mark.parametrize("late", [-1, 0, 1])
def test_both_angles_that_jump_together_or_a_sample_apart_lost_samples(late):
    assert "samples were lost" in jumped([400], late).text


def test_angles_that_jump_all_the_time_lost_no_samples():
    assert jumped([]) is None
    assert jumped(range(100, 700, 25)) is not None
    assert jumped(range(100, 700, 13)) is None


def test_a_forgotten_bend_is_that_of_the_friction_that_is_seen():
    cable = SimpleNamespace(friction_coefficient=0.15)
    parity = SimpleNamespace(batch=SimpleNamespace(rig=SimpleNamespace(cable=cable)))
    assert _bend_for(parity, 0.3) == "2 rad"
    cable.friction_coefficient = 0.0
    assert _bend_for(parity, 0.3) == "some radians"
