"""A compliance in series at a cable's end.

Equation: Each cable stretches by compliance times its tension at one end, in series and without friction.

Signature: The apparent stiffness lies below the one measured on the cable. The paper measured 13.88 kN/m and fitted
7.5 to 7.75 kN/m, while none of its equations contains the 0.4 m of free cable and the two terminations.

Separated by: two conduit lengths; partial motion, in which a termination yields before the friction front has
advanced.

Source: Agrawal, Peine and Yao 2010, Section V: measured and fitted stiffness.
"""

import numpy as np

from ccmodel.mechanisms.contract import END_STRETCH, Curve, Mechanism, Parameter

# 4 to 200 % of a cable's own: 1 / 13.88 kN/m is 72 um/N.
_COMPLIANCE = Parameter("compliance", "m/N", 3e-6, 150e-6, 20e-6, "compliance of one end of each cable")

MECHANISM = Mechanism(
    name="termination-compliance",
    text=__doc__,
    tex=r"\Delta u_\mathrm{end} = \mathrm{compliance}\cdot T_\mathrm{end}",
    sentence="the cables' fastening at the {side} yields by {compliance}",
    places=("drive-end", "load-end"),
    parameters=(_COMPLIANCE,),
    mistaken_for=("K",),
    depends_on_time=False,
    settings={"{side}_end_compliance": "compliance"},
    curves=(Curve(END_STRETCH, "tension", lambda tension, c: np.full(tension.shape, c["compliance"]), (_COMPLIANCE,)),),
)
