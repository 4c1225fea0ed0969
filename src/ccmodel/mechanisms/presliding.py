"""Friction builds up over sliding lengths of a range.

Equation: Generalised Maxwell slip: friction is mu N times the mean of four elements xi, -1 to 1, each a spring that
slips at its limit: d xi_k/ds = 1/z_k along the sliding s while |xi_k| < 1. The lengths z_k are evenly spaced in the
logarithm; z0 is their middle, and spread is the longest over the shortest. It depends on the sliding distance and not
on the speed.

Signature: Corners at reversals, sharp in the paper's model, are rounded over a few z0 of sliding.

Separated by: reversals of growing amplitude: with presliding small ones lose no work until the shortest element slips;
with a compliant termination the cable next to it slides, and loses work, from the smallest on.

Source: Iwan, A distributed-element model for hysteresis and its steady-state dynamic response, Journal of Applied
Mechanics 33(4), 893-900, 1966, doi:10.1115/1.3625199.
"""

from ccmodel.mechanisms.contract import Mechanism, Parameter

# Elements of a contact. Four describe eight whose lengths differ by a factor of 3 or 15 to 0.4 and 3 % of friction
# (root mean square along nested reversals); one does to 9 and 19 %.
ELEMENTS = 4
# Longest over shortest length unless a model states it.
SPREAD = 4.0


def element_lengths(z0: float, spread: float) -> tuple[float, ...]:
    """Length of each element (m), the shortest first."""
    return tuple(float(z0 * spread ** (k / (ELEMENTS - 1) - 0.5)) for k in range(ELEMENTS))


MECHANISM = Mechanism(
    name="presliding",
    text=__doc__,
    tex=(
        r"\frac{d\xi_k}{ds} = \frac{1}{z_k} \ \text{while}\ |\xi_k| < 1, \qquad F_\mathrm{friction} = \mu N\,"
        r"\frac{1}{4}\sum_k \xi_k, \qquad z_k = z_0\,\mathrm{spread}^{\,(k-1)/3-1/2}"
    ),
    sentence="friction builds up over {z0} of sliding",
    places=("conduit",),
    parameters=(
        Parameter("z0", "m", 5e-6, 200e-6, 50e-6, "middle sliding length over which friction builds up"),
        Parameter(
            "spread",
            "1",
            1.0,
            30.0,
            SPREAD,
            "longest over shortest of these lengths",
            neutral=SPREAD,
            screening_grid=(0.4,),
            default=SPREAD,
        ),
    ),
    mistaken_for=("termination-compliance",),
    depends_on_time=False,
    # It misses 0.03 % of the effect on rigs with eight elements (`make form-errors`). Of a single bristle of Dahl's law,
    # whose nested loops creep, it misses 8 % of the friction, root mean square along nested reversals.
    model_form_error=0.02,
    settings={"bristle_m": "z0", "bristle_spread": "spread"},
)
