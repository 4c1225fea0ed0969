"""What could be missing: nothing, one mechanism at one of its places, or two of them."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ccmodel import mechanisms as registry
from ccmodel.inference.problem import Free
from ccmodel.mechanisms import Parameter
from ccmodel.model.general.run import Active
from ccmodel.model.parameters import Parameters, mechanism_key

# How far beyond its plausible range a fit may take a number: far enough to see that it wants to leave it.
BEYOND = 3.0
# Where in its range, on a logarithmic scale, the strength of a mechanism is tried out.
STRENGTHS = (0.25, 0.6)
SHAPES = (0.2, 0.5, 0.8)
UNLIKE = 1.15  # A ratio that is tried out.


@dataclass(frozen=True)
class Hypothesis:
    """Mechanisms that act besides the paper's physics.

    Attributes
    ----------
    acting : tuple of (str, str)
        Mechanism and place of each; empty for the model that is in question.
    baseline : tuple of (str, str)
        The same of what that model has besides the paper's physics; their numbers are fitted with the others.
    is_frozen : bool
        Whether they are not, but stay as they are. One of them in `acting` means that its numbers have changed.
    """

    acting: tuple[tuple[str, str], ...] = ()
    baseline: tuple[tuple[str, str], ...] = ()
    is_frozen: bool = False

    def __str__(self) -> str:
        return " + ".join(f"{name} at {place}" for name, place in self.acting) or "the calibrated model"

    def and_also(self, other: "Hypothesis") -> "Hypothesis":
        """The same with what acts in another."""
        return replace(self, acting=self.acting + other.acting)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its mechanisms in their order, wherever they act."""
        return tuple(sorted(name for name, _ in self.acting))

    @property
    def model_form_error(self) -> float:
        """Share of what it does to recordings that the simple forms of its mechanisms may miss."""
        return max((registry.get(name).model_form_error for name, _ in self.acting), default=0.0)

    def of(self, parameters: Parameters) -> Parameters:
        """Parameters with the mechanisms in them: at the values that they have there, or else at where they start."""
        known = {(m.name, m.place): m.values for m in parameters.mechanisms}
        every = dict.fromkeys(self.baseline + self.acting)
        acting = tuple(Active(*one, known.get(one) or registry.get(one[0]).start) for one in every)
        return replace(parameters, mechanisms=acting)

    @property
    def start(self) -> dict[str, float]:
        """The mechanisms' starting values, by the names of the unknowns."""
        return {key: parameter.start for key, parameter, _ in self._unknowns()}

    def free(self, start: Mapping[str, float]) -> dict[str, Free]:
        """The mechanisms' numbers as unknowns, from `start`."""
        found = {}
        for key, parameter, is_strength in self._unknowns():
            low, high = _reach(parameter, is_strength)
            found[key] = Free(float(np.clip(start[key], low, high)), low, high)
        return found

    @property
    def continuation(self) -> list[str]:
        """Unknowns whose fit begins high and is then repeated from lower and lower."""
        return [key for key, parameter, _ in self._unknowns() if parameter.continuation]

    def _unknowns(self) -> Iterator[tuple[str, Parameter, bool]]:
        """Name of each of the mechanisms' numbers, what is known of it, and whether it is a mechanism's strength."""
        for name, place in self.acting if self.is_frozen else self.baseline + self.acting:
            mechanism = registry.get(name)
            for parameter in mechanism.parameters:
                yield mechanism_key(name, place, parameter.name), parameter, parameter in mechanism.strengths

    def probes(self) -> Iterator[dict[str, float]]:
        """Values at which a single mechanism is tried out, all over its plausible range."""
        ((name, place),) = self.acting
        mechanism = registry.get(name)
        grids = [[p.at(share) for share in p.screening_grid or SHAPES] for p in mechanism.shapes]
        for strength in mechanism.strengths:
            others = {p.name: p.neutral for p in mechanism.strengths if p is not strength}
            sizes = (
                [UNLIKE] if strength.ratio else [strength.at(share) for share in strength.screening_grid or STRENGTHS]
            )
            for size, *values in product(sizes, *grids):
                shapes = dict(zip((p.name for p in mechanism.shapes), values, strict=True))
                said = others | {strength.name: size} | shapes
                yield {mechanism_key(name, place, p.name): said[p.name] for p in mechanism.parameters}


PAPER = Hypothesis()


def singles(without: Collection[str] = (), model: Hypothesis = PAPER) -> list[Hypothesis]:
    """Every mechanism at each of its places that is asked for unnamed, may be known, and that no model fits already."""
    names = [name for name in registry.names() if name not in without and not registry.get(name).by_name_only]
    every = ((name, place) for name in names for place in registry.get(name).places)
    return [Hypothesis((acting,)) for acting in every if model.is_frozen or acting not in model.baseline]


def plausible(hypothesis: Hypothesis, values: Mapping[str, float], slack: float = 1.5) -> bool:
    """Whether no mechanism is stronger than its range has it by more than a factor, or the other way round.

    Weaker ones are still there.
    """
    for name, place in hypothesis.acting:
        for strength in registry.get(name).strengths:
            value = values[mechanism_key(name, place, strength.name)]
            low, high = sorted((slack * strength.low, slack * strength.high))
            if strength.ratio:  # which may as well be the other way round
                low = strength.low / slack
            elif strength.signed:
                low = -high
            else:
                low, high = min(low, 0.0), max(high, 0.0)
            if not low <= value <= high:
                return False
    return True


def _reach(parameter: Parameter, strength: bool) -> tuple[float, float]:
    low, high = parameter.low, parameter.high
    if parameter.scale == "linear" and not strength:
        # An angle may go round; a place may not leave the conduit.
        return (2 * low, 2 * high) if parameter.unit == "rad" else (low, high)
    if low < 0:
        return BEYOND * low, 0.5 * abs(low)
    if parameter.ratio:
        return low / BEYOND, high * BEYOND
    if parameter.signed:
        return -BEYOND * high, BEYOND * high
    return (0.0 if strength else low / BEYOND), BEYOND * high
