"""Run Snakemake on a folder of results: ``python workflow/run.py RESULTS COMMAND...``.

Snakemake's lock of the working directory stays after a kill, and nothing tells it from that of a run that goes on. The
operating system's lock, held here and by Snakemake itself, is gone with the last process that holds it. Runs into other
folders of results do not wait for one another.
"""

import fcntl
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import IO
from urllib.parse import quote

# Below the working directory, as Snakemake's own locks.
RUNS, LOCKS = Path(".snakemake/runs"), Path(".snakemake/locks")


def main(results: str, *command: str) -> int:
    """Run the command, and return its exit code; 1 if another run into the same results goes on."""
    RUNS.mkdir(parents=True, exist_ok=True)
    name = f"{quote(os.path.normpath(results), safe='')}.json"
    with open(RUNS / name, "a+", encoding="utf-8") as record:
        if not _hold(record):
            print(f"{results}: {_holder(record)}", file=sys.stderr)
            return 1
        if _content(record) and not _others(name):
            # A run that was killed did not empty its record.
            shutil.rmtree(LOCKS, ignore_errors=True)
        code = _run(command, record)
        # What a signal has killed leaves its lock, and the record says so.
        if code >= 0:
            record.truncate(0)
    return code


def _run(command: tuple[str, ...], record: IO[str]) -> int:
    """Run a process that holds the lock too, so that it lasts if only this one is killed."""
    process = subprocess.Popen(command, pass_fds=[record.fileno()])
    about = {"process": process.pid, "host": socket.gethostname(), "since": time.strftime("%Y-%m-%d %H:%M:%S")}
    record.truncate(0)
    json.dump(about, record)
    record.flush()
    # Ctrl-C reaches Snakemake by itself; it ends its jobs, and is waited for.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: process.terminate())
    return process.wait()


def _hold(record: IO[str]) -> bool:
    """Take the lock of a record; False if another process has it."""
    try:
        fcntl.flock(record, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _others(own: str) -> bool:
    """Whether a run into other results goes on."""
    for file in RUNS.glob("*.json"):
        if file.name != own:
            with open(file, "a+", encoding="utf-8") as record:
                if not _hold(record):
                    return True
    return False


def _holder(record: IO[str]) -> str:
    try:
        about = json.loads(_content(record))
    except ValueError:  # it has just begun
        return "another run has just begun; wait until it ends"
    place = "" if about["host"] == socket.gethostname() else f" on {about['host']}"
    return (
        f"process {about['process']}{place} has been working on these results since {about['since']}; wait until it"
        f" ends, or end it: kill {about['process']}"
    )


def _content(record: IO[str]) -> str:
    record.seek(0)
    return record.read()


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
