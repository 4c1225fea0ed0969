"""One attempt to read a file: its signals, or one clear line on why there are none.

Libraries raise anything for damaged files, and print and log beside it. Some, written in C, end the whole process; a
format with such a library is read in a process of its own.
"""

import io
import logging
import math
import os
import pickle
import signal
import subprocess
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory

from ccmodel.rig.findings import LogError
from ccmodel.rig.readers.contract import Format, SignalFile, TextLayout

COPY = "copy it again from the recorder"
# Time for a file of its own process: a sound one takes a second for tens of MB. A library that goes round in circles on
# a damaged file uses the processor all the time; one that waits for a slow disk does not.
_PATIENCE_S, _COMPUTING_S, _S_PER_MB = 60.0, 8.0, 1.0
_CHILD = "from ccmodel.rig.readers.attempt import _main; _main()"


def read_here(format: Format, path: Path, text: TextLayout | None = None) -> SignalFile | LogError:
    """Read a file, or say why it cannot be read.

    The error is returned and not raised, so that nothing of the library's own error outlives the attempt: objects of a
    library that are half made complain when they are deleted.
    """
    with _quiet():
        try:
            return format.read(path, text) if text else format.read(path)
        except LogError as error:
            return LogError(*error.args)
        except ModuleNotFoundError as error:
            advice = f"pip install 'ccmodel[{format.extra}]'"
            return LogError(None, None, f"a {format.name} needs the library {error.name}: {advice}")
        except FileNotFoundError:
            return LogError(None, None, "there is no such file")
        except PermissionError as error:
            return LogError(None, None, f"cannot be read ({error.strerror})")
        except MemoryError:
            return _damaged(format, "a size in it is larger than the memory")
        except Exception as error:
            return _damaged(format, _detail(error))


def read_apart(name: str, format: Format, path: Path) -> SignalFile | LogError:
    """As `read_here`, in a process of its own; `name` is the module of the format."""
    more = _S_PER_MB * path.stat().st_size / 1e6
    patience, computing = _PATIENCE_S + more, _COMPUTING_S + more
    command = [sys.executable, "-c", _CHILD, name, str(path), str(computing)]
    # A library that fails on a damaged file leaves its temporary files behind.
    with TemporaryDirectory(prefix="ccmodel-read-") as scratch:
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p), "TMPDIR": scratch}
        try:
            child = subprocess.run(command, capture_output=True, env=environment, timeout=patience, check=False)
        except subprocess.TimeoutExpired:
            return _damaged(format, f"not read after {patience:.0f} s")
    if child.returncode == -getattr(signal, "SIGXCPU", 0) != 0:
        return _damaged(format, f"not read after {computing:.0f} s of computing")
    return pickle.loads(child.stdout) if child.returncode == 0 else _damaged(format, "its library fails on it")


def _main() -> None:
    """The process of `read_apart`: the result goes to standard output, and nothing else does.

    Of the formats it loads its own only.
    """
    result = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    name, path, computing = sys.argv[1:]
    limit_computing(float(computing))
    format = import_module(f"{__package__}.{name}").FORMAT
    pickle.dump(read_here(format, Path(path)), result, protocol=5)
    result.close()


def limit_computing(seconds: float = _COMPUTING_S) -> None:
    """Let the system end this process after a time of computing; Windows has no such limit."""
    try:
        import resource
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(seconds), math.ceil(seconds) + 1))


def _damaged(format: Format, detail: str) -> LogError:
    detail = f" ({detail})" if detail else ""
    advice = f", or {format.repair}" if format.repair else ""
    return LogError(None, None, f"the {format.name} is cut short or damaged{detail}: {COPY}{advice}")


def _detail(error: Exception) -> str:
    """What a library says, in short; "" if these are no words for a person."""
    said = " ".join(str(error).split()).strip("'\"")
    if " " not in said or isinstance(error, IndexError | TypeError | AttributeError | AssertionError):
        return ""
    return said if len(said) <= 100 else said[:100].rstrip() + " ..."


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep libraries from printing and logging: what is wrong is said once, by us."""
    level, hook = logging.root.manager.disable, sys.unraisablehook
    logging.disable(logging.CRITICAL)
    sys.unraisablehook = lambda unraisable: None
    try:
        with warnings.catch_warnings(), redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            warnings.simplefilter("ignore")
            yield
    finally:
        logging.disable(level)
        sys.unraisablehook = hook
