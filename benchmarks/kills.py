"""Kills at random moments, and full disks: ``python -m benchmarks.kills``, or ``make kills``.

The pipeline, a diagnosis, an import and ``ccmodel accuracy accept`` run on small inputs. First each runs undisturbed,
which gives the files that it has to make and the time it takes. Then it is killed (SIGKILL, with all its processes) at
moments drawn over this time; for every second kill, the result of an earlier version is in place. After a kill, the
place has to hold the earlier result, the new one, or what the command promises between them. Then the command runs
again, without any help, and has to end with the same files as the undisturbed run. Last, each runs on a full disk that
holds an earlier result, and on a disk with room for half of the result.

A kill is a line of kills.jsonl. An interrupted run goes on behind the last line, as long as the sources are the same.
Exits with 1 if anything was lost, mixed or different.
"""

import argparse
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import yaml

from benchmarks.compared_files import Files, differing, files_in
from ccmodel.provenance import source_digest

ROOT = Path(__file__).parents[1]
CCMODEL = ("-m", "ccmodel.cli")
SNAKEMAKE = ("-m", "snakemake", "--snakefile", str(ROOT / "Snakefile"), "--configfile", "config.yaml", "--cores")
TUTORIAL = ROOT / "docs/tutorial"
LOGS = ("logs/run1.csv", "logs/run2.csv")
UNFINISHED = ".unfinished-"
VERDICT = "diagnosis.json"
# A moment that was drawn may lie behind the end of a run that was faster than those before.
DRAWS = 10
# Disks by their name: the working folder that is put on them, and the share of the result that they have room for.
DISKS = {"full disk": ("older", 0.0), "room for half": ("fresh", 0.5)}
SPARE_BYTES = 8_000_000


@dataclass(frozen=True)
class Command:
    """A command that is killed.

    Attributes
    ----------
    kills : int
        How often, if not asked otherwise.
    line : tuple of str
        What follows the interpreter.
    out : tuple of str
        Files and folders that it writes, relative to the working folder.
    prepare : callable
        Write its inputs to a working folder, with or without the result of an earlier version.
    state : callable
        What its places hold: all as "before", all as "after", something "between" that is promised, or something
        "wrong". It is called with the files there, those before and those after an undisturbed run.
    says_one_line : bool
        Whether a full disk is one line for the reader.
    """

    kills: int
    line: tuple[str, ...]
    out: tuple[str, ...]
    prepare: Callable[[Path, bool], None]
    state: Callable[[Files, Files, Files], str]
    says_one_line: bool = True


def visible(files: Files) -> dict[str, bytes]:
    """Files without what a killed command has left beside its place."""
    return {name: content for name, content in files.items() if UNFINISHED not in name}


def whole(there: Files, before: Files, after: Files) -> str:
    """Whether files are all as "before" or all as "after"; "" if neither."""
    return next((name for name, files in (("before", before), ("after", after)) if there == files), "")


def state_of_set(there: Files, before: Files, after: Files) -> str:
    """Files that belong together: those of one run, and without its verdict if they are not all there.

    The others then lie beside them, where the next run finds them.
    """
    seen = visible(there)

    def is_between(files: Files, aside: str) -> bool:
        kept = {name.replace(f"{UNFINISHED}files/{aside}/", ""): content for name, content in there.items()}
        return seen.items() <= files.items() <= kept.items()

    has_verdict = any(name.endswith(VERDICT) for name in seen)
    between = not has_verdict and (is_between(before, "earlier") or is_between(after, "complete"))
    return whole(seen, before, after) or ("between" if between else "wrong")


def state_of_folder(there: Files, before: Files, after: Files) -> str:
    """A folder as a whole; between the two renamings, the earlier one lies beside its place."""
    seen = visible(there)
    kept = {name.replace(f"{UNFINISHED}first/earlier-first", "first"): content for name, content in there.items()}
    beside = not seen and before.items() <= kept.items()
    return whole(seen, before, after) or ("between" if beside else "wrong")


def state_of_each(there: Files, before: Files, after: Files) -> str:
    """Files each of which is whole, of the earlier run or of the new one; one that is gone is made by the next run."""
    there = visible(there)
    each = all(content in (before.get(name), after.get(name)) for name, content in there.items())
    return whole(there, before, after) or ("between" if each else "wrong")


def prepare_diagnosis(folder: Path, older: bool) -> None:
    """A batch that agrees with the model; the earlier result is that of its other recording alone."""
    if older:
        write_batch(folder / "tiny", pretensions=(3.5,))
        run(COMMANDS["diagnose"].line, folder)
        shutil.rmtree(folder / "tiny")
    write_batch(folder / "tiny")


def prepare_import(folder: Path, older: bool) -> None:
    """Logs of the tutorial; the earlier result is of its later ones, with a batch.yaml that was filled in."""
    (folder / "logs").mkdir(parents=True)
    shutil.copy(TUTORIAL / "map.yaml", folder)
    if older:
        for later, log in zip(("run5.csv", "run6.csv"), LOGS, strict=True):
            shutil.copy(TUTORIAL / "later" / later, folder / log)
        run(COMMANDS["import"].line, folder)
        with open(folder / "raw/first/batch.yaml", "a") as stated:
            stated.write("# mine\n")
    for log in LOGS:
        shutil.copy(TUTORIAL / log, folder / log)


def prepare_pipeline(folder: Path, older: bool) -> None:
    """A tiny batch and its accuracy; the earlier result is of a softer cable."""
    raw = folder / "data/raw/tiny"
    if older:
        write_batch(raw, k=7000.0)
        write_config(folder)
        run(COMMANDS["pipeline"].line, folder)
        shutil.rmtree(raw)
    write_batch(raw)
    write_config(folder)


def prepare_accept(folder: Path, older: bool) -> None:
    """A project whose pipeline has run; the earlier baseline is of another commit and of a softer cable."""
    prepare_pipeline(folder, older)
    if older:
        run(COMMANDS["accept"].line, folder)
        history = folder / "config/history.csv"
        rows = [line.split(",", 1)[-1] for line in history.read_text().splitlines()]
        history.write_text("\n".join(["commit," + rows[0], *("0000000," + row for row in rows[1:])]) + "\n")
    run(COMMANDS["pipeline"].line, folder)


def write_batch(folder: Path, **options: object) -> None:
    """The small batch of the tests, which belong to no package."""
    sys.path.insert(0, str(ROOT / "tests"))
    import builders

    builders.write_batch(folder, **options)


def write_config(folder: Path) -> None:
    """Configuration of a run that measures its accuracy."""
    files = {"file": "config/baseline.json", "history": "config/history.csv"}
    (folder / "config.yaml").write_text(yaml.safe_dump({"baseline": files}))


COMMANDS = {
    "diagnose": Command(
        12,
        (*CCMODEL, "diagnose", "tiny", "--out", "out", "--time-limit", "3000", "--quiet"),
        ("out",),
        prepare_diagnosis,
        state_of_set,
    ),
    "import": Command(
        10,
        (*CCMODEL, "import", *LOGS, "--map", "map.yaml", "--out", "raw/first", "--quiet"),
        ("raw",),
        prepare_import,
        state_of_folder,
    ),
    "accept": Command(
        8,
        (*CCMODEL, "accuracy", "accept", "results", "--reason", "a test", "--quiet"),
        ("config",),
        prepare_accept,
        state_of_each,
    ),
    "pipeline": Command(
        20,
        (str(ROOT / "workflow/run.py"), "results", sys.executable, *SNAKEMAKE, "1"),
        ("results",),
        prepare_pipeline,
        state_of_each,
        says_one_line=False,
    ),
}


def run(line: tuple[str, ...], folder: Path, before: Callable[[], None] | None = None) -> subprocess.CompletedProcess:
    """Run a command to its end; a failure is an error, unless it is caught."""
    command = [sys.executable, *line]
    # A small disk is a file system of its own, and the repository, whose commit is accepted, lies on another.
    env = {**os.environ, "GIT_DISCOVERY_ACROSS_FILESYSTEM": "1"}
    return subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True, check=True, preexec_fn=before)


@dataclass(frozen=True)
class Reference:
    """The undisturbed runs of a command.

    Attributes
    ----------
    command : Command
    inputs : Path
        Folder of the working folders before the run: without an earlier result ("fresh"), and with one ("older").
    work : Path
        Where all runs take place, since some files name their folder.
    before, ended : mapping
        Files at the command's places before and after an undisturbed run, by the name of the working folder.
    took_s : float
        Duration of the run without an earlier result.
    """

    command: Command
    inputs: Path
    work: Path
    before: dict[str, Files]
    ended: dict[str, Files]
    took_s: float

    def begin(self, which: str) -> None:
        """Put a working folder into its place as it was before any run."""
        for entry in [*self.work.iterdir()] if self.work.exists() else []:
            shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
        shutil.copytree(self.inputs / which, self.work, dirs_exist_ok=True)

    def there(self) -> dict[str, bytes]:
        """Files at the command's places."""
        return files_in(self.work, self.command.out)

    def lost(self, which: str) -> list[str]:
        """Files of the inputs that are gone or changed."""
        inputs = [p.name for p in (self.inputs / which).iterdir() if p.name not in (*self.command.out, ".snakemake")]
        return differing(files_in(self.inputs / which, inputs), files_in(self.work, inputs))


def reference(command: Command, folder: Path) -> Reference:
    """Prepare a command's working folders, and run it undisturbed in both."""
    made, inputs, work = folder / "reference.json", folder / "inputs", folder / "work"
    if not made.exists():
        shutil.rmtree(folder, ignore_errors=True)
        for which in ("fresh", "older"):
            command.prepare(work, which == "older")
            shutil.copytree(work, inputs / which)
            shutil.rmtree(work)
        took = [_undisturbed(command, inputs / which, work, folder / f"ended-{which}") for which in ("older", "fresh")]
        made.write_text(json.dumps({"took_s": took[-1]}))
    before = {which: files_in(inputs / which, command.out) for which in ("fresh", "older")}
    ended = {which: files_in(folder / f"ended-{which}", command.out) for which in ("fresh", "older")}
    return Reference(command, inputs, work, before, ended, json.loads(made.read_text())["took_s"])


def _undisturbed(command: Command, inputs: Path, work: Path, ended: Path) -> float:
    shutil.copytree(inputs, work)
    started = time.monotonic()
    run(command.line, work)
    took_s = time.monotonic() - started
    work.rename(ended)
    return took_s


def kill(of: Reference, which: str, random: np.random.Generator) -> dict:
    """Kill a command at a random moment, look at what is there, and run it again; what was found."""
    longest_s = of.took_s
    for _ in range(DRAWS):
        at_s = random.uniform(0, longest_s)
        of.begin(which)
        started = time.monotonic()
        if killed(of.command.line, of.work, at_s):
            break
        longest_s = time.monotonic() - started
    else:
        return {"at_s": at_s, "state": "wrong", "why": "it always ended before it was killed"}
    state = of.command.state(of.there(), of.before[which], of.ended[which])
    why = [f"after the kill: {_some(differing(of.there(), of.ended[which]))}"] if state == "wrong" else []
    return {"at_s": round(at_s, 2), "state": state, "why": "; ".join([*why, *ends_as_ever(of, which)])}


def ends_as_ever(of: Reference, which: str) -> list[str]:
    """Run a command again; what is not as after an undisturbed run."""
    try:
        run(of.command.line, of.work)
    except subprocess.CalledProcessError as error:
        return [f"the next run failed: {error.stderr[-500:]}"]
    wrong = []
    if other := differing(of.there(), of.ended[which]):
        wrong.append(f"the next run differs: {_some(other)}")
    if lost := of.lost(which):
        wrong.append(f"inputs are lost: {_some(lost)}")
    return wrong


def killed(line: tuple[str, ...], work: Path, at_s: float) -> bool:
    """Start a command and kill it with all its processes; False if it has ended before."""
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    process = subprocess.Popen([sys.executable, *line], cwd=work, start_new_session=True, **quiet)
    try:
        process.wait(at_s)
        return False
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    # The kernel ends the group's other processes a moment after its leader.
    while _working_in(work):
        time.sleep(0.05)
    return True


def _working_in(folder: Path) -> bool:
    """Whether a process has a working directory."""
    for place in Path("/proc").glob("[0-9]*/cwd"):
        try:
            if Path(os.readlink(place)) == folder.resolve():
                return True
        except OSError:  # it has ended, or is another user's
            continue
    return False


def on_disk(of: Reference, disk: str) -> dict:
    """Run a command on a disk that is too small, look at what is there, make room, and run it again."""
    which, share = DISKS[disk]
    before, after = of.before[which], of.ended[which]
    with small_disk(of.work, round(share * sum(map(len, after.values())))) as (begin, limit, clear):
        begin(partial(of.begin, which))
        why = _fails(of, limit)
        state = of.command.state(of.there(), before, after)
        if state == "wrong" or (state != "before" and of.command.says_one_line):
            why.append(f"the earlier result is not there: {_some(differing(of.there(), before))}")
        clear()
        why += ends_as_ever(of, which)
    return {"at_s": None, "state": state, "why": "; ".join(why)}


def _fails(of: Reference, limit: Callable[[], None] | None) -> list[str]:
    try:
        run(of.command.line, of.work, limit)
        return ["the full disk was no failure"]
    except subprocess.CalledProcessError as error:
        lines = error.stderr.strip().splitlines()
        return [f"{len(lines)} lines: {lines[-3:]}"] if of.command.says_one_line and len(lines) != 1 else []


@contextmanager
def small_disk(work: Path, free: int) -> Iterator[tuple[Callable, Callable[[], None] | None, Callable[[], None]]]:
    """A disk of its own at `work`; without the right to mount one, a limit on the size of a file.

    Yields
    ------
    callable
        Called with what writes the working folder; afterwards `free` bytes are left.
    callable or None
        What a process has to call before the command, to have the limit.
    callable
        Makes room.
    """
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir()
    filler, size = work / ".filler", SPARE_BYTES + 4 * sum(f.stat().st_size for f in work.parent.rglob("*"))
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(work)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        most = max(free, 1)
        yield (lambda write: write(), partial(resource.setrlimit, resource.RLIMIT_FSIZE, (most, most)), lambda: None)
        return
    try:
        yield (partial(_fill, filler, free), None, filler.unlink)
    finally:
        subprocess.run(["umount", str(work)], check=True)


def _fill(filler: Path, free: int, write: Callable[[], None]) -> None:
    """Write the working folder, then a file that takes all of the disk but `free` bytes."""
    write()
    with open(filler, "wb", buffering=0) as file:
        size = shutil.disk_usage(filler.parent).free - free
        while size > 0:
            size -= file.write(bytes(min(size, 1 << 20)))


def _some(names: list[str]) -> str:
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")


def kills_of(name: str, count: int, seed: int, out: Path) -> Iterator[dict]:
    """Rows of a command's kills and of its small disks, those of an earlier run first."""
    done = {(row["command"], row["number"]): row for row in _rows(out / "kills.jsonl")}
    numbers = [*range(count), *DISKS]
    yield from (done[name, number] for number in numbers if (name, number) in done)
    if all((name, number) in done for number in numbers):
        return
    of = reference(COMMANDS[name], (out / name).resolve())
    for number in numbers:
        if (name, number) in done:
            continue
        row = {"command": name, "number": number}
        if number in DISKS:
            row |= {"older": DISKS[number][0] == "older"} | on_disk(of, number)
        else:
            which = "older" if number % 2 else "fresh"
            random = np.random.default_rng([seed, [*COMMANDS].index(name), number])
            row |= {"older": which == "older"} | kill(of, which, random)
        with open(out / "kills.jsonl", "a") as file:
            file.write(json.dumps(row) + "\n")
        yield row


def _rows(file: Path) -> list[dict]:
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


def table(rows: list[dict]) -> str:
    """Counts by command, as a table of Markdown."""
    lines = [
        "| command | kills | with an earlier result | state after the kill | small disks | failed |",
        "|---|---|---|---|---|---|",
    ]
    for name in dict.fromkeys(row["command"] for row in rows):
        own = [row for row in rows if row["command"] == name]
        kills = [row for row in own if row["number"] not in DISKS]
        states = ", ".join(f"{state} {n}" for state, n in sorted(Counter(row["state"] for row in kills).items()))
        failed = sum(bool(row["why"]) for row in own)
        older = sum(row["older"] for row in kills)
        lines.append(f"| {name} | {len(kills)} | {older} | {states} | {len(own) - len(kills)} | {failed} |")
    return "\n".join(lines)


def main() -> int:
    """Run as a script; 1 if a kill or a full disk failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results/kills"))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--share", type=float, default=1.0, help="share of the fifty kills")
    parser.add_argument("--only", choices=COMMANDS, action="append", help="a command; may be repeated")
    asked = parser.parse_args()
    # Kills of other sources say nothing of these.
    out = asked.out / f"{source_digest('ccmodel.cli.__init__')}-{asked.seed}"
    out.mkdir(parents=True, exist_ok=True)
    rows = []
    for name in asked.only or COMMANDS:
        for row in kills_of(name, max(1, round(asked.share * COMMANDS[name].kills)), asked.seed, out):
            rows.append(row)
            print(json.dumps(row), flush=True)
    print(table(rows))
    return int(any(row["why"] for row in rows))


if __name__ == "__main__":
    sys.exit(main())
