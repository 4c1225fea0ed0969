"""The load's moment of inertia.

Equation: tau_out = K_e theta + B dtheta/dt + J d2theta/dt2, with B = 2 zeta sqrt(J K_e). Where the load is a measured
torque, B and J act beside it, and no sensor reads what they take.

Signature: The torque's deviation from the spring's grows with the square of the frequency. While the cables hold
still the load rings on them.

Separated by: a frequency sweep: the error of a delay grows with the first power.

Source: Agrawal, Peine and Yao 2010, Section VI: load dynamics.
"""

from math import sqrt

from ccmodel.mechanisms.contract import LOAD, Curve, Mechanism, Parameter, Settings

# A mass that is a few per cent off rings out of phase with the recording. Screening therefore tries this many masses,
# with high damping, under which a resonance is seen from further off; the fit then lowers the damping by continuation.
MASSES = tuple(k / 36 for k in range(1, 36))


def load_damping(settings: Settings, stiffness: float) -> float:
    """Damping of the load (N m s/rad) on a spring of `stiffness` (N m/rad)."""
    return 2 * settings.damping_ratio * sqrt(settings.inertia * stiffness)


_J = Parameter("J", "kg m^2", 1e-5, 1e-2, 1e-4, "moment of inertia", screening_grid=MASSES)

MECHANISM = Mechanism(
    name="load-inertia",
    text=__doc__,
    tex=r"\tau_\mathrm{out} = K_e\,\theta + B\,\dot\theta + J\,\ddot\theta, \qquad B = 2\zeta\sqrt{J K_e}",
    sentence="the load has a moment of inertia of {J}",
    places=("load",),
    parameters=(
        _J,
        Parameter("zeta", "1", 1e-3, 0.3, 0.1, "damping ratio", screening_grid=(0.85,), continuation=True, default=0.0),
    ),
    mistaken_for=("time-skew",),
    depends_on_time=True,
    settings={"inertia": "J", "damping_ratio": "zeta"},
    curves=(Curve(LOAD, "acceleration", lambda x, values: values["J"] * x, (_J,)),),
)
