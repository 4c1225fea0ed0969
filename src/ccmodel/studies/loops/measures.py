"""Quantities of the loops of one cycle: backlash, slopes, slack, lost work; the same for recordings and models.

The two reversals of the drive divide a cycle into two branches. At the start of a branch the load rests (the flat part
of the loop), then it follows the drive. While one cable is slack, the other one transmits the torque alone, and the
loop is less steep. The glossary (docs/glossary.md) defines phases IVa and IVb.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from ccmodel.channels import CABLES, MEASURED, TABLE, TAU_IN, TAU_OUT, TENSIONS, THETA_IN, THETA_OUT
from ccmodel.errors import last_cycle
from ccmodel.recording import Recording
from ccmodel.studies.loops.settings import Measuring

# Channel on the x axis, channel on the y axis.
TORQUE_LOOP = (TAU_IN, TAU_OUT)
MOTION_LOOP = (THETA_IN, THETA_OUT)


class NotMeasurableError(Exception):
    """A quantity cannot be obtained from a recording; the text gives the reason."""


@dataclass(frozen=True)
class Cycle:
    """The last cycle of a recording, smoothed, and its two branches.

    Attributes
    ----------
    channels : dict of str to ndarray, shape (n,)
    slack : ndarray of bool, shape (2, n)
        Whether cable A and cable B are slack: the tension at the load end is below the threshold at more than half of
        the samples within the smoothing window. By the capstan bound the drive end then holds at most exp(mu phi) times
        the threshold. Its own reading is not used: it contains the friction of the drive, half of it over R. A smoothed
        tension is not used: it rises above the threshold before the cable is taut. Shape (0, n) if a tension was not
        recorded.
    branches : tuple of ndarray of int
        Sample numbers of each branch, from one reversal of the drive to the next. The second branch runs over the end
        of the cycle and continues at its beginning.
    how : Measuring
        Settings of the measurement.
    """

    channels: dict[str, NDArray]
    slack: NDArray
    branches: tuple[NDArray, NDArray]
    how: Measuring

    @classmethod
    def of(cls, recording: Recording, how: Measuring) -> "Cycle":
        """The last cycle of a recording.

        Raises
        ------
        NotMeasurableError
            If the drive makes no whole cycle, or the cycle has too few samples.
        """
        window = last_cycle(recording)
        theta = recording[THETA_IN][window]
        n = theta.size
        if n < 4 * how.fewest_samples:
            raise NotMeasurableError(f"{n} samples in the last cycle, fewer than {4 * how.fewest_samples}")
        if not abs(theta[-1] - theta[0]) < how.closed_share * np.ptp(theta):
            raise NotMeasurableError("the drive makes no whole cycle")
        size = max(1, round(how.smoothing_share * n))
        channels = {c: uniform_filter1d(v, size)[window] for c, v in recording.channels.items()}
        theta = channels[THETA_IN]
        up, down = int(theta.argmax()), int(theta.argmin())
        if not up < down:
            raise NotMeasurableError("the drive does not go up and down once in its cycle")
        slack = _slack(recording, how, size)[:, window]
        return cls(channels, slack, (np.arange(up, down + 1), np.r_[down:n, 0 : up + 1]), how)

    def __getitem__(self, channel: str) -> NDArray:
        if channel not in self.channels:
            raise NotMeasurableError(f"{channel} was not recorded")
        return self.channels[channel]

    @property
    def slack_cables(self) -> NDArray:
        """`slack`; raises where it is unknown."""
        if not self.slack.size:
            raise NotMeasurableError("a tension was not recorded")
        return self.slack

    def follows(self, branch: NDArray) -> NDArray:
        """Whether the load torque has left its value at the reversal, at each sample of a branch."""
        y = self[TAU_OUT]
        return np.abs(y[branch] - y[branch[0]]) > self.how.moved_share * float(np.ptp(y))


def _slack(recording: Recording, how: Measuring, size: int) -> NDArray:
    """Attribute `slack` of a cycle, over the whole recording; `size` is the number of samples in the window."""
    if not all(c in recording for c in TENSIONS):
        return np.empty((0, recording.time_s.size), dtype=bool)
    below = [recording[load] < how.slack_below_N for _, load in CABLES.values()]
    return uniform_filter1d(np.array(below, dtype=float), size, axis=1) > 0.5


def peak_to_peak(cycle: Cycle, channel: str) -> float:
    """Highest less lowest value of a channel."""
    return float(np.ptp(cycle[channel]))


def width(cycle: Cycle) -> float:
    """Distance along tau_in between the two branches in the middle of the range of tau_out."""
    (first, _), (second, _) = _middle_lines(cycle)
    return abs(first - second)


def slope(cycle: Cycle) -> float:
    """Gradient of tau_out over tau_in in the middle of the range of tau_out, mean of the two branches."""
    return float(np.mean([1 / gradient for _, gradient in _middle_lines(cycle)]))


def deadband(cycle: Cycle, loop: tuple[str, str] = TORQUE_LOOP) -> float:
    """Change of x after a reversal of the drive until y follows, mean of the two branches.

    Encoder steps and noise conceal the first small motion of y. The end of the deadband is therefore extrapolated: a
    line is fitted to the part of the branch in which y has moved by one to three times `moved_share` of its range, and
    the deadband ends where this line has the value that y had at the reversal.
    """
    x, y = cycle[loop[0]], cycle[loop[1]]
    span, low = float(np.ptp(y)), cycle.how.moved_share
    high = 3 * low
    found = []
    for branch in cycle.branches:
        moved = np.abs(y[branch] - y[branch[0]]) / span if span > 0 else np.zeros(branch.size)
        end = int(np.argmax(moved > high)) if (moved > high).any() else branch.size
        following = branch[:end][moved[:end] >= low]
        corner, _ = _line(y[following], x[following], y[branch[0]], cycle.how)
        found.append(abs(corner - x[branch[0]]))
    return float(np.mean(found))


def slack_share(cycle: Cycle) -> float:
    """Share of the cycle's samples at which a cable is slack."""
    return float(cycle.slack_cables.any(axis=0).mean())


def slack_through_reversal_share(cycle: Cycle) -> float:
    """Share of the cycle in phase IVb: the load follows while a cable is slack that was slack at the last reversal."""
    count = 0
    for branch in cycle.branches:
        since_reversal = np.logical_and.accumulate(cycle.slack_cables[:, branch], axis=1).any(axis=0)
        count += int((since_reversal & cycle.follows(branch)).sum())
    return count / cycle[TAU_OUT].size


def slack_before_reversal_share(cycle: Cycle) -> float:
    """Share of the cycle in phase IVa: the load follows while a cable is slack that stays slack until the reversal."""
    return sum(_slack_until_reversal(cycle, branch).size for branch in cycle.branches) / cycle[TAU_OUT].size


def slack_slope(cycle: Cycle) -> float:
    """Gradient of tau_out over tau_in in phase IVa (`slack_before_reversal_share`), mean of the two branches."""
    tau_in, tau_out = (cycle[c] for c in TORQUE_LOOP)
    found = []
    for branch in cycle.branches:
        part = _slack_until_reversal(cycle, branch)
        # The line is fitted to the second half of the phase, less a smoothing window at its end: a cable counts as
        # slack a little too early, and smoothing rounds off the reversal.
        part = part[: -max(1, round(cycle.how.smoothing_share * tau_in.size))]
        distance = np.abs(tau_in[part] - tau_in[part[0]]) if part.size else np.zeros(1)
        if not distance.max() > cycle.how.moved_share * np.ptp(tau_in):
            raise NotMeasurableError("no cable is slack before a reversal for long enough to have a slope")
        part = part[distance > distance.max() / 2]
        found.append(_line(tau_in[part], tau_out[part], float(tau_in[part].mean()), cycle.how)[1])
    return float(np.mean(found))


def work_lost(cycle: Cycle) -> float:
    """Work of the drive over one cycle, the area of the loop of tau_in over theta_in, J."""
    # The first sample is repeated at the end to close the loop.
    tau, theta = (np.append(cycle[c], cycle[c][0]) for c in (TAU_IN, THETA_IN))
    return float(abs(np.trapezoid(tau, theta)))


@dataclass(frozen=True)
class Quantity:
    """A quantity of a cycle, with its name, unit and computation.

    Attributes
    ----------
    text : str
        Its name in tables and figures.
    unit : str
    factor : float
        From SI units to `unit`.
    of_cycle : callable
    channels : tuple of str
        Channels from which it is computed; the study of the accuracy propagates their uncertainty.
    """

    text: str
    unit: str
    factor: float
    of_cycle: Callable[[Cycle], float]
    channels: tuple[str, ...]

    @property
    def is_share(self) -> bool:
        """Whether it is a share, which may be zero, so that its scatter is absolute and not relative."""
        return self.unit == "%"


def _peak(channel: str) -> Quantity:
    c = TABLE[channel]
    text, of_cycle = f"peak to peak of {c.symbol}", partial(peak_to_peak, channel=channel)
    return Quantity(text, c.plot_unit or c.unit, c.scale, of_cycle, (channel,))


# By the name that config.yaml and the tables use.
QUANTITIES = {
    **{TABLE[c].short_name: _peak(c) for c in (*MEASURED, *TENSIONS)},
    "width": Quantity("width of the torque loop", "mN·m", 1e3, width, TORQUE_LOOP),
    "backlash": Quantity("backlash of the torque loop (its flat part)", "mN·m", 1e3, deadband, TORQUE_LOOP),
    "lost_motion": Quantity("lost motion", "rad", 1.0, partial(deadband, loop=MOTION_LOOP), MOTION_LOOP),
    "slope": Quantity("slope of the torque loop, both cables taut", "1", 1.0, slope, TORQUE_LOOP),
    "slack_slope": Quantity("slope of the torque loop, one cable slack", "1", 1.0, slack_slope, TORQUE_LOOP),
    "slack_share": Quantity("share of the cycle with a slack cable", "%", 100.0, slack_share, TENSIONS),
    "IVa_share": Quantity(
        "share of the cycle in phase IVa (slack, drive going on)", "%", 100.0, slack_before_reversal_share, TENSIONS
    ),
    "IVb_share": Quantity(
        "share of the cycle in phase IVb (slack through a reversal)", "%", 100.0, slack_through_reversal_share, TENSIONS
    ),
    "work_lost": Quantity("work lost in a cycle", "mJ", 1e3, work_lost, (TAU_IN, THETA_IN)),
}


def measure(recording: Recording, names: Sequence[str], how: Measuring) -> tuple[dict[str, float], dict[str, str]]:
    """Quantities of a recording's last cycle, in their units, and the reason for each that is missing.

    Parameters
    ----------
    recording : Recording
    names : sequence of str
        Out of `QUANTITIES`.
    how : Measuring

    Returns
    -------
    values : dict of str to float
    gaps : dict of str to str
        Reasons. Every name is a key of `values` or of `gaps`.
    """
    try:
        cycle = Cycle.of(recording, how)
    except NotMeasurableError as gap:
        return {}, dict.fromkeys(names, str(gap))
    values, gaps = {}, {}
    for name in names:
        quantity = QUANTITIES[name]
        try:
            values[name] = quantity.factor * quantity.of_cycle(cycle)
        except NotMeasurableError as gap:
            gaps[name] = str(gap)
    return values, gaps


def _middle_lines(cycle: Cycle) -> list[tuple[float, float]]:
    """For each branch, tau_in in the middle of the range of tau_out, and d tau_in / d tau_out there."""
    x, y = (cycle[c] for c in TORQUE_LOOP)
    middle, span = float(y.max() + y.min()) / 2, float(np.ptp(y))
    near = [b[np.abs(y[b] - middle) <= cycle.how.middle_share * span] for b in cycle.branches]
    return [_line(y[part], x[part], middle, cycle.how) for part in near]


def _line(u: NDArray, v: NDArray, at: float, how: Measuring) -> tuple[float, float]:
    """Value at u = `at`, and gradient dv / du, of the straight line fitted to v over u."""
    if u.size < how.fewest_samples or not np.ptp(u) > 0:
        raise NotMeasurableError(f"{u.size} samples for a line that takes {how.fewest_samples} different ones")
    gradient, value = np.polyfit(u - at, v, 1)
    return float(value), float(gradient)


def _slack_until_reversal(cycle: Cycle, branch: NDArray) -> NDArray:
    """The last samples of a branch during which one cable is slack throughout and the load follows."""
    slack = cycle.slack_cables[:, branch[::-1]]
    until_reversal = np.logical_and.accumulate(slack, axis=1)[:, ::-1].any(axis=0)
    return branch[until_reversal & cycle.follows(branch)]
