"""A pair of cables and its motions, shared by the tests of the general solver and of the mechanisms."""

import numpy as np

from ccmodel.geometry import ConduitPath
from ccmodel.mechanisms import laws
from ccmodel.model.general import Active, simulate
from ccmodel.model.general.run import NO_MOTOR
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.transmission import Transmission

R, K_E, T0, MU, K, L = 0.006, 0.05, 7.3, 0.156, 7750.0, 1.2
HALF_LOOP = ConduitPath([L], [np.pi])
TENSIONS = ("T1_N", "T2_N", "T3_N", "T4_N")
OUTPUTS = (*TENSIONS, "theta_out_rad", "tau_in_Nm", "tau_out_Nm")


def transmission(path=HALF_LOOP, mu=MU, k=K):
    return Transmission(path, k * L, mu, R, R)


def sine(amplitude=0.6, cycles=2, samples=500):
    return amplitude * np.sin(2 * np.pi * np.arange(cycles * samples + 1) / samples)


def evenly_added_bend(added_rad):
    """The law that adds bend, of the same bend everywhere: (name, place, values)."""
    law = laws()["learned-sliding-friction-bend-by-position-along-conduit"]
    even = np.linalg.lstsq(law.basis, np.ones(len(law.basis)), rcond=None)[0]
    values = {"first": 0.0, "last": 1.0, "scale": added_rad}
    return law.name, law.place, values | dict(zip(law.coefficients, even.tolist(), strict=True))


def run(
    theta_in,
    mechanisms=(),
    *,
    period_s=1.0,
    path=HALF_LOOP,
    T=T0,
    load=None,
    elements=32,
    samples=500,
    motor=NO_MOTOR,
    **kw,
):
    """A run in which `samples` samples take `period_s`; one mechanism may be given as (name, place, values)."""
    if mechanisms and isinstance(mechanisms[0], str):
        mechanisms = [mechanisms]
    active = [m if isinstance(m, Active) else Active(*m) for m in mechanisms]
    time_s = np.arange(theta_in.size) * period_s / samples
    initial = InitialTension.uniform(path, T) if np.isscalar(T) else T
    response = simulate(
        transmission(path, **kw), load or SpringLoad(K_E), time_s, theta_in, initial, active, elements, motor=motor
    )
    return response.complete()


def rms(a, b):
    return float(np.sqrt(np.mean((a - b) ** 2)))


def last_cycle(values, samples=500):
    return values[-samples:]


def loop_area(response, samples=500):
    """Energy that goes in at the drive in the last cycle and does not come out at the load, J."""
    theta_in = response.read["theta_in_rad"]
    work_in = np.trapezoid(response.tau_in_Nm[-samples - 1 :], theta_in[-samples - 1 :])
    return work_in - np.trapezoid(response.tau_out_Nm[-samples - 1 :], response.theta_out_rad[-samples - 1 :])
