"""Drag in proportion to sliding speed.

Equation: Friction per length is mu T dphi/dx + c v, with v the sliding speed.

Signature: Loops widen with speed and not with tension; at low speed the effect vanishes.

Separated by: three speeds: with Stribeck friction loops narrow with speed.

Source: Olsson, Astrom, Canudas de Wit, Gafvert and Lischinsky, Friction models and friction compensation, European
Journal of Control 4(3), 176-195, 1998, doi:10.1016/S0947-3580(98)70113-X.
"""

from ccmodel.mechanisms.contract import SLIDING_FRICTION, Curve, Mechanism, Parameter

# What the drag adds to Coulomb friction depends on the tension; over the speed it is one constant of its own: at
# 10 mm/s from 0.3 % to as much as Coulomb friction.
_RISE = Parameter("rise", "s/m", 0.3, 100.0, 10.0, "relative rise of friction per sliding speed")
# From a negligible film to half of Coulomb friction: 15 mN to 3 N over a metre of conduit at 3 mm/s.
_DRAG = Parameter("c", "N s/m^2", 5.0, 1000.0, 50.0, "drag per sliding speed and length")

MECHANISM = Mechanism(
    name="viscous-friction",
    text=__doc__,
    tex=r"\left|\frac{\partial T}{\partial x}\right| = \mu\,T\,\frac{d\varphi}{dx} + c\,|v|",
    sentence="the conduits have a viscous drag of {c}",
    places=("conduit",),
    parameters=(_DRAG,),
    mistaken_for=("stribeck", "time-skew"),
    depends_on_time=True,
    settings={"viscous": "c"},
    curves=(
        Curve(SLIDING_FRICTION, "speed", lambda log_speed, values: 1 + values["rise"] * 10**log_speed, (_RISE,)),
        Curve(SLIDING_FRICTION, "speed", lambda speed, values: values["c"] * speed, (_DRAG,), form="drag"),
    ),
)
