"""A kink: a sharp bend that the measured path does not show.

Equation: the bend angle phi(x) jumps by beta at x = s L, in both conduits, since they run side by side.

Signature: the friction front stalls part-way, and the loss in full slip exceeds mu times the measured bend.

Mistaken for a larger mu, and for a compliant termination. The time at which the front passes tells, and gives s.
"""

from ccmodel.mechanisms.contract import Mechanism, Parameter


def _enters(settings, place, values):
    if not 0 < values["s"] < 1:
        raise ValueError(f"a kink's s is a share of the length between 0 and 1; got {values['s']}")
    if values["beta"] < 0:
        raise ValueError(f"a kink's bend is not negative; got beta = {values['beta']} rad")
    settings.kinks.append((values["s"], values["beta"]))


MECHANISM = Mechanism(
    name="kink",
    places=("conduit",),
    parameters=(
        Parameter("beta", "rad", 0.2, 1.5, 0.6),
        Parameter("s", "1", 0.05, 0.95, 0.5, neutral=0.5, scale="linear"),
    ),
    summary="extra bend at one place of the conduits",
    mistaken_for="mu, termination-compliance",
    separated_by="the front's timing",
    enters=_enters,
)
