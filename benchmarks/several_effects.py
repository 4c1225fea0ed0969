"""Rigs with several concealed effects, each of them visible by itself: which of them does the diagnosis name?

``python -m benchmarks.several_effects --kind triple --seed S --count N --out DIR`` draws N cases and diagnoses them as
the proof does. Where an effect is not named, its rig is recorded again with each effect alone. An effect is visible by
itself if the recalibrated model is then off by the proof's `VISIBLE` noise floors on the held-out recordings.
"""

import argparse
import json
import tempfile
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

import ccmodel
from ccmodel.inference.pool import set_threads
from proof.build import noise_floors, record
from proof.cases import SEVERAL, Case, draw
from proof.intervals import rate, text_of
from proof.judge import blind, judge
from proof.measured import CHANNELS, error_squares
from proof.outcome import VISIBLE, outcome


def visible_alone(case: Case) -> bool:
    """Whether the recalibrated model of a case with a single effect is visibly off on its held-out recordings."""
    with tempfile.TemporaryDirectory() as folder:
        batch, held_out, blinded = (Path(folder) / name for name in ("batch", "held-out", "blinded"))
        batch, held_out, blinded = (path / case.name for path in (batch, held_out, blinded))
        record(case, case.recordings, batch)
        floors = noise_floors(case, record(case, case.kept_back, held_out))
        blinded.parent.mkdir()
        blind(held_out, blinded)
        predicted = Path(folder) / "predicted"
        ccmodel.predict(ccmodel.fit(batch), blinded).save(predicted)
        squares = [error_squares(held_out, id_, predicted / f"{id_}.csv") for id_ in floors]
    over = [
        (sum(s[c] for s in squares) / sum(floor[channel] ** 2 for floor in floors.values())) ** 0.5
        for c, channel in enumerate(CHANNELS)
    ]
    return max(over) >= VISIBLE


def judged(seed: int, kind: str, out: Path) -> dict:
    """Result of a case: its effects, which of them are visible alone, and what was named; read again if it exists."""
    set_threads(1)
    case = draw(seed, kind)
    file = out / case.name / "several.json"
    if file.exists():
        return json.loads(file.read_text(encoding="utf-8"))
    result = judge(case, out / case.name, report=lambda text: None, with_follow_ups=False)
    found = outcome(result)
    true, named = [t.name for t in case.truth], [m["name"] for m in found.identified]
    missed = bool(set(true) - set(named))
    row = {
        "case": case.name,
        "protocol": case.protocol,
        "true": true,
        "visible": [bool(visible_alone(case.alone(k))) for k in range(len(true))] if missed else None,
        "verdict": found.verdict,
        "failure": found.failure,
        "named": named,
        "confidence": [m["confidence"] for m in found.identified],
        "alternatives": found.alternatives,
        "before": found.error_before,
        "after": found.error_after,
        "took_s": result["took_s"],
    }
    file.write_text(json.dumps(row), encoding="utf-8")
    return row


def rates(rows: list[dict], size: int) -> list[dict]:
    """How often all effects are named, one that is not there, and more than there are."""
    all_named = [set(r["true"]) <= set(r["named"]) for r in rows]
    wrong = [bool(set(r["named"]) - set(r["true"])) for r in rows]
    too_many = [len(r["named"]) > size for r in rows]
    unseen = sum(not all(r["visible"]) for r in rows if r["visible"])
    return [
        rate("all effects named", sum(all_named), len(rows)),
        rate("all effects named, without missed cases that have an invisible one", sum(all_named), len(rows) - unseen),
        rate("an effect named that is not there", sum(wrong), len(rows)),
        rate("more effects named than there are", sum(too_many), len(rows)),
    ]


def main() -> None:
    """Diagnose the cases and print a line for each, then the rates."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kind", choices=SEVERAL, default="triple")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    rows = []
    with ProcessPoolExecutor(asked.cores) as pool:
        seeds = range(asked.seed, asked.seed + asked.count)
        for done in as_completed(pool.submit(judged, seed, asked.kind, asked.out) for seed in seeds):
            rows.append(done.result())
            print(json.dumps(rows[-1]), flush=True)
    for one in rates(rows, SEVERAL[asked.kind]):
        print(text_of(one))


if __name__ == "__main__":
    main()
