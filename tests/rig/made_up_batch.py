"""A small made-up batch that a test can damage in one place."""

from pathlib import Path

import numpy as np
import pandas as pd
import yaml

R, COUNTS, KT, SENSITIVITY, ZERO, T0 = 0.006, 2000, 0.0234, 0.1, 0.25, 3.5


def description(ids=("one", "two")) -> dict:
    side = {
        "pulley_radius_m": R,
        "encoder_counts_per_rev": COUNTS,
        "torque_constant_Nm_per_A": KT,
        "load_cell": {"sensitivity_V_per_N": SENSITIVITY, "zero_V": ZERO},
    }
    return {
        "format": 1,
        "batch": "bench",
        "origin": "rig",
        "rig": {
            "drive": dict(side),
            "load": {**side, "spring_stiffness_Nm_per_rad": 0.05},
            "cable": {"stiffness_N_per_m": 13880.0, "length_m": 1.2, "friction_coefficient": 0.147},
            "accuracy": {"encoder_rad": 0.00314, "torque_Nm": 0.0001, "load_cell_N": 0.1},
        },
        "recordings": [
            {
                "id": i,
                "file": f"{i}.csv",
                "pretension_N": T0,
                "conduit": [{"length_m": 0.4, "bend_rad": 0.0}, {"length_m": 0.8, "bend_rad": 3.1416}],
            }
            for i in ids
        ],
    }


def table(n=400, dt=0.004, rest=0.4, seed=0, bend=np.pi) -> pd.DataFrame:
    """Raw columns of a sine that starts from rest, with noise on currents and load cells.

    The parity relations hold about as on a rig: the spring is the stated one, and both cables slip.
    """
    noise = np.random.default_rng(seed).normal(0, 1, (n, 4))
    time = dt * np.arange(1, n + 1)
    phase = np.pi * np.maximum(time - rest, 0)
    theta = (0.6 + 0.01 * seed) * np.sin(phase)
    load = 0.9 * theta
    # Full slip: the pulled cable has exp(mu phi) times the load's tension at the drive, the other the inverse.
    ratio = np.exp(0.147 * bend * np.sign(np.cos(phase)) * (time > rest))
    t2, t4 = (T0 + 0.05 * load / R / 2 * sign for sign in (1, -1))
    tau_in, f_drive = (t2 * ratio - t4 / ratio) * R, t2 * ratio + t4 / ratio
    return pd.DataFrame(
        {
            "time_s": time.round(6),
            "drive_encoder_counts": np.round(theta * COUNTS / 2 / np.pi).astype(int) + 100,
            "load_encoder_counts": np.round(load * COUNTS / 2 / np.pi).astype(int) - 50,
            "drive_current_A": (tau_in / KT + 0.01 * noise[:, 0]).round(5),
            "load_current_A": (0.05 * load / KT + 0.01 * noise[:, 1]).round(5),
            "drive_load_cell_V": (ZERO + SENSITIVITY * f_drive + 0.01 * noise[:, 2]).round(5),
            "load_load_cell_V": (ZERO + SENSITIVITY * 2 * T0 + 0.01 * noise[:, 3]).round(5),
        }
    )


class Bench:
    """The batch as a folder: `write()` it, then damage a log by `lines` or `text`."""

    def __init__(self, root: Path):
        self.folder = root / "bench"
        self.folder.mkdir()
        self.described = description()
        self.tables = {"one": table(seed=1), "two": table(seed=2)}

    def write(self) -> "Bench":
        (self.folder / "batch.yaml").write_text(yaml.safe_dump(self.described, sort_keys=False))
        for name, frame in self.tables.items():
            frame.to_csv(self.folder / f"{name}.csv", index=False)
        return self

    def log(self, name="one") -> Path:
        return self.folder / f"{name}.csv"

    def change_line(self, row: int, change) -> None:
        lines = self.log().read_text().splitlines()
        lines[row - 1] = change(lines[row - 1])
        self.log().write_text("\n".join(lines) + "\n")
