"""Does the accuracy gate pass other noise, and does it fail what makes the model worse? (`make accuracy-gate`)

The baseline is that of the recordings in data/raw, with the batches' estimates and the fits; diagnoses are left out for
their time. Every recording of the virtual rig is then simulated once, with its own friction, pretension and tension
profile, and logged again with other sensor noise, zeros and encoder positions: once for each seed. Faults of the code
are then run on the same recordings and on recordings made again. Writes a section of docs/accuracy.md.
"""

import argparse
import sys
import time
import zlib
from collections import Counter
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from datetime import UTC, datetime
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import numpy as np

from ccmodel.accuracy.comparison import LOST, Comparison, compare
from ccmodel.accuracy.measure import Batches, Simulated, measure
from ccmodel.channels import symbol_of
from ccmodel.config import ESTIMATED, load_config
from ccmodel.errors import last_cycle
from ccmodel.model.general.run import Active
from ccmodel.model.parameters import Parameters
from ccmodel.rig.ingest import ingest_batch
from ccmodel.steps.fit import fit_parameters
from ccmodel.steps.ingest import ingest
from ccmodel.steps.settings import Fit
from ccmodel.steps.simulate import simulate, simulate_recording
from ccmodel.studies.settings import EACH
from virtualrig.campaign import as_yaml, compress, describe, log_name, prepare, recording_generator, rig_during, run
from virtualrig.config import Campaign, read_campaign
from virtualrig.sensors import log
from virtualrig.trajectory import Trajectory

CONFIG = Path("config/config.yaml")
CAMPAIGN = Path("config/virtual-rig.yaml")
PAGE = Path("docs/accuracy.md")
BEGIN, END = "<!-- made by `make accuracy-gate` -->", "<!-- end -->"


def run_pipeline(raw: Path, batches: list[str], fits: Mapping[str, Fit], results: Path) -> Batches:
    """Recordings, fits and simulations of some batches, and their accuracy."""
    for folder in ("recordings", "fits"):
        (results / folder).mkdir(parents=True, exist_ok=True)
    recordings = {batch: results / f"recordings/{batch}.nc" for batch in batches}
    for batch, file in recordings.items():
        ingest(raw / batch, file, file.with_suffix(".json"))
    runs = [Simulated("virtual rig", ESTIMATED, file, Path()) for file in recordings.values()]
    for name, fit in fits.items():
        fit_file = results / f"fits/{name}.json"
        fit_parameters(name, fit, [recordings[batch] for batch in fit.batches], fit_file)
        runs += [Simulated("virtual rig", name, file, Path(), fit_file) for file in recordings.values()]
    simulated = []
    for one in runs:
        file = results / f"simulated/{one.parameters}/{one.recordings.name}"
        file.parent.mkdir(parents=True, exist_ok=True)
        simulate(one.recordings, one.fit, file, file.with_suffix(".json"))
        simulated.append(Simulated(one.rig, one.parameters, one.recordings, file, one.fit))
    return measure(simulated)


def friction_exponent(n: float):
    """Friction proportional to T^(1 + n) in the model; with n = 0 its general solver alone."""
    estimated, mechanism = Parameters.estimated, Active("load-dependent-friction", "conduit", {"n": n})
    return patch.object(Parameters, "estimated", lambda rig: replace(estimated(rig), mechanisms=(mechanism,)))


def flipped(channel: str):
    """The sign of a simulated channel reversed."""

    def changed(recording, parameters):
        simulated = simulate_recording(recording, parameters)
        channels = {**simulated.channels, channel: -simulated[channel]}
        return simulated.with_channels(channels, simulated.derived_from, simulated.origin)

    return patch("ccmodel.steps.simulate.simulate_recording", changed)


def without_last_cycle():
    """A reading of the logs that drops the last cycle of every recording."""

    def changed(folder, progress):
        read = ingest_batch(folder, progress)
        return replace(read, recordings=[r[: last_cycle(r).start + 1] for r in read.recordings])

    return patch("ccmodel.steps.ingest.ingest_batch", changed)


FAULTS: Mapping[str, Callable] = {
    "friction proportional to T^0.95": lambda: friction_exponent(-0.05),
    "sign of the load torque reversed": lambda: flipped("tau_out_Nm"),
    "sign of the load angle reversed": lambda: flipped("theta_out_rad"),
    "the last cycle of every recording dropped": without_last_cycle,
}
CONTROLS: Mapping[str, Callable] = {
    "nothing": nullcontext,
    "the general solver in place of the exact one": lambda: friction_exponent(0.0),
}


def simulated_campaign(campaign: Campaign, batches: list[str], seed: int, pool) -> dict[tuple[str, str], Trajectory]:
    """The true motion of every recording, with the run-to-run draws of a seed."""
    plans = [(batch, plan) for batch in batches for plan in campaign.batches[batch].recordings]
    done = pool.map(_trajectory, [(campaign, seed, *each) for each in plans])
    return {(batch, plan.id): trajectory for (batch, plan), trajectory in zip(plans, done, strict=True)}


def _trajectory(given) -> Trajectory:
    campaign, seed, batch, plan = given
    return run(campaign, plan, prepare(campaign, plan, recording_generator(seed, batch, plan.id)))


def record_again(campaign: Campaign, truth: Mapping, noise_seed: int, raw: Path) -> None:
    """Log true motions with the sensors' noise, zeros and positions of another seed."""
    # Strokes are chosen for the campaign's own draws; the rig does not simulate a sensor beyond its range.
    torque = campaign.sensors.torque.model_copy(update={"range_Nm": np.inf})
    load_cell = campaign.sensors.load_cell.model_copy(update={"range_N": np.inf})
    sensors = campaign.sensors.model_copy(update={"torque": torque, "load_cell": load_cell})
    for batch in dict.fromkeys(batch for batch, _ in truth):
        (raw / batch).mkdir(parents=True)
        (raw / batch / "batch.yaml").write_text(as_yaml(describe(campaign, batch)), encoding="utf-8")
        for plan in campaign.batches[batch].recordings:
            draw = np.random.default_rng([noise_seed, zlib.crc32(f"{batch}/{plan.id}".encode())])
            columns = log(truth[batch, plan.id], sensors, rig_during(campaign, plan), draw)
            (raw / batch / log_name(plan)).write_bytes(compress(columns))


def one_run(given) -> tuple[str, Comparison]:
    """Name and outcome of one run, by the name of its fault or control and its folder of raw recordings."""
    name, fault, raw, batches, fits, accepted, limits = given
    with TemporaryDirectory() as scratch, (FAULTS | CONTROLS)[fault]():
        found = compare(accepted, run_pipeline(raw, batches, fits, Path(scratch)), limits)
    print(f"{name}: {len(found.losses)} losses", file=sys.stderr)
    return name, found


def lines(title: str, outcomes: list[tuple[str, Comparison]]) -> list[str]:
    """Rows of a table: what was done, losses, and the largest loss of a channel."""
    rows = [f"| {title} | comparisons | losses | largest loss |", "|---|---|---|---|"]
    for name, found in outcomes:
        largest = found.of(LOST)[0] if found.of(LOST) else None
        text = "none"
        if largest:
            text = (
                f"{largest.batch}, {symbol_of(largest.channel)}, {largest.parameters}: {largest.accepted:.3g} to"
                f" {largest.now:.3g} % ({largest.times})"
            )
        elif found.less:
            text = found.less[0]
        rows.append(f"| {name} | {len(found.changes)} | {len(found.losses)} | {text} |")
    return rows


def closest(outcomes: list[tuple[str, Comparison]]) -> float:
    """Largest share of the way from the accepted error to the end of its interval (in ln) over runs and channels."""
    shares = [
        np.log(c.now / c.accepted) / np.log(c.high / c.accepted) for _, f in outcomes for c in f.changes if c.high
    ]
    return float(max(shares))


def main() -> None:
    """Run all and write the section."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--seeds", type=int, default=20, help="number of noise seeds")
    arguments.add_argument(
        "--anew", type=int, default=0,
        help="campaigns with friction and pretension drawn anew, too; a draw may exceed the range of the torque sensor",
    )  # fmt: skip
    arguments.add_argument("--cores", type=int, default=2)
    stated = arguments.parse_args()
    started = time.monotonic()
    config, campaign = load_config(CONFIG), read_campaign(CAMPAIGN)
    batches, limits, raw = sorted(campaign.batches), config.baseline.limits, Path(config.raw)
    fits = {name: fit for name, fit in config.fits.items() if fit.batches != EACH and set(fit.batches) <= set(batches)}
    with TemporaryDirectory() as folder, ProcessPoolExecutor(stated.cores, mp_context=get_context("spawn")) as pool:
        scratch = Path(folder)
        accepted = run_pipeline(raw, batches, fits, scratch / "accepted")
        truth = simulated_campaign(campaign, batches, campaign.seed, pool)
        for k in range(stated.seeds):
            record_again(campaign, truth, 1 + k, scratch / f"noise-{k}")
        for k in range(stated.anew):
            drawn = simulated_campaign(campaign, batches, campaign.seed + 1 + k, pool)
            record_again(campaign, drawn, 1001 + k, scratch / f"anew-{k}")
        again = scratch / "noise-0"
        jobs = {
            "noise": [(f"noise {k}", "nothing", scratch / f"noise-{k}") for k in range(stated.seeds)],
            "anew": [(f"anew {k}", "nothing", scratch / f"anew-{k}") for k in range(stated.anew)],
            "same": [(name, name, raw) for name in (*CONTROLS, *FAULTS)],
            "both": [(name, name, again) for name in FAULTS],
        }
        tasks = [(*job, batches, fits, accepted, limits) for of in jobs.values() for job in of]
        outcomes = iter(pool.map(one_run, tasks))
        found = {kind: [next(outcomes) for _ in of] for kind, of in jobs.items()}
    passed = {kind: sum(not f.losses for _, f in found[kind]) for kind in ("noise", "anew")}
    again_of = Counter(line for kind in ("noise", "anew") for _, f in found[kind] for line in f.losses)
    compared = len(found["noise"][0][1].changes)
    drawn_anew = []
    if stated.anew:
        drawn_anew = [
            f"With friction, pretension and tension profile of every run drawn anew as well: **{passed['anew']} of"
            f" {stated.anew}**, {100 * closest(found['anew']):.0f} % of the way."
        ]
    section = [
        f"Made on {datetime.now(UTC):%Y-%m-%d} in {(time.monotonic() - started) / 60:.0f} minutes: {len(batches)}"
        f" batches of the virtual rig, {compared} comparisons in each run, parameters"
        f" {' and '.join([ESTIMATED, *fits])}.",
        "",
        f"**Other noise.** Recorded again with other sensor noise, zeros and encoder positions: **{passed['noise']} of"
        f" {stated.seeds}** runs without a loss. The error nearest to the end of its interval came"
        f" {100 * closest(found['noise']):.0f} % of the way (in ln error).",
        *drawn_anew,
        *(f"- false alarm: {line}" for line in again_of),
        "",
        "**Faults, on the same recordings.**",
        "",
        *lines("change of the code", found["same"]),
        "",
        "**The same faults, on recordings made again** with other noise. The intervals are wider, since the recordings'"
        " own scatter no longer cancels.",
        "",
        *lines("change of the code", found["both"]),
    ]
    text = "\n".join(section)
    print(text)
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{rest.partition(END)[2]}", encoding="utf-8")


if __name__ == "__main__":
    main()
