"""Physics that the paper's model leaves out: one file an effect (`ccmodel.mechanisms.contract`), found by listing."""

from collections.abc import Iterator
from difflib import get_close_matches
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

from ccmodel.mechanisms.contract import PAPER_LOOK_ALIKES, PLACES, Mechanism, Parameter, Sensing, Settings
from ccmodel.mechanisms.learned import laws

__all__ = [
    "PLACES",
    "Mechanism",
    "Parameter",
    "Sensing",
    "Settings",
    "UnknownMechanismError",
    "get",
    "laws",
    "march_settings",
    "module_of",
    "names",
    "neutral_settings",
]


class UnknownMechanismError(ValueError):
    """No mechanism has this name; the text gives the nearest names."""


@cache
def _registry() -> dict[str, Mechanism]:
    found: dict[str, Mechanism] = {}
    for mechanism, _ in _declared():
        if mechanism.name in found:
            raise ValueError(f"two mechanisms are called {mechanism.name}")
        found[mechanism.name] = mechanism
    for mechanism in found.values():
        if unknown := set(mechanism.mistaken_for) - {*found, *PAPER_LOOK_ALIKES}:
            raise ValueError(f"{mechanism.name} is mistaken for what does not exist: {', '.join(sorted(unknown))}")
    return dict(sorted(found.items()))


def _declared() -> Iterator[tuple[Mechanism, str]]:
    """Every mechanism and the name of its module within this package."""
    for module_info in iter_modules(__path__):
        module = import_module(f"{__name__}.{module_info.name}")
        declared = [*getattr(module, "MECHANISMS", ()), getattr(module, "MECHANISM", None)]
        yield from ((mechanism, module_info.name) for mechanism in declared if mechanism is not None)


@cache
def _neutral() -> dict[str, Any]:
    neutral: dict[str, Any] = {}
    # A setting that holds several effects is a tuple or a law, to which each of them adds.
    of_laws = {law.setting for law in laws().values()}
    for mechanism in _registry().values():
        own = {name for name, value in mechanism.neutral_settings.items() if not isinstance(value, tuple)} - of_laws
        if taken := neutral.keys() & own:
            raise ValueError(f"{mechanism.name} declares settings of another mechanism: {', '.join(sorted(taken))}")
        neutral |= mechanism.neutral_settings
    for law in laws().values():
        neutral |= law.mechanism.neutral_settings
    return neutral


def neutral_settings() -> Settings:
    """The solver's settings at their neutral values, which is the paper's model."""
    return Settings(_neutral())


def march_settings() -> tuple[str, ...]:
    """Names of the settings that the compiled march takes: the numbers."""
    return tuple(name for name, value in _neutral().items() if isinstance(value, float))


def names() -> tuple[str, ...]:
    """Names of all mechanisms, in alphabetical order."""
    return tuple(_registry())


def module_of(name: str) -> str:
    """Name of the module of this package that holds a mechanism."""
    return next(module for mechanism, module in _declared() if mechanism.name == name)


def get(name: str) -> Mechanism:
    """The mechanism of that name, or the law (`ccmodel.mechanisms.learned`).

    Raises
    ------
    UnknownMechanismError
        If there is none.
    """
    if (law := laws().get(name)) is not None:
        return law.mechanism
    try:
        return _registry()[name]
    except KeyError:
        near = get_close_matches(name, names(), n=3, cutoff=0.4)
        hint = f"; nearest are {', '.join(near)}" if near else f"; there are {', '.join(names())}"
        raise UnknownMechanismError(f"no mechanism is called {name!r}{hint}") from None
