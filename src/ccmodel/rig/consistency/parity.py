"""Parity relations: what two sensors, or a sensor and the batch file, say independently of each other.

The relations are those of the transmission, with every mechanism of the project allowed for: cables pull, friction
dissipates, a spring returns its energy, and a cable that slips along its whole conduit has the capstan's ratio of
tensions, ln(T1 / T2) = mu phi.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from ccmodel.channels import (
    CHANNELS,
    F_DRIVE,
    F_LOAD,
    SUM_AT,
    T1,
    T2,
    T3,
    T4,
    TAU_IN,
    TAU_OUT,
    TENSIONS_AT,
    THETA_IN,
    THETA_OUT,
    TORQUE_AT,
)
from ccmodel.recording import Recording
from ccmodel.rig.angle import passes_of_zero
from ccmodel.rig.batch import WAVES, Batch
from ccmodel.rig.consistency import limits

# Channel of each sum of tensions, by the name of its relation.
SUMS = {"F_drive": F_DRIVE, "F_load": F_LOAD}


@dataclass(frozen=True)
class Parity:
    """Relations of one recording.

    Attributes
    ----------
    recording : Recording
    batch : Batch
        The stated values.
    """

    recording: Recording
    batch: Batch

    @cached_property
    def moving(self) -> Mapping[str, NDArray]:
        """Channels after the initial rest and the start-up transient."""
        r = self.recording
        kept = slice(int(np.searchsorted(r.time_s, max(r.settled_s, r.rest_s))), None)
        return {name: values[kept] for name, values in r.channels.items()} | {"time_s": r.time_s[kept]}

    @cached_property
    def cycles(self) -> slice | None:
        """Samples of `moving` over which a zero does no work (`closed_part`); None without a whole cycle."""
        return closed_part(self.moving[THETA_IN])

    def without_cell_error(self, end: str, offset_N: float, drift_N_per_s: float) -> "Parity":
        """The same with an offset and a drift of the load cell at the "drive" or "load" end taken out."""
        r = self.recording
        error = offset_N + drift_N_per_s * r.time_s
        corrected = {SUM_AT[end]: r[SUM_AT[end]] - error}
        corrected |= {name: r[name] - error / 2 for name in TENSIONS_AT[end] if name in r}
        return replace(self, recording=replace(r, channels=dict(r.channels) | corrected))

    def sources(self, channel: str) -> tuple[str, ...]:
        """Other channels that a channel follows from; none if it is a sensor's own."""
        formula = self.recording.derived_from.get(channel, "")
        return tuple(other for other in CHANNELS if other != channel and other in formula)

    @cached_property
    def signs(self) -> dict[str, float]:
        """Correlations and shares of work by relation, in -1 to 1, each positive if the signs are right.

        - ``angles``: correlation of drive and load angle
        - ``torques``: correlation of drive and load torque
        - ``work``: net work of the drive, over the work exchanged
        - ``load``: correlation of load torque and angle for a spring, otherwise net work on the load; none of a far end
          that something else moves
        - ``loss``: energy lost between the ends, over the work exchanged at the end that exchanges more
        - ``F_drive``, ``F_load``: sign of the sum of tensions
        """
        found = {}
        x = self.moving
        spring = self.batch.rig.load.spring_stiffness_Nm_per_rad
        if THETA_OUT in x:
            found["angles"] = correlation(x[THETA_IN], x[THETA_OUT])
        if TAU_IN in x and TAU_OUT in x:
            found["torques"] = correlation(x[TAU_IN], x[TAU_OUT])
        drive, load = work(x, (TAU_IN, THETA_IN), self.cycles), self.work_at_load
        if drive:
            found["work"] = drive[0] / drive[1]
        if load and self.recording.far_end != "measured-motion":
            found["load"] = correlation(x[TAU_OUT], x[THETA_OUT]) if spring else load[0] / load[1]
        if drive and load:
            found["loss"] = (drive[0] - load[0]) / max(drive[1], load[1])
        for name, channel in SUMS.items():
            if channel in x:
                found[name] = float(np.sign(np.median(x[channel])))
        return {name: value for name, value in found.items() if np.isfinite(value)}

    @cached_property
    def work_at_load(self) -> tuple[float, float] | None:
        """Energy that the load takes over whole cycles and energy that it exchanges, J; None without both sensors."""
        return work(self.moving, (TAU_OUT, THETA_OUT), self.cycles)

    @cached_property
    def lags(self) -> dict[str, float]:
        """By which the load follows the drive, as the area of a loop in -1 to 1, whatever the scales.

        - ``angles``: load angle over drive angle; positive if the drive reverses first, as the end that pulls does
        - ``torques``: load torque over drive torque; positive if the drive torque turns first, as friction lets it

        Channels of one end that come late change both. The energy at each end (`signs`) is then as it was.
        """
        loops = {"angles": (THETA_OUT, THETA_IN), "torques": (TAU_OUT, TAU_IN)}
        areas = {name: work(self.moving, channels, self.cycles) for name, channels in loops.items()}
        return {name: -area[0] / area[1] for name, area in areas.items() if area}

    @cached_property
    def ratios(self) -> dict[str, float]:
        """Found over stated value by relation.

        - ``travel``: travel of the load over that of the drive, at the cable
        - ``amplitude``, ``frequency``: those of a periodic motion over the noted ones
        - ``noise of <channel>``: standard deviation of a sensor's white noise, in the channel's unit
        - ``spring``: load torque over load angle, over the stated spring
        - ``friction of the sums``: ln of the ratio of tensions in full slip, over mu phi
        - ``friction of the slope``: the same without what an offset of a load cell does
        - ``friction``: the one of the two that is nearer to the stated value
        - ``stiffness``: mean tension over stretch of the taut cables, over the stated stiffness; friction makes it
          uncertain, and ``nearest stiffness`` is the value within its bounds that is nearest to the stated one
        - ``pretension at the drive``, ``pretension at the load``: sum of tensions at rest over twice the pretension
        - ``pretension``: their geometric mean, which friction while the cables were tensioned leaves as it is
        - ``torque at the drive``, ``torque at the load``: torque over radius and sum of tensions, its 95 % quantile
        """
        x, rig, entry = self.moving, self.batch.rig, self.recording
        radii = rig.drive.pulley_radius_m, rig.load.pulley_radius_m
        found = {}
        noted = entry.excitation if entry.excitation.get("wave") in WAVES else {}
        if amplitude := noted.get("amplitude_rad"):
            found["amplitude"] = np.ptp(x[THETA_IN]) / 2 / amplitude
        if (frequency := noted.get("frequency_Hz")) and (marks := crossings(x[THETA_IN])).size > 2:
            found["frequency"] = 0.5 / np.median(np.diff(x["time_s"][marks])) / frequency
        for channel in (TAU_IN, TAU_OUT, F_DRIVE, F_LOAD):
            if channel in x:
                found[f"noise of {channel}"] = self.noise(channel)
        # A far end that is moved by something else need not follow.
        if THETA_OUT in x and entry.far_end != "measured-motion":
            found["travel"] = np.ptp(x[THETA_OUT]) * radii[1] / (np.ptp(x[THETA_IN]) * radii[0])
        if THETA_OUT in x and TAU_OUT in x and (spring := rig.load.spring_stiffness_Nm_per_rad):
            angle = x[THETA_OUT] - x[THETA_OUT].mean()
            found["spring"] = (angle * x[TAU_OUT]).sum() / (angle * angle).sum() / spring
        resting = entry.time_s <= entry.rest_s if entry.rest_s else np.zeros(entry.time_s.size, dtype=bool)
        for name, channel in SUM_AT.items():
            if channel in entry and resting.any() and not entry.far_end:
                found[f"pretension at the {name}"] = entry[channel][resting].mean() / (2 * entry.pretension_N)
        ends = [
            found[f"pretension at the {name}"] for name in ("drive", "load") if f"pretension at the {name}" in found
        ]
        if ends and min(ends) > 0:
            found["pretension"] = np.exp(np.mean(np.log(ends)))
        for name, radius in zip(("drive", "load"), radii, strict=True):
            if (torque := TORQUE_AT[name]) in x and (force := SUM_AT[name]) in x:
                sums = np.maximum(np.abs(x[force]), limits.TAUT_N)
                found[f"torque at the {name}"] = np.quantile(np.abs(x[torque]) / radius / sums, 0.95)
        if (log_ratio := self.log_ratio) is not None and self.capstan > limits.LEAST_CAPSTAN:
            estimates = {"friction of the sums": log_ratio}
            if self.offset_free_ratio is not None:
                estimates["friction of the slope"] = self.offset_free_ratio
            estimates = {name: ratio / self.capstan for name, ratio in estimates.items()}
            found |= estimates | {"friction": min(estimates.values(), key=lambda ratio: abs(ratio - 1))}
        if (slopes := self.stiffnesses) is not None:
            low, high = sorted(slope / self.stated_stiffness for slope in slopes)
            found["stiffness"] = np.sign(low) * np.sqrt(low * high)
            found["nearest stiffness"] = float(np.clip(1.0, low, high))
        return {name: float(value) for name, value in found.items() if np.isfinite(value)}

    @cached_property
    def load_speed(self) -> float | None:
        """Variance of the load's speed over that of its angle, 1/s^2: the square of the frequency of a sine.

        What an inertia J takes off the slope of torque over angle is J times this, whatever the motion.
        """
        x = self.moving
        if THETA_OUT not in x or not (variance := float(x[THETA_OUT].var())):
            return None
        return float(speed(x[THETA_OUT], x["time_s"]).var()) / variance

    def noise(self, channel: str) -> float:
        """Standard deviation of white noise in motion; at rest, if it is far less: cables may stick and slip."""
        moving = white_noise(self.moving[channel])
        at_rest = self.recording[channel][self.recording.time_s <= self.recording.rest_s]
        # A channel that repeats its value at rest shows no noise there.
        if at_rest.size < limits.NOISE_SAMPLES // 2 or np.mean(np.diff(at_rest) == 0) > 0.5:
            return moving
        resting = white_noise(at_rest)
        return resting if moving > limits.CHATTER * resting else moving

    @cached_property
    def stroke_rad(self) -> float:
        """Peak to peak of the drive angle, rad."""
        return float(np.ptp(self.moving[THETA_IN]))

    @cached_property
    def frequency_per_s(self) -> float:
        """Speed of the drive over its angle, each as a root mean square, 1/s."""
        x = self.moving
        return float(np.std(speed(x[THETA_IN], x["time_s"])) / max(np.std(x[THETA_IN]), 1e-12))

    @property
    def capstan(self) -> float:
        """Stated mu phi."""
        return self.batch.rig.cable.friction_coefficient * self.recording.path.bend_rad

    @property
    def stated_stiffness(self) -> float:
        """Stated stiffness of this recording's length of cable, N/m."""
        cable = self.batch.rig.cable
        return cable.stiffness_N_per_m * cable.length_m / self.recording.path.length_m

    @cached_property
    def log_ratio(self) -> float | None:
        """ln(T1 / T2) of the pulled cable in full slip, from the sums and the load's tensions; None if not determined.

        With u = T1 / T2 and the other cable sliding against its tension, F_drive = u T2 + T4 / u. The drive torque,
        which holds the friction of the drive's bearing, does not enter.
        """
        found = []
        for total, pulled, other in self._in_full_slip:
            root = np.sqrt(np.maximum(total**2 - 4 * pulled * other, 0.0))
            found.append(np.median(np.log(np.maximum((total + root) / (2 * pulled), 1e-9))))
        return float(np.mean(found)) if found else None

    @cached_property
    def offset_free_ratio(self) -> float | None:
        """The same from how the difference of the sums rises with that of the load's tensions; None if it does not.

        F_drive - F_load = (u - 1) T2 - (1 - 1 / u) T4, whose slope over T2 - T4 is about u - 1. An offset of a load
        cell is its intercept.
        """
        found = []
        for total, pulled, other in self._in_full_slip:
            load = pulled - other
            if np.ptp(load) > 0:
                found.append(np.polyfit(load, total - pulled - other, 1)[0])
        return float(np.log(max(1.0 + np.mean(found), 1e-9))) if found else None

    @cached_property
    def _in_full_slip(self) -> list[tuple[NDArray, NDArray, NDArray]]:
        """By direction, F_drive and the load's tensions of the pulled and of the other cable while both slip, N."""
        x, found = self.moving, []
        if not all(name in x for name in (F_DRIVE, T2, T4, THETA_OUT)):
            return []
        for direction, pulled, other in ((1, T2, T4), (-1, T4, T2)):
            a, b = x[pulled], np.maximum(x[other], 0.0)
            slips = self._slips(direction) & (a > self.taut_N) & (a > limits.PULLED * b)
            if slips.sum() >= limits.FEWEST_SAMPLES:
                found.append((x[F_DRIVE][slips], a[slips], b[slips]))
        return found

    @cached_property
    def stiffnesses(self) -> tuple[float, float] | None:
        """Slope of the mean tension over the stretch of the taut cables, N/m; None if it is not determined.

        Friction scatters both. The regression of the tension on the stretch gives the lower bound, that of the stretch
        on the tension the upper. Sensors of one end that come late hide their relation, or turn its sign.
        """
        x, rig = self.moving, self.batch.rig
        if not all(name in x for name in (T1, T2, T3, T4, THETA_OUT)):
            return None
        stretch = rig.drive.pulley_radius_m * x[THETA_IN] - rig.load.pulley_radius_m * x[THETA_OUT]
        tensions, lengths = [], []
        for ends, sign in (((T1, T2), 1), ((T3, T4), -1)):
            taut = np.minimum(x[ends[0]], x[ends[1]]) > self.taut_N
            tensions.append((x[ends[0]] + x[ends[1]])[taut] / 2)
            lengths.append(sign * stretch[taut])
        tension, length = np.concatenate(tensions), np.concatenate(lengths)
        # Where the cables are often slack, the few taut samples show the friction front and not the stiffness.
        if (
            tension.size < limits.MOSTLY_TAUT * 2 * x[THETA_IN].size
            or not np.ptp(length) > 0
            or not np.ptp(tension) > 0
        ):
            return None
        length -= length.mean()
        tension -= tension.mean()
        # Over the same number of samples, which cancels below.
        variance, covariance, of_tension = (
            np.einsum("i,i", a, b) for a, b in ((length, length), (length, tension), (tension, tension))
        )
        if covariance**2 < limits.LEAST_OF_STRETCH * variance * of_tension:
            return None
        late_m = limits.LATE_S * rig.drive.pulley_radius_m * np.std(speed(x[THETA_IN], x["time_s"]))
        if covariance < 0 and variance < late_m**2 * length.size:
            return None  # Sensors of one end that come late turn the relation.
        return float(covariance / variance), float(of_tension / covariance)

    @property
    def taut_N(self) -> float:
        """Tension from which a cable counts as taut, N."""
        return limits.TAUT_SHARE * self.recording.pretension_N + limits.TAUT_N

    def _slips(self, direction: int) -> NDArray:
        """Samples at which both ends move fast in a direction: both cables slip along the whole conduit."""
        x = self.moving
        drive, load = (direction * speed(x[name], x["time_s"]) for name in (THETA_IN, THETA_OUT))
        return (drive > limits.MOVING * np.abs(drive).max()) & (load > limits.MOVING * np.abs(load).max())


def white_noise(values: NDArray) -> float:
    """Standard deviation of a sensor's white noise where it is quietest: stick and slip make noise of their own."""
    # Motions hardly reach the third differences. The sum of squares of 1, -3, 3, -1 is 20; 0.6745 turns a median into a
    # standard deviation.
    differences = np.abs(np.diff(values, 3)) / 0.6745 / np.sqrt(20)
    parts = np.array_split(differences, max(1, differences.size // limits.NOISE_SAMPLES))
    return float(np.quantile([np.median(part) for part in parts], 0.1))


def correlation(one: NDArray, other: NDArray) -> float:
    """Correlation of two channels; nan if one is constant."""
    # Sums, not dot products: for so few numbers the threads of BLAS cost more than they save.
    x, y = one - one.mean(), other - other.mean()
    scale = np.sqrt((x * x).sum() * (y * y).sum())
    return float((x * y).sum() / scale) if scale > 0 else np.nan


def speed(values: NDArray, time_s: NDArray) -> NDArray:
    """Derivative averaged over `limits.SPEED_WINDOW_S`, in 1/s of the values."""
    window = max(3, round(limits.SPEED_WINDOW_S / float(np.median(np.diff(time_s)))) | 1)
    return uniform_filter1d(np.gradient(uniform_filter1d(values, window), time_s), window)


def crossings(values: NDArray) -> NDArray:
    """Samples at which a channel crosses the middle of its range, not counting those of noise about it."""
    middle, band = (values.max() + values.min()) / 2, 0.1 * np.ptp(values)
    ends = zip(*passes_of_zero(values - middle, band), strict=True)
    return np.array([a + int(np.argmin(np.abs(values[a : b + 1] - middle))) for a, b in ends], dtype=int)


def closed_part(angle: NDArray) -> slice | None:
    """Samples between the first and the last crossing of the middle; None without a whole cycle.

    A torque's zero does no work over them, and the energy that the cables store is nearly the same at both ends.
    """
    found = crossings(angle)
    return slice(found[0], found[-1] + 1) if found.size > 2 else None


def work(x: Mapping[str, NDArray], ends: tuple[str, str], part: slice | None) -> tuple[float, float] | None:
    """Net and exchanged work of a torque over an angle, J; None without both, or if nothing is exchanged."""
    if part is None or not all(name in x for name in ends):
        return None
    return work_over(*(x[name][part] for name in ends))


def work_over(torque: NDArray, angle: NDArray) -> tuple[float, float] | None:
    """Net and exchanged work of a torque over an angle on whole cycles, J; None if nothing is exchanged."""
    # Over a closed part the mean torque does no work, but it would count as work exchanged.
    torque = torque - torque.mean()
    steps = (torque[1:] + torque[:-1]) / 2 * np.diff(angle)
    exchanged = float(np.abs(steps).sum())
    return (float(steps.sum()), exchanged) if exchanged > 0 else None
