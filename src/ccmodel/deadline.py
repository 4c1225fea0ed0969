"""A limit on the time of long work."""

import time
from dataclasses import dataclass
from math import inf

from ccmodel.failure import ModelError


class OutOfTimeError(ModelError):
    """The time of a work is over."""


@dataclass(frozen=True)
class Deadline:
    """A moment of the monotonic clock, s."""

    at_s: float = inf

    @classmethod
    def after(cls, seconds: float) -> "Deadline":
        """So many seconds from now."""
        return cls(time.monotonic() + seconds)

    @property
    def has_passed(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() > self.at_s

    def check(self) -> None:
        """Raise `OutOfTimeError` if the time is over."""
        if self.has_passed:
            raise OutOfTimeError("the time limit is over")


UNLIMITED = Deadline()
