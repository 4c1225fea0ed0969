"""Elementary functions without branches, which the compiler vectorises in a kernel's loops over nodes.

A call of the mathematical library for each node takes longer than all other arithmetic of the node.
"""

import numpy as np

from ccmodel.kernel import kernel

# 1.5 x 2^52. Adding it to a number below 2^51 rounds the number to an integer, which is then in the last bits of the
# sum. The compiler must not reorder these terms, so `fastmath` is limited to contraction.
ROUNDER = 6755399441055744.0
LOG2_E = 1.4426950408889634
# ln 2 in two parts (Cody and Waite 1980); the product of the first with an integer exponent is exact.
LN2_HIGH, LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10
MANTISSA_BITS, EXPONENT_BIAS = 52, 1023
SQRT_HALF_BITS = 4604544271217802189


@kernel(forceinline=True, fastmath={"contract"})
def quick_exp(x: float) -> float:
    """exp(x) to rounding error, for x from -700 to 700; x is clipped to this range."""
    x = min(max(x, -700.0), 700.0)
    shifted = x * LOG2_E + ROUNDER
    exponent = shifted - ROUNDER
    r = (x - exponent * LN2_HIGH) - exponent * LN2_LOW
    power = np.int64((np.float64(shifted).view(np.int64) + EXPONENT_BIAS) << MANTISSA_BITS).view(np.float64)
    tail = 1 / 5040 + r * (1 / 40320 + r * (1 / 362880 + r * (1 / 3628800 + r * (1 / 39916800 + r * (1 / 479001600)))))
    tail = 1 / 6 + r * (1 / 24 + r * (1 / 120 + r * (1 / 720 + r * tail)))
    return power * (1.0 + r * (1.0 + r * (0.5 + r * tail)))


@kernel(forceinline=True, fastmath={"contract"})
def quick_log(x: float) -> float:
    """ln(x) to rounding error, for a normal number x > 0."""
    bits = np.float64(x).view(np.int64)
    exponent = (bits - SQRT_HALF_BITS) >> MANTISSA_BITS
    mantissa = np.int64(bits - (exponent << MANTISSA_BITS)).view(np.float64)
    power = np.int64(np.float64(ROUNDER).view(np.int64) + exponent).view(np.float64) - ROUNDER
    s = (mantissa - 1.0) / (mantissa + 1.0)
    q = s * s
    tail = 1 / 11 + q * (1 / 13 + q * (1 / 15 + q * (1 / 17 + q * (1 / 19 + q * (1 / 21)))))
    tail = 1 / 3 + q * (1 / 5 + q * (1 / 7 + q * (1 / 9 + q * tail)))
    return power * LN2_HIGH + (2.0 * s + (2.0 * s * q * tail + power * LN2_LOW))


@kernel(forceinline=True, fastmath={"contract"})
def quick_tanh(y: float) -> float:
    """tanh(y) for y >= 0: to rounding error below 0.05, to 1e-6 at 1."""
    y2 = y * y
    small = y * (945.0 + y2 * (105.0 + y2)) / (945.0 + y2 * (420.0 + 15.0 * y2))
    decay = quick_exp(-2.0 * y)
    return small if y <= 1.0 else (1.0 - decay) / (1.0 + decay)
