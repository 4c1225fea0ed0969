"""What a run writes depends on no order of a set, which Python draws anew for each process, no time zone, no locale."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from builders import spoil, write_batch
from ccmodel.model.files import Model
from ccmodel.model.general.run import Active
from model_runs import CABLE

RUN = """
from pathlib import Path
from ccmodel.steps.ingest import ingest
from ccmodel.steps.simulate import simulate
from ccmodel.studies.accuracy.settings import Accuracy
from ccmodel.studies.loops.settings import Measuring
from ccmodel.studies.run import Run, run_study

recordings, simulated, model = Path("bench.nc"), Path("simulated.nc"), Path("model.json")
ingest(Path("bench"), recordings, Path("bench.json"))
simulate(recordings, model, simulated, Path("simulated.json"))
run = Run("model", recordings, simulated, model)
tables, figures = [Path("a.csv"), Path("b.csv"), Path("accuracy.json")], [[Path("a.svg")], [Path("b.svg")]]
run_study("accuracy", Accuracy().model_dump_json(), Measuring().model_dump_json(), [run], tables, figures)
"""


def written(folder: Path, **environment: str) -> dict[str, bytes]:
    """What the steps and the accuracy study write in a process with this environment."""
    subprocess.run([sys.executable, "-c", RUN], cwd=folder, env=os.environ | environment, check=True)
    return {file.name: file.read_bytes() for file in folder.iterdir() if file.is_file()}


@pytest.mark.long
def test_the_same_bytes_with_any_seed_of_hashes_time_zone_and_locale(tmp_path):
    spoil(write_batch(tmp_path / "bench"))
    acting = (
        Active("viscous-friction", "conduit", {"c": 50.0}),
        Active("pulley-friction", "drive-pulley", {"friction_torque": 5e-4}),
    )
    sds = {"stiffness_N_per_m": 90.0, "friction_coefficient": 2e-3, "load_stiffness_Nm_per_rad": 3e-4}
    sds |= {"viscous-friction/conduit/c": 3.0, "pulley-friction/drive-pulley/friction_torque": 4e-5}
    intervals = {name: {"low": None, "high": None, "sd": sd} for name, sd in sds.items()}
    Model(replace(CABLE, mechanisms=acting), intervals=intervals).save(tmp_path / "model.json")
    first = written(tmp_path, PYTHONHASHSEED="0", TZ="UTC", LC_ALL="C.UTF-8")
    assert {"accuracy.json", "a.csv", "b.csv", "a.svg", "bench.nc", "simulated.nc"} <= first.keys()
    assert b'"quantity": "work_lost"' in first["accuracy.json"]
    # Without the German locale on the machine, this is the one with ASCII.
    assert written(tmp_path, PYTHONHASHSEED="1", TZ="America/St_Johns", LC_ALL="de_DE.UTF-8") == first
