"""Content for pages: recordings, models and diagnoses made by hand."""

import numpy as np
import pandas as pd

from builders import recording
from ccmodel.errors import COLUMNS
from ccmodel.report.page import viewer
from ccmodel.report.page.writing import Content

BACKLASH = {
    "name": "backlash",
    "place": "load-pulley",
    "confidence": 0.97,
    "parameters": [{"name": "half_gap", "value": 0.0301, "low": 0.0292, "high": 0.0309, "unit": "rad"}],
}
SCALE = {
    "name": "torque-scale",
    "place": "load-sensor",
    "confidence": 0.99,
    "parameters": [{"name": "gain", "value": 0.148, "low": 0.147, "high": 0.149, "unit": "1"}],
}
ERROR = {
    "tau_out": {"before": 6e-4, "after": 1.2e-4, "noise": 1e-4, "unit": "N*m"},
    "theta_out": {"before": 2e-3, "after": 1e-3, "noise": 1e-3, "unit": "rad"},
}
UNCHANGED = {channel: e | {"after": e["before"]} for channel, e in ERROR.items()}


def diagnosis(batch: str, verdict: str | None, **changed) -> dict:
    """Content of diagnosis.json of a verdict, with some of it changed."""
    if verdict is None:
        return {"batch": batch, "verdict": None, "why": "no recording that can be used"} | changed
    found = {
        "format": 1,
        "batch": batch,
        "verdict": verdict,
        "is_held": False,
        "location": {"place": None if verdict == "agrees" else "load-pulley", "channels": [], "phases": [], "text": ""},
        "mechanisms": [BACKLASH] if verdict == "explained" else [],
        "laws": [],
        "alternatives": [],
        "likeliest": [],
        "repeatability": [],
        "nearest": None,
        "fit": {
            "held_out": ["a", "b"],
            "calibrated": {},
            "mean_square": {"calibrated": 1.1, "extended": 1.0},
            "error": ERROR if verdict in ("explained", "learned", "undecided") else UNCHANGED,
        },
        "next_experiment": None,
        "not_judged": [],
    }
    if verdict == "unexplained":
        found["nearest"] = {"mechanisms": [BACKLASH], "mean_square": 9.0, "one_fault_at": [], "error": ERROR}
    if verdict == "inputs-inconsistent":
        found["location"] = {"place": None, "places": [], "channels": [], "phases": [], "text": ""}
        found["fit"] |= {"held_out": [], "mean_square": {"calibrated": None, "extended": None}, "error": {}}
        found["next_experiment"] = {"text": "Correct batch.yaml.", "separates": []}
        found["not_judged"] = [{"what": "one.csv, tau_in_Nm", "why": "is 0 throughout", "confidence": 1.0}]
    if verdict == "undecided":
        found |= {"likeliest": [BACKLASH], "alternatives": [BACKLASH | {"confidence": 0.5}]}
    return found | changed


def summary(batch: str, origin: str = "virtual-rig", note: str = "") -> dict:
    """Summary of an ingested batch."""
    rig = {"transmission": "pull-pull"}
    stated = {"batch": batch, "origin": origin, "note": note, "rig": rig}
    return {"folder": f"data/raw/{batch}", "batch": stated, "recordings": [{"id": "r"}], "findings": []}


def run(id: str = "r", origin: str = "virtual-rig", duration: float = 12.0, noise: float = 0.0):
    """A recording with all channels of a screen, and a calibrated and an extended model of it."""
    random = np.random.default_rng(0)
    wave = lambda size, late=0.0: lambda t: size * np.sin(2 * np.pi * t - late)  # noqa: E731
    made = {"theta_out_rad": (0.8, 0.3), "tau_in_Nm": (0.05, 0.1), "tau_out_Nm": (0.04, 0.3)}
    tensions = {name: (lambda t: 7.0 + np.sin(2 * np.pi * t)) for name in ("T1_N", "T2_N", "T3_N", "T4_N")}
    recorded = recording(duration, id=id, **{name: wave(*of) for name, of in made.items()}, **tensions)
    recorded = recorded.with_channels(recorded.channels, recorded.derived_from, origin)
    models = {}
    for name, share in (("calibrated", 0.9), ("extended", 0.99)):
        channels = {
            c: share * values + noise * np.ptp(values) * random.standard_normal(values.size)
            for c, values in recorded.channels.items()
        }
        models[name] = recorded.with_channels(channels, dict.fromkeys(channels, "model"), "model")
    return recorded, models


def entries(count: int = 2, batch: str = "b", **kw) -> list[dict]:
    """Runs for the viewer."""
    return [viewer.entry(*run(f"run-{k}", **kw)) | {"batch": batch} for k in range(count)]


def content(*diagnoses: dict, **given) -> Content:
    """Content of a page on the batches of these diagnoses."""
    nothing = pd.DataFrame([], columns=list(COLUMNS)).astype(COLUMNS)
    batches = given.pop("batches", [summary(d["batch"]) for d in diagnoses])
    reports = {d["batch"]: f"<main><h1>Report of {d['batch']}</h1></main>" for d in diagnoses}
    return Content(**{"batches": batches, "errors": nothing, "diagnoses": diagnoses, "reports": reports} | given)
