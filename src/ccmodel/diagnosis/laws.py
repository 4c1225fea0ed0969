"""Learning a law that no list holds: which slot, which argument, and the curve.

Every law (`ccmodel.mechanisms.learned`) extends a fitted model by a few coefficients with a normal prior. Their
sensitivities about no effect, from one run each, give its evidence to first order, under each of a few a priori sizes
of its values. A mass is linearised about the one that the load's own equation shows: about none, the load does not
ring. The leading laws are then fitted as any other candidate, and compete with these.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.channels import CHANNELS, TAU_OUT, TENSIONS, THETA_IN
from ccmodel.deadline import Deadline
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.equation_error import INERTIA
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.normal_equations import NormalEquations
from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.inference.pool import each
from ccmodel.mechanisms import Sensing, laws
from ccmodel.mechanisms.law_forms import ADDED_BEND, CONSTANT_DRAG, DELAY, DRAG, ELEMENTS_IN_BEARING, IN_BEARING
from ccmodel.mechanisms.learned import Law
from ccmodel.model.general.run import settings_of
from ccmodel.model.parameters import mechanism_key
from ccmodel.model.run import simulate
from ccmodel.progress import Progress, silent

# Share of a mass over which its derivative is taken, and masses about which it is linearised, over the one that a
# regression shows: a load that rings gets out of step within a few per cent.
STEP_OF_MASS, MASSES_TRIED = 0.01, (0.9, 1.0, 1.1)


@dataclass(frozen=True)
class Proposal:
    """A law beside a fitted model, to first order.

    Attributes
    ----------
    hypothesis : Hypothesis
        The law alone, with its range and its a priori size.
    evidence : float
        Logarithm of its evidence, over that of the model that it extends.
    values : dict of str to float
        Coefficients that are most probable to first order.
    """

    hypothesis: Hypothesis
    evidence: float
    values: dict[str, float]


def proposals(
    base: CandidateFit,
    every: Sequence[Law],
    deadline: Deadline,
    progress: Progress = silent,
    known: Mapping[str, float] = MappingProxyType({}),
) -> list[Proposal]:
    """Each law beside a fitted model with the a priori size that suits it best, the highest evidence first.

    `known` are values of unknowns that a regression shows (`ccmodel.diagnosis.equation_error`).

    A law that the model cannot be run with, or whose argument does not vary, is left out, and a message says so.
    """
    nothing = NormalEquations.of(base).log_evidence
    mass = _missing_mass(base, known)
    motions = each(base.whitened, lambda i, w: _motion(base, i))
    channels = {THETA_IN}.union(*(w.observations.channels for w in base.whitened))
    found = []
    for law in every:
        if deadline.has_passed:
            break
        if law.channel is not None and law.channel not in channels:
            continue
        masses = [share * mass for share in MASSES_TRIED] if law.form.in_proportion and mass > 0.0 else []
        tried: list[Proposal] = []
        for about in (0.0, *masses):
            try:
                tried += _proposed(base, law, motions, nothing, about)
            except (ModelError, ValueError) as error:
                progress(f"{law.name} at {law.place}: not proposed ({error})")
        if tried:
            found.append(max(tried, key=lambda p: p.evidence))
    return sorted(found, key=lambda p: -p.evidence)


def visited(candidate: CandidateFit, law: Law) -> NDArray:
    """Values of a law's argument at all samples that are judged, as a fitted model simulates the recordings."""
    return _visited(candidate, law, each(candidate.whitened, lambda i, w: _motion(candidate, i)))


def _visited(base: CandidateFit, law: Law, motions: Sequence[Sensing]) -> NDArray:
    pairs = zip(base.whitened, motions, strict=True)
    return np.concatenate([law.argument.of(m)[..., w.observations.judged].ravel() for w, m in pairs])


def _missing_mass(base: CandidateFit, known: Mapping[str, float]) -> float:
    """What a model lacks of the inertia that a regression shows, kg m^2; 0 if that is no plausible inertia."""
    acting = settings_of(base.model(base.whitened[0].observations.parameters).mechanisms)
    missing = known.get(mechanism_key(*INERTIA, "J"), 0.0) - acting.inertia - sum(acting.load_masses)
    return missing if missing >= registry.get(INERTIA[0]).parameter("J").low else 0.0


def _motion(base: CandidateFit, i: int) -> Sensing:
    """What the arguments of laws are read from, as the fitted model simulates a recording."""
    o = base.whitened[i].observations
    simulated = simulate(o.given, base.model(o.parameters, o.session))
    channels = {c: simulated[c] for c in CHANNELS if c in simulated} | {THETA_IN: o.given.theta_in}
    return Sensing(o.given.recording.time_s, channels, o.parameters.drive_radius_m, o.parameters.load_radius_m)


def _proposed(
    base: CandidateFit, law: Law, motions: Sequence[Sensing], nothing: float, about: float
) -> Iterator[Proposal]:
    """A law with each a priori size; it is linearised where its values are `about` times its argument."""
    first, last = law.range_of(_visited(base, law, motions))
    if not last > first:
        raise ValueError("its argument does not vary")
    unit = _unit_of(law, base, motions)

    def hypothesis(scale: float) -> Hypothesis:
        fixed = {"first": first, "last": last, "scale": scale}
        of_law = tuple((mechanism_key(law.name, law.place, name), value) for name, value in fixed.items())
        return Hypothesis(((law.name, law.place),), fixed=of_law)

    tried = hypothesis(settings.LAW_STEP * unit)
    coefficient = about * last / (settings.LAW_STEP * unit * law.basis[-1, 0]) if about else 0.0
    start = dict.fromkeys(tried.start, float(coefficient))
    linear = _linearised(base, tried, law, start)
    equations, is_new = NormalEquations.of(linear), np.array([name not in base.values for name in linear.values])
    for share in settings.LAW_SCALES:
        one, larger = hypothesis(share * unit), share / settings.LAW_STEP
        scaled = equations.scaled(np.where(is_new, larger, 1.0))
        x = dict(zip(linear.values, scaled.most_probable.tolist(), strict=True))
        values = {name: start[name] / larger + x[name] for name in one.start}
        if law.form.in_proportion:
            values = {name: max(value, 0.0) for name, value in values.items()}
        yield Proposal(one, scaled.log_evidence - nothing, values)


def _unit_of(law: Law, base: CandidateFit, motions: Sequence[Sensing]) -> float:
    """Unit of the a priori sizes of a law's values.

    It is 1 for a factor, the peak to peak of a channel for what is added to it, that of tau_out for the torque of the
    load pulley's bearing, the mean bend of the conduits for an added bend, mean Coulomb friction per length of conduit
    for a drag, `LAW_CABLES` times the compliance of a cable for that of an end, and `LAW_DELAY_S` for a delay.
    """
    channel = law.channel or (TAU_OUT if law.form in (IN_BEARING, ELEMENTS_IN_BEARING) else None)
    if channel is not None:
        return float(np.ptp(np.concatenate([m.channels[channel] for m in motions])))
    if law.form.is_factor:
        return 1.0
    if law.form is DELAY:
        return settings.LAW_DELAY_S
    if law.form is ADDED_BEND:
        return float(np.mean([path.bend_rad for path in _paths(base)]))
    if law.form in (DRAG, CONSTANT_DRAG):
        model = base.model(base.whitened[0].observations.parameters)
        bend_per_m = np.mean([path.bend_rad / path.length_m for path in _paths(base)])
        tension_N = np.mean([m.channels[c].clip(0.0).mean() for m in motions for c in TENSIONS if c in m.channels])
        return float(model.friction_coefficient * tension_N * bend_per_m)
    return settings.LAW_CABLES / base.model(base.whitened[0].observations.parameters).stiffness_N_per_m


def _paths(base: CandidateFit) -> list[ConduitPath]:
    return [w.observations.given.recording.path for w in base.whitened]


def _linearised(base: CandidateFit, tried: Hypothesis, law: Law, start: Mapping[str, float]) -> CandidateFit:
    """A fitted model with a law whose coefficients have a start: its residuals there, and derivatives by the law.

    The derivatives by the model's own unknowns stay those of the model without the law.
    """
    hypothesis, about = base.hypothesis.and_also(tried), base.values | dict(start)
    names = [mechanism_key(law.name, law.place, name) for name in law.coefficients]
    has_effect = any(start.values())
    # What is impossible has no effect: the difference of a curve and its opposite shows most of what the curve does.
    one_sided = law.form.has_impossible_opposites

    def of(i: int) -> tuple[NDArray, NDArray]:
        w = base.whitened[i]
        w = w.with_parameters(hypothesis.of(w.observations.parameters))
        if one_sided and not has_effect:
            columns = [w.errors(about | {n: 1.0}) - w.errors(about | {n: -1.0}) for n in names]
            return base.residuals[i], np.column_stack(columns)
        here = w.errors(about)
        step = {n: STEP_OF_MASS * start[n] if has_effect else 1.0 for n in names}
        columns = [(w.errors(about | {n: start[n] + step[n]}) - here) / step[n] for n in names]
        return here if has_effect else base.residuals[i], np.column_stack(columns)

    found = each(base.whitened, lambda i, w: of(i))
    rows = [len(e) for e in base.residuals]
    residuals = [e[:n] for n, (e, _) in zip(rows, found, strict=True)]
    jacobian = [np.column_stack([J, D[:n]]) for n, J, (_, D) in zip(rows, base.jacobian, found, strict=True)]
    return replace(base, hypothesis=hypothesis, values=about, residuals=residuals, jacobian=jacobian)


def unknowns_of(candidate: CandidateFit, law: Law) -> list[int]:
    """Position of each coefficient of a law among the unknowns of a fitted candidate."""
    unknowns = list(candidate.values)
    return [unknowns.index(mechanism_key(law.name, law.place, name)) for name in law.coefficients]


def values_of(candidate: CandidateFit, law: Law) -> dict[str, float]:
    """The range, the scale and the coefficients of a law of a fitted candidate."""
    every = dict(candidate.hypothesis.fixed) | candidate.values
    keys = {p.name: mechanism_key(law.name, law.place, p.name) for p in law.mechanism.parameters}
    return {name: every[key] for name, key in keys.items()}


def first_laws() -> list[Law]:
    """The laws that are tried first: every one with few knots, and those of an angle, which may repeat, with many."""
    return [law for law in laws().values() if law.is_first or law.argument.unit == "rad"]
