"""Ctrl-C and the request to end (SIGTERM): what a command leaves, and how to go on."""

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

AGAIN = "the same command starts again"
# Names of files in the message, at most.
_MOST_NAMED = 5
# Module that runs the compiler of kernels, and the time after which a signal is sent again meanwhile, s.
COMPILER = "llvmlite.binding.executionengine"
REPEAT_S = 0.1


class Terminated(BaseException):
    """The process was asked to end."""


class Interrupted(Exception):  # noqa: N818
    """A command was interrupted; the text says what it leaves.

    Parameters
    ----------
    text : str
    exit_code : int
        128 and the number of the signal.
    """

    def __init__(self, text: str, exit_code: int):
        super().__init__(text)
        self.exit_code = exit_code


@contextmanager
def signals() -> Iterator[None]:
    """Answer to SIGTERM by `Terminated`, so that files and processes are cleared up as after Ctrl-C."""
    former = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        for number, handler in former.items():
            # A command that runs in the background of a script ignores Ctrl-C.
            if handler is not signal.SIG_IGN:
                signal.signal(number, _answer)
        yield
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)


def _answer(number: int, frame: FrameType | None) -> None:
    """Raise the exception of a signal; while a kernel is being compiled, wait and send the signal again.

    The compiler calls functions of Python, and an exception in them is dropped.
    """
    if any(one.f_globals.get("__name__") == COMPILER for one in _outwards(frame)):
        threading.Timer(REPEAT_S, os.kill, (os.getpid(), number)).start()
    else:
        raise Terminated if number == signal.SIGTERM else KeyboardInterrupt


def _outwards(frame: FrameType | None) -> Iterator[FrameType]:
    """A frame, and those that called it."""
    while frame is not None:
        yield frame
        frame = frame.f_back


@contextmanager
def leaving(*outs: Path, go_on: str = AGAIN) -> Iterator[None]:
    """Work that writes these folders or files; if it is interrupted, say what it has written.

    Raises
    ------
    Interrupted
    """
    began = time.time()
    try:
        yield
    except (KeyboardInterrupt, Terminated) as interruption:
        written = [f for out in outs for f in _files(out) if f.stat().st_mtime >= began]
        raise Interrupted(f"{_left(outs, written)}; {go_on}", exit_code(interruption)) from None


def exit_code(interruption: BaseException) -> int:
    """Exit code of an interrupted command."""
    return 128 + (signal.SIGTERM if isinstance(interruption, Terminated) else signal.SIGINT)


def _files(out: Path) -> list[Path]:
    return sorted(f for f in out.rglob("*") if f.is_file()) if out.is_dir() else [out] if out.is_file() else []


def _left(outs: tuple[Path, ...], written: list[Path]) -> str:
    if not written:
        return f"nothing was written to {' and '.join(map(str, outs))}"
    more = f" and {len(written) - _MOST_NAMED} more" if len(written) > _MOST_NAMED else ""
    names = ", ".join(map(str, written[:_MOST_NAMED]))
    return f"written so far: {names}{more}"
