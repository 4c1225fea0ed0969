"""A limit on long work: on the runs of the model, and on the time."""

import time
from dataclasses import dataclass
from math import inf

from ccmodel.effort import model_runs
from ccmodel.failure import ModelError


class OutOfTimeError(ModelError):
    """The limit of a work is reached."""


@dataclass(frozen=True)
class Deadline:
    """When a work ends.

    A limit on runs ends it at the same point on every machine, as long as it is asked between model runs.

    Attributes
    ----------
    at_s : float
        A moment of the monotonic clock, s.
    at_runs : float
        Runs of the model that this process has then made (`ccmodel.effort`).
    """

    at_s: float = inf
    at_runs: float = inf

    @classmethod
    def after(cls, seconds: float, runs: float = inf) -> "Deadline":
        """So many seconds, or so many runs of the model, from now."""
        return cls(time.monotonic() + seconds, model_runs() + runs)

    @property
    def has_passed(self) -> bool:
        """Whether the work is over."""
        return model_runs() > self.at_runs or self.is_late

    @property
    def is_late(self) -> bool:
        """Whether it is over by the clock."""
        return time.monotonic() > self.at_s

    def check(self) -> None:
        """Raise `OutOfTimeError` if the work is over."""
        if self.has_passed:
            raise OutOfTimeError("the limit of time or of model runs is reached")


UNLIMITED = Deadline()
