"""A contradiction: what recordings and batch file cannot all be right about."""

from dataclasses import dataclass

# A relation far beyond its limit, one near it, and one that leaves more than one cause: a warning.
SURE, LIKELY, DOUBTFUL = 0.98, 0.9, 0.7


@dataclass(frozen=True)
class Contradiction:
    """What cannot be, for the person who recorded it.

    Attributes
    ----------
    what : str
        Channel, recording or key of the batch file that is wrong.
    text : str
        What is wrong, by which values, and what to do.
    recording : str or None
        The recording, None if it concerns the batch.
    confidence : float
        Probability that `what` is wrong.
    """

    what: str
    text: str
    recording: str | None = None
    confidence: float = SURE
