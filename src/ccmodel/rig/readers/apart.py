"""Reading files in another process, since some libraries end the whole process on a damaged file.

The process starts with the first such file. It loads the libraries once, and forks for each file: what a damaged file
does to a fork is one line about this file. It ends with the process that asks it.
"""

import math
import os
import pickle
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Event, Lock, Timer
from typing import IO, NamedTuple

from ccmodel.rig.findings import LogError
from ccmodel.rig.readers.attempt import damaged, read_here
from ccmodel.rig.readers.contract import Format, SignalFile

# Time for a file of its own process: a sound one takes a second for tens of MB. A library that goes round in circles on
# a damaged file uses the processor all the time; one that waits for a slow disk does not.
_PATIENCE_S, _COMPUTING_S, _S_PER_MB = 60.0, 8.0, 1.0
_CHILD = "from ccmodel.rig.readers.apart import _main; _main()"
# Elsewhere some libraries of the system do not outlive a fork, or there is none.
_FORKS = sys.platform == "linux"
# Exit code of a fork that has answered; a library that ends the process may give 0.
_ANSWERED = 99
# What is added to the number of the signal that ends a fork, as shells do.
_SIGNALLED = 128
# The signal that ends a process whose time of computing is over.
_OUT_OF_COMPUTING = getattr(signal, "SIGXCPU", 24)


def read_apart(name: str, format: Format, path: Path) -> SignalFile | LogError:
    """As `read_here`, in a process of its own; `name` is the module of the format."""
    more = _S_PER_MB * path.stat().st_size / 1e6
    # A library that fails on a damaged file leaves its temporary files behind.
    with TemporaryDirectory(prefix="ccmodel-read-") as scratch:
        environment = {**os.environ, "TMPDIR": scratch}
        result = _apart.read(_Request(name, path.absolute(), _COMPUTING_S + more, environment), _PATIENCE_S + more)
    return damaged(format, result) if isinstance(result, str) else result


class _Request(NamedTuple):
    """A file to be read by another process."""

    name: str  # module of the format
    path: Path
    computing_s: float  # the process is ended after this time of computing
    environment: dict[str, str]


class _Apart:
    """The process that reads files for this one. It starts with the first file, and again after it has failed."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._owner = 0  # a process that was forked from this one must not share it
        self._lock = Lock()

    def read(self, request: _Request, patience_s: float) -> SignalFile | LogError | str:
        """Result of a request; if the process ends without one, the reason."""
        with self._lock:
            process, is_late, result = self._running(), Event(), None
            timer = Timer(patience_s, _give_up, [process, is_late])
            timer.start()
            try:
                result = _asked(process, request)
            except BaseException:  # the user interrupts: what the process still writes must answer no later request
                _kill(process)
                raise
            finally:
                timer.cancel()
                timer.join()
                if result is None or is_late.is_set() or not _FORKS:
                    self._process, code = None, process.wait()
        if result is not None:
            return result
        if is_late.is_set():
            return f"not read after {patience_s:.0f} s"
        if code in (-_OUT_OF_COMPUTING, _SIGNALLED + _OUT_OF_COMPUTING):  # of the process itself, or of its fork
            return f"not read after {request.computing_s:.0f} s of computing"
        return "its library fails on it"

    def _running(self) -> "subprocess.Popen[bytes]":
        if self._process is None or self._owner != os.getpid() or self._process.poll() is not None:
            # Threads of a library for linear algebra would not outlive a fork, and nothing here needs them.
            environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "OMP_NUM_THREADS": "1"}
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", _CHILD],  # -P: modules in the user's folder are not imported
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=environment,
                start_new_session=True,
            )
            self._owner = os.getpid()
        return self._process


_apart = _Apart()


def _asked(process: "subprocess.Popen[bytes]", request: _Request) -> SignalFile | LogError | None:
    """Answer of a process to a request; None if it ends without one."""
    assert process.stdin is not None and process.stdout is not None
    try:
        pickle.dump(request, process.stdin)
        process.stdin.flush()
        result: SignalFile | LogError = pickle.load(process.stdout)
    except (BrokenPipeError, EOFError, pickle.UnpicklingError):
        return None
    return result


def _give_up(process: "subprocess.Popen[bytes]", is_late: Event) -> None:
    is_late.set()
    _kill(process)


def _kill(process: "subprocess.Popen[bytes]") -> None:
    """Kill a process and, where a process can have one, its group."""
    with suppress(ProcessLookupError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()


def _main() -> None:
    """Serve the requests that come by standard input.

    The results go to what was standard output, and nothing else does. Of the formats, those that are asked for are
    loaded. A fork for each file has the libraries loaded already, and leaves nothing behind; where no process can be
    forked safely, this one ends after a file.
    """
    results = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    while request := _next_request():
        format = import_module(f"{__package__}.{request.name}").FORMAT
        for library in format.apart:
            with suppress(Exception):  # `read_here` meets and words it again
                import_module(library)
        if _FORKS and (child := os.fork()):
            code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
            if code != _ANSWERED:
                os._exit(_SIGNALLED - code if code < 0 else 1)
            continue
        _answer(request, format, results)
        os._exit(_ANSWERED)


def _next_request() -> _Request | None:
    try:
        request: _Request = pickle.load(sys.stdin.buffer)
    except EOFError:
        return None
    return request


def _answer(request: _Request, format: Format, results: IO[bytes]) -> None:
    os.environ.clear()
    os.environ.update(request.environment)
    tempfile.tempdir = None  # to be found again from the environment
    limit_computing(request.computing_s)
    pickle.dump(read_here(format, request.path), results, protocol=5)
    results.flush()


def limit_computing(seconds: float = _COMPUTING_S) -> None:
    """Let the system end this process after a time of computing; Windows has no such limit."""
    try:
        import resource
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    soft, hard = math.ceil(seconds), math.ceil(seconds) + 1
    if (inherited := resource.getrlimit(resource.RLIMIT_CPU)[1]) != resource.RLIM_INFINITY:
        soft, hard = min(soft, inherited), min(hard, inherited)
    resource.setrlimit(resource.RLIMIT_CPU, (soft, hard))
