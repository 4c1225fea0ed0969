"""Rigs with several concealed effects, each of them visible by itself: which of them does the diagnosis name?

``python -m benchmarks.several_effects --kind triple --seed S --count N --out DIR`` draws a rig for each seed, with
eight effects in random order. The rig is recorded with one effect at a time, until as many are visible by themselves
as its kind has; it has these. An effect is visible by itself if the recalibrated model is then off by the proof's
`VISIBLE` noise floors on the held-out recordings. The first N such rigs are diagnosed as the proof does; how many
effects were tried for them is printed with the rates.
"""

import argparse
import json
import tempfile
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from itertools import count
from pathlib import Path
from typing import Any

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


def visible_case(seed: int, size: int) -> tuple[Case | None, int]:
    """A rig with as many effects that are visible by themselves, and how many were tried; None if there are not."""
    drawn, visible = draw(seed, "many"), []
    for k in range(len(drawn.truth)):
        if visible_alone(drawn.having([k])):
            visible.append(k)
        if len(visible) == size:
            return drawn.having(visible), k + 1
    return None, len(drawn.truth)


def judged(seed: int, kind: str, out: Path) -> dict:
    """Result of a rig: its effects, and what was named; read again if it exists.

    A rig with too few visible effects is not diagnosed, and has no ``verdict``.
    """
    set_threads(1)
    file = out / f"{kind}-{seed}" / "several.json"
    if file.exists():
        return json.loads(file.read_text(encoding="utf-8"))
    case, tried = visible_case(seed, SEVERAL[kind])
    row: dict[str, Any] = {"seed": seed, "tried": tried, "visible": case is not None}
    if case is not None:
        result = judge(case, file.parent, report=lambda text: None, with_follow_ups=False)
        found = outcome(result)
        row |= {
            "case": case.name,
            "protocol": case.protocol,
            "true": [t.name for t in case.truth],
            "verdict": found.verdict,
            "failure": found.failure,
            "named": [m["name"] for m in found.identified],
            "all_named": found.are_all_identified,
            "all_accounted_for": found.are_all_accounted_for,
            "not_there": [m["name"] for m in found.identified if not found.true_among([m])],
            "all_listed": found.true_names <= found.true_among([*found.identified, *found.listed]),
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
    """How often all effects are named, named or learned, listed; one that is not there named, or more than there are.

    An effect counts at its place.
    """
    all_named, all_accounted_for, all_listed = (
        [r[key] for r in rows] for key in ("all_named", "all_accounted_for", "all_listed")
    )
    wrong = [bool(r["not_there"]) for r in rows]
    too_many = [len(r["named"]) > size for r in rows]
    return [
        rate("all effects named", sum(all_named), len(rows)),
        rate("all effects named, or a law learned in the slot of one", sum(all_accounted_for), len(rows)),
        rate("all effects named or among the alternatives", sum(all_listed), len(rows)),
        rate("an effect named that is not there", sum(wrong), len(rows)),
        rate("more effects named than there are", sum(too_many), len(rows)),
    ]


def main() -> None:
    """Diagnose the cases and print a line for each, then the rates."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kind", choices=("pair", "triple"), default="triple")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    rows, tried = [], 0
    seeds = count(asked.seed)
    with ProcessPoolExecutor(asked.cores) as pool:
        waiting = {pool.submit(judged, next(seeds), asked.kind, asked.out) for _ in range(asked.cores)}
        while waiting:
            ready, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            for done in ready:
                tried += done.result()["tried"]
                if done.result()["visible"]:
                    rows.append(done.result())
                    print(json.dumps(rows[-1]), flush=True)
                if len(rows) + len(waiting) < asked.count:
                    waiting.add(pool.submit(judged, next(seeds), asked.kind, asked.out))
    print(f"{tried} effects tried, {len(rows)} rigs of {SEVERAL[asked.kind]} that are visible by themselves")
    for one in rates(rows, SEVERAL[asked.kind]):
        print(text_of(one))


if __name__ == "__main__":
    main()
