import itertools
from dataclasses import replace

import numpy as np
import pytest

from ccmodel import mechanisms
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.hypothesis import Hypothesis, _bounds, plausible, single_mechanisms
from ccmodel.diagnosis.screening import scaled
from ccmodel.mechanisms import Parameter
from ccmodel.model.active import Active
from ccmodel.model.parameters import mechanism_key, mechanism_parameter
from made_observations import PARAMETERS


def test_every_mechanism_is_asked_at_each_of_its_places_but_what_is_asked_for_by_name():
    asked = {h.acting[0] for h in single_mechanisms()}
    every = {(name, place) for name in mechanisms.names() for place in mechanisms.get(name).places}
    assert every - asked == {("drive-train", "drive-pulley")}
    assert asked < every


def test_a_law_of_a_frozen_baseline_that_is_learned_again_has_one_range():
    """The solver runs with the range that the report states."""
    law = mechanisms.laws()["learned-load-by-load-angle"]
    before, after = {"first": -0.5, "last": 0.5, "scale": 0.001}, {"first": -0.9, "last": 0.9, "scale": 0.006}
    keys = {name: mechanism_key(law.name, law.place, name) for name in before}
    acting = Active(law.name, law.place, before | dict.fromkeys(law.coefficients, 1.0))
    fixed = tuple((keys[name], value) for name, value in before.items())
    baseline = Hypothesis(baseline=((law.name, law.place),), is_frozen=True, fixed=fixed)
    again = Hypothesis(((law.name, law.place),), fixed=tuple((keys[name], value) for name, value in after.items()))
    (found,) = baseline.and_also(again).of(replace(PARAMETERS, mechanisms=(acting,))).mechanisms
    assert {name: found.values[name] for name in after} == after


@pytest.mark.parametrize("hypothesis", single_mechanisms(), ids=str)
def test_probes_are_plausible_and_within_reach_of_a_fit(hypothesis):
    probes = list(hypothesis.screening_values())
    assert probes
    for probe in probes:
        assert plausible(hypothesis, probe)
        for key, free in hypothesis.free(probe).items():
            assert free.low <= probe[key] <= free.high
            assert free.start == probe[key]


def test_a_probe_is_scaled_about_the_neutral_value():
    drag = Hypothesis((("constant-drag", "conduit"),))
    probe = next(drag.screening_values())
    key = "constant-drag/conduit/f0"
    assert scaled(drag, probe, 2.0) == pytest.approx(probe | {key: 2 * probe[key]})
    assert scaled(drag, probe, -1.0) is None
    gain = Hypothesis((("torque-scale", "load-sensor"),))
    ((key, value),) = next(gain.screening_values()).items()
    assert scaled(gain, {key: value}, -1.0)[key] == pytest.approx(-value)
    uneven = Hypothesis((("cable-asymmetry", "cable"),))
    for probe in uneven.screening_values():
        back = scaled(uneven, probe, -1.0)
        for key, value in probe.items():
            assert back[key] - 1 == pytest.approx(1 - value)


def test_a_number_far_out_of_its_range_is_not_plausible():
    friction = Hypothesis((("pulley-friction", "drive-pulley"),))
    key = "pulley-friction/drive-pulley/friction_torque"
    assert mechanism_parameter(key) == ("pulley-friction", "drive-pulley", "friction_torque")
    assert plausible(friction, {key: 5e-3})
    assert not plausible(friction, {key: 5.0})
    assert plausible(friction, {key: np.float64(1e-6)})
    unlike = Hypothesis((("cable-asymmetry", "cable"),))
    for key, other in itertools.permutations(unlike.start):
        found = [plausible(unlike, {key: ratio, other: 1.0}) for ratio in (0.1, 0.6, 1.0, 1.4, 4.2)]
        assert found == [False, True, True, True, False]
    rising, key = Hypothesis((("load-dependent-friction", "conduit"),)), "load-dependent-friction/conduit/n"
    assert [plausible(rising, {key: n}) for n in (-1.0, -0.2, -0.01, 0.1)] == [False, True, True, False]
    drift, key = Hypothesis((("load-cell-drift", "load-sensor"),)), "load-cell-drift/load-sensor/rate"
    assert [plausible(drift, {key: rate}) for rate in (-1.0, -0.1, 0.1, 1.0)] == [False, True, True, False]


def test_a_mass_is_tried_at_many_sizes_under_one_damping():
    probes = list(Hypothesis((("load-inertia", "load"),)).screening_values())
    masses = np.array([p["load-inertia/load/J"] for p in probes])
    assert (masses[1:] / masses[:-1]).max() < 1.25
    assert len({p["load-inertia/load/zeta"] for p in probes}) == 1
    assert scaled(Hypothesis((("load-inertia", "load"),)), probes[3], 0.2) == probes[3]
    assert Hypothesis((("load-inertia", "load"),)).continuation == ["load-inertia/load/zeta"]


def test_what_the_model_has_already_is_fitted_and_neither_named_nor_asked_for():
    """What belongs to the model in question is part of every hypothesis beside it, and no finding."""
    friction, gain = ("pulley-friction", "drive-pulley"), ("torque-scale", "load-sensor")
    model = Hypothesis(baseline=(friction,))
    both = model.and_also(Hypothesis((gain,)))
    assert both.names == ("torque-scale",)
    assert [(m.name, m.place) for m in both.of(PARAMETERS).mechanisms] == [friction, gain]
    assert set(both.free(both.start)) > set(model.free(model.start)) != set()
    asked = {h.acting[0] for h in single_mechanisms(model=model)}
    assert friction not in asked
    assert ("pulley-friction", "load-pulley") in asked


def test_what_is_held_stays_as_it_is_unless_it_is_what_has_changed():
    friction = ("pulley-friction", "drive-pulley")
    key = "pulley-friction/drive-pulley/friction_torque"
    model = Hypothesis(baseline=(friction,), is_frozen=True)
    known = model.of(PARAMETERS).with_values({key: 7e-3})
    assert model.free({}) == {}
    assert model.of(known).value_of(key) == 7e-3
    changed = model.and_also(Hypothesis((friction,)))
    assert changed in {model.and_also(h) for h in single_mechanisms(model=model)}
    assert list(changed.free(changed.start | {key: 7e-3})) == list(changed.start)
    assert [(m.name, m.place) for m in changed.of(known).mechanisms] == [friction]


def test_of_a_strength_with_a_state_what_is_left_is_judged():
    """Half of a running-in of 50 % shows as much as a fresh one of 25 %; no cable is fresh and runs in by 50 %."""
    running_in = Hypothesis((("running-in", "conduit"),))
    change, done = (f"running-in/conduit/{name}" for name in ("change", "done"))
    found = [plausible(running_in, {change: -0.5, done: share}) for share in (0.0, 0.05, 0.5)]
    assert found == [False, False, True]


def test_a_signed_strength_is_bounded_alike_on_both_sides():
    signed = Parameter("x", "1", 0.02, 0.2, 0.05, "a share", signed=True)
    low, high = _bounds(signed, is_strength=True)
    assert -low == high == settings.BEYOND_RANGE * 0.2
    assert _bounds(replace(signed, signed=False), is_strength=True) == (0.0, high)
