import numpy as np
import pytest

from ccmodel.rig.findings import LogError
from ccmodel.rig.importing.matching import match_clocks


def motion(time):
    return np.sin(2 * np.pi * 0.5 * time) + 0.4 * np.sin(2 * np.pi * 0.83 * time + 1) * (time > 3)


def two_recordings(seed, offset, drift, noise=0.01, seconds=30.0, step=0.0):
    """The same motion on two clocks; t_first = offset + (1 + drift) t."""
    rng = np.random.default_rng(seed)
    first = np.arange(0, seconds, 0.001)
    here = np.arange(0.2, seconds - 1, 0.0025)
    recorded = 40 * motion(offset + (1 + drift) * here) + 3 + 40 * noise * rng.normal(size=here.size)
    if step:
        recorded = np.round(recorded / step) * step
    return here, recorded, first, motion(first) + noise * rng.normal(size=first.size)


@pytest.mark.parametrize(("offset", "drift"), [(0.0, 0.0), (-0.1234, 40e-6), (2.5, -200e-6), (-3.0, 1e-3)])
def test_offset_and_drift_are_recovered(offset, drift):
    found = match_clocks(*two_recordings(1, offset, drift))
    assert found.drift == pytest.approx(drift, abs=1.5 * found.drift_uncertainty)
    middle = 14.6
    error = found.on_first(np.array([middle])) - (offset + (1 + drift) * middle)
    assert abs(error[0]) < 1.5 * found.offset_uncertainty_s
    assert found.offset_uncertainty_s < 1e-3
    assert found.how == "matched over " + found.how.split()[2] + " s"


def test_the_stated_uncertainty_holds_in_about_nineteen_of_twenty():
    inside = {"offset": 0, "drift": 0}
    cases = 30
    for seed in range(cases):
        offset, drift = 0.05 * seed - 1, 1e-5 * (seed - 20)
        found = match_clocks(*two_recordings(seed, offset, drift, noise=0.02))
        middle = 14.6
        error = found.on_first(np.array([middle]))[0] - (offset + (1 + drift) * middle)
        inside["offset"] += abs(error) <= found.offset_uncertainty_s
        inside["drift"] += abs(found.drift - drift) <= found.drift_uncertainty
    # 28 of 30 are expected; fewer than 24 would be seen once in a hundred such tests.
    assert min(inside.values()) >= 24, inside


@pytest.mark.parametrize("noise", [0.02, 0.002])
def test_the_interval_of_the_offset_is_that_of_the_offset_at_time_zero(noise):
    """The drift's error is an error of this offset too."""
    inside = 0
    for seed in range(20):
        offset, drift = 0.05 * seed - 1, 1e-5 * (seed - 20)
        found = match_clocks(*two_recordings(seed, offset, drift, noise=noise))
        inside += abs(found.offset_s - offset) <= found.offset_uncertainty_s
    # 19 of 20 are expected; fewer than 16 would be seen once in four hundred such tests.
    assert inside >= 16


def test_an_inverted_and_coarse_signal_matches_too():
    here, values, first, first_values = two_recordings(5, 0.75, 1e-4, step=0.9)
    found = match_clocks(here, -values, first, first_values)
    assert found.offset_s == pytest.approx(0.75, abs=2e-3)
    assert found.drift == pytest.approx(1e-4, abs=1e-4)


def test_other_quantities_are_refused():
    here, _, first, values = two_recordings(5, 0.75, 0)
    noise = np.random.default_rng(0).normal(size=here.size)
    with pytest.raises(LogError) as caught:
        match_clocks(here, noise, first, values)
    assert "only: match two of the same quantity" in caught.value.args[2]
    with pytest.raises(LogError) as caught:
        match_clocks(here, np.ones(here.size), first, values)
    assert "is constant" in caught.value.args[2]


def test_a_motion_that_repeats_is_refused_rather_than_guessed():
    here = np.arange(0, 20, 0.002)
    with pytest.raises(LogError) as caught:
        match_clocks(here, np.sin(np.pi * here), here.copy(), np.sin(np.pi * (here - 0.3)))
    assert "the matched signals repeat" in caught.value.args[2]


def test_two_offsets_that_fit_alike_are_refused():
    """Of a motion that repeats every 10 s within 20 s: both shifts of half a period have three quarters in common."""

    def motion_of_10_s(time):
        return np.sin(0.2 * np.pi * time) + 0.5 * np.sin(0.4 * np.pi * time)

    here = np.arange(0, 20, 0.002)
    with pytest.raises(LogError, match="repeat, and offsets of -?5 s and -?5 s fit alike"):
        match_clocks(here, motion_of_10_s(here), here.copy(), motion_of_10_s(here - 5.0))


def test_a_motion_that_repeats_after_a_rest_is_matched():
    def moves(time):
        return np.sin(np.pi * np.maximum(time - 1, 0))

    here = np.arange(0, 8, 0.002)
    found = match_clocks(here, moves(here + 0.35), here.copy(), moves(here))
    assert found.offset_s == pytest.approx(0.35, abs=1e-3)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_chirp_after_a_rest_does_not_repeat(noise):
    random, time = np.random.default_rng(8), np.arange(0, 20, 0.004)

    def chirp(at):
        moving = np.maximum(at - 2.0, 0.0)
        return np.sin(2 * np.pi * (0.2 * moving + 0.03 * moving**2))

    late = np.arange(0, 18, 0.002)
    here = chirp(late + 0.7) + random.normal(0, noise + 1e-9, late.size)
    clock = match_clocks(late, here, time, chirp(time))
    assert clock.offset_s == pytest.approx(0.7, abs=0.003)


def test_clocks_that_differ_by_a_unit_are_refused():
    time = np.arange(0, 20, 0.004)
    walk = np.interp(time, np.arange(0, 21), np.random.default_rng(2).normal(0, 1, 21))
    with pytest.raises(LogError, match="check the units of time"):
        match_clocks(time * 0.97, walk, time, walk)
