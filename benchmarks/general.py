"""Time of the general solver a sample, on one core: ``python benchmarks/general.py``.

Prints microseconds a sample, best of some repeats, for the smooth sine at 1,000 samples a cycle with 32 elements a
cable, without effects, with presliding and with every mechanism at its starting values; the same for a noisy and for
a jumping drive; and the exponent of time against elements from 8 to 256.
"""

import json
import time

import numpy as np

from ccmodel import mechanisms
from ccmodel.geometry import ConduitPath
from ccmodel.model.general import Active, simulate
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.transmission import Transmission

SAMPLES, CYCLES, REPEATS = 1000, 5, 9
PATH = ConduitPath([1.2], [np.pi])
TRANSMISSION = Transmission(PATH, 7750 * 1.2, 0.156, 0.006, 0.006)
PRESLIDING = [Active("presliding", "conduit", {"z0": 50e-6})]


def everything() -> list[Active]:
    """Every mechanism at every place it can have, at its starting values."""
    return [Active(n, p, mechanisms.get(n).start) for n in mechanisms.names() for p in mechanisms.get(n).places]


def drives() -> dict[str, np.ndarray]:
    """Drive angles, rad: smooth; with noise of half a coarse encoder's step; jumping at every sample."""
    rng = np.random.default_rng(1)
    smooth = 0.6 * np.sin(2 * np.pi * np.arange(CYCLES * SAMPLES) / SAMPLES)
    noisy = smooth + rng.normal(0, 1.5e-3, smooth.size)
    jumping = rng.uniform(-0.6, 0.6, smooth.size)
    noisy[0] = jumping[0] = 0.0
    return {"smooth": smooth, "noisy": noisy, "jumping": jumping}


def us_per_sample(theta_in: np.ndarray, active: list[Active], elements: int = 32) -> float:
    """Best time of a run over its samples, microseconds."""
    time_s = np.arange(theta_in.size) / SAMPLES
    initial = InitialTension.uniform(PATH, 7.3)
    best = np.inf
    for _ in range(REPEATS):
        start = time.perf_counter()
        simulate(TRANSMISSION, SpringLoad(0.05), time_s, theta_in, initial, active, elements).complete()
        best = min(best, time.perf_counter() - start)
    return best / theta_in.size * 1e6


def measure() -> dict[str, float]:
    """All figures by name."""
    figures = {}
    models = {"": [], "_presliding": PRESLIDING, "_everything": everything()}
    for drive, theta_in in drives().items():
        for model, active in models.items():
            suffix = "" if drive == "smooth" else f"_{drive}"
            figures[f"general{model}{suffix}_us_per_sample"] = us_per_sample(theta_in, active)
    elements = np.array([8, 16, 32, 64, 128, 256])
    times = [us_per_sample(drives()["smooth"], PRESLIDING, int(n)) for n in elements]
    figures |= {f"general_presliding_{n}_elements_us_per_sample": t for n, t in zip(elements, times, strict=True)}
    figures["general_cost_exponent"] = float(np.polyfit(np.log(elements), np.log(times), 1)[0])
    return figures


if __name__ == "__main__":
    print(json.dumps({name: round(value, 3) for name, value in measure().items()}, indent=1))
