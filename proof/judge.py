"""One case from its seed to what the diagnosis made of it, with no answer on disk while it works."""

import gzip
import json
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from proof import conceal, rivals
from proof.build import floors_of, folder_digest, record
from proof.cases import Case
from proof.measured import CHANNELS, error_squares

DRIVE = ("time_s", "drive_encoder_counts")
MODELS = {"before": "calibrated.json", "after": "model.json"}


def judge(
    case: Case,
    out: Path,
    sources: Path = conceal.SOURCES,
    tell: Callable[[str], None] = print,
    with_rivals: bool = False,
) -> dict:
    """Record a case, have it diagnosed where nothing else is, then record what is kept back and hold predictions to it.

    Parameters
    ----------
    case : Case
    out : Path
        Folder that gets the diagnosis with its page, and ``result.json``.
    sources : Path
        The diagnosis's package.
    tell : callable
        Takes a line on how it went.
    with_rivals : bool
        Whether `proof.rivals` are held to the same recordings.

    Returns
    -------
    dict
        What is in ``result.json``: the case's seed, the digests of its key and of the diagnosis's sources, what the
        diagnosis said, and in each channel the errors on the kept-back recordings before and after it, beside their
        floor.
    """
    started = conceal.core_s()
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="case-") as folder:
        batch, kept = Path(folder) / "batch" / case.name, Path(folder) / "kept" / case.name
        record(case, case.recordings, batch)
        digest = folder_digest(batch)
        ran = conceal.diagnose(batch, out, case.without, sources)
        diagnosis = _read(out / "diagnosis.json") if ran.code == 0 and not ran.tampering else None
        tampering, errors, rivalled = list(ran.tampering), {}, {}
        if diagnosis is not None:
            floors = floors_of(case, record(case, case.kept_back, kept))
            predictions = {which: Path(folder) / which for which in MODELS}
            errors = _errors(floors, kept, out, predictions, sources, tampering)
            if errors and with_rivals:
                conceal.predict(batch, {out / MODELS["before"]: Path(folder) / "fitted"}, sources)
                rivalled = rivals.errors(batch, Path(folder) / "fitted", kept, predictions["before"])
    result = {
        "case": case.name,
        "seed": case.seed,
        "asked": case.asked,
        "key": case.digest,
        **conceal.made_by(sources),
        "batch": digest,
        "tampering": tampering,
        "why": None if diagnosis is not None else f"exit code {ran.code}: {ran.said.strip()[-500:]}",
        "diagnosis": diagnosis,
        "errors": errors,
        "rivals": rivalled,
        "took_s": round(conceal.core_s() - started, 1),
    }
    (out / "result.json").write_text(json.dumps(result, indent=1), encoding="utf-8")
    tell(f"{case.name}: {diagnosis['verdict'] if diagnosis else 'no diagnosis'}, {result['took_s']:.0f} s of one core")
    return result


def _read(file: Path) -> dict | None:
    """What counts of a diagnosis: names, places, probabilities, values. None where there is none of the format."""
    try:
        said = json.loads(file.read_text(encoding="utf-8"))
        return {
            "verdict": said["verdict"],
            "place": (said.get("location") or {}).get("place"),
            "mechanisms": [_claim(m) for m in said.get("mechanisms") or []],
            "alternatives": [_claim(a) for a in said.get("alternatives") or []],
        }
    except (OSError, KeyError, ValueError, TypeError):
        return None


def _claim(said: dict) -> dict:
    return {
        "name": said["name"],
        "place": said.get("place"),
        "confidence": float(said["confidence"]),
        "parameters": said.get("parameters") or [],
    }


def _errors(
    floors: dict[str, dict[str, float]],
    kept: Path,
    out: Path,
    predictions: dict[str, Path],
    sources: Path,
    tampering: list[str],
) -> dict[str, dict[str, float]]:
    """By channel, the kept-back recordings' errors before and after the diagnosis and their floor, root mean square.

    Empty where a model of the diagnosis says nothing of one of the recordings. Predictions go to the folders of
    `predictions`; what one tried to reach is added to `tampering`.
    """
    squares = {"floor": [[floor[c] ** 2 for c in CHANNELS] for floor in floors.values()]}
    with tempfile.TemporaryDirectory(prefix="blinded-") as folder:
        blinded = Path(folder) / kept.name
        blind(kept, blinded)
        asked = {out / model: predictions[which] for which, model in MODELS.items()}
        tampering += conceal.predict(blinded, asked, sources).tampering
        for which, said in predictions.items():
            try:
                squares[which] = [error_squares(kept, id_, said / f"{id_}.csv") for id_ in floors]
            except (OSError, KeyError, ValueError):
                return {}
    mean = {which: np.sqrt(np.mean(values, axis=0)) for which, values in squares.items()}
    return {c: {which: float(mean[which][i]) for which in mean} for i, c in enumerate(CHANNELS)}


def blind(batch: Path, out: Path) -> None:
    """Copy a batch with every sensor but the drive's encoder standing still after the rest.

    A prediction may take the drive angle and the rest from a recording. What it must not see is not there.
    """
    out.mkdir()
    (out / "batch.yaml").write_bytes((batch / "batch.yaml").read_bytes())
    for log in batch.glob("*.csv.gz"):
        table = pd.read_csv(log)
        moving = table["time_s"] >= _rest_s(table)
        for name in table.columns.difference(DRIVE):
            still = table.loc[~moving, name].mean()
            table.loc[moving, name] = round(still) if name.endswith("counts") else still
        with gzip.open(out / log.name, "wt") as file:
            table.to_csv(file, index=False, float_format="%.9g")


def _rest_s(log: pd.DataFrame) -> float:
    """When the drive's count first changes, s."""
    counts = log["drive_encoder_counts"]
    return float(log["time_s"][int(np.argmax(counts != counts[0]))])
