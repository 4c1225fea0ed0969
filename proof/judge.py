"""One case from its seed to its result. No answer is on disk while the diagnosis runs."""

import gzip
import json
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from proof import conceal, regressors
from proof.build import folder_digest, noise_floors, record
from proof.cases import Case
from proof.follow_up import follow_ups
from proof.measured import CHANNELS, error_squares

DRIVE_COLUMNS = ("time_s", "drive_encoder_counts")
# Model files of a diagnosis: with recalibrated parameters alone, and with the identified mechanisms.
MODELS = {"before": "calibrated.json", "after": "model.json"}

Report = Callable[[str], None]


def judge(
    case: Case,
    out: Path,
    sources: Path = conceal.SOURCES,
    report: Report = print,
    with_regressors: bool = False,
    with_follow_ups: bool = True,
) -> dict:
    """Record a case, have it diagnosed in isolation, then compare its models' predictions with held-out recordings.

    Parameters
    ----------
    case : Case
    out : Path
        Folder that gets the diagnosis with its page, and ``result.json``.
    sources : Path
        The diagnosis's package.
    report : callable
        Called with a line on each stage and on the outcome.
    with_regressors : bool
        Whether the reference regressors (`proof.regressors`) are fitted to the same recordings.
    with_follow_ups : bool
        Whether an open case is diagnosed again with a further experiment (`proof.follow_up`).

    Returns
    -------
    dict
        Content of ``result.json``: seed, digests of answer and sources, the diagnosis, and by channel the root mean
        square errors on held-out recordings before and after it, with the noise floor. Of an open case also the
        diagnoses with a further experiment, whose time is not in that of the case.
    """
    started = conceal.core_s()
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="case-") as folder:
        batch = Path(folder) / "batch" / case.name
        report(f"{case.name}: recording")
        record(case, case.recordings, batch)
        report(f"{case.name}: diagnosing, {conceal.core_s() - started:.0f} s of one core so far")
        digest = folder_digest(batch)
        before_s = conceal.core_s()
        completed = conceal.diagnose(batch, out, case.without, sources)
        diagnosis_s = conceal.core_s() - before_s
        report(f"{case.name}: predicting held-out recordings, {conceal.core_s() - started:.0f} s of one core so far")
        diagnosis = _read_diagnosis(out / "diagnosis.json") if completed.is_usable else None
        held_out = _compare_with_held_out(case, batch, out, sources, with_regressors) if diagnosis else _HeldOut()
        took_s = conceal.core_s() - started
        again, further = _Again(case, sources), {}
        if diagnosis and with_follow_ups:
            further = follow_ups(case, out / "diagnosis.json", batch, Path(folder), again.diagnosed)
    result = {
        "case": case.name,
        "seed": case.seed,
        "asked": case.requested,
        "key": case.digest,
        **conceal.made_by(sources),
        "batch": digest,
        "tampering": [*completed.tampering, *again.tampering, *held_out.tampering],
        "why": None if diagnosis is not None else completed.failure,
        "diagnosis": diagnosis,
        "errors": held_out.errors,
        "rivals": held_out.regressors,
        "follow_ups": further,
        "diagnosis_s": round(diagnosis_s, 1),
        "took_s": round(took_s, 1),
    }
    write_result(result, out, report)
    return result


def write_result(result: dict, out: Path, report: Report) -> None:
    """Write ``result.json``, and report its verdict and processor time."""
    (out / "result.json").write_text(json.dumps(result, indent=1), encoding="utf-8")
    verdict = result["diagnosis"]["verdict"] if result["diagnosis"] else "no diagnosis"
    report(f"{result['case']}: {verdict}, {result['took_s']:.0f} s of one core")


def _read_diagnosis(file: Path) -> dict | None:
    """The scored part of a diagnosis: names, places, confidences, values. None if the file has another format."""
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        return {
            "verdict": content["verdict"],
            "place": (content.get("location") or {}).get("place"),
            "mechanisms": [_claim(m) for m in content.get("mechanisms") or []],
            "alternatives": [_claim(a) for a in content.get("alternatives") or []],
            "laws": content.get("laws") or [],
        }
    except (OSError, KeyError, ValueError, TypeError):
        return None


def _claim(mechanism: dict) -> dict:
    return {
        "name": mechanism["name"],
        "place": mechanism.get("place"),
        "confidence": float(mechanism["confidence"]),
        "parameters": mechanism.get("parameters") or [],
    }


@dataclass
class _Again:
    """Further diagnoses of a case; what they were refused is collected in `tampering`."""

    case: Case
    sources: Path
    tampering: tuple[str, ...] = ()

    def diagnosed(self, batch: Path, out: Path) -> dict | None:
        """Diagnose a batch of the case; None without a usable result."""
        completed = conceal.diagnose(batch, out, self.case.without, self.sources)
        self.tampering += completed.tampering
        return _read_diagnosis(out / "diagnosis.json") if completed.is_usable else None


@dataclass
class _HeldOut:
    """Comparison with the held-out recordings: errors, errors of the reference regressors, refused accesses."""

    errors: dict[str, dict[str, float]] = field(default_factory=dict)
    regressors: dict[str, dict[str, float]] = field(default_factory=dict)
    tampering: tuple[str, ...] = ()


def _compare_with_held_out(case: Case, batch: Path, out: Path, sources: Path, with_regressors: bool) -> _HeldOut:
    found = _HeldOut()
    with tempfile.TemporaryDirectory(prefix="held-out-") as folder:
        recordings = Path(folder) / "kept" / case.name
        floors = noise_floors(case, record(case, case.kept_back, recordings))
        predictions = {which: Path(folder) / which for which in MODELS}
        found.tampering = _predict_blinded(recordings, out, predictions, sources)
        found.errors = _errors(floors, recordings, predictions)
        if found.errors and with_regressors:
            fitted = Path(folder) / "fitted"
            conceal.predict(batch, {out / MODELS["before"]: fitted}, sources)
            found.regressors = regressors.errors(batch, fitted, recordings, predictions["before"])
    return found


def _predict_blinded(recordings: Path, out: Path, predictions: dict[str, Path], sources: Path) -> tuple[str, ...]:
    """Predict held-out recordings with the models in `out`; returns the accesses that were refused."""
    with tempfile.TemporaryDirectory(prefix="blinded-") as folder:
        blinded = Path(folder) / recordings.name
        blind(recordings, blinded)
        models = {out / model: predictions[which] for which, model in MODELS.items()}
        return conceal.predict(blinded, models, sources).tampering


def _errors(
    floors: dict[str, dict[str, float]], recordings: Path, predictions: dict[str, Path]
) -> dict[str, dict[str, float]]:
    """By channel, the root mean square error of each model over the held-out recordings, and the noise floor.

    Empty if a prediction is missing or not finite.
    """
    squares = {"floor": [[floor[c] ** 2 for c in CHANNELS] for floor in floors.values()]}
    for which, predicted in predictions.items():
        try:
            squares[which] = [error_squares(recordings, id_, predicted / f"{id_}.csv") for id_ in floors]
        except (OSError, KeyError, ValueError):
            return {}
    mean = {which: np.sqrt(np.mean(values, axis=0)) for which, values in squares.items()}
    return {c: {which: float(mean[which][i]) for which in mean} for i, c in enumerate(CHANNELS)}


def blind(batch: Path, out: Path) -> None:
    """Copy a batch, with every sensor but the drive's encoder frozen at its mean over the rest.

    A prediction may use the drive angle and the rest of a recording. The remaining measurements are not in the copy.
    """
    out.mkdir()
    (out / "batch.yaml").write_bytes((batch / "batch.yaml").read_bytes())
    for log in batch.glob("*.csv.gz"):
        table = pd.read_csv(log)
        moving = table["time_s"] >= _rest_s(table)
        for name in table.columns.difference(DRIVE_COLUMNS):
            at_rest = table.loc[~moving, name].mean()
            table.loc[moving, name] = round(at_rest) if name.endswith("counts") else at_rest
        with gzip.open(out / log.name, "wt") as file:
            table.to_csv(file, index=False, float_format="%.9g")


def _rest_s(log: pd.DataFrame) -> float:
    """Time at which the drive's count first changes, s."""
    counts = log["drive_encoder_counts"]
    return float(log["time_s"][int(np.argmax(counts != counts[0]))])
