"""Batches of a single cable, simulated with known truth and logged as a rig would, for tests."""

import gzip

import numpy as np
import yaml

from ccmodel.geometry import ConduitPath
from ccmodel.model import general
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import AngleLoad, FixedLoad, SpringLoad, TorqueLoad
from ccmodel.model.transmission import Transmission

RADIUS, STIFFNESS, LENGTH, FRICTION, SPRING = 0.006, 7750.0, 1.2, 0.156, 0.1
COUNTS, CONSTANT, SENSITIVITY, ZERO = 4000, 0.0234, 0.1, 0.25
NOISE_NM, NOISE_N = 1e-4, 0.05
RATE_HZ, REST_S = 250, 0.5
CASES = [  # pretension (N), bend (rad), amplitude (rad), frequency (Hz)
    (6.0, np.pi, 0.6, 1.0),
    (6.0, np.pi, 0.3, 0.5),
    (9.0, np.pi, 0.6, 1.0),
    (6.0, 2 * np.pi, 0.6, 1.0),
    (9.0, 2 * np.pi, 0.5, 0.7),
]


def rig(far_end):
    """What `batch.yaml` states of the rig, its stiffness and friction a tenth off the truth."""
    side = {
        "pulley_radius_m": RADIUS,
        "encoder_counts_per_rev": COUNTS,
        "torque_constant_Nm_per_A": CONSTANT,
        "load_cell": {"sensitivity_V_per_N": SENSITIVITY, "zero_V": ZERO},
    }
    load = side | ({"spring_stiffness_Nm_per_rad": 1.1 * SPRING} if far_end == "spring" else {})
    return {
        "transmission": "single-cable",
        "far_end": far_end,
        "drive": side,
        "load": load,
        "cable": {"stiffness_N_per_m": 0.9 * STIFFNESS, "length_m": LENGTH, "friction_coefficient": 1.1 * FRICTION},
        "accuracy": {"encoder_rad": 0.00157, "torque_Nm": NOISE_NM, "load_cell_N": NOISE_N},
    }


def write_batch(folder, far_end="spring", active=(), seed=0):
    """A batch folder of a Bowden cable pulled over and over, with mechanisms that `batch.yaml` knows nothing of."""
    folder.mkdir(parents=True)
    draw = np.random.default_rng(seed)
    entries = []
    for number, (pretension, bend, amplitude, frequency) in enumerate(CASES):
        entry = {
            "id": f"r{number}",
            "file": f"r{number}.csv.gz",
            "pretension_N": pretension,
            "conduit": [{"length_m": LENGTH, "bend_rad": float(bend)}],
            "excitation": {"wave": "sine", "amplitude_rad": amplitude, "frequency_Hz": frequency},
        }
        entries.append(entry)
        with gzip.open(folder / entry["file"], "wt") as file:
            file.write(_log(far_end, pretension, bend, amplitude, frequency, active, draw))
    batch = {"format": 1, "batch": folder.name, "origin": "virtual-rig", "rig": rig(far_end), "recordings": entries}
    (folder / "batch.yaml").write_text(yaml.safe_dump(batch, sort_keys=False))
    return folder


def _log(far_end, pretension, bend, amplitude, frequency, active, draw):
    t = np.arange(1, round((REST_S + 3 / frequency) * RATE_HZ)) / RATE_HZ
    phase = 2 * np.pi * frequency * np.maximum(t - REST_S, 0)
    theta = 0.5 * amplitude * (1 - np.cos(phase))
    cable = Transmission(ConduitPath([LENGTH], [bend]), STIFFNESS * LENGTH, FRICTION, RADIUS, RADIUS, True)
    load = {
        "spring": SpringLoad(SPRING),
        "fixed": FixedLoad(),
        "measured-tension": TorqueLoad(RADIUS * (pretension + 2.0 * np.sin(phase) ** 2)),
        "measured-motion": AngleLoad(0.3 * theta),
    }[far_end]
    initial = InitialTension.uniform(cable.path, pretension)
    r = general.simulate(cable, load, t, theta, initial, active, elements=64).complete()
    step = 2 * np.pi / COUNTS
    read = r.read

    def noisy(values, noise):
        return values + draw.normal(0, noise, t.size)

    columns = {
        "time_s": t,
        "drive_encoder_counts": np.floor(read["theta_in_rad"] / step + draw.uniform()) + 100,
        "load_encoder_counts": np.floor((read["theta_out_rad"] - read["theta_out_rad"][0]) / step + draw.uniform()) - 4,
        "drive_current_A": noisy(read["tau_in_Nm"], NOISE_NM) / CONSTANT,
        "load_current_A": noisy(read["tau_out_Nm"], NOISE_NM) / CONSTANT,
        "drive_load_cell_V": ZERO + SENSITIVITY * noisy(read["F_drive_N"], NOISE_N),
        "load_load_cell_V": ZERO + SENSITIVITY * noisy(read["F_load_N"], NOISE_N),
    }
    rows = "\n".join(
        f"{a:.4f},{b:.0f},{c:.0f}," + ",".join(f"{v:.6f}" for v in rest)
        for a, b, c, *rest in zip(*columns.values(), strict=True)
    )
    return ",".join(columns) + "\n" + rows + "\n"
