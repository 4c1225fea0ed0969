"""Derivatives of model runs by finite differences.

The exact solver rounds at 1e-13 of tension, the general one balances to 1e-8 and mostly far better. Both have corners,
where a friction front meets an older one or a node begins to slide, and these shift with the parameters: a difference
is wrong at the samples that a corner shifts across. Between 1e-4 and 1e-6 of a parameter no source of error exceeds
1e-4 of the rms sensitivity over a run.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.model.parameters import mechanism_parameter, parameter_of

# Step of a difference, as a share of a parameter's size.
STEP = 1e-5
# What stands for the size of a parameter that is zero, by the end of its name.
SIZE_AT_ZERO = {"_Nm": 1e-3, "_N": 1.0, "_rad": 1e-2}
# Least size of a parameter whose range is linear, as a share of the range: zero is a value like any other there.
LEAST_SIZE = 0.1


def size_of(name: str, value: float) -> float:
    """The size by which a parameter's steps are measured: its own, or, at zero, a plausible one.

    Of a mechanism's parameter with a linear range it is at least a share of the range: the step of a value that is all
    but zero would be lost in rounding.
    """
    p = None
    if (parts := mechanism_parameter(name)) is not None:
        mechanism, _, parameter = parts
        p = registry.get(mechanism).parameter(parameter)
        if p.scale == "linear" and np.isfinite(p.high - p.low):
            return max(abs(value), LEAST_SIZE * (p.high - p.low))
    if value != 0:
        return abs(value)
    if p is not None:
        return p.start or 1.0
    return next((size for end, size in SIZE_AT_ZERO.items() if parameter_of(name).endswith(end)), 1.0)


def inward(steps: NDArray, x: NDArray, high: NDArray) -> NDArray:
    """Steps with the sign that keeps each unknown below its upper bound; all of shape (unknowns,)."""
    return np.where(x + steps > high, -steps, steps)


def jacobian(run: Callable[[NDArray], NDArray], x: NDArray, steps: NDArray, base: NDArray | None = None) -> NDArray:
    """Derivatives of a run by each unknown.

    Parameters
    ----------
    run : callable
        Maps unknowns, shape (unknowns,), to results of any shape.
    x, steps : ndarray, shape (unknowns,)
        Where to differentiate, and the step of each unknown with its sign.
    base : ndarray, optional
        ``run(x)``, for one-sided differences; without it differences are central, over a step to either side.

    Returns
    -------
    ndarray, shape (*result, unknowns)

    Raises
    ------
    ModelError
        If the model cannot be run a step aside.
    """
    columns = []
    for step, aside in zip(steps, np.diag(steps), strict=True):
        difference = (run(x + aside) - run(x - aside)) / 2 if base is None else run(x + aside) - base
        columns.append(difference / step)
    if not columns:
        return np.empty((*(run(x) if base is None else base).shape, 0))
    return np.stack(columns, axis=-1)
