"""Physics that the paper's model leaves out: one file an effect (`ccmodel.mechanisms.contract`)."""

from difflib import get_close_matches
from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from ccmodel.mechanisms.contract import PLACES, Mechanism, Parameter, Sensing, Settings

__all__ = ["PLACES", "Mechanism", "Parameter", "Sensing", "Settings", "UnknownMechanismError", "get", "names"]


class UnknownMechanismError(ValueError):
    """A name that no mechanism has; the text gives the nearest."""


@cache
def _registry() -> dict[str, Mechanism]:
    found = {}
    for module_info in iter_modules(__path__):
        module = import_module(f"{__name__}.{module_info.name}")
        for mechanism in (*getattr(module, "MECHANISMS", ()), *filter(None, [getattr(module, "MECHANISM", None)])):
            if mechanism.name in found:
                raise ValueError(f"two mechanisms are called {mechanism.name}")
            found[mechanism.name] = mechanism
    return dict(sorted(found.items()))


def names() -> tuple[str, ...]:
    """Names of all mechanisms, in alphabetical order."""
    return tuple(_registry())


def get(name: str) -> Mechanism:
    """The mechanism of that name.

    Raises
    ------
    UnknownMechanismError
        If there is none.
    """
    try:
        return _registry()[name]
    except KeyError:
        near = get_close_matches(name, names(), n=3, cutoff=0.4)
        hint = f"; nearest are {', '.join(near)}" if near else f"; there are {', '.join(names())}"
        raise UnknownMechanismError(f"no mechanism is called {name!r}{hint}") from None
