"""Fits of recordings of a virtual rig without flaws: another solver, with all of the paper's sensors."""

from pathlib import Path

import numpy as np
import pytest

from ccmodel.inference.fit import fit
from ccmodel.inference.observations import Observations
from ccmodel.inference.problem import Free, Problem
from ccmodel.model.parameters import Parameters
from ccmodel.rig.ingest import ingest_batch
from drawn_batches import SPREAD

LOOPS = Path(__file__).parents[1] / "data/ideal-rig/loops"


@pytest.fixture(scope="module")
def said():
    """One, two and three half loops, each twice."""
    batch = ingest_batch(LOOPS)
    estimates = Parameters.estimated(batch.batch.rig)
    observations = [Observations.of(r, estimates, step_s=0.004, offset_is_free=True) for r in batch.recordings]
    free = {
        "stiffness_N_per_m": Free(estimates.stiffness_N_per_m, 1e3, 1e5),
        "friction_coefficient": Free(estimates.friction_coefficient, 0.01, 0.6),
        "load_stiffness_Nm_per_rad": Free(0.06, 0.005, 0.5),
    }
    scales = ("friction_scale", "pretension_scale")
    own = {name: Free(1.0 if name in scales else 0.0, spread=spread) for name, spread in SPREAD.items()}
    return fit(Problem(observations, free, own))


def test_stiffness_friction_and_load_are_what_the_rig_was_made_with(said):
    assert said.succeeded
    assert said.values["stiffness_N_per_m"] == pytest.approx(7750, rel=0.01)
    assert said.values["friction_coefficient"] == pytest.approx(0.156, rel=0.01)
    assert said.values["load_stiffness_Nm_per_rad"] == pytest.approx(0.05, rel=0.01)


def test_friction_scatters_as_the_rig_was_told_to(said):
    """1 %; six recordings tell it to a third."""
    assert 0.4 < said.scatter["friction_scale"].found / 0.01 < 1.8
    # Each of three conditions was recorded twice: three degrees of freedom, of the rig's friction alone.
    assert said.scatter["friction_scale"].freedom == 3
    assert 0.2 < said.scatter["friction_scale"].of_repeats / 0.01 < 2.1
    own = [each["friction"] for each in said.own_intervals.values()]
    middle = np.array([(i.low + i.high) / 2 for i in own])
    assert np.std(middle) / np.mean(middle) == pytest.approx(said.scatter["friction_scale"].found, rel=0.3)


def test_nothing_is_left_that_the_noise_does_not_explain(said):
    """Mean square of the errors over their noise."""
    assert said.cost < 1.3
    assert not said.undetermined
    assert not said.at_bound
