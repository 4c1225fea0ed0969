"""The measure of a run by hand: signs, percents, verdicts, and what a fit's uncertainty does to an error."""

from dataclasses import replace

import numpy as np
import pytest

from builders import recording
from ccmodel.accuracy import measure as measuring
from ccmodel.accuracy.measure import Simulated, measure
from ccmodel.errors import error_table
from ccmodel.model.model_input import ModelInput
from ccmodel.recording import write_recordings
from ccmodel.steps.files import Fitted, write_json
from model_runs import CABLE


def above(recorded, share):
    """A simulation that is above the recording's torque by a share of it."""
    return recorded.with_channels({"tau_in_Nm": (1 + share) * recorded["tau_in_Nm"]}, {"tau_in_Nm": "model"}, "model")


@pytest.fixture
def recorded():
    """Four samples of a motion without a cycle: mean 2, mean square 6, peak to peak 4."""
    return recording(0.03, theta_in_rad=lambda t: t, tau_in_Nm=lambda t: np.array([0.0, 2.0, 2.0, 4.0]))


def test_a_model_that_is_a_tenth_too_high_has_a_positive_bias_and_its_verdict(recorded, tmp_path):
    recordings, simulated, model = (tmp_path / name for name in ("b.nc", "s.nc", "model.json"))
    write_recordings(recordings, [recorded], {})
    write_recordings(simulated, [above(recorded, 0.1)], {})
    named = [{"name": "kink", "place": "conduit"}]
    write_json(tmp_path / "diagnosis.json", {"verdict": "explained", "mechanisms": named})
    found = measure([Simulated("rig", "extended", recordings, simulated, model)], for_comparison=False)["b"]
    channel = found.sets["extended"].channels["tau_in_Nm"]
    assert channel.biases == [pytest.approx(100 * 0.1 * 2 / 4)]
    assert channel.errors == [pytest.approx(100 * 0.1 * np.sqrt(6) / 4, rel=1e-4)]
    assert found.recordings == {"r": [0.0, 0.03, 4.0]}
    assert found.verdict == "explained: kink at conduit"
    write_json(tmp_path / "diagnosis.json", {"verdict": None})
    runs = [Simulated("rig", "extended", recordings, simulated, model)]
    assert measure(runs, for_comparison=False)["b"].verdict == "not diagnosed"


def test_the_uncertainty_of_a_fit_is_the_relative_change_of_the_error_for_each_parameter(recorded, monkeypatch):
    """A model whose error is as the product of stiffness and friction; with the first it is 1.5 times, the other 2."""

    def share(parameters):
        return 1e-3 * parameters.stiffness_N_per_m * parameters.friction_coefficient

    monkeypatch.setattr(measuring, "simulate", lambda given, parameters: above(given, share(parameters)))
    monkeypatch.setattr(ModelInput, "of", lambda one: one)
    fitted_to = replace(CABLE, stiffness_N_per_m=2.0, friction_coefficient=0.1)
    sds = {"stiffness_N_per_m": 1.0, "friction_coefficient": 0.1, "load_stiffness_Nm_per_rad": np.inf}
    pairs = [(recorded, above(recorded, share(fitted_to)))]
    found = measuring._fit_sds(pairs, Fitted(fitted_to, sds, ["b/r"]), error_table(pairs, ""))
    assert found == {"tau_in_Nm": pytest.approx(np.hypot(np.log(1.5), np.log(2.0)))}
