"""The load's spring stiffens with its angle.

Equation: tau_out = K_e theta + K3 theta^3, on top of the load's own law. Where the load is a measured torque, K3 acts
beside it, and no sensor reads what it takes.

Signature: tau_out against theta_out is curved.

Separated by: torque near zero angle: flat with backlash, straight with a cubic spring.

Source: Kovacic and Brennan (editors), The Duffing Equation: Nonlinear Oscillators and their Behaviour, Wiley, 2011,
doi:10.1002/9780470977859.
"""

from ccmodel.mechanisms.contract import LOAD, Curve, Mechanism, Parameter

_K3 = Parameter("K3", "N m/rad^3", 1e-3, 1.0, 0.03, "cubic stiffness", signed=True)

MECHANISM = Mechanism(
    name="load-stiffening",
    text=__doc__,
    tex=r"\tau_\mathrm{out} = K_e\,\theta + K_3\,\theta^3",
    sentence="the load's spring [stiffens|softens] with its angle by {K3}",
    places=("load",),
    parameters=(_K3,),
    mistaken_for=("backlash",),
    depends_on_time=False,
    settings={"cubic_stiffness": "K3"},
    curves=(Curve(LOAD, "load-angle", lambda theta, values: values["K3"] * theta**3, (_K3,)),),
)
