"""A compliance in series at a cable's end.

Equation: At one end each cable yields by u, in series and without friction, under the tension T_end =
(u - u_b (1 - exp(-u / u_b))) / compliance with u_b = bedding compliance. A knot beds in like this: up to a tension of
about bedding it is softer. Without bedding, u = compliance T_end.

Signature: The apparent stiffness lies below the one measured on the cable. The paper measured 13.88 kN/m and fitted
7.5 to 7.75 kN/m, while none of its equations contains the 0.4 m of free cable and the two terminations. With bedding,
the transmission is soft at low tension.

Separated by: two conduit lengths; partial motion, in which a termination yields before the friction front has
advanced. Settling strands depend on the tension all along the cable, a fastening that beds in on the one at its end.

Source: Agrawal, Peine and Yao 2010, Section V: measured and fitted stiffness. The course of the bedding is that of
`strand-settling`.
"""

from ccmodel.mechanisms.contract import END_STRETCH, Curve, Mechanism, Parameter
from ccmodel.mechanisms.strand_settling import over_settled

# 4 to 200 % of a cable's own: 1 / 13.88 kN/m is 72 um/N.
_COMPLIANCE = Parameter("compliance", "m/N", 3e-6, 150e-6, 20e-6, "compliance of one end of each cable")
# A fastening whose tension never falls to the bedding does not determine it.
_BEDDING = Parameter(
    "bedding",
    "N",
    0.0,
    8.0,
    0.0,
    "tension scale of the bedding of a knot",
    scale="linear",
    screening_grid=(0.0, 0.25),
    default=0.0,
    optional=True,
    prior_sd=3.0,
)

MECHANISM = Mechanism(
    name="termination-compliance",
    text=__doc__,
    tex=(
        r"T_\mathrm{end} = \frac{u - u_b\,\bigl(1 - e^{-u/u_b}\bigr)}{\mathrm{compliance}}, \qquad "
        r"u_b = \mathrm{bedding}\cdot\mathrm{compliance}"
    ),
    sentence="the cables' fastening at the {side} yields by {compliance}[bedding:, and by more below about {bedding}]",
    places=("drive-end", "load-end"),
    parameters=(_COMPLIANCE, _BEDDING),
    mistaken_for=("K", "strand-settling"),
    depends_on_time=False,
    settings={"{side}_end_compliance": "compliance", "{side}_end_bedding_N": "bedding"},
    curves=(
        Curve(
            END_STRETCH,
            "tension",
            lambda tension, values: values["compliance"] * over_settled(tension, values["bedding"]),
            (_COMPLIANCE, _BEDDING),
        ),
    ),
)
