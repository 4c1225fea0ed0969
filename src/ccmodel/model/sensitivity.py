"""Steps of finite differences over parameters."""

from ccmodel import mechanisms as registry
from ccmodel.model.parameters import mechanism_parameter

# Relative step of the differences. The exact solver rounds at 1e-13 of tension; the general one balances to 1e-8 and
# mostly far better. The response of both has corners, where a slip front meets an older corner of the profile or a node
# begins to slide, and these shift with the parameters: a difference is wrong at the samples that a corner crosses.
# With steps of 1e-4 to 1e-6 neither error exceeds 1e-4 of a sensitivity's root mean square over a run.
STEP = 1e-5
# Size of a parameter whose value is zero, by the end of its name.
SIZE_AT_ZERO = {"_Nm": 1e-3, "_N": 1.0, "_rad": 1e-2}


def size_of(name: str, value: float) -> float:
    """Scale of a parameter's steps: the size of its value or, at zero, a plausible size."""
    if value != 0:
        return abs(value)
    if (parts := mechanism_parameter(name)) is not None:
        mechanism, _, parameter = parts
        return next(p.start for p in registry.get(mechanism).parameters if p.name == parameter) or 1.0
    return next((size for end, size in SIZE_AT_ZERO.items() if name.endswith(end)), 1.0)
