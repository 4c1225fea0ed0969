"""Elementary functions without branches, for kernels' loops over nodes: these then run several nodes at a time.

A call of the mathematical library for each node takes longer than all other arithmetic of a node together.
"""

import numpy as np

from ccmodel.kernel import small_kernel

# Added to a number below 2^51, this leaves it rounded to a whole one, which then stands in the sum's last bits. Terms
# must keep their order here, whatever the loop around allows the compiler.
ROUNDER = 6755399441055744.0
LOG2_E = 1.4426950408889634
# ln 2 in two parts, the first with room for a whole number's bits.
LN2_HIGH, LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10
MANTISSA_BITS, EXPONENT_BIAS = 52, 1023
SQRT_HALF_BITS = 4604544271217802189


@small_kernel(fastmath={"contract"})
def quick_exp(x):
    """Exp to rounding, for x from -700 to 700; beyond, what it is there."""
    x = min(max(x, -700.0), 700.0)
    shifted = x * LOG2_E + ROUNDER
    twos = shifted - ROUNDER
    r = (x - twos * LN2_HIGH) - twos * LN2_LOW
    power = np.int64((np.float64(shifted).view(np.int64) + EXPONENT_BIAS) << MANTISSA_BITS).view(np.float64)
    tail = 1 / 5040 + r * (1 / 40320 + r * (1 / 362880 + r * (1 / 3628800 + r * (1 / 39916800 + r * (1 / 479001600)))))
    tail = 1 / 6 + r * (1 / 24 + r * (1 / 120 + r * (1 / 720 + r * tail)))
    return power * (1.0 + r * (1.0 + r * (0.5 + r * tail)))


@small_kernel(fastmath={"contract"})
def quick_log(x):
    """Ln to rounding, for a normal x > 0."""
    bits = np.float64(x).view(np.int64)
    twos = (bits - SQRT_HALF_BITS) >> MANTISSA_BITS
    mantissa = np.int64(bits - (twos << MANTISSA_BITS)).view(np.float64)
    power = np.int64(np.float64(ROUNDER).view(np.int64) + twos).view(np.float64) - ROUNDER
    s = (mantissa - 1.0) / (mantissa + 1.0)
    q = s * s
    tail = 1 / 11 + q * (1 / 13 + q * (1 / 15 + q * (1 / 17 + q * (1 / 19 + q * (1 / 21)))))
    tail = 1 / 3 + q * (1 / 5 + q * (1 / 7 + q * (1 / 9 + q * tail)))
    return power * LN2_HIGH + (2.0 * s + (2.0 * s * q * tail + power * LN2_LOW))


@small_kernel(fastmath={"contract"})
def quick_tanh(y):
    """Tanh, y >= 0: to rounding below 0.05, to 1e-6 at 1."""
    y2 = y * y
    small = y * (945.0 + y2 * (105.0 + y2)) / (945.0 + y2 * (420.0 + 15.0 * y2))
    left = quick_exp(-2.0 * y)
    return small if y <= 1.0 else (1.0 - left) / (1.0 + left)
