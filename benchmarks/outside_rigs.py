"""Concealed effects on rigs that do not share the forms, the damping and the constants of the model.

    python -m benchmarks.outside_rigs build DIR --seed 0 --count 3 [--kind kink ...]
    python -m benchmarks.outside_rigs diagnose RESULTS DIR [--cores 2]
    python -m benchmarks.outside_rigs score RESULTS DIR

The proof's rig has the model's friction law, a load without noticeable mass and one sampling rate. Here friction is of
Iwan elements with lengths of their own, the load always has a little mass and hardly any damping, and pulleys, cables,
springs, encoders, rates and tensions vary more widely. The kinds are those that were missed on such rigs. A folder has
`cases`, `kept-back` and `keys.json`, like ``python -m proof build --with-keys``. RESULTS holds, for each case,
diagnosis.json and the predictions of the kept-back recordings in calibrated/ and extended/.

An effect is visible if the calibrated model errs on the kept-back recordings by `VISIBLE` noise floors at least.
"""

import argparse
import gzip
import json
import time
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from numpy.random import Generator
from numpy.typing import NDArray

import ccmodel
from benchmarks.clock import NEVER_S
from ccmodel.inference.pool import set_threads
from proof.build import noise_floor, simulate
from proof.plan import read_plan
from proof.recording_draw import Conditions, draw_held_out, draw_recordings
from proof.rig_draw import draw_campaign, log_uniform, rounded
from virtualrig.campaign import as_yaml, compress, description, log_name, prepare, recording_generator, rig_during
from virtualrig.config import Campaign, Piece, RecordingPlan
from virtualrig.effects import Effects, merged
from virtualrig.sensors import log
from virtualrig.trajectory import Preparation, Trajectory

STREAM = 0x0175
VISIBLE = 3 * np.sqrt(2)
CHANNELS = ("theta_out_rad", "tau_in_Nm", "tau_out_Nm", "F_drive_N", "F_load_N")
# A stroke of this size pulls the load's spring to a difference of tensions within these bounds.
STROKE_RAD, SPRING_PULL_N = 0.6, (3.0, 20.0)

# For longer time steps than the proof's, on stiffer cables: heavier cables and larger cells.
DENSITY_KG_PER_M, COARSER = 0.0044, {"cell_length_m": 0.0225, "cell_bend_rad": 0.09}


@dataclass(frozen=True)
class Seeded:
    """What a kind conceals.

    Attributes
    ----------
    truth : list of {"name", "place", "values"}
    effects : dict
        Settings of the rig's effects.
    protocol : {"rich", "paper"}
    conduit : callable
        The true conduit from the stated one.
    trajectory : callable
        What acts on the true quantities after the motion.
    pretension_N : float, optional
        Stated pretension of the first recording; drawn if None.
    """

    truth: list[dict] = field(default_factory=list)
    effects: dict = field(default_factory=dict)
    protocol: str = "rich"
    conduit: Callable[[Piece], tuple[Piece, ...]] = lambda piece: (piece,)
    trajectory: Callable[[Trajectory], Trajectory] = lambda trajectory: trajectory
    pretension_N: float | None = None


@dataclass(frozen=True)
class OutsideCase:
    """A case: its rig, its stated recordings, and what it conceals."""

    name: str
    seed: int
    kind: str
    campaign: Campaign
    seeded: Seeded
    recordings: tuple[RecordingPlan, ...]
    kept_back: tuple[RecordingPlan, ...]

    def true(self, plan: RecordingPlan) -> RecordingPlan:
        """A stated recording with the true conduit."""
        (piece,) = plan.conduit
        return plan.model_copy(update={"conduit": self.seeded.conduit(piece)})


def _truth(name: str, place: str, **values: float) -> dict:
    return {"name": name, "place": place, "values": values, "severity": 3}


def _clean(rig: Mapping[str, float], random: Generator) -> Seeded:
    return Seeded()


def _clean_paper(rig: Mapping[str, float], random: Generator) -> Seeded:
    return Seeded(protocol="paper", pretension_N=7.0)


def _load_inertia(rig: Mapping[str, float], random: Generator) -> Seeded:
    """A load that rings at 3 to 15 Hz on spring and cables, with a damping ratio of 1 to 5 % on the spring alone."""
    rings = 2 * np.pi * log_uniform((3.0, 15.0), random)
    total = rig["spring"] + 2 * rig["stiffness"] * rig["radius"] ** 2
    inertia = total / rings**2
    damping = 2 * log_uniform((0.01, 0.05), random) * np.sqrt(rig["spring"] * inertia)
    effects = {"load": {"inertia_kg_m2": inertia}, "damping": damping}
    return Seeded([_truth("load-inertia", "load", J=inertia)], effects)


def _stribeck(low: float, high: float) -> Callable[[Mapping[str, float], Generator], Seeded]:
    def draw(rig: Mapping[str, float], random: Generator) -> Seeded:
        law = {
            "rise": random.uniform(low, high),
            "speed_m_per_s": log_uniform((5e-4, 5e-3), random),
            "exponent": random.uniform(0.7, 2.0),
            "renewal_m": log_uniform((5e-6, 1e-4), random),
        }
        return Seeded([_truth("stribeck", "conduit", a=law["rise"])], {"stribeck": law})

    return draw


def _stribeck_and_relaxation(rig: Mapping[str, float], random: Generator) -> Seeded:
    first = _stribeck(0.2, 0.35)(rig, random)
    branches = [{"share": random.uniform(0.1, 0.2), "time_constant_s": log_uniform((5.0, 40.0), random)}]
    return replace(
        first,
        truth=[*first.truth, _truth("relaxation", "cable", r=branches[0]["share"])],
        effects=first.effects | {"relaxation": branches},
    )


def _kink(rig: Mapping[str, float], random: Generator) -> Seeded:
    """A strong kink, spread over 1 to 5 cm of conduit."""
    beta, share, spread_m = random.uniform(0.8, 1.4), random.uniform(0.15, 0.85), random.uniform(0.01, 0.05)

    def conduit(piece: Piece) -> tuple[Piece, ...]:
        curvature, before_m = piece.bend_rad / piece.length_m, share * piece.length_m - spread_m / 2
        lengths = (before_m, spread_m, piece.length_m - before_m - spread_m)
        extra = (0.0, beta, 0.0)
        return tuple(Piece(length_m=m, bend_rad=curvature * m + b) for m, b in zip(lengths, extra, strict=True))

    return Seeded([_truth("kink", "conduit", beta=beta, s=share)], conduit=conduit)


def _settling_paper(rig: Mapping[str, float], random: Generator) -> Seeded:
    scale = log_uniform((1.0, 8.0), random)
    effects = {"strand_settling": {"tension_scale_N": scale}}
    return Seeded([_truth("strand-settling", "cable", T_scale=scale)], effects, "paper", pretension_N=7.0)


def _termination_paper(rig: Mapping[str, float], random: Generator) -> Seeded:
    """A fastening that yields by 40 to 150 % of what its cable does."""
    end = str(random.choice(["drive", "load"]))
    compliance = log_uniform((0.4, 1.5), random) / rig["stiffness"]
    effects = {"termination_compliance": {f"{end}_m_per_N": compliance}}
    truth = _truth("termination-compliance", f"{end}-end", compliance=compliance)
    return Seeded([truth], effects, "paper", pretension_N=7.0)


def _offset(rig: Mapping[str, float], random: Generator) -> Seeded:
    offset = float(random.choice([-0.25, 0.25]))
    effects = {"load_sensors": {"load_cell_offset_N": offset}}
    return Seeded([_truth("load-cell-offset", "load-sensor", offset=offset)], effects)


def _cogging(rig: Mapping[str, float], random: Generator) -> Seeded:
    """A drive motor whose torque ripples with its angle, which no mechanism describes."""
    poles, phase = int(random.integers(6, 25)), random.uniform(-np.pi, np.pi)
    amplitude = random.uniform(0.05, 0.2) * rig["radius"] * rig["pretension"]

    def trajectory(t: Trajectory) -> Trajectory:
        return replace(t, tau_in_Nm=t.tau_in_Nm + amplitude * np.sin(poles * t.theta_in_rad + phase))

    truth = _truth("unlisted-cogging", "drive-pulley", amplitude=amplitude)
    return Seeded([truth], trajectory=trajectory)


KINDS: Mapping[str, Callable[[Mapping[str, float], Generator], Seeded]] = {
    "clean": _clean,
    "clean-paper": _clean_paper,
    "load-inertia": _load_inertia,
    "stribeck-weak": _stribeck(0.08, 0.12),
    "stribeck-strong": _stribeck(0.25, 0.35),
    "stribeck-relaxation": _stribeck_and_relaxation,
    "kink": _kink,
    "settling-paper": _settling_paper,
    "termination-paper": _termination_paper,
    "load-cell-offset": _offset,
    "cogging": _cogging,
}


def draw(seed: int, kind: str) -> OutsideCase:
    """Draw a case of a kind."""
    plan = read_plan()
    random = np.random.default_rng(np.random.SeedSequence([seed, STREAM, list(KINDS).index(kind)]))
    radius, pretension = random.uniform(0.005, 0.012), log_uniform((3.0, 15.0), random)
    stiffness, spring = log_uniform((5e3, 3e4), random), radius * log_uniform(SPRING_PULL_N, random) / STROKE_RAD
    rig = {"radius": radius, "pretension": pretension, "stiffness": stiffness, "spring": spring}
    seeded = KINDS[kind](rig, random)
    shortest = log_uniform((1e-7, 2e-7), random)
    friction = {"law": "iwan", "shortest_m": shortest, "longest_m": 4 * shortest, "elements": 3}
    load = {k: v for k, v in seeded.effects.items() if k != "damping"}
    effects = Effects.model_validate(merged([load, {"presliding": friction}]))
    campaign = _campaign(seed, rig, effects, seeded.effects.get("damping"), random)
    protocol = plan.protocols[seeded.protocol]
    conditions = Conditions(
        pretension_N=seeded.pretension_N or pretension,
        bend_rad=random.uniform(*(protocol.bend_rad or plan.rig.bend_rad)),
        length_m=campaign.rig.cable.length_m,
    )
    return OutsideCase(
        name=f"{kind}-{seed:03d}",
        seed=seed,
        kind=kind,
        campaign=campaign,
        seeded=seeded,
        recordings=draw_recordings(protocol, plan, conditions, random),
        kept_back=draw_held_out(protocol, plan, conditions, random),
    )


def _campaign(
    seed: int, rig: Mapping[str, float], effects: Effects, damping: float | None, random: Generator
) -> Campaign:
    """The proof's rig with other constants: pulleys, cables, load, damping, sampling and encoders."""
    plan = read_plan()
    drawn = draw_campaign(seed, plan, rig["spring"], effects, random)
    stiffness = drawn.rig.cable.stiffness_N_per_m
    error = drawn.rig.estimates.stiffness_N_per_m / stiffness
    inertia = log_uniform((1e-7, 1e-6), random)
    own_damping = 2 * log_uniform((0.01, 0.1), random) * np.sqrt(inertia * rig["spring"])
    counts, rate = int(random.integers(20, 101)) * 100, float(random.choice([200.0, 250.0, 400.0, 500.0, 1000.0]))
    load = drawn.rig.load.model_copy(
        update={"inertia_kg_m2": inertia, "damping_Nms_per_rad": own_damping if damping is None else damping}
    )
    estimates = drawn.rig.estimates.model_copy(update={"stiffness_N_per_m": rounded(rig["stiffness"] * error)})
    encoder = drawn.sensors.encoder.model_copy(
        update={"counts_per_rev": counts, "accuracy_rad": rounded(2 * np.pi / counts)}
    )
    return drawn.model_copy(
        update={
            "rig": drawn.rig.model_copy(
                update={
                    "pulley_radius_m": rounded(rig["radius"]),
                    "cable": drawn.rig.cable.model_copy(
                        update={"stiffness_N_per_m": rig["stiffness"], "density_kg_per_m": DENSITY_KG_PER_M}
                    ),
                    "load": load,
                    "estimates": estimates,
                }
            ),
            "sensors": drawn.sensors.model_copy(update={"sample_rate_Hz": rate, "encoder": encoder}),
            "numerics": drawn.numerics.model_copy(
                update={
                    **COARSER,
                    "wave_damping": random.uniform(0.03, 0.3),
                    "drag_rate_per_s": random.uniform(5.0, 60.0),
                }
            ),
        }
    )


def build(case: OutsideCase, out: Path) -> dict:
    """Write a case's batch and its kept-back recordings; returns its key."""
    _record(case, case.recordings, out / "cases" / case.name)
    held_out = out / "kept-back" / case.name
    runs = _record(case, case.kept_back, held_out)
    floor = {plan.id: noise_floor(case.campaign, case.true(plan), *runs[plan.id]) for plan in case.kept_back}
    truth = case.seeded.truth or [{"name": "none", "place": None, "severity": 0}]
    return {
        "case": case.name,
        "kind": case.kind,
        "protocol": case.seeded.protocol,
        "truth": truth,
        "rig": case.campaign.rig.model_dump(mode="json"),
        "floor": floor,
    }


def _record(
    case: OutsideCase, plans: Sequence[RecordingPlan], folder: Path
) -> dict[str, tuple[Preparation, Trajectory]]:
    folder.mkdir(parents=True, exist_ok=True)
    campaign, runs = case.campaign, {}
    for plan in plans:
        random = recording_generator(case.seed, case.name, plan.id)
        preparation = prepare(campaign, plan, random)
        trajectory = simulate(campaign, case.true(plan), preparation)
        runs[plan.id] = preparation, trajectory
        read = log(case.seeded.trajectory(trajectory), campaign.sensors, rig_during(campaign, plan), random)
        (folder / log_name(plan)).write_bytes(compress(read))
    note = "recordings of a simulated rig; its physics is not disclosed"
    (folder / "batch.yaml").write_text(as_yaml(description(campaign, case.name, note, plans)), encoding="utf-8")
    return runs


def diagnose(results: Path, folder: Path, name: str) -> str:
    """Diagnose a case and predict its kept-back recordings, unless that has been done; a line about it."""
    set_threads(1)
    out = results / name
    if (out / "extended").exists():
        return f"{name}: done"
    started = time.process_time()
    found = ccmodel.diagnose(folder / "cases" / name, time_limit_s=NEVER_S)
    found.save(out)
    for model, into in ((found.calibrated, "calibrated"), (found.model, "extended")):
        if model is not None:
            ccmodel.predict(model, folder / "kept-back" / name).save(out / into)
    return f"{name}: {found.verdict} in {time.process_time() - started:.0f} s of one core"


def score(results: Path, folder: Path) -> pd.DataFrame:
    """One row a case: verdict, names, and the worst channel's errors on kept-back recordings over the noise floor."""
    rows = []
    for key in json.loads((folder / "keys.json").read_text()):
        told = results / key["case"] / "diagnosis.json"
        if not told.exists():
            rows.append({"case": key["case"], "kind": key["kind"], "verdict": "none", "named_first": False})
            continue
        said = json.loads(told.read_text())
        truth = [t["name"] for t in key["truth"] if t["name"] != "none" and not t["name"].startswith("unlisted")]
        names = [f"{m['name']}@{m['place']} {m['confidence']:.2f}" for m in said["mechanisms"]]
        first = said["mechanisms"][0]["name"] if said["mechanisms"] else None
        before, after = (_over_floor(results, folder, key, model) for model in ("calibrated", "extended"))
        rows.append(
            {
                "case": key["case"],
                "kind": key["kind"],
                "verdict": said["verdict"],
                "named_first": first in truth if truth else first is None,
                "all_named": {m["name"] for m in said["mechanisms"]} == set(truth),
                "before": before,
                "after": after,
                "visible": before >= VISIBLE,
                "names": ", ".join(names) or said["location"].get("place"),
                "nearest": ", ".join(m["name"] for m in (said.get("nearest") or {}).get("mechanisms", [])),
            }
        )
    return pd.DataFrame(rows)


def _over_floor(results: Path, folder: Path, key: Mapping[str, Any], model: str) -> float:
    errors, floors = np.zeros(len(CHANNELS)), np.zeros(len(CHANNELS))
    kept_back = folder / "kept-back" / key["case"]
    side = yaml.safe_load((kept_back / "batch.yaml").read_text())["rig"]["drive"]
    for recording, floor in key["floor"].items():
        predicted = results / key["case"] / model / f"{recording}.csv"
        if not predicted.exists():
            return np.nan
        time_s, read = _read(kept_back / f"{recording}.csv.gz", side)
        table = pd.read_csv(predicted)
        error = np.stack([np.interp(time_s, table["time_s"], table[c]) for c in CHANNELS]) - read
        error[0] -= error[0, time_s < 0.3].mean()  # an encoder has no zero of its own
        errors += (error**2).mean(axis=1)
        floors += np.array([floor[c] for c in CHANNELS]) ** 2
    return float(np.sqrt(errors / floors).max())


def _read(file: Path, side: Mapping[str, Any]) -> tuple[NDArray, NDArray]:
    """Times (s) and channels, shape (5, samples), of a raw log, in SI."""
    with gzip.open(file, "rt") as text:
        raw = pd.read_csv(text)
    cell, torque = side["load_cell"], side["torque_constant_Nm_per_A"]
    forces = [(raw[f"{s}_load_cell_V"] - cell["zero_V"]) / cell["sensitivity_V_per_N"] for s in ("drive", "load")]
    angle = raw["load_encoder_counts"] * 2 * np.pi / side["encoder_counts_per_rev"]
    torques = [raw[f"{s}_current_A"] * torque for s in ("drive", "load")]
    return raw["time_s"].to_numpy(), np.stack([angle, *torques, *forces])


def _build_all(folder: Path, seed: int, count: int, kinds: Sequence[str]) -> None:
    file = folder / "keys.json"
    keys = {key["case"]: key for key in (json.loads(file.read_text()) if file.exists() else [])}
    for kind in kinds:
        for k in range(seed, seed + count):
            case = draw(k, kind)
            if case.name not in keys:
                keys[case.name] = build(case, folder)
                file.write_text(json.dumps(list(keys.values()), indent=1), encoding="utf-8")
                print(case.name, flush=True)


def _summary(table: pd.DataFrame) -> str:
    by_kind = defaultdict(list)
    for row in table.to_dict("records"):
        by_kind[row["kind"]].append(row)
    lines = []
    for kind, rows in by_kind.items():
        visible = [r for r in rows if r.get("visible") is True] if "clean" not in kind else rows
        named = sum(bool(r["named_first"]) for r in visible)
        lines.append(f"{kind:22s} named first {named} of {len(visible)} visible, {len(rows)} in all")
    return "\n".join(lines)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    commands = parser.add_subparsers(dest="command", required=True)
    building = commands.add_parser("build")
    building.add_argument("folder", type=Path)
    building.add_argument("--seed", type=int, default=0)
    building.add_argument("--count", type=int, default=1)
    building.add_argument("--kind", nargs="+", choices=list(KINDS), default=list(KINDS))
    diagnosing = commands.add_parser("diagnose")
    diagnosing.add_argument("results", type=Path)
    diagnosing.add_argument("folder", type=Path)
    diagnosing.add_argument("--cores", type=int, default=2)
    scoring = commands.add_parser("score")
    scoring.add_argument("results", type=Path)
    scoring.add_argument("folder", type=Path)
    given = parser.parse_args()
    if given.command == "build":
        _build_all(given.folder, given.seed, given.count, given.kind)
        return
    if given.command == "diagnose":
        with ProcessPoolExecutor(given.cores) as pool:
            names = sorted(key["case"] for key in json.loads((given.folder / "keys.json").read_text()))
            for line in pool.map(diagnose, *zip(*((given.results, given.folder, n) for n in names), strict=True)):
                print(line, flush=True)
        return
    table = score(given.results, given.folder)
    print(table.to_string(index=False, float_format="%.2f"))
    print(_summary(table))


if __name__ == "__main__":
    main()
