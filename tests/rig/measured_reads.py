"""Reads of files, each in a process of its own whose time and memory are measured and whose end does no harm.

A fresh interpreter takes 2 s for the libraries. So one process loads them and forks for each file.
"""

import json
import os
import re
import resource
import select
import signal
import subprocess
import sys
import tempfile
import traceback
import warnings
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

# A read that waits is stopped there. What stands in memory is measured and not stopped, up to a size that spares the
# machine.
PATIENCE_S = 60.0
_ADDRESS_SPACE = 12 << 30
_CODE = "from measured_reads import _serve; _serve()"


class Read(NamedTuple):
    """A read of a file.

    Attributes
    ----------
    refusal : str or None
        The line of the refusal; None if there are signals.
    fault : str
        What must not be: a traceback, output, the end of the process; "" if there is none.
    seconds : float
        Of computing, so that other processes of the machine do not count.
    megabytes : float
        Growth of the peak of memory.
    names : list of str
        The signals that were read.
    """

    refusal: str | None
    fault: str
    seconds: float
    megabytes: float
    names: Sequence[str] = ()


class MeasuredReads:
    """The process that reads."""

    def __init__(self):
        path = os.pathsep.join((str(Path(__file__).parent), *filter(None, sys.path)))
        self._process = subprocess.Popen(
            [sys.executable, "-c", _CODE],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": path},
            text=True,
        )

    def read(self, path: Path) -> Read:
        """Read the signals of a file, guess what they are and make a log of them."""
        self._process.stdin.write(f"{path}\n")
        self._process.stdin.flush()
        return Read(*json.loads(self._process.stdout.readline()))

    def close(self) -> None:
        self._process.stdin.close()
        self._process.wait()
        self._process.stdout.close()


def _serve() -> None:
    import asammdf  # noqa: F401
    import h5py  # noqa: F401
    import nptdms  # noqa: F401
    import rosbags.highlevel  # noqa: F401
    import scipy.io  # noqa: F401
    from rosbags.typesys import Stores, get_typestore

    from ccmodel.rig import readers

    readers.registry()
    get_typestore(Stores.LATEST)
    with TemporaryDirectory() as folder:
        # The first read loads what the others use too, such as the table of units.
        first = Path(folder, "first.csv")
        first.write_text("t [s],angle [deg]\n" + "".join(f"{0.1 * i},{i}\n" for i in range(20)))
        _outcome(first)
    for line in sys.stdin:
        print(json.dumps(_in_a_fork(Path(line.rstrip("\n")))), flush=True)


def _in_a_fork(path: Path) -> Read:
    """Read a file in a fork of this process."""
    output, input_ = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(output)
        with os.fdopen(input_, "w") as pipe:
            pipe.write(json.dumps(_measured(path)))
        os._exit(0)
    os.close(input_)
    with os.fdopen(output) as pipe:
        in_time = bool(select.select([pipe], [], [], PATIENCE_S)[0])
        if not in_time:
            os.kill(child, signal.SIGKILL)
        said = pipe.read()
    _, status, used = os.wait4(child, 0)
    seconds = used.ru_utime + used.ru_stime
    if not in_time:
        return Read(None, f"not read after {PATIENCE_S:g} s", seconds, 0.0)
    if not said:
        return _ended(path, status, seconds)
    refusal, fault, megabytes, names = json.loads(said)
    return Read(refusal, fault, seconds, megabytes, names)


def _ended(path: Path, status: int, seconds: float) -> Read:
    """What comes of a library that ends the process: a refusal, if its format is read in a process of its own."""
    from ccmodel.rig import readers
    from ccmodel.rig.readers import signatures

    end = f"the process ended with signal {os.WTERMSIG(status)}" if os.WIFSIGNALED(status) else "the process ended"
    module = signatures.kind_of(path).module
    if module and readers.registry()[module].apart:
        return Read(f"copy it again ({end})", "", seconds, 0.0)
    return Read(None, end, seconds, 0.0)


def _measured(path: Path) -> tuple[str | None, str, float, list[str]]:
    """Refusal, fault, growth of the peak of memory, MB, and names of the signals."""
    resource.setrlimit(resource.RLIMIT_AS, (_ADDRESS_SPACE, _ADDRESS_SPACE))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    # A library that fails on a damaged file leaves its temporary files behind; the file's folder goes with its test.
    tempfile.tempdir = str(path.parent)
    # What a library in C prints would be seen by the user of a format that is read in the process itself.
    printed = os.memfd_create("printed")
    os.dup2(printed, 1), os.dup2(printed, 2)
    before = _peak_kB()
    refusal, fault, names = _outcome(path)
    if not fault and (size := os.fstat(printed).st_size):
        fault = f"prints {os.pread(printed, min(size, 300), 0)!r}"
    return refusal, fault, (_peak_kB() - before) / 1024, names


def _peak_kB() -> int:
    return int(re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())[1])


def _outcome(path: Path) -> tuple[str | None, str, list[str]]:
    """Refusal, fault and names of the signals."""
    from ccmodel.rig import readers
    from ccmodel.rig.findings import LogError
    from ccmodel.rig.importing.guess import guess_file
    from ccmodel.rig.readers.apart import limit_computing
    from ccmodel.rig.readers.attempt import read_here
    from ccmodel.rig.readers.log_table import log_of_signals

    def read_apart(name, format, path):
        limit_computing()
        return read_here(format, path)

    readers.read_apart = read_apart  # this process is already one of its own
    strict = path.suffix in (".csv", ".gz")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            file = readers.read_signals(path)
            guess_file(file)
            with suppress(LogError):  # sound signals may be no log of a batch
                readers.read(path) if strict else log_of_signals(file, "file")
    except LogError as error:
        row, column, text = error.args
        fine = (row is None or row > 0) and (column is None or isinstance(column, str)) and isinstance(text, str)
        return text, "" if fine else f"odd arguments {error.args}", []
    except BaseException:
        return None, traceback.format_exc()[-3000:], []
    return None, _odd(file), [s.name for s in file.signals]


def _odd(file) -> str:
    """What is wrong with signals; "" if nothing is."""
    if not file.signals:
        return "no signals"
    for signal_ in file.signals:
        values, time_s = signal_.values, signal_.time_s
        if values.ndim != 1 or values.dtype != float or (time_s is not None and time_s.shape != values.shape):
            return f"signal {signal_.name!r} of shape {values.shape}, {values.dtype}"
    return ""
