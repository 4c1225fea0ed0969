"""Limits of the faults of a log: below them it is used with a warning, above them it is refused."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """Limits of the faults of a log.

    Attributes
    ----------
    fewest_samples : int
        Samples of a recording. A log that was closed as soon as it was opened has fewer.
    bad_cells_in_a_row, bad_cells_fraction : int, float
        Rows with empty cells that may be dropped. A lost sample now and then has no effect on the others; a run of them
        or a large share may hide a reversal.
    gap_steps : float
        A step of time is a gap, not jitter, from this many median steps on.
    uneven_fraction : float
        If less than this share of the time in gaps is lost in the end, later samples made up for it: the log is sampled
        unevenly and lacks no samples.
    gap_s, gap_fraction : float
        Longest single gap and largest share of the duration in gaps. The drive moves at a few Hz at most, so 0.1 s can
        be interpolated; a longer gap may hide a reversal, and with it a branch of the loop.
    fastest_rad_per_s : float
        Highest speed of a pulley. Commanded speeds reach 3 rad/s, a snapping jaw reached 14 rad/s. A faster change is a
        counter that was reset, wrapped or lost counts, and the angle after it has another zero.
    lost_counts : int
        Smaller changes are noise of a counter at any speed: at high sampling rates one count is a high speed.
    other_end_counts, other_end_fraction : int, float
        Travel of the load, in counts and as a share of its range, during which the drive encoder may stand still. The
        load may creep less; if it moves more, the drive encoder is stuck.
    whole_travel_fraction : float
        Travel of the drive, as a share of its range, during which the load encoder may stand still: up to there it may
        be lost motion.
    flat_samples : int
        Equal samples in a row at the extreme value of a noisy channel: it is clipped.
    flat_noise_fraction : float
        Repeated samples, as a share, below which a channel counts as noisy for that.
    frozen_s, frozen_samples : float, int
        Duration and samples for which a noisy channel may keep one value while the drive moves; longer, it froze.
    frozen_noise_fraction : float
        Repeated samples, as a share, below which a channel counts as noisy for that: a coarse converter repeats a value
        now and then (a fifth of the samples of the public recordings), but not 20 times in a row.
    still_counts : int
        Counts by which an encoder at rest may dither.
    shortest_rest_s : float
        Duration of an initial rest. Less is the time to the first count of a motion.
    """

    fewest_samples: int = 10
    bad_cells_in_a_row: int = 3
    bad_cells_fraction: float = 0.01
    gap_steps: float = 1.5
    uneven_fraction: float = 0.5
    gap_s: float = 0.1
    gap_fraction: float = 0.1
    fastest_rad_per_s: float = 30.0
    lost_counts: int = 10
    other_end_counts: int = 10
    other_end_fraction: float = 0.25
    whole_travel_fraction: float = 0.95
    flat_samples: int = 5
    flat_noise_fraction: float = 0.1
    frozen_s: float = 0.5
    frozen_samples: int = 20
    frozen_noise_fraction: float = 0.5
    still_counts: int = 1
    shortest_rest_s: float = 0.1


LIMITS = Limits()
