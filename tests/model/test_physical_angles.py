"""Fits of one recording as counts, as an angle in steps and as an angle without a step."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from ccmodel.inference.least_squares import solve
from ccmodel.inference.observations import Observations
from ccmodel.inference.problem import Free, Problem
from ccmodel.model.model_input import ModelInput
from ccmodel.model.parameters import Parameters
from ccmodel.rig.ingest import ingest_batch

RAW = Path(__file__).parents[2] / "data/raw/half-loop"
STEP = 2 * np.pi / 2000
RAW_KEYS = ("encoder_counts_per_rev", "torque_constant_Nm_per_A", "load_cell")
FREE = {"stiffness_N_per_m": (1e3, 1e5), "friction_coefficient": (0.01, 0.6)}


@pytest.fixture(scope="module")
def counted():
    ingested = ingest_batch(RAW)
    return ingested.recordings[0], fitted(ingested)


def fitted(ingested):
    estimates = Parameters.estimated(ingested.batch.rig)
    observations = [Observations.of(ingested.recordings[0], estimates, step_s=0.02, tolerance=0.05)]
    start = {name: Free(getattr(estimates, name), low, high) for name, (low, high) in FREE.items()}
    problem = Problem(observations, start)
    return problem.values_of(solve(problem, problem.start).x, 0)


def as_angles(folder, recording, theta_in, theta_out, resolution):
    """The batch with one log in SI units."""
    folder.mkdir()
    stated = yaml.safe_load((RAW / "batch.yaml").read_text())
    stated |= {"batch": folder.name, "recordings": [stated["recordings"][0] | {"file": "a.csv"}]}
    for end in ("drive", "load"):
        for key in RAW_KEYS:
            del stated["rig"][end][key]
        stated["rig"][end]["angle_resolution_rad"] = resolution
    (folder / "batch.yaml").write_text(yaml.safe_dump(stated))
    measured = {c: recording[c] for c in ("tau_in_Nm", "tau_out_Nm", "F_drive_N", "F_load_N")}
    table = {"time_s": recording.time_s, "theta_in_rad": theta_in, "theta_out_rad": theta_out} | measured
    pd.DataFrame(table).round(9).to_csv(folder / "a.csv", index=False)
    ingested = ingest_batch(folder)
    assert ingested.findings == []
    return ingested


def test_an_angle_in_steps_is_fitted_as_its_counts(tmp_path, counted):
    recording, values = counted
    steps = as_angles(tmp_path / "steps", recording, recording["theta_in_rad"] + 1, recording["theta_out_rad"], STEP)
    found = fitted(steps)
    for name in FREE:
        assert found[name] == pytest.approx(values[name], rel=1e-5), name


@pytest.mark.parametrize(("noise", "tolerance"), [(0.0, 1e-3), (1e-4, 5e-3)])
def test_an_angle_without_a_step_gives_the_same_parameters(tmp_path, counted, noise, tolerance):
    recording, values = counted
    given, random = ModelInput.of(recording), np.random.default_rng(0)
    angles = (theta + random.normal(0, noise, theta.size) for theta in (given.theta_in, given.theta_out))
    smooth = as_angles(tmp_path / "smooth", recording, *angles, 0)
    assert smooth.recordings[0].encoder_step_rad == {}
    assert smooth.recordings[0].rest_s == pytest.approx(recording.rest_s, abs=0.05)
    found = fitted(smooth)
    for name in FREE:
        assert found[name] == pytest.approx(values[name], rel=tolerance), name
