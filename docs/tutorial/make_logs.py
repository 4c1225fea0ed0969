"""The logs of the tutorial: ``python docs/tutorial/make_logs.py``, half a minute.

The virtual rig records the batches of `rig.yaml` with ``virtualrig record``. This script writes each recording as a
lab's data acquisition might: semicolons, decimal commas, ms, degrees, mA and mN m, and a joint encoder that is mounted
the other way round. Everything is simulated.
"""

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd
import yaml

HERE = Path(__file__).parent
# The batch of the virtual rig, and the folder for its logs.
FOLDERS = {"tutorial": "logs", "later": "later"}


def as_the_lab_logs(log: pd.DataFrame, rig: dict) -> pd.DataFrame:
    """One recording under the lab's names and in its units."""
    drive, load = rig["drive"], rig["load"]
    force = {end: (log[f"{end}_load_cell_V"] - rig[end]["load_cell"]["zero_V"]) for end in ("drive", "load")}
    columns = {
        "Time (ms)": 1e3 * log["time_s"],
        "Motor angle (deg)": 360 / drive["encoder_counts_per_rev"] * log["drive_encoder_counts"],
        "Joint angle (deg)": -360 / load["encoder_counts_per_rev"] * log["load_encoder_counts"],
        "Motor current (mA)": 1e3 * log["drive_current_A"],
        "Joint torque (mNm)": 1e3 * load["torque_constant_Nm_per_A"] * log["load_current_A"],
        "Motor cable force (N)": force["drive"] / drive["load_cell"]["sensitivity_V_per_N"],
        "Joint cable force (N)": force["load"] / load["load_cell"]["sensitivity_V_per_N"],
    }
    return pd.DataFrame(columns)


def write_log(logged: pd.DataFrame, file: Path) -> None:
    """A log with semicolons and decimal commas."""
    decimals = np.array([0, 4, 4, 2, 2, 2, 2])
    rows = [
        ";".join(f"{v:.{d}f}".replace(".", ",") for v, d in zip(row, decimals, strict=True)) for row in logged.values
    ]
    file.write_text("\n".join([";".join(logged.columns), *rows]) + "\n", encoding="utf-8")


def write_logs(out: Path, batches: Iterable[str] = FOLDERS) -> None:
    """Record batches of the rig, and write their logs below `out`."""
    with tempfile.TemporaryDirectory() as folder:
        command = [Path(sys.executable).with_name("virtualrig"), "record", HERE / "rig.yaml", "--out", folder]
        subprocess.run([*command, *(f"--batch={batch}" for batch in batches)], check=True)
        for batch in batches:
            stated = yaml.safe_load((Path(folder) / batch / "batch.yaml").read_text())
            (out / FOLDERS[batch]).mkdir(parents=True, exist_ok=True)
            for entry in stated["recordings"]:
                log = pd.read_csv(Path(folder) / batch / entry["file"])
                # The virtual rig ends the names of its recordings with the letter of the repeat.
                file = out / FOLDERS[batch] / f"{entry['id'].removesuffix('-a')}.csv"
                write_log(as_the_lab_logs(log, stated["rig"]), file)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, default=HERE, help="folder for logs/ and later/; this script's by default")
    write_logs(parser.parse_args().out)
