"""Rigs whose effect no single study decides: how often their studies decide it when they are diagnosed together.

Each rig has one concealed effect, drawn as in the proof but without the largest and the smallest ones, and is recorded
in three studies on three days. A study repeats one condition; the studies differ in bend, pretension and motion. From
day to day friction differs by a further 2 % (`BETWEEN`), which no batch file states, and every recording has zeros and
a pretension of its own. A rig counts if none of its studies, diagnosed by itself, is `explained`, and at least one is
`undecided`; those whose studies are each `undecided` are counted apart. It is decided if all three together are
`explained`, with the true effect named first.

A study has two recordings. One (`--repeats 1`) would be `undecided` by rule, whatever it shows.

    python -m benchmarks.joint_rigs --first 8000000 --rigs 25 --cores 2 --out results/joint-rigs.csv
"""

import argparse
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import count, islice
from pathlib import Path

import numpy as np
import pandas as pd

import ccmodel as cc
from benchmarks.clock import NEVER_S
from ccmodel.inference.pool import set_threads
from proof.build import record
from proof.cases import Case, draw
from proof.intervals import rate, text_of
from proof.plan import Conditions as Factors
from proof.plan import PlannedRecording, Protocol, read_plan
from proof.recording_draw import Conditions, draw_recordings

FIRST_SEED = 8_000_000  # far from the seeds of tests, proofs and other benchmarks
# Strengths of the effects, from 0 (barely visible) to 1 (large), as in `proof.cases.Truth`. Weaker ones no study shows;
# stronger ones every study decides.
STRENGTHS = (0.1, 0.6)
# Standard deviation of a day's friction over the rig's, besides the 1 % from run to run.
BETWEEN = 0.02
# By study, factors of the rig's pretension and bend, and amplitude (rad) and frequency (Hz) of the drive's sine.
STUDIES = {"loops": (1.0, 2.0, 0.3, 0.5), "pretension": (0.45, 1.0, 0.3, 0.5), "speed": (1.0, 1.0, 0.3, 0.8)}
SINE = {"wave": "sine", "rest_s": 0.5, "start_up_cycles": 0.5, "cycles": 3.0}
WANTED = 0.8


def studies(seed: int, repeats: int = 2) -> dict[str, Case]:
    """The batches of a rig with one effect, by study, each as a case whose name is the batch's."""
    plan, rig = read_plan(), draw(seed, "single")
    random = np.random.default_rng([seed, 0x10E7])
    own = Conditions(
        pretension_N=random.uniform(*plan.rig.pretension_N),
        bend_rad=random.uniform(*plan.rig.bend_rad),
        length_m=rig.campaign.rig.cable.length_m,
    )
    return {name: _study(rig, name, own, repeats, random) for name in STUDIES}


def _study(rig: Case, name: str, own: Conditions, repeats: int, random: np.random.Generator) -> Case:
    """The batch of one study, one condition that is recorded `repeats` times on a day of its own."""
    pretension, bend, amplitude_rad, frequency_Hz = STUDIES[name]
    motion = SINE | {"amplitude_rad": amplitude_rad, "frequency_Hz": frequency_Hz}
    planned = [
        {"id": f"{name}-{k}", "pretension": pretension, "bend": bend, "motion": motion}
        | ({"again": f"{name}-0"} if k else {})
        for k in range(repeats)
    ]
    whole = Factors(pretension=(1.0, 1.0), bend=(1.0, 1.0))
    protocol = Protocol(recordings=tuple(map(PlannedRecording.model_validate, planned)), kept_back=whole)
    cable = rig.campaign.rig.cable
    friction = cable.friction_coefficient * (1 + BETWEEN * random.standard_normal())
    of_day = rig.campaign.rig.model_copy(update={"cable": cable.model_copy(update={"friction_coefficient": friction})})
    campaign = rig.campaign.model_copy(update={"rig": of_day})
    plans = draw_recordings(protocol, read_plan(), own, random)
    return replace(rig, name=name, campaign=campaign, recordings=plans)


def row(seed: int, repeats: int = 2) -> dict:
    """Verdicts on a rig's studies, and, if each is `undecided`, on all of them together."""
    set_threads(1)
    started, cases = time.process_time(), studies(seed, repeats)
    (truth,) = next(iter(cases.values())).truth
    found: dict = {"seed": seed, "truth": truth.name, "place": truth.place, "strength": round(truth.strength, 3)}
    with tempfile.TemporaryDirectory() as folder:
        batches = [Path(folder) / name for name in cases]
        for case, batch in zip(cases.values(), batches, strict=True):
            record(case, case.recordings, batch)
            said = cc.diagnose(batch, time_limit_s=NEVER_S)
            found |= {case.name: said.verdict, f"{case.name}_confidence": said.confidence}
            # The rig does not count; the time is better spent on another.
            if found[case.name] == "explained":
                break
        else:
            if "undecided" in (verdicts := [found[name] for name in cases]):
                found |= _together(batches, truth.name) | {"all_undecided": set(verdicts) == {"undecided"}}
    return found | {"took_s": round(time.process_time() - started, 1)}


def _together(batches: list[Path], truth: str) -> dict:
    said = cc.diagnose(batches, time_limit_s=NEVER_S)
    named = [m["name"] for m in said.report["mechanisms"]]
    return {
        "together": said.verdict,
        "named": " + ".join(named),
        "confidence": said.confidence,
        "alternatives": " ".join(f"{a['name']}:{a['confidence']:.2f}" for a in said.report["alternatives"]),
        "decided": said.verdict == "explained" and named[:1] == [truth],
    }


def rows(first: int, rigs: int, most: int, repeats: int, cores: int) -> Iterator[dict]:
    """Rows of rigs from the seed `first` on, until so many count, or the `most` were drawn."""
    low, high = STRENGTHS
    seeds, counted = islice((s for s in count(first) if low < draw(s, "single").truth[0].strength < high), most), 0
    with ProcessPoolExecutor(cores) as pool:
        while counted < rigs and (chunk := list(islice(seeds, cores))):
            for one in pool.map(partial(row, repeats=repeats), chunk):
                counted += "decided" in one
                yield one


def rates(table: pd.DataFrame) -> list[dict]:
    """How many rigs count, and how many of these are decided, rightly or wrongly."""
    asked = table[table["together"].notna()] if "together" in table else table.iloc[:0]
    decided = asked["decided"].astype(bool) if len(asked) else pd.Series(dtype=bool)
    wrong = (asked["together"] == "explained") & ~decided if len(asked) else decided
    each = asked["all_undecided"].astype(bool) if len(asked) else decided
    return [
        rate("rigs without an explained study, with one or more undecided", len(asked), len(table)),
        rate("decided together, of these", int(decided.sum()), len(asked), WANTED),
        rate("explained by another effect, of these", int(wrong.sum()), len(asked)),
        rate("rigs with three undecided studies: decided together", int(decided[each].sum()), int(each.sum()), WANTED),
    ]


def main() -> None:
    """Run as a script."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="seed of the first rig")
    parser.add_argument("--rigs", type=int, default=25, help="rigs that count")
    parser.add_argument("--most", type=int, default=600, help="rigs that are recorded at most")
    parser.add_argument("--repeats", type=int, default=2, help="recordings of each study")
    parser.add_argument("--cores", type=int, default=1, help="processes")
    parser.add_argument("--out", type=Path, required=True, help="CSV with a row for each rig")
    asked = parser.parse_args()
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    found: list[dict] = []
    for one in rows(asked.first, asked.rigs, asked.most, asked.repeats, asked.cores):
        found.append(one)
        print(" ".join(f"{key}={value}" for key, value in one.items()), flush=True)
        # An interrupted run leaves what it has.
        pd.DataFrame(found).to_csv(asked.out, index=False)
    print(*map(text_of, rates(pd.DataFrame(found))), sep="\n")


if __name__ == "__main__":
    main()
