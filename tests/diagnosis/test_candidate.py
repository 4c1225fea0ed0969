"""Fits of candidate models."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import continued, discretisation_shift, fit
from ccmodel.diagnosis.hypothesis import Hypothesis
from made_observations import batch, calibrated

LOW = np.array([0.0, 1e-3])
KEY = "conduit-compliance/conduit/compliance"


def test_the_discretisation_shift_is_that_of_a_fit_on_the_finer_solver(monkeypatch):
    """Recordings of the paper's model: a compliance that is found is noise and discretisation error."""
    recordings = batch()
    base = calibrated(recordings)
    hypothesis = Hypothesis((("conduit-compliance", "conduit"),))
    found = fit(recordings, hypothesis, base.free, base.values | {KEY: 1e-5})
    k = list(found.values).index(KEY)
    moved = discretisation_shift(found)
    finer = [w.with_parameters(replace(w.observations.parameters, refinement=settings.REFINEMENT)) for w in recordings]
    there = fit(finer, hypothesis, base.free, found.values)
    assert found.values[KEY] + moved[k] == pytest.approx(there.values[KEY], abs=0.3 * abs(moved[k]))
    monkeypatch.setattr(settings, "REFINEMENT", 1)
    assert discretisation_shift(found) == pytest.approx(np.zeros(moved.size), abs=1e-12)


def test_the_papers_model_has_no_solver_to_refine():
    for w in batch():
        refined = w.with_parameters(replace(w.observations.parameters, refinement=3))
        assert (w.observations.modelled({}) == refined.observations.modelled({})).all()


@pytest.mark.parametrize(("least", "end"), [(0.005, 0.00625), (0.08, 0.1), (0.0, 0.0015625)])
def test_continuation_goes_down_as_long_as_the_cost_falls(least, end):
    def search(x):
        return SimpleNamespace(x=x, cost=1 + abs(np.log((x[1] + 1e-9) / (least + 1e-9))))

    assert continued(search, search(np.array([3.0, 0.1])), 1, LOW).x == pytest.approx([3.0, end])


def test_a_model_without_unknowns_is_evaluated_as_it_is():
    recordings = batch()
    found = fit(recordings, Hypothesis(), {}, {})
    assert found.values == {}
    assert found.mean_square == pytest.approx(calibrated(recordings).mean_square, rel=0.05)
