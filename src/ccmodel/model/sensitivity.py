"""How every output of a run answers to every parameter."""

from collections.abc import Sequence

from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.model.parameters import Parameters, mechanism_parameter
from ccmodel.model.run import LoadFrom, ModelInput, simulate

# Relative step of the differences. The exact solver rounds at 1e-13 of tension, the general one balances to 1e-8 and
# mostly far better, and both have corners, where a friction front meets an older one or a node begins to slide, that
# shift with the parameters: a difference is wrong at the samples that a corner shifts across. Between 1e-4 and 1e-6
# no source is worth more than 1e-4 of a sensitivity's root mean square over a run.
STEP = 1e-5
# What stands for the size of a parameter that is zero, by the end of its name.
SIZE_AT_ZERO = {"_Nm": 1e-3, "_N": 1.0, "_rad": 1e-2}


def sensitivities(
    given: ModelInput, parameters: Parameters, names: Sequence[str], load_from: LoadFrom = "law"
) -> dict[str, dict[str, NDArray]]:
    """Derivatives of all channels by some parameters: one more run for each.

    Parameters
    ----------
    given : ModelInput
    parameters : Parameters
        Where to differentiate.
    names : sequence of str
        Parameters as `Parameters.with_values` calls them.
    load_from : {"law", "torque", "angle"}
        As for `ccmodel.model.run.simulate`.

    Returns
    -------
    dict of str to dict of str to ndarray, each of shape (n,)
        By parameter, then channel, in the channel's unit per unit of the parameter.

    Raises
    ------
    ModelError
        If the model cannot be run here or a step aside.
    """
    base = simulate(given, parameters, load_from)
    found = {}
    for name in names:
        value = parameters.value_of(name)
        step = STEP * size_of(name, value)
        aside = simulate(given, parameters.with_values({name: value + step}), load_from)
        found[name] = {channel: (aside[channel] - base[channel]) / step for channel in base.channels}
    return found


def size_of(name: str, value: float) -> float:
    """The size that a parameter's steps are measured by: its own, or, at zero, what is plausible for it."""
    if value != 0:
        return abs(value)
    if (parts := mechanism_parameter(name)) is not None:
        mechanism, _, parameter = parts
        return next(p.start for p in registry.get(mechanism).parameters if p.name == parameter) or 1.0
    return next((size for end, size in SIZE_AT_ZERO.items() if name.endswith(end)), 1.0)
