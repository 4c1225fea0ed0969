"""What holds for every mechanism: its contract, no trace when absent, the paper's model at its neutral value."""

import numpy as np
import pytest

from ccmodel import mechanisms
from ccmodel.model.general import Active
from general_runs import OUTPUTS, rms, run, sine

READ = ("theta_out_rad", "tau_in_Nm", "tau_out_Nm", "F_drive_N", "F_load_N")
# Where the neutral value is a limit: how close to it the parameter is taken, and how close the numbers then are.
NEARLY_NEUTRAL = {
    "presliding": ({"z0": 1e-10}, 1e-5),
    "strand-settling": ({"T_scale": 1e-4}, 2e-4),
    "termination-compliance": ({"compliance": 1e-12}, 1e-6),
}
EVERYWHERE = [(name, place) for name in mechanisms.names() for place in mechanisms.get(name).places]
THE_LIST = {
    "presliding": {"z0"},
    "stribeck": {"a", "vs"},
    "viscous-friction": {"c"},
    "load-dependent-friction": {"n"},
    "constant-drag": {"f0"},
    "kink": {"beta", "s"},
    "running-in": {"change", "tau"},
    "cable-asymmetry": {"ratio", "K_ratio"},
    "relaxation": {"r", "tau"},
    "strand-settling": {"T_scale"},
    "termination-compliance": {"compliance"},
    "conduit-compliance": {"compliance"},
    "pulley-friction": {"friction_torque"},
    "pulley-eccentricity": {"e", "psi"},
    "backlash": {"half_gap"},
    "load-stiffening": {"K3"},
    "load-inertia": {"J"},
    "torque-scale": {"gain"},
    "load-cell-scale": {"gain"},
    "load-cell-offset": {"offset"},
    "load-cell-drift": {"rate"},
    "load-cell-crosstalk": {"crosstalk"},
    "time-skew": {"delay"},
    "drive-windup": {"compliance", "lost_motion"},
}


@pytest.fixture(scope="module")
def base():
    return run(sine())


def test_the_registry_has_the_whole_list():
    must_be_said = {
        name: {p.name for p in mechanisms.get(name).parameters if p.default is None} for name in mechanisms.names()
    }
    assert must_be_said == THE_LIST


@pytest.mark.parametrize("name", mechanisms.names())
def test_contract(name):
    mechanism = mechanisms.get(name)
    assert mechanism.summary
    assert mechanism.mistaken_for
    assert mechanism.separated_by
    for p in mechanism.parameters:
        assert p.low < p.high, p.name
        assert p.low <= p.start <= p.high, p.name
        assert p.unit, p.name
        assert p.scale == "linear" or p.low > 0, p.name


def test_an_unknown_name_is_answered_with_the_nearest():
    with pytest.raises(mechanisms.UnknownMechanismError, match="nearest are presliding"):
        mechanisms.get("pre-sliding")


@pytest.mark.parametrize(("name", "place"), EVERYWHERE)
def test_it_acts_and_leaves_no_trace_when_absent(base, name, place):
    theta = sine()
    start = mechanisms.get(name).start
    values = start | {"ratio": 1.2} if name == "cable-asymmetry" else start
    r = run(theta, [Active(name, place, values)])
    assert any(np.abs(r.read[channel] - base.read[channel]).max() > 1e-6 for channel in READ)
    for channel in READ:
        assert np.isfinite(r.read[channel]).all()
    again = run(theta)
    for output in OUTPUTS:
        assert (getattr(again, output) == getattr(base, output)).all(), output


@pytest.mark.parametrize(("name", "place"), EVERYWHERE)
def test_its_neutral_value_is_the_papers_model(base, name, place):
    mechanism = mechanisms.get(name)
    r = run(sine(), [Active(name, place, mechanism.neutral)])
    near, limit = NEARLY_NEUTRAL.get(name, ({}, 0.0))
    # A kink of no bend still puts a node at its place, which is another grid.
    limit = 1e-3 if name == "kink" else 1e-9
    for channel in READ:
        assert rms(r.read[channel], base.read[channel]) <= limit * np.ptp(base.read[channel]), channel
    if near:
        r = run(sine(), [Active(name, place, mechanism.neutral | near)])
        limit = NEARLY_NEUTRAL[name][1]
        for channel in READ:
            assert rms(r.read[channel], base.read[channel]) <= limit * np.ptp(base.read[channel]), channel


@pytest.mark.parametrize(("name", "place"), EVERYWHERE)
def test_refining_the_grid_changes_little(name, place):
    active = [Active(name, place, mechanisms.get(name).start)]
    coarse, fine = run(sine(), active), run(sine(), active, elements=128)
    for channel in READ:
        assert rms(coarse.read[channel], fine.read[channel]) < 2e-3 * np.ptp(fine.read[channel]), channel


def everything():
    return [Active(name, place, mechanisms.get(name).start) for name, place in EVERYWHERE]


def test_all_of_them_together():
    r = run(sine(), everything())
    fine = run(sine(), everything(), elements=128)
    for channel in READ:
        assert rms(r.read[channel], fine.read[channel]) < 5e-3 * np.ptp(fine.read[channel]), channel


@pytest.mark.parametrize("seed", range(3))
def test_all_of_them_together_bear_a_jumping_drive(seed):
    rng = np.random.default_rng(seed)
    theta = np.concatenate([[0.0], rng.uniform(-0.6, 0.6, 300)])
    r = run(theta, everything())
    for channel in READ:
        assert np.isfinite(r.read[channel]).all()


@pytest.mark.parametrize("seed", range(4))
def test_any_pair_of_them(seed):
    rng = np.random.default_rng(seed)
    for _ in range(12):
        picked = [everything()[i] for i in rng.choice(len(EVERYWHERE), 2, replace=False)]
        values = []
        for a in picked:
            drawn = {p.name: rng.uniform(p.low, p.high) for p in mechanisms.get(a.name).parameters}
            values.append(Active(a.name, a.place, drawn))
        r = run(sine(cycles=1), values, T=rng.uniform(0.7, 10))
        assert all(np.isfinite(r.read[channel]).all() for channel in READ), values
