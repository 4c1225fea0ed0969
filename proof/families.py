"""Families of cases: every effect in turn, each on a rig of its own."""

from collections.abc import Iterator
from itertools import cycle, islice, product

from proof.cases import Case, draw
from proof.plan import Plan, read_plan


def family(name: str, seed: int, count: int | None = None, first: int = 0) -> Iterator[Case]:
    """Cases of a family from consecutive seeds.

    Parameters
    ----------
    name : str
        "removed": an effect whose mechanism is excluded from the candidates; "unlisted": one without a mechanism;
        "doubtful": a weak effect in few recordings.
    seed : int
        Of case 0 of the family.
    count : int, optional
        Number of cases; those up to the plan's last one if not given.
    first : int
        Number of the first case.

    Yields
    ------
    Case
        Effects come in the order of the plan, all of them at its first strength before any at the next.
    """
    plan = read_plan()
    of_plan = plan.families[name]
    last = of_plan.cases if count is None else first + count
    members = islice(enumerate(cycle(members_of(name, plan))), first, last)
    for k, (effect, strength) in members:
        yield draw(seed + k, of_plan.kind, effect, strength)


def members_of(name: str, plan: Plan) -> list[tuple[str, float]]:
    """Effects of a family with their strengths."""
    of_plan = plan.families[name]
    effects = plan.unlisted if of_plan.kind == "unlisted" else plan.effects
    return [(effect, strength) for strength, effect in product(of_plan.strengths, effects)]
