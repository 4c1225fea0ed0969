"""What is found wrong with outside data, and from where on it is no longer used."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Finding:
    """One thing found wrong, for a person to look up.

    Attributes
    ----------
    batch : str
        The batch.
    file : str
        The file in which it was found.
    row : int or None
        Line of that file as an editor counts it, the header being row 1; None if it concerns no row in particular.
    column : str or None
        The column, None if it concerns no column in particular.
    severity : str
        "warning" if the data are used all the same, "refused" if they are not.
    text : str
        What was found, and what became of it.
    """

    batch: str
    file: str
    row: int | None
    column: str | None
    severity: Literal["warning", "refused"]
    text: str

    def __str__(self) -> str:
        place = [self.file, f"row {self.row}" if self.row is not None else None, self.column]
        return f"{', '.join(p for p in place if p)}: {self.text}"


@dataclass(frozen=True)
class Limits:
    """How much may be wrong with a log that is still used; beyond, the log is refused.

    Attributes
    ----------
    fewest_samples : int
        Fewer are no recording: a log that was closed as soon as it was opened.
    bad_cells_in_a_row, bad_cells_fraction : int, float
        Rows with empty cells that may be dropped: a lost sample now and then says nothing of the rest, a run of them
        or many may hide a reversal.
    gap_steps : float
        A step of time this many times the usual one is a gap, not jitter.
    uneven_fraction : float
        If less than this share of the time in gaps is missing in the end, late samples were caught up with: the log is
        sampled unevenly rather than lacking samples.
    gap_s, gap_fraction : float
        Longest single gap and largest share of the duration lost in gaps. Within a tenth of a second the drive, which
        moves at a few Hz at most, can be bridged; a longer gap may hide a reversal, and with it a branch of the loop.
    fastest_rad_per_s : float
        Faster than any pulley of such a rig turns (3 rad/s asked for, 14 rad/s seen in a jaw that snaps): the counter
        was reset, wrapped or missed counts, and from there on its angle means something else.
    lost_counts : int
        Fewer counts than this are noise of a counter, however fast: at high sampling rates one count is soon fast.
    other_end_counts, other_end_fraction : int, float
        Counts, and share of its whole travel, that the load must move by while the drive's encoder stands still before
        that encoder is called stuck: by less it may creep.
    whole_travel_fraction : float
        Share of its whole travel that the drive must run through before a load encoder that stands still is doubted:
        up to there it may be lost motion.
    flat_samples : int
        As many equal samples in a row at a noisy channel's extreme value are no coincidence: it is clipped.
    flat_noise_fraction : float
        A channel counts as noisy if less than this share of its samples repeat the one before.
    frozen_s, frozen_samples : float, int
        A noisy channel that stays the same for longer, and for more samples, while the drive moves, froze.
    frozen_noise_fraction : float
        A channel counts as noisy for that up to this share of repeats: a coarse converter repeats a value now and then
        (a fifth of the time in the public recordings), yet not a score of times in a row.
    still_counts : int
        Counts that an encoder at rest may dither by.
    shortest_rest_s : float
        Less is no rest but the time to the first count.
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
