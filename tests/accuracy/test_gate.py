"""The gate on a tiny batch: other noise passes, changes of the code that make the model worse fail and are named."""

import gzip
import io
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from benchmarks.accuracy_gate import CONTROLS, FAULTS, one_run, run_pipeline
from builders import write_batch
from ccmodel.accuracy.comparison import Limits
from ccmodel.steps.settings import Fit

LIMITS = Limits()
FITS = {
    "fitted": Fit.model_validate(
        {
            "batches": ["tiny"],
            "free": {
                "stiffness_N_per_m": {"bounds": (1e3, 1e5)},
                "friction_coefficient": {"bounds": (0.01, 0.6)},
            },
            "channels": ["theta_out_rad", "tau_in_Nm"],
        }
    )
}
# Standard deviations of the sensors' noise and of their zeros, in the units of a log.
NOISE = {"drive_current_A": 0.004, "load_current_A": 0.004, "drive_load_cell_V": 0.005, "load_load_cell_V": 0.005}


def record(raw: Path, seed: int) -> Path:
    """A tiny batch with two repeats of two conditions, logged with the noise of a seed."""
    folder = write_batch(raw / "tiny")
    draw, description = np.random.default_rng(seed), yaml.safe_load((folder / "batch.yaml").read_text())
    entries = []
    for entry in description["recordings"]:
        true = pd.read_csv(folder / entry["file"])
        for letter in "ab":
            log = true.copy()
            for column, sd in NOISE.items():
                log[column] += draw.normal(0, sd) + draw.normal(0, sd, len(log))
            name, text = f"{entry['id']}-{letter}", io.StringIO()
            log.to_csv(text, index=False)
            (folder / f"{name}.csv.gz").write_bytes(gzip.compress(text.getvalue().encode(), mtime=0))
            entries.append(entry | {"id": name, "file": f"{name}.csv.gz"})
        (folder / entry["file"]).unlink()
    (folder / "batch.yaml").write_text(yaml.safe_dump(description | {"recordings": entries}))
    return raw


@pytest.fixture(scope="module")
def accepted(tmp_path_factory):
    raw = record(tmp_path_factory.mktemp("accepted"), seed=0)
    return raw, run_pipeline(raw, ["tiny"], FITS, tmp_path_factory.mktemp("results"))


def run(fault, raw, accepted):
    return one_run((fault, fault, raw, ["tiny"], FITS, accepted, LIMITS))[1]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_other_noise_passes(accepted, tmp_path, seed):
    found = run("nothing", record(tmp_path, seed), accepted[1])
    assert found.again == ["tiny"]
    assert len(found.changes) == 18
    assert found.losses == []


@pytest.mark.parametrize("control", CONTROLS)
def test_the_same_model_passes(accepted, control):
    raw, batches = accepted
    found = run(control, raw, batches)
    assert all(change.same_recordings for change in found.changes)
    assert found.losses == []


@pytest.mark.parametrize(
    "fault, named",
    [
        ("friction proportional to T^0.95", "τ_in with estimated parameters"),
        ("sign of the load torque reversed", "τ_out with fitted parameters"),
        ("sign of the load angle reversed", "θ_out with estimated parameters"),
        ("the last cycle of every recording dropped", "recording t-7N-a: compared from"),
    ],
)
def test_a_change_that_makes_the_model_worse_fails_and_is_named(accepted, fault, named):
    assert fault in FAULTS
    raw, batches = accepted
    losses = run(fault, raw, batches).losses
    assert any(named in line for line in losses), losses
    assert all(line.startswith("batch tiny") for line in losses)


def test_a_reversed_sign_is_named_on_other_recordings_too(accepted, tmp_path):
    losses = run("sign of the load torque reversed", record(tmp_path, 7), accepted[1]).losses
    assert losses
    assert all("τ_out" in line for line in losses)
