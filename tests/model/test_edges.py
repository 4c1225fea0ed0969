"""Edges of what a model may hold: what is there twice, laws steeper than the spring, a session without length."""

from dataclasses import replace

import numpy as np
import pytest

from builders import recording
from ccmodel import mechanisms as registry
from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.model.active import active_of
from ccmodel.model.general import Active, simulate
from ccmodel.model.general.rest import _angle_at_rest, _deflection
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.session import position_of
from ccmodel.model.transmission import Transmission
from made_observations import PARAMETERS

R, K, L, MU, SPRING = 0.006, 7750.0, 1.2, 0.156, 0.05
PATH = ConduitPath([L], [np.pi])
PAIR = Transmission(PATH, K * L, MU, R, R)
TIME_S = np.arange(250) / 250
# At rest with a torque of 6.6 mN m between the cables.
TENSIONED = InitialTension.between_ends(PATH, MU, (7.3, 8.0), (7.3, 6.9))


def test_a_mechanism_is_at_a_place_once():
    kinks = [Active("kink", "conduit", {"beta": b, "s": s}) for b, s in ((1.0, 0.3), (0.5, 0.7))]
    with pytest.raises(ModelError, match="kink acts at conduit twice"):
        active_of(kinks)
    with pytest.raises(ModelError, match="kink acts at conduit twice"):
        simulate(PAIR, SpringLoad(SPRING), TIME_S, np.sin(TIME_S), TENSIONED, kinks)
    ends = [Active("termination-compliance", place, {"compliance": 2e-5}) for place in ("drive-end", "load-end")]
    assert len(active_of(ends)) == 2


def test_a_bristle_that_would_create_energy_is_refused():
    for creep in (-1.0, 1.5):
        with pytest.raises(ModelError, match="creep"):
            active_of([Active("presliding", "conduit", {"z0": 5e-5, "creep": creep})])
    assert active_of([Active("presliding", "conduit", {"z0": 5e-5, "creep": 1.0})])


@pytest.mark.parametrize("slope", [0.02, 0.06, 0.2])
def test_a_load_law_steeper_than_the_spring_begins_at_rest(slope):
    """With the fixed point of the spring alone the first sample had tensions of 0 to 56 N."""
    law = registry.laws()["learned-load-by-load-angle"]
    fixed = {"first": -1.0, "last": 1.0, "scale": 1.0}
    none = dict.fromkeys(law.coefficients, 0.0)
    unit = np.stack([law.at_knots(fixed | none | {name: 1.0})[1] for name in law.coefficients], axis=1)
    x, _ = law.at_knots(fixed | none)
    found_z = np.linalg.lstsq(unit, slope * x, rcond=None)[0]
    values = fixed | dict(zip(law.coefficients, found_z.tolist(), strict=True))
    np.testing.assert_allclose(law.at_knots(values)[1], slope * x, atol=0.02 * slope)
    steep = Active(law.name, law.place, values)
    found = simulate(PAIR, SpringLoad(SPRING), TIME_S, np.zeros(TIME_S.size), TENSIONED, [steep])
    assert found.T2_N[0] == pytest.approx(8.0, abs=0.05)
    assert found.T4_N[0] == pytest.approx(6.9, abs=0.05)


def test_a_spring_that_softens_holds_no_torque_beyond_its_peak():
    # K z + K3 z^3 with K = 0.05 and K3 = -0.3 has its peak at 7.9 mN m.
    assert _deflection(0.05, -0.3, 5e-3) == pytest.approx(0.1078, abs=1e-3)
    with pytest.raises(ModelError, match="holds no torque of 9 mN m"):
        _deflection(0.05, -0.3, 9e-3)


def test_a_load_stays_within_its_gap():
    at = [_angle_at_rest(0.05, 0.0, 0.03, 0.0, SpringLoad(0.05, 1e-3, position)) for position in (1.0, 3.0)]
    assert at[0] == at[1] == 0.03


def test_a_session_without_length_has_no_position_by_time():
    one = replace(recording(pretension_N=7.0), started_at_s=5.0, position=0.25)
    assert position_of(one, replace(PARAMETERS, session_start_s=5.0, session_end_s=5.0)) == 0.25
