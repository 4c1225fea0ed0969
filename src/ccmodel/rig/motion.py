"""The drive's true motion behind the staircase of its encoder, for use as the model's input."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

# Motions much slower than this are followed, wiggles much faster are taken for the staircase's. Longer makes sines
# better still and rounds off the corners of triangles; 7 ms was the best compromise of 5, 7 and 10.
SMOOTHING_S = 0.007
# Between 5 and 100 the error changes by a fiftieth of a count at most on sines and slow motions.
ROUNDS = 20
# Difference of third order: what is penalised is jerk, so that a constant acceleration is left as it is.
JERK = np.array([-1.0, 3.0, -3.0, 1.0])


def drive_motion(time_s: NDArray, theta_counts_rad: NDArray, step_rad: float, rest_s: float) -> NDArray:
    """Estimate the drive angle that an encoder's counts only bound.

    The smoothest curve (least jerk) that stays within half a count of the counts, softly: penalised least squares
    towards the nearest angle that the counts allow, a few rounds of it. At rest the angle rests.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Sample times, s, increasing; small gaps are bridged.
    theta_counts_rad : ndarray, shape (n,)
        Drive angle as counted, rad, zero at rest.
    step_rad : float
        Angle of one count, rad.
    rest_s : float
        Time up to which the drive rests, s; 0 where there is no rest.

    Returns
    -------
    ndarray, shape (n,)
        Drive angle, rad.

    Raises
    ------
    ValueError
        If the arrays differ in shape, have fewer than 4 samples or the step is not positive.

    Notes
    -----
    Rms error in counts, over the whole motion / near reversals, on motions that start from rest: a sine (0.6 rad,
    0.5 Hz), a triangle (0.45 rad, 0.4 Hz, corners rounded over 80 ms), steps with holds, a slow sine (0.5 rad, 0.1 Hz).
    First counts of 0.18 deg at 250 Hz, then 8192 counts a revolution at 1 kHz:

    ====================================  ===========  ===========  ===========  ===========
    0.18 deg, 250 Hz                      sine         triangle     steps        slow
    ====================================  ===========  ===========  ===========  ===========
    the counts as they stand              0.29 / 0.29  0.29 / 0.28  0.29 / 0.29  0.29 / 0.29
    pchip through the changes of count    0.21 / 0.33  0.26 / 0.49  0.29 / 0.30  0.15 / 0.23
    Savitzky-Golay, cubic, 60 ms          0.14 / 0.13  0.14 / 0.10  0.27 / 0.29  0.16 / 0.26
    smoothing spline, lambda 1e-6         0.13 / 0.12  0.13 / 0.12  0.27 / 0.29  0.15 / 0.25
    this                                  0.12 / 0.09  0.09 / 0.18  0.27 / 0.29  0.14 / 0.24
    ====================================  ===========  ===========  ===========  ===========

    ====================================  ===========  ===========  ===========  ===========
    8192 counts/rev, 1 kHz                sine         triangle     steps        slow
    ====================================  ===========  ===========  ===========  ===========
    the counts as they stand              0.29 / 0.29  0.29 / 0.29  0.30 / 0.30  0.29 / 0.29
    pchip through the changes of count    0.20 / 0.25  0.26 / 0.45  0.30 / 0.31  0.14 / 0.19
    Savitzky-Golay, cubic, 60 ms          0.10 / 0.06  0.09 / 0.32  0.29 / 0.30  0.12 / 0.17
    smoothing spline, lambda 1e-6         0.10 / 0.07  0.08 / 0.14  0.27 / 0.29  0.12 / 0.18
    this                                  0.09 / 0.04  0.10 / 0.40  0.31 / 0.34  0.11 / 0.14
    ====================================  ===========  ===========  ===========  ===========

    The spline's lambda fits one sampling rate, and it takes six times as long. Where the drive holds, nothing tells
    where within a count it stands: what is left of the steps' error is that.
    """
    time = np.asarray(time_s, dtype=float)
    counted = np.asarray(theta_counts_rad, dtype=float)
    if time.shape != counted.shape or time.ndim != 1 or time.size < JERK.size:
        raise ValueError(f"time and angle must be alike and have {JERK.size} samples or more; got {counted.shape}")
    if not step_rad > 0:
        raise ValueError(f"the angle of one count must be positive; got {step_rad}")
    # Differences are those of even steps.
    step_s = np.median(np.diff(time))
    grid = np.linspace(time[0], time[-1], max(JERK.size, round((time[-1] - time[0]) / step_s) + 1))
    centre = np.interp(grid, time, counted)
    room = np.where((grid <= rest_s) & (rest_s > 0), 0.0, step_rad / 2)
    factor = cholesky_banded(_normal_matrix(grid.size, (SMOOTHING_S / step_s) ** 6))
    angle = centre
    for _ in range(ROUNDS):
        angle = cho_solve_banded((factor, False), np.clip(angle, centre - room, centre + room))
    return np.interp(time, grid, angle)


def _normal_matrix(n: int, weight: float) -> NDArray:
    """Identity + weight * D^T D, D the third difference of n samples, in the upper banded form of scipy."""
    order = JERK.size - 1
    banded = np.zeros((order + 1, n))
    for above in range(order + 1):
        for i in range(order + 1 - above):
            first = i + above
            banded[order - above, first : first + n - order] += weight * JERK[i] * JERK[first]
    banded[order] += 1.0
    return banded
