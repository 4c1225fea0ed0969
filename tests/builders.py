"""Recordings and batches made by hand, for tests."""

import gzip
import io

import numpy as np
import pandas as pd
import yaml

from ccmodel.geometry import ConduitPath
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.paper import simulate_pair
from ccmodel.model.transmission import Transmission
from ccmodel.recording import Recording

RIG = {
    "drive": {
        "pulley_radius_m": 0.006,
        "encoder_counts_per_rev": 2000,
        "torque_constant_Nm_per_A": 0.0234,
        "load_cell": {"sensitivity_V_per_N": 0.1, "zero_V": 0.25},
    },
    "load": {
        "pulley_radius_m": 0.006,
        "encoder_counts_per_rev": 2000,
        "torque_constant_Nm_per_A": 0.0234,
        "load_cell": {"sensitivity_V_per_N": 0.1, "zero_V": 0.25},
        "spring_stiffness_Nm_per_rad": 0.05,
    },
    "cable": {"stiffness_N_per_m": 13880.0, "length_m": 1.2, "friction_coefficient": 0.147},
    "accuracy": {"encoder_rad": 0.00314, "torque_Nm": 0.0001, "load_cell_N": 0.1},
}

# Noise as of the paper's sensors.
NOISE = {"drive_current_A": 1e-4 / 0.0234, "load_current_A": 1e-4 / 0.0234}
NOISE |= {"drive_load_cell_V": 0.005, "load_load_cell_V": 0.005}


def recording(duration=3.0, pretension_N=7.0, id="r", settled_s=0.0, **channels) -> Recording:
    """A recording of a 1 Hz sine at 100 Hz; channels are functions of time."""
    t = np.arange(0, duration + 1e-9, 0.01)
    channels = {"theta_in_rad": lambda t: np.sin(2 * np.pi * t)} | channels
    return Recording(
        batch="b",
        id=id,
        origin="virtual-rig",
        time_s=t,
        channels={name: f(t) for name, f in channels.items()},
        derived_from=dict.fromkeys(channels, "made by hand"),
        pretension_N=pretension_N,
        path=ConduitPath([1.2], [np.pi]),
        accuracy={"theta_in_rad": 0.00314},
        settled_s=settled_s,
    )


def write_batch(folder, pretensions=(7.0, 3.5), k=7750.0, mu=0.156):
    """A batch folder of short noise-free logs of the paper's model with stiffness `k` and friction `mu`."""
    folder.mkdir(parents=True)
    entries = []
    for T in pretensions:
        entry = {
            "id": f"t-{T:g}N",
            "file": f"t-{T:g}N.csv.gz",
            "pretension_N": T,
            "conduit": [{"length_m": 1.2, "bend_rad": 3.1416}],
            "excitation": {"wave": "sine", "amplitude_rad": 0.6, "frequency_Hz": 1.0},
        }
        entries.append(entry)
        with gzip.open(folder / entry["file"], "wt") as f:
            f.write(log(T, k, mu))
    batch = {"format": 1, "batch": folder.name, "origin": "virtual-rig", "rig": RIG, "recordings": entries}
    (folder / "batch.yaml").write_text(yaml.safe_dump(batch, sort_keys=False))
    return folder


def log(T: float, k: float, mu: float) -> str:
    """A raw log of 2.5 s at 250 Hz: half a second of rest, two cycles."""
    t = np.arange(1, 626) / 250
    theta = 0.6 * np.sin(2 * np.pi * np.maximum(t - 0.5, 0))
    path = ConduitPath([1.2], [3.1416])
    r = simulate_pair(
        Transmission(path, k * 1.2, mu, 0.006, 0.006), SpringLoad(0.05), theta, InitialTension.uniform(path, T)
    )
    step = 2 * np.pi / 2000
    columns = {
        "time_s": t,
        "drive_encoder_counts": np.floor(theta / step) + 100,
        "load_encoder_counts": np.floor(r.theta_out_rad / step) - 40,
        "drive_current_A": r.tau_in_Nm / 0.0234,
        "load_current_A": r.tau_out_Nm / 0.0234,
        "drive_load_cell_V": 0.25 + 0.1 * (r.T1_N + r.T3_N),
        "load_load_cell_V": 0.25 + 0.1 * (r.T2_N + r.T4_N),
    }
    rows = "\n".join(
        f"{a:.4f},{b:.0f},{c:.0f}," + ",".join(f"{v:.5f}" for v in rest)
        for a, b, c, *rest in zip(*columns.values(), strict=True)
    )
    return ",".join(columns) + "\n" + rows + "\n"


def spoil(folder, change=lambda table: table, seed=0):
    """Give the logs of a batch noise, and change them."""
    random = np.random.default_rng(seed)
    for file in sorted(folder.glob("*.csv.gz")):
        table = pd.read_csv(file)
        for column, sd in NOISE.items():
            table[column] += sd * random.standard_normal(len(table))
        text = io.StringIO()
        change(table).to_csv(text, index=False, float_format="%.7g")
        with gzip.open(file, "wt") as f:
            f.write(text.getvalue())
    return folder
