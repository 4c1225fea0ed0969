"""What the loops of a cycle measure: backlash, slopes, slack, lost work; of a recording and of a model alike.

The drive's two turns cut a cycle into two branches. On a branch the load first stays (the flat part of the loop), then
follows; where a cable has gone slack, only the other one carries the torque, and the loop is less steep.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from ccmodel.compare.errors import last_cycle
from ccmodel.config import Measuring
from ccmodel.recording import TENSIONS, Recording

TORQUE_LOOP = ("tau_in_Nm", "tau_out_Nm")
MOTION_LOOP = ("theta_in_rad", "theta_out_rad")
CABLES = (("T1_N", "T2_N"), ("T3_N", "T4_N"))


class NotMeasurableError(Exception):
    """A quantity cannot be had from a recording; the text says why."""


@dataclass(frozen=True)
class Cycle:
    """The last cycle of a recording, smoothed, and its two branches.

    Attributes
    ----------
    channels : dict of str to ndarray, shape (n,)
    slack : ndarray of bool, shape (2, n), or None
        Whether cable A and B hang slack: tension at both ends below the threshold, at most of the samples around, not
        in their mean, which would end every slack early. None where a tension was not recorded.
    branches : tuple of ndarray of int
        Samples of each branch in the order of time, from one turn of the drive to the next; the one that the cycle's
        beginning cuts in two is put together again.
    how : Measuring
    """

    channels: dict[str, NDArray]
    slack: NDArray | None
    branches: tuple[NDArray, NDArray]
    how: Measuring

    @classmethod
    def of(cls, recording: Recording, how: Measuring) -> "Cycle":
        """Cut the last cycle out of a recording.

        Raises
        ------
        NotMeasurableError
            If the drive makes no whole cycle, or too few samples of it were taken.
        """
        window = last_cycle(recording)
        theta = recording["theta_in_rad"][window]
        n = theta.size
        if n < 4 * how.fewest_samples:
            raise NotMeasurableError(f"{n} samples in the last cycle, fewer than {4 * how.fewest_samples}")
        span = float(np.ptp(theta))
        if not abs(theta[-1] - theta[0]) < how.closed_share * span:
            raise NotMeasurableError("the drive makes no whole cycle")
        size = max(1, round(how.smoothing_share * n))
        channels = {c: uniform_filter1d(v, size)[window] for c, v in recording.channels.items()}
        theta = channels["theta_in_rad"]
        up, down = int(theta.argmax()), int(theta.argmin())
        if not up < down:
            raise NotMeasurableError("the drive does not go up and down once in its cycle")
        slack = _slack(recording, how, size)
        slack = None if slack is None else slack[:, window]
        return cls(channels, slack, (np.arange(up, down + 1), np.r_[down:n, 0 : up + 1]), how)

    def __getitem__(self, channel: str) -> NDArray:
        if channel not in self.channels:
            raise NotMeasurableError(f"{channel} was not recorded")
        return self.channels[channel]

    @property
    def slack_cables(self) -> NDArray:
        """`slack`, where it is known."""
        if self.slack is None:
            raise NotMeasurableError("a tension was not recorded")
        return self.slack


def _slack(recording: Recording, how: Measuring, size: int) -> NDArray | None:
    if not all(c in recording for c in TENSIONS):
        return None
    below = [np.maximum(recording[near], recording[far]) < how.slack_below_N for near, far in CABLES]
    return uniform_filter1d(np.array(below, dtype=float), size, axis=1) > 0.5


def peak_to_peak(cycle: Cycle, channel: str) -> float:
    """Highest less lowest value of a channel."""
    return float(np.ptp(cycle[channel]))


def width(cycle: Cycle, loop: tuple[str, str] = TORQUE_LOOP) -> float:
    """Distance along x between the two branches where y stands in the middle of its range."""
    (first, _), (second, _) = _middle_lines(cycle, loop)
    return abs(first - second)


def slope(cycle: Cycle, loop: tuple[str, str] = TORQUE_LOOP) -> float:
    """Gradient dy / dx in the middle of y's range, mean of the two branches."""
    return float(np.mean([1 / gradient for _, gradient in _middle_lines(cycle, loop)]))


def deadband(cycle: Cycle, loop: tuple[str, str] = TORQUE_LOOP) -> float:
    """Change of x after a turn of the drive until y follows, mean of the two branches.

    Where y begins to follow is where the line through its next part meets its value at the turn: encoder counts and
    noise hide the first small motion.
    """
    x, y = cycle[loop[0]], cycle[loop[1]]
    span, low = float(np.ptp(y)), cycle.how.moved_share
    found = []
    for branch in cycle.branches:
        moved = np.abs(y[branch] - y[branch[0]]) / span if span > 0 else np.zeros(branch.size)
        until = int(np.argmax(moved > 3 * low)) if (moved > 3 * low).any() else branch.size
        following = branch[:until][moved[:until] >= low]
        corner, _ = _line(y[following], x[following], y[branch[0]], cycle.how)
        found.append(abs(corner - x[branch[0]]))
    return float(np.mean(found))


def slack_share(cycle: Cycle) -> float:
    """Share of the cycle's samples at which a cable hangs slack."""
    return float(cycle.slack_cables.any(axis=0).mean())


def slack_through_turn_share(cycle: Cycle) -> float:
    """Share of the cycle at which a cable still hangs slack from before the turn, while the load follows: phase IVb."""
    y, slack = cycle["tau_out_Nm"], cycle.slack_cables
    span, count = float(np.ptp(y)), 0
    for branch in cycle.branches:
        still = np.logical_and.accumulate(slack[:, branch], axis=1).any(axis=0)
        count += int((still & (np.abs(y[branch] - y[branch[0]]) > cycle.how.moved_share * span)).sum())
    return count / y.size


def slack_before_turn_share(cycle: Cycle) -> float:
    """Share of the cycle at which a cable hangs slack while the drive goes on to its turn: phase IVa."""
    return sum(_slack_to_the_turn(cycle, branch).size for branch in cycle.branches) / cycle["tau_out_Nm"].size


def slack_slope(cycle: Cycle) -> float:
    """Gradient of tau_out over tau_in while one cable is slack and the drive goes on, mean of the two branches."""
    tau_in, tau_out = (cycle[c] for c in TORQUE_LOOP)
    found = []
    for branch in cycle.branches:
        part = _slack_to_the_turn(cycle, branch)
        # Smoothing rounds the turn off, and a cable is called slack a little before it is: the outer half counts.
        part = part[: -max(1, round(cycle.how.smoothing_share * tau_in.size))]
        way = np.abs(tau_in[part] - tau_in[part[0]]) if part.size else np.zeros(1)
        if not way.max() > cycle.how.moved_share * np.ptp(tau_in):
            raise NotMeasurableError("no cable hangs slack before a turn for long enough to have a slope")
        part = part[way > way.max() / 2]
        middle = float(tau_in[part].mean())
        found.append(_line(tau_in[part], tau_out[part], middle, cycle.how)[1])
    return float(np.mean(found))


def work_lost(cycle: Cycle) -> float:
    """Work that the drive puts in over a cycle and does not get back, J."""
    tau, theta = (np.append(cycle[c], cycle[c][0]) for c in ("tau_in_Nm", "theta_in_rad"))
    return float(abs(np.trapezoid(tau, theta)))


@dataclass(frozen=True)
class Quantity:
    """Something that can be told of a cycle.

    Attributes
    ----------
    text : str
        What it is called.
    unit : str
    factor : float
        From SI units to `unit`.
    of_cycle : callable
    channels : tuple of str
        What it is made from, for its uncertainty.
    """

    text: str
    unit: str
    factor: float
    of_cycle: Callable[[Cycle], float]
    channels: tuple[str, ...]

    @property
    def is_share(self) -> bool:
        """Whether it may be zero: its scatter is not relative to it."""
        return self.unit == "%"


def _peak(channel: str, symbol: str, unit: str, factor: float = 1.0) -> Quantity:
    return Quantity(f"peak to peak of {symbol}", unit, factor, partial(peak_to_peak, channel=channel), (channel,))


QUANTITIES = {
    "theta_out": _peak("theta_out_rad", "θ_out", "rad"),
    "tau_in": _peak("tau_in_Nm", "τ_in", "mN·m", 1e3),
    "tau_out": _peak("tau_out_Nm", "τ_out", "mN·m", 1e3),
    "F_drive": _peak("F_drive_N", "F_drive", "N"),
    "F_load": _peak("F_load_N", "F_load", "N"),
    **{t[:2]: _peak(t, t[:2], "N") for t in TENSIONS},
    "width": Quantity("width of the torque loop", "mN·m", 1e3, width, TORQUE_LOOP),
    "backlash": Quantity("backlash of the torque loop (its flat part)", "mN·m", 1e3, deadband, TORQUE_LOOP),
    "lost_motion": Quantity("lost motion", "rad", 1.0, partial(deadband, loop=MOTION_LOOP), MOTION_LOOP),
    "slope": Quantity("slope of the torque loop, both cables taut", "1", 1.0, slope, TORQUE_LOOP),
    "slack_slope": Quantity("slope of the torque loop, one cable slack", "1", 1.0, slack_slope, TORQUE_LOOP),
    "slack_share": Quantity("share of the cycle with a slack cable", "%", 100.0, slack_share, TENSIONS),
    "IVa_share": Quantity(
        "share of the cycle in phase IVa (slack, drive going on)", "%", 100.0, slack_before_turn_share, TENSIONS
    ),
    "IVb_share": Quantity(
        "share of the cycle in phase IVb (slack through a turn)", "%", 100.0, slack_through_turn_share, TENSIONS
    ),
    "work_lost": Quantity("work lost in a cycle", "mJ", 1e3, work_lost, ("tau_in_Nm", "theta_in_rad")),
}


def measure(recording: Recording, names: Sequence[str], how: Measuring) -> tuple[dict[str, float], dict[str, str]]:
    """Quantities of a recording's last cycle, in their units, and why the others could not be had.

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
        One of the two holds each name.
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


def _middle_lines(cycle: Cycle, loop: tuple[str, str]) -> list[tuple[float, float]]:
    """Of each branch, x in the middle of y's range and dx / dy there."""
    x, y = cycle[loop[0]], cycle[loop[1]]
    middle, span = float(y.max() + y.min()) / 2, float(np.ptp(y))
    near = [b[np.abs(y[b] - middle) <= cycle.how.middle_share * span] for b in cycle.branches]
    return [_line(y[part], x[part], middle, cycle.how) for part in near]


def _line(u: NDArray, v: NDArray, at: float, how: Measuring) -> tuple[float, float]:
    """Value at `at` and gradient of the line through v over u."""
    if u.size < how.fewest_samples or not np.ptp(u) > 0:
        raise NotMeasurableError(f"{u.size} samples for a line that takes {how.fewest_samples} different ones")
    gradient, value = np.polyfit(u - at, v, 1)
    return float(value), float(gradient)


def _slack_to_the_turn(cycle: Cycle, branch: NDArray) -> NDArray:
    """The last samples of a branch at all of which the same cable hangs slack, while the load follows."""
    y = cycle["tau_out_Nm"]
    to_the_turn = np.logical_and.accumulate(cycle.slack_cables[:, branch[::-1]], axis=1)[:, ::-1].any(axis=0)
    follows = np.abs(y[branch] - y[branch[0]]) > cycle.how.moved_share * float(np.ptp(y))
    return branch[to_the_turn & follows]
