"""Times at which recordings started, against what they last: one rig makes one recording at a time."""

from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import pairwise

from ccmodel.rig.consistency import limits
from ccmodel.rig.consistency.contradiction import Contradiction
from ccmodel.rig.consistency.parity import Parity


def overlapping(parities: Sequence[Parity]) -> list[Contradiction]:
    """Recordings that started before an earlier one had ended: one line for the batch."""
    timed = sorted(
        ((start, p.recording) for p in parities if (start := p.recording.started_at_s) is not None),
        key=lambda pair: pair[0],
    )
    if not timed:
        return []
    found = []
    for (start, earlier), (later_start, later) in pairwise(timed):
        early_s = start + float(earlier.time_s[-1]) - later_start
        if early_s > _noted_to_s(start, later_start):
            found.append(
                f"{later.id} started at {_clock(later_start)}, {early_s:.3g} s before the end of {earlier.id}, which"
                f" started at {_clock(start)} and lasts {earlier.time_s[-1]:.3g} s"
            )
    if not found:
        return []
    more = f" (and {len(found) - 1} more such pairs)" if len(found) > 1 else ""
    text = f"{found[0]}{more}: one rig makes one recording at a time; correct started_at, or take it out of all entries"
    return [Contradiction("started_at", text)]


def _noted_to_s(*starts: float) -> float:
    """Unit to which times are noted, s: one that falls on a whole minute, or second, may be noted no finer."""
    *units, least = limits.NOTED_TO_S
    return next((unit for unit in units if any(start % unit == 0 for start in starts)), least)


def _clock(at_s: float) -> str:
    return datetime.fromtimestamp(at_s, UTC).isoformat(timespec="seconds")
