"""The experiment that would tell rivals apart."""

import numpy as np

from ccmodel.diagnose.experiment import candidates, proposed
from ccmodel.diagnose.hypothesis import Hypothesis
from ccmodel.diagnose.judge import Judgement
from ccmodel.diagnose.trial import Trial
from made_evidence import PARAMETERS, batch

VALUES = {"stiffness_N_per_m": 9000.0, "friction_coefficient": 0.15, "load_stiffness_Nm_per_rad": 0.05}


def trial(recordings, *acting, **numbers):
    aside = [np.ones(w.evidence.measured.size) for w in recordings]
    return Trial(Hypothesis(acting), {}, VALUES | numbers, [], [], np.eye(1), np.ones(1), [], aside)


def test_it_is_within_what_the_rig_has_done():
    recordings = batch()
    largest = max(np.ptp(w.evidence.given.theta_in) / 2 for w in recordings)
    for candidate in candidates(recordings):
        assert np.abs(candidate.theta_in).max() <= largest * (1 + 1e-9)
        assert 0 < candidate.pretension_share <= 1


def test_slow_and_fast_friction_are_told_apart_by_speed():
    """Viscous friction that looks like a bearing at the one speed recorded: at another speed they part."""
    recordings = batch()
    bearing = {f"pulley-friction/drive-pulley/{name}": 2e-3 for name in ("friction_torque", "presliding")}
    rivals = [
        trial(recordings, ("viscous-friction", "conduit"), **{"viscous-friction/conduit/c": 30.0}),
        trial(recordings, ("pulley-friction", "drive-pulley"), **bearing),
    ]
    base = trial(recordings)
    found = proposed(Judgement("undecided", base, rivals[0], rivals, [0.5, 0.5], 1.0, [], {}, recordings), PARAMETERS)
    assert found["separates"] == ["viscous-friction", "pulley-friction"]
    assert "Hz" in found["text"]
