"""Progress of long work: what is being done, the share that is behind, and the time that is left."""

import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol, TextIO, TypeVar

if TYPE_CHECKING:
    from rich.console import Console

T = TypeVar("T")
# Shown until the first stage begins.
START = "starting; the first run of an installation compiles the solvers, which takes a minute or two"


class Progress(Protocol):
    """Takes each stage of a work as it begins."""

    def __call__(self, text: str, done: float | None = None) -> None:
        """A stage begins.

        Parameters
        ----------
        text : str
            The stage, in a line.
        done : float, optional
            Estimated share, from 0 to 1, of the work before the stage; None if it is not known.
        """


def silent(text: str, done: float | None = None) -> None:
    """Report no progress."""


def within(progress: Progress, low: float, high: float) -> Progress:
    """Progress of a part of a work, which takes the shares from `low` to `high` of the whole."""

    def part(text: str, done: float | None = None) -> None:
        progress(text, None if done is None else low + (high - low) * done)

    return part


def each_of(items: Iterable[T], progress: Progress, text: Callable[[T], str]) -> Iterator[T]:
    """The items, each with its line of progress; items of about equal work.

    Parameters
    ----------
    items : sequence
    progress : Progress
    text : callable
        Line on an item.
    """
    count = len(items) if isinstance(items, Sized) else None
    for i, item in enumerate(items):
        progress(text(item), i / count if count else None)
        yield item


@dataclass
class Stopwatch:
    """Elapsed and remaining time of a work whose share is known now and then.

    The remaining time takes the rest of the work to be as fast as the work so far, and counts down between two stages.

    Attributes
    ----------
    now : callable
        Time, s.
    done : float
        Largest share that was reported.
    """

    now: Callable[[], float] = time.monotonic
    done: float = 0.0
    began_s: float = field(init=False)
    at_stage_s: float = field(init=False)

    def __post_init__(self) -> None:
        self.began_s = self.at_stage_s = self.now()

    def stage(self, done: float | None) -> None:
        """A stage begins; the share never falls and never exceeds 1."""
        if done is not None and done > self.done:
            self.done, self.at_stage_s = min(done, 1.0), self.now()

    @property
    def elapsed_s(self) -> float:
        """Time since the start, s."""
        return self.now() - self.began_s

    @property
    def remaining_s(self) -> float | None:
        """Estimated time to the end, s; None before the first share, and where a stage has outlasted the estimate."""
        if not self.done:
            return None
        at_stage = (self.at_stage_s - self.began_s) * (1 / self.done - 1)
        left = at_stage - (self.now() - self.at_stage_s)
        return left if left > 0 or self.done == 1.0 else None


def clock(seconds: float | None) -> str:
    """A duration as ``1:05`` or ``1:01:05``; ``-:--`` for None."""
    if seconds is None:
        return "-:--"
    minutes, rest = divmod(round(max(seconds, 0.0)), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


@contextmanager
def shown(console: "Console | None" = None) -> Iterator[Progress]:
    """A bar with elapsed and remaining time on a terminal, by default on standard error; nothing in a pipe."""
    if console is None and not sys.stderr.isatty():
        yield silent
        return
    from rich.console import Console
    from rich.progress import BarColumn, ProgressColumn, Task, TextColumn
    from rich.progress import Progress as Bar
    from rich.table import Column
    from rich.text import Text

    console = console or Console(stderr=True)
    if not console.is_terminal:
        yield silent
        return
    watch = Stopwatch()

    class Times(ProgressColumn):
        """Elapsed and remaining time; they move on between the stages."""

        max_refresh = 0.5

        def render(self, task: Task) -> Text:
            return Text(f"{clock(watch.elapsed_s)}, {clock(watch.remaining_s)} left", style="cyan")

    description = Column(ratio=1, no_wrap=True, overflow="ellipsis")
    columns = (
        TextColumn("{task.description}", table_column=description, markup=False),
        BarColumn(20),
        TextColumn("{task.percentage:>3.0f} %"),
        Times(),
    )
    with Bar(*columns, console=console, transient=True, expand=True) as bar:
        task = bar.add_task(START, total=1.0)

        def stage(text: str, done: float | None = None) -> None:
            watch.stage(done)
            bar.update(task, description=text, completed=watch.done)

        yield stage


def log_lines(stream: TextIO, now: Callable[[], float] = time.monotonic) -> Progress:
    """Progress as lines with elapsed and estimated remaining time, as in ``0:12, 0:30 left: screening``."""
    watch = Stopwatch(now)

    def stage(text: str, done: float | None = None) -> None:
        watch.stage(done)
        print(f"{clock(watch.elapsed_s)}, {clock(watch.remaining_s)} left: {text}", file=stream, flush=True)

    return stage
