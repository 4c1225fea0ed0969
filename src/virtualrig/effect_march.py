"""The time loop of a rig with effects.

An absent effect costs next to nothing: it stands behind a flag outside the loops over nodes. Friction that depends on
tension, time and position (`Twin.slow_friction`) is evaluated every `SLOW_S`. The twins' compiled laws are chained to
one function of each kind; effects with a state of their own stand in the loop.
"""

from collections import namedtuple
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from virtualrig.effects import Effects, cached, chained, numbers, strand_settling, stribeck
from virtualrig.effects.pulley_friction import under_pull
from virtualrig.effects.unlisted_ageing_contact import FIRST_S, OLDEST_S
from virtualrig.effects.viscous_friction import REFERENCE_M_PER_S

SLOW_S = 1e-4
# A conduit follows its cable's mean tension within this time: far below any motion, well above the time step.
CONDUIT_LAG_S = 1e-4
# Logarithmic velocity weakening: from a tenth of its speed to ten times it.
DECADE = 10.0
# Below this speed a drag with a power of the speed is linear in it.
SLOWEST_M_PER_S = 1e-5
# A tension (N), time (s), travel and position (m) at which every law of slow friction that is present has an effect.
ANY_STATE = (2.3, 0.7, 0.011, 0.0037)

if TYPE_CHECKING:

    class Physics(NamedTuple):
        """Of the twins' numbers, a type checker knows only that they are numbers."""

        bristle_length: float
        radius: float
        spring: float
        damping: float
        inertia: float

        def __getattr__(self, name: str) -> float: ...

else:
    Physics = namedtuple("Physics", ["bristle_length", "radius", "spring", "damping", "inertia", *numbers(Effects())])
slow_friction, friction_law = chained("slow_friction"), chained("friction")


@njit
def drive_shape(p: Physics) -> tuple[float, float, float, float]:
    """Shares of the radius and phases of the drive pulley's first and second harmonic."""
    return p.drive_share, p.drive_phase, p.drive_second, p.drive_second_phase


@njit
def load_shape(p: Physics) -> tuple[float, float, float, float]:
    """The same of the load pulley."""
    return p.load_share, p.load_phase, p.load_second, p.load_second_phase


@njit
def roundness(theta: Any, shape: tuple[float, float, float, float]) -> Any:
    """A pulley's radius at an angle (rad), over its mean."""
    share, phase, second, second_phase = shape
    return 1 + share * np.sin(theta + phase) + second * np.sin(2 * theta + second_phase)


@njit(cache=True)
def bearing_course(theta: NDArray, angle: float) -> NDArray:
    """Deflection of a bearing's bristle (-1 to 1) along angles (rad), yielding over `angle`; shape (samples,)."""
    z = np.zeros_like(theta)
    for j in range(1, theta.size):
        rotation = theta[j] - theta[j - 1]
        direction = 1.0 if rotation > 0 else -1.0
        z[j] = direction + (z[j - 1] - direction) * np.exp(-abs(rotation) / angle)
    return z


@njit
def _winding(theta: float, shape: tuple[float, float, float, float]) -> float:
    """Cable travel over the mean radius, rad: the integral of the roundness."""
    share, phase, second, second_phase = shape
    return theta - share * np.cos(theta + phase) - 0.5 * second * np.cos(2 * theta + second_phase)


@njit
def spring_torque(p: Physics, theta: float) -> float:
    """Torque of the load's spring at an angle, N m."""
    above, below = theta - p.half_gap, theta + p.half_gap
    if p.soft_flank > 0.0:
        above = 0.5 * (above + np.hypot(above, p.soft_flank))
        below = 0.5 * (below - np.hypot(below, p.soft_flank))
    beyond = max(above, 0.0) + min(below, 0.0)
    further = p.cubic * beyond * beyond * beyond
    if p.exponential > 0.0:
        further += p.spring * (np.sinh(p.exponential * beyond) / p.exponential - beyond)
    if p.bumper > 0.0:
        further += p.bumper * (max(beyond - p.bumper_at, 0.0) + min(beyond + p.bumper_at, 0.0))
    if p.detent > 0.0:
        further += p.detent * (np.sin(p.detent_number * theta + p.detent_phase) - np.sin(p.detent_phase))
    return p.spring * beyond + further


@njit(inline="always")
def _bristle(z: float, slide_over_length: float) -> float:
    """Dahl's bristle after a slide, implicit: within its bounds for any step (as in `virtualrig.dynamics`)."""
    return (z + slide_over_length) / (1 + abs(slide_over_length))


@njit(error_model="numpy")
def _set_strength(
    p: Physics, strength: NDArray, half_bend: NDArray, tension: NDArray, time: float, travel: float, position: float
) -> None:
    """Friction of the nodes per sum of the tensions on both sides, without what changes fast."""
    for c in range(2):
        for i in range(strength.shape[1]):
            mean = 0.5 * (tension[c, i] + tension[c, i + 1])
            strength[c, i] = np.tanh(slow_friction(p, half_bend[c, i], mean, time, travel, position))


@njit(error_model="numpy")
def _set_hold(p: Physics, hold: NDArray, strength: NDArray, rested: NDArray, drag: NDArray, T: NDArray) -> None:
    """Friction (N) of one cable's nodes at fully deflected bristles."""
    n = hold.size
    for i in range(n):
        hold[i] = strength[i] * (T[i] + T[i + 1]) * (1.0 + p.stribeck_rise * rested[i]) + drag[i]


@njit(error_model="numpy")
def _deflect(p: Physics, z: NDArray, w: NDArray, dt: float) -> None:
    """Let one cable's bristles follow its nodes' speeds `w`: Dahl's, or those of Bouc and Wen."""
    slid = dt / p.bristle_length
    if p.bristle_exponent == 1.0:
        for i in range(z.size):
            z[i] = _bristle(z[i], w[i + 1] * slid)
        return
    for i in range(z.size):
        slide = w[i + 1] * slid
        held = abs(z[i]) ** p.bristle_exponent
        z[i] = min(max(z[i] + slide - abs(slide) * held * np.sign(z[i]), -1.0), 1.0)


@njit(error_model="numpy")
def _set_keep(p: Physics, keep: NDArray, drag_rate: NDArray, viscous_rate: NDArray, w: NDArray, dt: float) -> None:
    """Share of their speed that one cable's nodes keep in a step against a drag that thins with the speed."""
    for i in range(keep.size):
        speed = max(abs(w[i + 1]), SLOWEST_M_PER_S)
        if p.viscous_eyring > 0.0:
            thinned = np.arcsinh(speed / p.viscous_eyring) * p.viscous_eyring / speed
        else:
            thinned = (speed / REFERENCE_M_PER_S) ** (p.viscous_power - 1.0)
        keep[i] = 1.0 / (1.0 + dt * (drag_rate[i] + viscous_rate[i] * thinned))


@njit(error_model="numpy")
def _renew(p: Physics, rested: NDArray, w: NDArray, dt: float) -> None:
    """Let the contacts of one cable's nodes adapt to their sliding speed `w`."""
    inverse, renewal = 1.0 / p.stribeck_speed, dt / p.stribeck_renewal
    for i in range(rested.size):
        speed = abs(w[i + 1])
        s = speed * inverse
        if p.stribeck_law == stribeck.HESS_SOOM:
            target = 1.0 / ((1.0 + s) * (1.0 + s))
        elif p.stribeck_law == stribeck.LOGARITHMIC:
            target = max(1.0 - np.log1p(DECADE * s) / np.log1p(DECADE * DECADE), 0.0)
        else:
            if p.stribeck_exponent == 2.0:
                s = s * s
            elif p.stribeck_exponent != 1.0:
                s = s**p.stribeck_exponent
            target = np.exp(-s)
        share = speed * renewal
        rested[i] = (rested[i] + share * target) / (1.0 + share)


@njit(error_model="numpy")
def _age(p: Physics, hold: NDArray, age: NDArray, w: NDArray, dt: float) -> None:
    """Strengthen one cable's contacts by their age, which their sliding speed `w` renews."""
    for i in range(age.size):
        renewed = 1.0 + dt * abs(w[i + 1]) / p.ageing_renewal
        age[i] = min((age[i] + dt) / renewed, OLDEST_S)
        hold[i] *= 1.0 + p.ageing_rise * np.log10(1.0 + age[i] / p.ageing_shortest)


@njit(error_model="numpy")
def _set_elastic(
    p: Physics,
    elastic: NDArray,
    x: NDArray,
    stretch: NDArray,
    stiffness: NDArray,
    settling: NDArray,
    share: NDArray,
    shortening: float,
    settles: bool,
) -> None:
    """Tension (N) of one cable's segments without dampers; `x` are the slides, `shortening` is the conduit's."""
    n1 = elastic.size
    for i in range(n1):
        e = stretch[i] + (x[i] - x[i + 1]) - share[i] * shortening
        elastic[i] = stiffness[i] * max(e, 0.0)
    if settles:
        for i in range(n1):
            e, s = elastic[i] / stiffness[i], settling[i]
            if s == 0.0:
                continue
            if p.settling_law == strand_settling.EXPONENTIAL:
                elastic[i] = stiffness[i] * (e + s * np.expm1(-e / s))
            elif p.settling_law == strand_settling.TOE:
                elastic[i] = stiffness[i] * (e * e / (4 * s) if e < 2 * s else e - s)
            else:
                elastic[i] = stiffness[i] * (np.sqrt(e * e + s * s) - s)
    if p.yield_share > 0.0:
        for i in range(n1):
            elastic[i] -= p.yield_share * max(elastic[i] - p.yield_tension, 0.0)


@cached
def march(
    p: Physics,
    theta_in: NDArray,
    omega_in: NDArray,
    sample_s: float,
    steps: int,
    start_tension: NDArray,
    start_elastic: NDArray,
    start_relaxed: NDArray,
    bristles: NDArray,
    lengths: NDArray,
    stiffness: NDArray,
    stretch: NDArray,
    settling: NDArray,
    share: NDArray,
    relaxing: NDArray,
    relaxing_time: NDArray,
    damper: float,
    inverse_mass: NDArray,
    half_bend: NDArray,
    drag: NDArray,
    drag_rate: NDArray,
    viscous_rate: NDArray,
    theta_out: float,
) -> NDArray:
    """Integrate; returns theta_out, T1, T2, T3, T4 and the load bearing's torque at the samples, shape (6, samples).

    Rows and columns are those of `virtualrig.dynamics._run`; `bristles` has shape (elements, 2, n).
    """
    samples = theta_in.size
    nodes = inverse_mass.size
    elements = lengths.size
    share_of_one = 1.0 / elements
    dt = sample_s / steps
    slow_steps = max(1, int(SLOW_S / dt))
    settles = settling.max() > 0.0
    is_slow = slow_friction(p, 1.0, *ANY_STATE) != 1.0
    keep = 1 / (1 + (drag_rate + viscous_rate) * dt)
    thins = (p.viscous_power != 1.0 or p.viscous_eyring > 0.0) and viscous_rate.max() > 0.0
    u = np.zeros((2, nodes + 2))
    v = np.zeros((2, nodes + 2))
    tension = start_tension.copy()
    elastic = start_elastic.copy()
    base = np.empty(nodes + 1)
    relaxed = start_relaxed.copy()
    bristle = bristles[0].copy()
    strength = np.empty((2, nodes))
    hold = np.empty(nodes)
    rested = np.ones((2, nodes))
    age = np.full((2, nodes), FIRST_S)
    start_mean = np.zeros(2)
    shortening = np.zeros(2)
    for c in range(2):
        start_mean[c] = (share * start_tension[c]).sum()
    theta_rest = theta_out
    omega_out = 0.0
    bearing = 0.0
    bearing_torque = p.bearing_torque
    hysteresis = 0.0
    travel = 0.0
    drive = 0.0
    since_slow = slow_steps
    of_drive, of_load = drive_shape(p), load_shape(p)
    drive_start = _winding(theta_in[0], of_drive)
    load_start = _winding(theta_rest, of_load)
    out = np.empty((6, samples))

    for sample in range(samples):
        out[0, sample] = theta_out
        out[1, sample] = tension[0, 0]
        out[2, sample] = tension[0, nodes]
        out[3, sample] = tension[1, 0]
        out[4, sample] = tension[1, nodes]
        out[5, sample] = bearing_torque * bearing
        if sample == samples - 1:
            break
        # The drive angle between two samples: the cubic through angles and rates at both.
        rise = theta_in[sample + 1] - theta_in[sample]
        slope_0 = omega_in[sample] * sample_s
        slope_1 = omega_in[sample + 1] * sample_s
        c2 = 3 * rise - 2 * slope_0 - slope_1
        c3 = slope_0 + slope_1 - 2 * rise

        for step in range(1, steps + 1):
            s = step / steps
            theta = theta_in[sample] + s * (slope_0 + s * (c2 + s * c3))
            omega = (slope_0 + s * (2 * c2 + s * 3 * c3)) / sample_s
            drive = p.radius * (_winding(theta, of_drive) - drive_start)
            drive_rate = p.radius * roundness(theta, of_drive) * omega
            travel += abs(drive_rate) * dt
            if since_slow >= slow_steps:
                _set_strength(p, strength, half_bend, tension, (sample + s) * sample_s, travel, drive)
                since_slow = 0
            if is_slow:
                since_slow += 1

            load_radius = p.radius * roundness(theta_out, of_load)
            torque = load_radius * (tension[0, nodes] - tension[1, nodes])
            torque -= spring_torque(p, theta_out) + p.damping * omega_out
            if p.bearing_share > 0.0:
                pull = tension[0, nodes] + tension[1, nodes]
                bearing_torque = p.bearing_torque * under_pull(pull, p.bearing_share, p.bearing_pull, p.bearing_power)
            torque -= bearing_torque * bearing + p.hysteresis_torque * hysteresis
            omega_out += dt * torque / p.inertia
            theta_out += dt * omega_out
            bearing = _bristle(bearing, omega_out * dt / p.bearing_angle)
            hysteresis = _bristle(hysteresis, omega_out * dt / p.hysteresis_angle)
            load_radius = p.radius * roundness(theta_out, of_load)
            load_travel = p.radius * (_winding(theta_out, of_load) - load_start)

            for c in range(2):
                side = 1.0 - 2.0 * c
                T = tension[c]
                x = u[c]
                w = v[c]
                z = bristle[c]
                _set_hold(p, hold, strength[c], rested[c], drag, T)
                if p.ageing_rise > 0.0:
                    _age(p, hold, age[c], w, dt)
                if thins:
                    _set_keep(p, keep, drag_rate, viscous_rate, w, dt)
                for i in range(nodes):
                    friction = friction_law(p, hold[i] * z[i], z[i], w[i + 1])
                    w[i + 1] = keep[i] * (w[i + 1] + dt * inverse_mass[i] * (T[i] - T[i + 1] - friction))
                if p.stribeck_rise > 0.0:
                    _renew(p, rested[c], w, dt)
                if elements == 1:
                    _deflect(p, z, w, dt)
                else:
                    z[:] = 0.0
                    for k in range(elements):
                        zk = bristles[k, c]
                        slid = dt / lengths[k]
                        for i in range(nodes):
                            zk[i] = min(max(zk[i] + w[i + 1] * slid, -1.0), 1.0)
                            z[i] += share_of_one * zk[i]
                for i in range(1, nodes + 1):
                    x[i] += dt * w[i]
                x[0] = side * drive
                w[0] = side * drive_rate
                x[nodes + 1] = side * load_travel
                w[nodes + 1] = side * load_radius * omega_out
                _set_elastic(p, elastic[c], x, stretch[c], stiffness[c], settling[c], share, shortening[c], settles)
                base[:] = elastic[c]
                for k in range(relaxing.size):
                    q = relaxed[k, c]
                    rate = dt / relaxing_time[k]
                    for i in range(nodes + 1):
                        q[i] += rate * (elastic[c, i] - q[i])
                        base[i] -= relaxing[k] * q[i]
                for i in range(nodes + 1):
                    pull = base[i] + damper * (w[i] - w[i + 1])
                    # A slack segment neither pushes nor damps.
                    T[i] = max(0.0, pull) if base[i] > 0.0 else 0.0
                if p.conduit_compliance > 0.0:
                    mean = 0.0
                    for i in range(nodes + 1):
                        mean += share[i] * T[i]
                    change = mean - start_mean[c]
                    if p.conduit_closes > 0.0:
                        change = p.conduit_closes * np.tanh(change / p.conduit_closes)
                    shortening[c] += dt / CONDUIT_LAG_S * (p.conduit_compliance * change - shortening[c])
    return out
