"""The effects: every mechanism at each of its places over its range, and errors of the set-up."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ccmodel import mechanisms as registry
from ccmodel.diagnosis.hypothesis import single_mechanisms
from ccmodel.mechanisms import Parameter
from ccmodel.studies.table_one.settings import Grid

# Errors of the set-up: a property of the rig differs from the value that the model has.
SET_UP = ("pretension", "load-stiffness")
SET_UP_PLACE = "set-up"
DIFFERENCE = "difference"


@dataclass(frozen=True)
class Effect:
    """An effect with the values of its parameters.

    Attributes
    ----------
    name, place : str
        A mechanism and one of its places, or one of `SET_UP`.
    values : mapping of str to float
        By parameter.
    plausible : bool
        Whether the strength lies in the mechanism's range.
    """

    name: str
    place: str
    values: Mapping[str, float]
    plausible: bool

    @property
    def is_set_up(self) -> bool:
        """Whether it is an error of the set-up."""
        return self.place == SET_UP_PLACE


def all_effects(grid: Grid) -> list[list[Effect]]:
    """A list for every mechanism at each place and every error of the set-up, over all strengths and shapes."""
    found = [_of_mechanism(*hypothesis.acting[0], grid) for hypothesis in single_mechanisms()]
    differences = grid.set_up_differences
    found += [[Effect(n, SET_UP_PLACE, {DIFFERENCE: d}, True) for d in differences] for n in SET_UP if differences]
    return found


def scaled(effect: Effect, factor: float) -> Effect:
    """The same effect with its strength, the distance from the neutral value, times a factor."""
    if effect.is_set_up:
        return replace(effect, values={DIFFERENCE: factor * effect.values[DIFFERENCE]})
    p = _strength_of(effect)
    value = p.neutral + factor * (effect.values[p.name] - p.neutral)
    return replace(effect, values={**effect.values, p.name: value}, plausible=_is_plausible(p, value))


def finer(effect: Effect, grid: Grid) -> list[Effect]:
    """Strengths between an effect's neighbours on the grid, evenly spaced in their logarithm.

    At an end of the grid they reach as far outwards as inwards, by the same factor. Without a neighbour there are none.
    """
    if (factors := _factors_to_neighbours(effect, grid)) is None:
        return []
    return [scaled(effect, float(f)) for f in np.geomspace(*factors, grid.finer + 2)[1:-1]]


def _factors_to_neighbours(effect: Effect, grid: Grid) -> tuple[float, float] | None:
    """Next weaker and next stronger strength on the grid, on the effect's side of neutral, over its own strength."""
    if effect.is_set_up:
        own, tried = effect.values[DIFFERENCE], grid.set_up_differences
    else:
        p = _strength_of(effect)
        own, tried = effect.values[p.name] - p.neutral, [v - p.neutral for v in _strengths(p, grid)]
    sizes = np.unique([abs(d) for d in tried if d * own > 0])
    if sizes.size < 2:
        return None
    steps = sizes[1:] / sizes[:-1]
    at = int(np.argmin(np.abs(sizes - abs(own))))
    return 1 / float(steps[max(at - 1, 0)]), float(steps[min(at, steps.size - 1)])


def _of_mechanism(name: str, place: str, grid: Grid) -> list[Effect]:
    mechanism = registry.get(name)
    shapes = [[p.at(s) for s in grid.shapes] if p.default is None else [p.default] for p in mechanism.shapes]
    names = [p.name for p in mechanism.shapes]
    return [
        Effect(
            name, place, mechanism.neutral | {p.name: v} | dict(zip(names, of_shapes, strict=True)), _is_plausible(p, v)
        )
        for p in mechanism.strengths
        for v in _strengths(p, grid)
        for of_shapes in product(*shapes)
    ]


def _strength_of(effect: Effect) -> Parameter:
    return next(p for p in registry.get(effect.name).strengths if effect.values[p.name] != p.neutral)


def _strengths(parameter: Parameter, grid: Grid) -> list[float]:
    """Values of a strength, evenly spaced in the logarithm of its distance from neutral, on each side that it has."""
    if parameter.ratio:
        sizes = np.geomspace(grid.smallest_difference, parameter.high - 1, grid.strengths)
        return [*(1 - sizes[::-1]).tolist(), *(1 + sizes).tolist()]
    low, high = sorted((abs(parameter.low), abs(parameter.high)))
    sizes = np.geomspace(low / grid.beyond, high * grid.beyond, grid.strengths)
    if parameter.signed:
        return [*(-sizes[::-1]).tolist(), *sizes.tolist()]
    return (np.sign(parameter.low) * sizes).tolist()


def _is_plausible(parameter: Parameter, value: float) -> bool:
    low, high = sorted((parameter.low, parameter.high))
    size = abs(value) if parameter.signed else value
    return bool(low * (1 - 1e-9 * np.sign(low)) <= size <= high * (1 + 1e-9 * np.sign(high)))


def depends_on_time(effects: Sequence[Effect]) -> bool:
    """Whether one of the effects depends on time; all others depend on the order of the samples only."""
    return any(not e.is_set_up and registry.get(e.name).depends_on_time for e in effects)
