"""One attempt to read a file: its signals, or one clear line on why there are none.

Libraries raise anything for damaged files, and print and log beside it. Some, written in C, end the whole process: see
`ccmodel.rig.readers.apart`.
"""

import io
import logging
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path

from ccmodel.rig.findings import LogError
from ccmodel.rig.readers.contract import Format, SignalFile, TextLayout

COPY = "copy it again from the recorder"
# What to do with a log that is not in the format of a batch.
IMPORTING = "bring it to the format of a batch with 'ccmodel import'"


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
            advice = f"in a copy of ccmodel: pip install '.[{format.extra}]'"
            return LogError(None, None, f"a {format.name} needs the library {error.name}: {advice}")
        except FileNotFoundError:
            return LogError(None, None, "there is no such file")
        except PermissionError as error:
            return LogError(None, None, f"cannot be read ({error.strerror})")
        except MemoryError:
            return damaged(format, "a size in it is larger than the memory")
        except Exception as error:
            return damaged(format, _detail(error))


def damaged(format: Format, detail: str) -> LogError:
    """The line for a file that its library cannot read; `detail` says why, or is ""."""
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
