"""A kink: a sharp bend that the measured path does not show.

Equation: the bend angle phi(x) jumps by beta at x = s L, in both conduits, since they run side by side. At rest
tension changes there by hold times what friction makes of as much bend elsewhere: by all of it in conduits that had
their kink when the cables were tensioned, by nothing in conduits that were bent afterwards. No rest shows which; how
far the front has to go before it passes does.

Signature: the friction front stalls part-way, and the loss in full slip exceeds mu times the measured bend.

Mistaken for a larger mu, and for a compliant termination. The time at which the front passes tells, and gives s.
"""

from ccmodel.mechanisms.contract import Kink, Mechanism, Parameter


def _modifies_physics(settings, place, values):
    if not 0 < values["s"] < 1:
        raise ValueError(f"a kink's s is a share of the length between 0 and 1; got {values['s']}")
    if values["beta"] < 0:
        raise ValueError(f"a kink's bend is not negative; got beta = {values['beta']} rad")
    if not 0 <= values["hold"] <= 1:
        raise ValueError(f"what a kink holds at rest is a share between 0 and 1; got hold = {values['hold']}")
    settings.kinks.append(Kink(values["s"], values["beta"], values["hold"]))


MECHANISM = Mechanism(
    name="kink",
    places=("conduit",),
    parameters=(
        Parameter("beta", "rad", 0.2, 1.5, 0.6),
        Parameter("s", "1", 0.05, 0.95, 0.5, neutral=0.5, scale="linear"),
        Parameter("hold", "1", 0.0, 1.0, 0.5, neutral=1.0, scale="linear", screening_grid=(0.5,), default=1.0),
    ),
    summary="extra bend at one place of the conduits",
    mistaken_for="mu, termination-compliance",
    separated_by="the front's timing",
    modifies_physics=_modifies_physics,
)
