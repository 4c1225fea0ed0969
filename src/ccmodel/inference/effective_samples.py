"""How many independent samples a channel of a recording counts as.

A recording has thousands of samples, whose errors are correlated over long times: beyond the sensors' noise a model is
wrong alike from sample to sample. Each channel of a recording therefore counts as a fixed number of independent
samples. Neither number below is derived from the errors' autocorrelation; both were chosen.
"""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

# Of a channel in a fit of parameters.
IN_FITS = 100
# Of a channel elsewhere in a diagnosis: weights of nuisances, degrees of freedom of cycles, design of experiments.
IN_DIAGNOSIS = 20
# Of a channel in the evidence of a candidate beside a model discrepancy, which accounts for most of what is correlated.
IN_EVIDENCE = 50


class Measured(Protocol):
    """A recording with its measured values, shape (channels, samples)."""

    @property
    def measured(self) -> NDArray:
        """Values of the channels that are compared."""


def fit_weight(observations: Measured) -> float:
    """Weight of each squared error of a recording in a fit, so that a channel counts as `IN_FITS` samples at most."""
    return min(1.0, IN_FITS / observations.measured.shape[1])


def mean_weight(observations: Measured) -> float:
    """Weight of each squared error of a recording where every recording counts by its mean square."""
    return 1.0 / observations.measured.size


def of_recording(recording: Any) -> int:
    """Independent samples that a recording gives in a diagnosis."""
    return IN_DIAGNOSIS * len(recording.channels)


def prior_spread(spread: float, recordings: Sequence) -> float:
    """Standard deviation of a prior in a cost where every recording counts by its mean square.

    An error of one stated standard deviation has the weight of one independent sample.
    """
    return spread * float(np.sqrt(np.mean([of_recording(r) for r in recordings])))
