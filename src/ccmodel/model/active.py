"""Mechanisms that are in a model, with values for their parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ccmodel import mechanisms as registry
from ccmodel.failure import ModelError
from ccmodel.mechanisms.contract import Mechanism


@dataclass(frozen=True)
class Active:
    """A mechanism that is in a model.

    Attributes
    ----------
    name : str
        One of `ccmodel.mechanisms.names()`.
    place : str
        One of the mechanism's places.
    values : mapping of str to float
        A value for each of its parameters.
    """

    name: str
    place: str
    values: Mapping[str, float]


@dataclass(frozen=True)
class _Checked(Active):
    """One that `active_of` has returned: a run asks for it several times."""


def active_of(mechanisms: Sequence[Active]) -> list[Active]:
    """Mechanisms as given to `ccmodel.model.general.simulate`, checked, with a value for every parameter.

    Raises
    ------
    ModelError
        If a place, a parameter's name or a value is not one that the mechanism can have, or if a mechanism is there
        twice.
    ccmodel.mechanisms.UnknownMechanismError
        If a mechanism's name is not known.
    """
    found: list[Active] = []
    for a in mechanisms:
        if any((a.name, a.place) == (other.name, other.place) for other in found):
            raise ModelError(f"{a.name} acts at {a.place} twice; a model has each mechanism once at a place")
        found.append(a if isinstance(a, _Checked) else _checked(a))
    return found


def modify_physics(mechanisms: Sequence[Active]) -> bool:
    """Whether any of the mechanisms modifies the physics. The others modify the observation, or are drifts."""
    return any(registry.get(a.name).modifies_settings for a in mechanisms)


def without_faults(mechanisms: Sequence[Active]) -> tuple[Active, ...]:
    """Mechanisms without those that modify the observation alone."""
    every = [(m, registry.get(m.name)) for m in mechanisms]
    return tuple(m for m, known in every if known.modifies_settings or known.modifies_observation is None)


def _checked(a: Active) -> _Checked:
    known = registry.get(a.name)
    _check(a, known)
    return _Checked(a.name, a.place, known.default | dict(a.values))


def _check(a: Active, known: Mechanism) -> None:
    if a.place not in known.places:
        raise ModelError(f"{a.name} acts at {' or '.join(known.places)}; got {a.place!r}")
    names = {p.name for p in known.parameters}
    if not known.default.keys() | a.values.keys() >= names >= a.values.keys():
        raise ModelError(
            f"{a.name} has the parameters {', '.join(sorted(names))}; got {', '.join(sorted(a.values)) or 'none'}"
        )
    if not np.isfinite(list(a.values.values())).all():
        raise ModelError(f"{a.name} has a parameter that is not finite: {dict(a.values)}")
    for p in known.parameters:
        value = a.values[p.name] if p.default is None else a.values.get(p.name, p.default)
        if not p.above < value < p.below:
            limit = f"above {p.above:g}" if value <= p.above else f"below {p.below:g}"
            raise ModelError(f"{a.name} has {p.name} = {value:g} ({p.meaning}), which must be {limit}")
        if p.spread and not p.low <= value <= p.high:
            raise ModelError(f"{a.name} has {p.name} = {value:g} ({p.meaning}); it is {p.low:g} to {p.high:g}")
        if p.low > 0 and not p.signed and value < 0:
            raise ModelError(
                f"{a.name} has {p.name} = {value:g} {p.unit}, which must not be negative; "
                f"plausible is {p.low:g} to {p.high:g}"
            )
