"""Families of cases: every effect in turn, each on a rig of its own."""

from collections.abc import Iterator
from itertools import cycle, islice, product

from proof.cases import Case, draw
from proof.plan import Plan, read_plan


def family(name: str, seed: int, count: int | None = None) -> Iterator[Case]:
    """Cases of a family from consecutive seeds.

    Parameters
    ----------
    name : str
        "removed": an effect whose mechanism is excluded from the candidates; "unlisted": one without a mechanism;
        "doubtful": a weak effect in few recordings.
    seed : int
        Of the first case.
    count : int, optional
        Number of cases; the plan's if not given.

    Yields
    ------
    Case
        Effects come in the order of the plan, all of them at its first strength before any at the next.
    """
    plan = read_plan()
    of_plan = plan.families[name]
    members = islice(cycle(members_of(name, plan)), count or of_plan.cases)
    for k, (effect, strength) in enumerate(members):
        yield draw(seed + k, of_plan.kind, effect, strength)


def members_of(name: str, plan: Plan) -> list[tuple[str, float]]:
    """Effects of a family with their strengths."""
    of_plan = plan.families[name]
    effects = plan.unlisted if of_plan.kind == "unlisted" else plan.effects
    return [(effect, strength) for strength, effect in product(of_plan.strengths, effects)]
