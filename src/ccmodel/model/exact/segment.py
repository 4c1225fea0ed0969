"""Closed forms of a slip front inside one segment of the stored profile: one slope, one bend.

The sliding line behind a front changes ln T by -sigma per unit of m = mu phi going inward, sigma = +1 for a pull and -1
for a release. The front stands where r = expm1(sigma dm), dm counted from its entry into the segment. Against a stored
profile of the opposite slope
    displacement - displacement at entry = T_e r (E (2 + r) + sigma c r)
    end tension / end tension at entry   = (1 + r)**2
with T_e the tension at the point of entry, E the compliance of the sliding part per unit of the front's tension, and
c = dx / (EA dm) of the bend. This quadratic in r has coefficients of one sign, so nothing cancels. Increments count
from the entry into the segment, not from the last sample: small steps and large ones agree.
"""

from math import exp, expm1, log1p, sqrt

from numpy.typing import NDArray

from ccmodel.kernel import kernel, small_kernel
from ccmodel.model.exact.state import BEND, EE, PE, R_STOP, SLOPE, TE


@kernel
def _segment_stretch(s: float, y: float) -> float:
    """Displacement over a segment of relative slope s up to y, over tension at entry and c.

    exp((s + 1) y) - exp(s y) - (exp(s y) - 1) / s, summed as a series where these terms cancel.
    """
    if abs(y) < 0.3:
        # (1 + s) sum over n >= 2 of ((1 + s)^(n-1) - s^(n-1)) y^n / n!
        total, power, high, low = 0.0, y, 1.0, 1.0
        for n in range(2, 20):
            power *= y / n
            high *= 1.0 + s
            low *= s
            total += (high - low) * power
        return (1.0 + s) * total
    if abs(s) < 1e-9:
        return expm1(y) - y
    return exp(s * y) * expm1(y) - expm1(s * y) / s


@small_kernel
def tension_gain(slope: float, r: float) -> float:
    """Relative rise of the end's tension since the segment was entered."""
    if slope == 1.0:
        return r * (2.0 + r)
    return expm1((1.0 + slope) * log1p(r))


@small_kernel
def displacement_gain(front: NDArray, c: int, end: int, sigma: int, r: float) -> float:
    """Displacement of the end since the segment was entered, m."""
    T_e, E, bend, slope = (
        front[2 * c + end, TE],
        front[2 * c + end, EE],
        front[2 * c + end, BEND],
        front[2 * c + end, SLOPE],
    )
    if slope == 1.0:
        return T_e * r * (E * (2.0 + r) + sigma * bend * r)
    y = log1p(r)
    return T_e * (E * expm1((1.0 + slope) * y) + sigma * bend * _segment_stretch(slope, y))


@small_kernel
def _over(numerator: float, denominator: float) -> float:
    """A quotient; 0 for a motion so small that its square is 0 in double precision."""
    return numerator / denominator if denominator != 0.0 else 0.0


@small_kernel
def solve_segment(
    front: NDArray, c: int, end: int, sigma: int, weight_P: float, weight_d: float, residual: float
) -> float:
    """Solve weight_P (P - P_e) + weight_d (d - d_e) = residual for r within the segment."""
    T_e, P_e, E, bend = front[2 * c + end, TE], front[2 * c + end, PE], front[2 * c + end, EE], front[2 * c + end, BEND]
    slope = front[2 * c + end, SLOPE]
    b = weight_P * P_e + weight_d * T_e * E
    if slope == 1.0:
        a = b + weight_d * T_e * sigma * bend
        return _over(residual, b + sqrt(max(0.0, b * b + a * residual)))
    return _solve_sloping(slope, b, weight_d * T_e * sigma * bend, residual, log1p(front[2 * c + end, R_STOP]))


@kernel
def _solve_sloping(slope: float, b: float, k: float, residual: float, y_stop: float) -> float:
    """Solve b expm1((1 + slope) y) + k stretch(y) = residual for r = expm1(y), y between 0 and y_stop.

    Newton's method, bisecting where it leaves the bracket.
    """
    near, far = 0.0, y_stop
    gain = 1.0 + slope
    linear = b * gain
    square = 0.5 * gain * (b * gain + k)
    y = _over(2.0 * residual, linear + sqrt(max(0.0, linear * linear + 4.0 * square * residual)))
    for _ in range(60):
        if not (min(near, far) < y < max(near, far)):
            y = 0.5 * (near + far)
        excess = b * expm1(gain * y) + k * _segment_stretch(slope, y) - residual
        if (excess > 0.0) == (y_stop > 0.0):
            far = y
        else:
            near = y
        step = excess / (b * gain * exp(gain * y) + k * gain * exp(slope * y) * expm1(y))
        y -= step
        if abs(step) <= 2e-16 * abs(y):
            break
    return expm1(y)
