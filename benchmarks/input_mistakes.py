"""How often are mistakes in logs and batch files identified, and how many are false positives? (`make input-checks`)

Thirty-three mistakes are made in copies of batches, each with sizes, recordings and channels drawn from a seed, and the
copies are read as `ccmodel check` reads them. The batches are a measured one, a simulated one and concealed cases of
the proof with fresh seeds. The same batches without a mistake count the false alarms. Writes a section of
docs/input-checks.md.
"""

import argparse
import re
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
from ruamel.yaml import YAML
from scipy.stats import binomtest

from ccmodel.channels import ANGLE_AT, SUM_AT, TORQUE_AT
from ccmodel.recording import Recording
from ccmodel.rig.ingest import ingest_batch
from proof.build import build
from proof.cases import draw
from proof.rig_draw import log_uniform

MEASURED, SIMULATED = Path("data/raw/da-vinci"), Path("data/raw/rich")
PAGE = Path("docs/input-checks.md")
BEGIN, END = "<!-- made by `make input-checks` -->", "<!-- end -->"
COUNTS = ("drive_encoder_counts", "load_encoder_counts")
# Sensors but those of the drive's motion: the same command gives the same counts.
NOT_COMMANDED = "^(?!time_s|drive_encoder|motor)"
NOISY = re.compile(r"_(current_A|torque_counts|load_cell_V)$")
# Seeds of the draws: of the mistakes, and of the proof's cases, which no limit of the checks was chosen on.
SEED, CASES_SEED = 20261123, 960000


class NotApplicableError(Exception):
    """The batch has no such channel or value."""


@dataclass
class Copy:
    """A batch in memory, to be damaged.

    Attributes
    ----------
    logs : dict of str to DataFrame
        Logs by recording id.
    description : dict
        Content of batch.yaml.
    donors : sequence of Recording
        Recordings of other rigs.
    """

    logs: dict[str, pd.DataFrame]
    description: dict
    donors: Sequence[Recording]

    @property
    def rig(self) -> dict:
        """The section `rig`."""
        return self.description["rig"]

    def columns(self, pattern: str) -> list[str]:
        """Columns of all logs whose name matches."""
        found = [c for c in next(iter(self.logs.values())) if re.search(pattern, c)]
        if not found:
            raise NotApplicableError
        return found

    def any_log(self, random: np.random.Generator) -> str:
        """Name of a recording."""
        return str(random.choice(list(self.logs)))

    def entry(self, name: str) -> dict:
        """Entry of a recording."""
        return next(e for e in self.description["recordings"] if e["id"] == name)


def read_copy(folder: Path, donors: Sequence[Recording] = ()) -> Copy:
    """A batch as a copy in memory."""
    description = YAML(typ="safe").load(folder / "batch.yaml")
    logs = {e["id"]: pd.read_csv(folder / e["file"]) for e in description["recordings"]}
    return Copy(logs, description, donors)


def as_logged(recording: Recording, rig: Mapping, columns: Sequence[str]) -> pd.DataFrame | None:
    """A recording of another rig as this rig would log it, without the motor; None if it lacks a channel."""
    found = {"time_s": recording.time_s.round(6)}
    for column in columns:
        if column in found or column.startswith("motor"):
            continue
        end, sensor = column.split("_", 1)
        side = rig[end]
        channel, scale, zero = {
            "encoder_counts": (
                ANGLE_AT,
                lambda s: s["encoder_counts_per_rev"] / 2 / np.pi * s.get("encoder_sign", 1),
                0,
            ),
            "current_A": (TORQUE_AT, lambda s: s.get("torque_sign", 1) / s["torque_constant_Nm_per_A"], 0),
            "torque_counts": (TORQUE_AT, lambda s: s.get("torque_sign", 1) / s["torque_sensor"]["Nm_per_count"], 0),
            "load_cell_V": (
                SUM_AT,
                lambda s: s["load_cell"]["sensitivity_V_per_N"],
                side.get("load_cell", {}).get("zero_V"),
            ),
        }[sensor]
        if channel[end] not in recording:
            return None
        values = recording[channel[end]] * scale(side) + zero
        found[column] = np.round(values) if sensor == "encoder_counts" else values.round(5)
    return pd.DataFrame(found)


def write_copy(copy: Copy, folder: Path) -> Path:
    """Write a copy as a batch folder."""
    folder.mkdir(parents=True)
    copy.description["batch"] = folder.name
    for name, table in copy.logs.items():
        copy.entry(name)["file"] = f"{name}.csv"
        table.to_csv(folder / f"{name}.csv", index=False)
    yaml = YAML()
    yaml.dump(copy.description, folder / "batch.yaml")
    return folder


def _times_in_ms(copy: Copy, random) -> str:
    for table in copy.logs.values():
        table["time_s"] *= 1e3
    return "time_s"


def _scale_of_angles(factor: Callable[[np.random.Generator], float], ends: Sequence[str]):
    def damage(copy: Copy, random) -> str:
        if len(ends) == 2:  # seen by the spring alone
            _spring_of(copy)
        by = factor(random)
        for end in ends:
            copy.rig[end]["encoder_counts_per_rev"] = float(copy.rig[end]["encoder_counts_per_rev"] / by)
        return "theta"

    return damage


def _counts_by_two(copy: Copy, random) -> str:
    end, by = str(random.choice(["drive", "load"])), float(random.choice([0.5, 2.0]))
    if (end == "load") == (by > 1.0):  # less travel arrives, which friction may take: seen by the spring or the note
        _spring_of(copy)
    copy.rig[end]["encoder_counts_per_rev"] = float(copy.rig[end]["encoder_counts_per_rev"] * by)
    return "theta"


def _spring_of(copy: Copy) -> float:
    if "spring_stiffness_Nm_per_rad" not in copy.rig["load"]:
        raise NotApplicableError
    return copy.rig["load"]["spring_stiffness_Nm_per_rad"]


def _quadrature(random) -> float:
    return float(random.choice([4.0, 0.25]))


def _degrees(random) -> float:
    return 180 / np.pi


def _wrong_sign(pattern: str, what: str):
    def damage(copy: Copy, random) -> str:
        for column in copy.columns(pattern):
            zero = 2 * copy.rig[column.split("_")[0]]["load_cell"]["zero_V"] if column.endswith("cell_V") else 0.0
            for table in copy.logs.values():
                table[column] = zero - table[column]
        return what

    return damage


def _either_load_cell(copy: Copy, random) -> str:
    end = random.choice(["drive", "load"])
    return _wrong_sign(f"^{end}_load_cell_V", f"F_{end}")(copy, random)


def _exchanged(pattern: str, what: str):
    def damage(copy: Copy, random) -> str:
        exchange = {"drive": "load", "load": "drive"}
        renamed = {c: re.sub("^(drive|load)_", lambda m: f"{exchange[m[1]]}_", c) for c in copy.columns(pattern)}
        for name, table in copy.logs.items():
            copy.logs[name] = table.rename(columns=renamed)
        return what

    return damage


def _constant(copy: Copy, random) -> str:
    name, column = copy.any_log(random), random.choice(copy.columns(NOT_COMMANDED))
    copy.logs[name][column] = copy.logs[name][column].iloc[0]
    return column


def _saturated(copy: Copy, random) -> str:
    name, column = copy.any_log(random), random.choice(copy.columns(NOISY.pattern))
    values = copy.logs[name][column]
    middle, half = (values.max() + values.min()) / 2, np.ptp(values) / 2
    limit = random.uniform(0.5, 0.8) * half
    copy.logs[name][column] = values.clip(middle - limit, middle + limit).round(5)
    return column


def _wrapped(copy: Copy, random) -> str:
    name, column = copy.any_log(random), random.choice(COUNTS)
    values = copy.logs[name][column]
    copy.logs[name][column] = (values - values.min()) % max(2 ** int(np.log2(0.7 * np.ptp(values))), 16)
    return column


def _copied(copy: Copy, random) -> str:
    one, other = random.choice(list(copy.logs), 2, replace=False)
    column = random.choice(copy.columns(NOT_COMMANDED))
    n = min(len(copy.logs[one]), len(copy.logs[other]))
    copy.logs[one] = copy.logs[one].iloc[:n].copy()
    copy.logs[one][column] = copy.logs[other][column].to_numpy()[:n]
    return {
        "load_encoder_counts": "theta_out", "drive_current_A": "tau_in", "drive_torque_counts": "tau_in",
        "load_current_A": "tau_out", "load_torque_counts": "tau_out", "drive_load_cell_V": "F_drive",
        "load_load_cell_V": "F_load",
    }[column]  # fmt: skip


def _lost_samples(copy: Copy, random) -> str:
    name = copy.any_log(random)
    table = copy.logs[name]
    time = table["time_s"].to_numpy()
    speed = np.abs(pd.Series(np.gradient(table[COUNTS[0]], time)).rolling(41, center=True).mean())
    speed = speed.where(time >= copy.entry(name).get("settled_s", 0.0))
    fast = np.flatnonzero((speed > 0.7 * speed.max()).to_numpy())
    at = int(random.choice(fast[fast < len(table) - 400]))
    lost = max(2, round(random.uniform(0.03, 0.15) / np.median(np.diff(time))))
    kept = table.drop(table.index[at : at + lost])
    copy.logs[name] = kept.assign(time_s=time[: len(kept)])
    return "time_s"


def _drifting_clocks(copy: Copy, random) -> str:
    rate = random.choice([-1, 1]) * random.uniform(0.006, 0.02)
    for table in copy.logs.values():
        time = table["time_s"].to_numpy()
        for column in copy.columns("^load_"):
            moved = np.interp(time[0] + (time - time[0]) * (1 + rate), time, table[column])
            table[column] = np.round(moved) if column.endswith("counts") else moved.round(6)
    return "clocks"


def _magnitude(copy: Copy, random) -> str:
    column = random.choice(copy.columns("_current_A$"))
    for table in copy.logs.values():
        table[column] = table[column].abs()
    return {"drive_current_A": "tau_in", "load_current_A": "tau_out"}[column]


def _held(copy: Copy, random) -> str:
    hold_s = random.uniform(0.03, 0.1)
    columns = copy.columns(NOISY.pattern)
    for table in copy.logs.values():
        samples = max(round(hold_s / float(np.median(np.diff(table["time_s"])))), 5)
        table[columns] = table[columns].to_numpy()[np.arange(len(table)) // samples * samples]
    return columns[0]


def _torque_in_a_smaller_unit(copy: Copy, random) -> str:
    copy.columns("load_cell_V")  # a torque has no second source but the sum of tensions
    end, by = str(random.choice(["drive", "load"])), float(random.choice([100.0, 1000.0]))  # N cm, mN m
    for column in copy.columns(f"^{end}_(current_A|torque_counts)"):
        for table in copy.logs.values():
            table[column] *= by
    return TORQUE_AT[end]


def _fine_accuracy(copy: Copy, random) -> str:
    stated = copy.rig["accuracy"]
    key = random.choice([key for key in ("torque_Nm", "load_cell_N") if key in stated])
    stated[key] = float(stated[key] / log_uniform((50, 1000), random))
    return f"rig.accuracy.{key}"


def _near_starts(copy: Copy, random) -> str:
    at = datetime(2026, 3, 31, 14, 5, int(random.integers(60)), tzinfo=UTC)
    for entry in copy.description["recordings"]:
        entry["started_at"] = at.isoformat()
        at += timedelta(seconds=int(random.integers(1, 6)))
    return "started_at"


def _single_cable(copy: Copy, random) -> str:
    copy.columns("^load_load_cell_V")
    copy.rig.update({"transmission": "single-cable", "far_end": "measured-tension"})
    copy.rig["load"].pop("spring_stiffness_Nm_per_rad", None)
    return "rig.transmission"


def _other_rig(copy: Copy, random) -> str:
    name = copy.any_log(random)
    donor = copy.donors[random.integers(len(copy.donors))]
    log = as_logged(donor, copy.rig, list(copy.logs[name]))
    if log is None:
        raise NotApplicableError
    # The other rig has no sensors at the motor. A log without them would not be compared at all.
    copy.logs = {other: its[list(log)] for other, its in copy.logs.items()} | {name: log}
    return name


def _radius_in_mm(copy: Copy, random) -> str:
    for end in ("drive", "load"):
        copy.rig[end]["pulley_radius_m"] = float(copy.rig[end]["pulley_radius_m"] * 1e3)
    return "pulley_radius_m"


def _forgotten_bend(copy: Copy, random) -> str:
    copy.columns("load_cell_V")
    entry = copy.entry(copy.any_log(random))
    entry["conduit"] = [piece | {"bend_rad": 0.0} for piece in entry["conduit"]]
    return f"{entry['id']}.csv bend_rad"


def _pretension_of_one(copy: Copy, random) -> str:
    copy.columns("load_cell_V")
    entry = copy.entry(copy.any_log(random))
    factor = log_uniform((3, 1000), random) ** random.choice([-1, 1])
    entry["pretension_N"] = float(entry["pretension_N"] * factor)
    return f"{entry['id']}.csv pretension_N"


def _stated(section: str, key: str, needs: str = "load_cell_V"):
    def damage(copy: Copy, random) -> str:
        copy.columns(needs)
        if key not in copy.rig[section]:
            raise NotApplicableError
        factor = log_uniform((4, 20), random) ** random.choice([-1, 1])
        copy.rig[section][key] = float(copy.rig[section][key] * factor)
        return f"rig.{section}.{key}"

    return damage


MISTAKES: Mapping[str, Callable[[Copy, np.random.Generator], str]] = {
    "sample times in ms": _times_in_ms,
    "both angles in degrees": _scale_of_angles(_degrees, ("drive", "load")),
    "load angle in degrees": _scale_of_angles(_degrees, ("load",)),
    "counts per turn of both ends off by four": _scale_of_angles(_quadrature, ("drive", "load")),
    "counts per turn of one end off by four": lambda copy, random: _scale_of_angles(
        _quadrature, (str(random.choice(["drive", "load"])),)
    )(copy, random),
    "sign of the drive torque": _wrong_sign("^drive_(current_A|torque_counts)", "tau_in"),
    "sign of the load torque": _wrong_sign("^load_(current_A|torque_counts)", "tau_out"),
    "sign of the load angle": _wrong_sign("^load_encoder_counts", "theta_out"),
    "sign of a load cell": _either_load_cell,
    "drive and load exchanged": _exchanged("^(drive|load)_", "drive and load"),
    "cables A and B exchanged": _wrong_sign("(current_A|torque_counts)$", "A and B"),
    "a channel constant": _constant,
    "a channel saturated": _saturated,
    "an encoder wrapped": _wrapped,
    "a channel copied from another recording": _copied,
    "samples lost without a gap in time": _lost_samples,
    "clocks that drift": _drifting_clocks,
    "a recording of another rig": _other_rig,
    "pulley radii in mm": _radius_in_mm,
    "a forgotten bend": _forgotten_bend,
    "stated stiffness": _stated("cable", "stiffness_N_per_m"),
    "stated friction": _stated("cable", "friction_coefficient"),
    "stated spring": _stated("load", "spring_stiffness_Nm_per_rad", "^load_(current_A|torque_counts)"),
    "torques of drive and load exchanged": _exchanged("(current_A|torque_counts)$", "tau_in_Nm and tau_out_Nm"),
    "encoders of drive and load exchanged": _exchanged("^(drive|load)_encoder", "theta_in_rad and theta_out_rad"),
    "counts per turn of one end off by two": _counts_by_two,
    "magnitude of a current": _magnitude,
    "readings held for many samples": _held,
    "an accuracy far finer than the noise": _fine_accuracy,
    "starts of recordings too near": _near_starts,
    "a pair called a single cable": _single_cable,
    "the pretension of one recording": _pretension_of_one,
    "a torque in mN m or N cm": _torque_in_a_smaller_unit,
}


@dataclass(frozen=True)
class Outcome:
    """What was said of a batch with a mistake.

    Attributes
    ----------
    source, mistake : str
        The batch and the mistake.
    truth : str
        What is wrong, as the check should call it.
    said : list of str
        The contradictions, a sentence each.
    """

    source: str
    mistake: str
    truth: str
    said: list[str]

    @property
    def named(self) -> bool:
        """Whether what is wrong is named."""
        return any(self.truth in sentence.partition(": ")[0] for sentence in self.said)


def said_of(folder: Path) -> list[str]:
    """What a check says cannot be: file and what is wrong in it, a colon, and the sentence."""
    return [f"{Path(f.file).name} {f.column}: {f.text}" for f in ingest_batch(folder).findings if f.is_inconsistent]


def outcome(source: Path, mistake: str, seed: int, others: Sequence[Path]) -> Outcome | None:
    """The outcome of a mistake in a copy of a batch; None if the batch has no such channel or value."""
    random = np.random.default_rng([SEED, seed, list(MISTAKES).index(mistake)])
    donors = ingest_batch(others[seed % len(others)]).recordings if MISTAKES[mistake] is _other_rig else []
    copy = read_copy(source, donors)
    try:
        truth = MISTAKES[mistake](copy, random)
    except NotApplicableError:
        return None
    with TemporaryDirectory() as work:
        return Outcome(source.name, mistake, truth, said_of(write_copy(copy, Path(work) / "copy")))


def page_of(outcomes: Sequence[Outcome], alarms: Mapping[str, list[str]], took_s: float) -> str:
    """The section of the page."""
    sources = {"measured": {MEASURED.name}, "simulated": {SIMULATED.name}}
    known = set.union(*sources.values())
    sources["concealed cases"] = {o.source for o in outcomes} - known
    rows = ["| mistake | " + " | ".join(sources) + " | missed |", "|---|" + "---|" * (len(sources) + 1)]
    for mistake in MISTAKES:
        cells = []
        for of in sources.values():
            tried = [o for o in outcomes if o.mistake == mistake and o.source in of]
            cells.append(f"{sum(o.named for o in tried)} of {len(tried)}" if tried else "no such value")
        missed = [", ".join(o.said) or "nothing said" for o in outcomes if o.mistake == mistake and not o.named]
        rows.append(f"| {mistake} | {' | '.join(cells)} | {missed[0][:60] if missed else ''} |")
    named = sum(o.named for o in outcomes)
    low, high = (100 * p for p in binomtest(named, len(outcomes)).proportion_ci(0.95, "wilson"))
    false = {name: said for name, said in alarms.items() if said}
    lines = [
        f"Named: **{named} of {len(outcomes)}** ({100 * named / len(outcomes):.1f} %, 95 % interval {low:.1f} to"
        f" {high:.1f} %). False alarms: **{len(false)} of {len(alarms)}** batches without a mistake. Seed {SEED}, cases"
        f" from seed {CASES_SEED}; {took_s / 60:.0f} min.",
        "",
        *rows,
    ]
    lines += [f"\nFalse alarm in {name}: {'; '.join(said)}" for name, said in false.items()]
    return "\n".join(lines)


def main() -> None:
    """Make the mistakes, count, and write the section."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=40, help="fresh concealed cases without a mistake")
    parser.add_argument("--repeats", type=int, default=5, help="draws of each mistake in each kind of batch")
    parser.add_argument("--also", type=Path, nargs="*", default=[], help="further batches without a mistake")
    parser.add_argument("--cores", type=int, default=2)
    given = parser.parse_args()
    started = time.time()
    with TemporaryDirectory() as work, ProcessPoolExecutor(given.cores) as pool:
        parts = np.array_split(np.arange(given.cases), given.cores)
        recorded = [pool.submit(_cases, part.tolist(), Path(work) / str(k)) for k, part in enumerate(parts)]
        cases = [case for future in recorded for case in future.result()]
        untouched = [*sorted(p.parent for p in Path("data/raw").glob("*/batch.yaml")), *cases, *given.also]
        alarms = dict(zip([str(p.name) for p in untouched], pool.map(said_of, untouched), strict=True))
        jobs = [
            pool.submit(outcome, source, mistake, seed, [c for c in cases if c != source])
            for mistake in MISTAKES
            for seed in range(given.repeats)
            for source in (MEASURED, SIMULATED, cases[seed % len(cases)])
        ]
        outcomes = [found for job in jobs if (found := job.result())]
    section = page_of(outcomes, alarms, time.time() - started)
    print(section)
    for one in outcomes:
        if not one.named:
            print(f"missed: {one.source}, {one.mistake}, {one.truth}: {one.said}", file=sys.stderr)
    if PAGE.exists():
        text = PAGE.read_text(encoding="utf-8")
        before, rest = text.split(BEGIN)
        PAGE.write_text(f"{before}{BEGIN}\n{section}\n{END}{rest.split(END)[1]}", encoding="utf-8")


def _cases(seeds: Sequence[int], out: Path) -> list[Path]:
    found = []
    for seed in seeds:
        case = draw(CASES_SEED + seed)
        build(case, out)
        found.append(out / "cases" / case.name)
    return found


if __name__ == "__main__":
    main()
