"""Candidate models: the tested model with mechanisms at some of their places."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product
from math import prod

from ccmodel import mechanisms as registry
from ccmodel.diagnosis import settings
from ccmodel.inference.problem import Free
from ccmodel.mechanisms import Parameter
from ccmodel.mechanisms.learned import Law
from ccmodel.model.active import Active
from ccmodel.model.parameters import Parameters, mechanism_key, mechanism_parameter


@dataclass(frozen=True)
class Hypothesis:
    """Mechanisms that act in addition to the tested model.

    Attributes
    ----------
    acting : tuple of (str, str)
        Mechanism and place of each; empty for the tested model itself.
    baseline : tuple of (str, str)
        Mechanisms of the baseline model; empty where the paper's model is tested.
    is_frozen : bool
        Whether the baseline's parameters keep their values; otherwise they are fitted with the others. A mechanism of
        a frozen baseline among `acting` means that its parameters have changed.
    fixed : tuple of (str, float)
        Values of parameters that the conditions of the recordings set (`Parameter.fixed`), by `mechanism_key`.
    """

    acting: tuple[tuple[str, str], ...] = ()
    baseline: tuple[tuple[str, str], ...] = ()
    is_frozen: bool = False
    fixed: tuple[tuple[str, float], ...] = ()

    def __str__(self) -> str:
        return " + ".join(f"{name} at {place}" for name, place in self.acting) or "the calibrated model"

    def and_also(self, other: "Hypothesis") -> "Hypothesis":
        """The same with another's mechanisms added."""
        fixed = tuple(dict.fromkeys(self.fixed + other.fixed))
        return replace(self, acting=self.acting + other.acting, fixed=fixed)

    def part(self, acting: tuple[tuple[str, str], ...]) -> "Hypothesis":
        """The same with some of its mechanisms alone."""
        of = self.baseline + acting
        kept = tuple(one for one in self.fixed if (mechanism_parameter(one[0]) or ())[:2] in of)
        return replace(self, acting=acting, fixed=kept)

    @property
    def size(self) -> int:
        """Number of mechanisms that act."""
        return len(self.acting)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its mechanisms in alphabetical order, whatever their places."""
        return tuple(sorted(name for name, _ in self.acting))

    @property
    def places(self) -> list[str]:
        """Places of its mechanisms, each once."""
        return list(dict.fromkeys(place for _, place in self.acting))

    def of(self, parameters: Parameters) -> Parameters:
        """Parameters with the mechanisms added, at their values in `parameters` or else at their starting values.

        What is fixed, such as the range of a law that is learned again, has the hypothesis's value.
        """
        known = {(m.name, m.place): m.values for m in parameters.mechanisms}
        every = dict.fromkeys(self.baseline + self.acting)
        acting = tuple(Active(*one, self._values_of(*one, known.get(one))) for one in every)
        return replace(parameters, mechanisms=acting)

    def _values_of(self, name: str, place: str, known: Mapping[str, float] | None) -> dict[str, float]:
        fixed, values = dict(self.fixed), known or registry.get(name).start
        return {p: fixed.get(mechanism_key(name, place, p), value) for p, value in values.items()}

    @property
    def start(self) -> dict[str, float]:
        """Starting values of the mechanisms' unknowns."""
        return {key: parameter.start for key, parameter, _ in self._unknowns()}

    @property
    def neutral(self) -> dict[str, float]:
        """Values of the mechanisms' strengths at which they have no effect."""
        return {key: parameter.neutral for key, parameter, is_strength in self._unknowns() if is_strength}

    def free(self, start: Mapping[str, float]) -> dict[str, Free]:
        """The mechanisms' parameters as unknowns, from `start`."""
        unknowns = self._unknowns()
        return {key: Free.within(start[key], *_bounds(parameter, strength)) for key, parameter, strength in unknowns}

    @property
    def continuation(self) -> list[str]:
        """Unknowns that are fitted by continuation from high values to low ones."""
        return [key for key, parameter, _ in self._unknowns() if parameter.continuation]

    def _unknowns(self) -> Iterator[tuple[str, Parameter, bool]]:
        """Name of each unknown, its parameter, and whether it is a strength of its mechanism."""
        for name, place in self.acting if self.is_frozen else self.baseline + self.acting:
            mechanism = registry.get(name)
            for parameter in (p for p in mechanism.parameters if not p.fixed):
                yield mechanism_key(name, place, parameter.name), parameter, parameter in mechanism.strengths

    def screening_values(self) -> Iterator[dict[str, float]]:
        """Values at which a single mechanism is screened, spread over its plausible range."""
        ((name, place),) = self.acting
        mechanism = registry.get(name)
        grids = [[p.at(share) for share in p.screening_grid or settings.SCREENED_SHAPES] for p in mechanism.shapes]
        for strength in mechanism.strengths:
            others = {p.name: p.neutral for p in mechanism.strengths if p is not strength}
            shares = strength.screening_grid or settings.SCREENED_STRENGTHS
            sizes = [settings.SCREENED_RATIO] if strength.ratio else [strength.at(share) for share in shares]
            for size, *values in product(sizes, *grids):
                shapes = dict(zip((p.name for p in mechanism.shapes), values, strict=True))
                every = others | {strength.name: size} | shapes
                yield {mechanism_key(name, place, p.name): every[p.name] for p in mechanism.parameters}


PAPER = Hypothesis()


def single_mechanisms(
    without: Collection[str] = (), model: Hypothesis = PAPER, recorded: Collection[str] = ()
) -> list[Hypothesis]:
    """Every mechanism of the registry at each of its places, unless it is excluded or fitted in the model already.

    Of those that need a channel, the ones whose channel was recorded.
    """
    names = [name for name in registry.names() if name not in without and set(registry.get(name).needs) <= {*recorded}]
    every = ((name, place) for name in names for place in registry.get(name).places)
    return [Hypothesis((acting,)) for acting in every if model.is_frozen or acting not in model.baseline]


def stated_hypothesis(stated: Collection[str]) -> Hypothesis:
    """A candidate model from texts such as "kink at conduit"."""
    parts = (one.partition(" at ") for one in stated)
    return Hypothesis(tuple((name, place) for name, _, place in parts))


def laws_in(hypothesis: Hypothesis) -> list[Law]:
    """The laws among the mechanisms of a hypothesis."""
    return [registry.laws()[name] for name, _ in hypothesis.acting if name in registry.laws()]


def law_of(hypothesis: Hypothesis) -> Law | None:
    """The first of the laws among the mechanisms of a hypothesis, if there is one."""
    return next(iter(laws_in(hypothesis)), None)


def prior_means(hypothesis: Hypothesis) -> dict[str, float]:
    """Mean of the normal prior of each parameter that has one (`Parameter.prior_sd`), as a coefficient of a law."""
    return {
        mechanism_key(name, place, p.name): p.start
        for name, place in hypothesis.baseline + hypothesis.acting
        for p in registry.get(name).parameters
        if p.prior_sd
    }


def plausible(hypothesis: Hypothesis, values: Mapping[str, float]) -> bool:
    """Whether every strength lies within its plausible range or below it.

    A mechanism with a state is judged by the part of its strength that is still to come when recordings start. Only
    this part shows: a stronger effect that is nearly over looks the same.
    """
    return all(
        _is_plausible(strength, _left(name, place, values) * values[mechanism_key(name, place, strength.name)])
        for name, place in hypothesis.acting
        for strength in registry.get(name).strengths
    )


def _left(name: str, place: str, values: Mapping[str, float]) -> float:
    """Share of a mechanism's strength that is left when recordings start, 1 without states."""
    states = registry.get(name).states
    return prod(1.0 - values.get(mechanism_key(name, place, state.name), state.neutral) for state in states)


def _is_plausible(strength: Parameter, value: float) -> bool:
    low, high = sorted((settings.RANGE_SLACK * strength.low, settings.RANGE_SLACK * strength.high))
    if strength.ratio:
        low = strength.low / settings.RANGE_SLACK
    elif strength.signed:
        low = -high
    else:
        low, high = min(low, 0.0), max(high, 0.0)
    return low <= value <= high


def _bounds(parameter: Parameter, is_strength: bool) -> tuple[float, float]:
    """Bounds of a parameter in a fit."""
    low, high = parameter.low, parameter.high
    if parameter.scale == "linear" and not is_strength:
        # An angle may exceed a revolution; a position may not leave the conduit.
        return (2 * low, 2 * high) if parameter.unit == "rad" else (low, high)
    if low < 0:
        return settings.BEYOND_RANGE * low, 0.5 * abs(low)
    if parameter.ratio:
        return low / settings.BEYOND_RANGE, high * settings.BEYOND_RANGE
    if parameter.signed:
        return -settings.BEYOND_RANGE * high, settings.BEYOND_RANGE * high
    return (0.0 if is_strength else low / settings.BEYOND_RANGE), settings.BEYOND_RANGE * high
