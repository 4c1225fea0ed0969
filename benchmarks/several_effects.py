"""Rigs with several concealed effects, each of them visible by itself: which of them does the diagnosis name?

``python -m benchmarks.several_effects --kind triple --seed S --count N --out DIR`` draws cases one seed after the
other. A case's rig is first recorded with each of its effects alone. An effect is visible by itself if the recalibrated
model is then off by the proof's `VISIBLE` noise floors on the held-out recordings. The first N cases all of whose
effects are visible are diagnosed as the proof does; how many were drawn for them is printed with the rates.
"""

import argparse
import json
import tempfile
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from itertools import count
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
        ccmodel.predict(ccmodel.fit(batch, trust_inputs=True), blinded).save(predicted)
        squares = [error_squares(held_out, id_, predicted / f"{id_}.csv") for id_ in floors]
    over = [
        (sum(s[c] for s in squares) / sum(floor[channel] ** 2 for floor in floors.values())) ** 0.5
        for c, channel in enumerate(CHANNELS)
    ]
    return max(over) >= VISIBLE


def judged(seed: int, kind: str, out: Path) -> dict:
    """Result of a case: its effects, whether each is visible alone, and what was named; read again if it exists.

    A case with an effect that is not visible is not diagnosed, and has no ``verdict``.
    """
    set_threads(1)
    case = draw(seed, kind)
    file = out / case.name / "several.json"
    if file.exists():
        return json.loads(file.read_text(encoding="utf-8"))
    row = {"case": case.name, "seed": seed, "protocol": case.protocol, "true": [t.name for t in case.truth]}
    row["visible"] = all(visible_alone(case.alone(k)) for k in range(len(row["true"])))
    if row["visible"]:
        result = judge(case, out / case.name, report=lambda text: None, with_follow_ups=False)
        found = outcome(result)
        row |= {
            "verdict": found.verdict,
            "failure": found.failure,
            "named": [m["name"] for m in found.identified],
            "confidence": [m["confidence"] for m in found.identified],
            "alternatives": found.alternatives,
            "before": found.error_before,
            "after": found.error_after,
            "took_s": result["took_s"],
        }
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(row), encoding="utf-8")
    return row


def rates(rows: list[dict], size: int) -> list[dict]:
    """How often all effects are named, listed, one that is not there named, and more named than there are."""
    all_named = [set(r["true"]) <= set(r["named"]) for r in rows]
    all_listed = [set(r["true"]) <= {*r["named"], *r["alternatives"]} for r in rows]
    wrong = [bool(set(r["named"]) - set(r["true"])) for r in rows]
    too_many = [len(r["named"]) > size for r in rows]
    return [
        rate("all effects named", sum(all_named), len(rows)),
        rate("all effects named or among the alternatives", sum(all_listed), len(rows)),
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
    rows, drawn = [], 0
    seeds = count(asked.seed)
    with ProcessPoolExecutor(asked.cores) as pool:
        waiting = {pool.submit(judged, next(seeds), asked.kind, asked.out) for _ in range(asked.cores)}
        while waiting:
            ready, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            for done in ready:
                drawn += 1
                if done.result()["visible"]:
                    rows.append(done.result())
                    print(json.dumps(rows[-1]), flush=True)
                if len(rows) + len(waiting) < asked.count:
                    waiting.add(pool.submit(judged, next(seeds), asked.kind, asked.out))
    print(f"{drawn} cases drawn, {len(rows)} with every effect visible by itself")
    for one in rates(rows, SEVERAL[asked.kind]):
        print(text_of(one))


if __name__ == "__main__":
    main()
