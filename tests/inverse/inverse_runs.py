"""A pair of cables with a known load, and its drive side, shared by the tests of the inverse."""

import numpy as np

from ccmodel.geometry import ConduitPath
from ccmodel.inverse import exact, general
from ccmodel.inverse.estimate import WANDERS_RAD
from ccmodel.inverse.update import BY_MISFIT, Considered, Drive, Prior
from ccmodel.model.active import active_of
from ccmodel.model.general.run import settings_of
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad, TorqueLoad
from ccmodel.model.parameters import Parameters
from ccmodel.model.transmission import Transmission
from ccmodel.recording import Recording

R, K_E, T0, MU, K, L = 0.006, 0.05, 7.3, 0.156, 7750.0, 1.2
PATH = ConduitPath([L], [np.pi])
PAIR = Transmission(PATH, K * L, MU, R, R)
EVEN = InitialTension.uniform(PATH, T0)
PARAMETERS = Parameters(K, L, MU, R, R, K_E)
WANDER = (2 * K * R * R) ** 2 * WANDERS_RAD
RATE_HZ = 500
# A sine that grows, so that the load goes where it has not been, and its times.
TIME_S = np.arange(3 * RATE_HZ + 1) / RATE_HZ
GROWING = np.linspace(0.3, 0.7, TIME_S.size) * np.sin(2 * np.pi * TIME_S)


def drive_side(theta, torque, noise_Nm=0.0):
    nothing = np.zeros(theta.size)
    return Drive(theta, torque, nothing, np.full(theta.size, noise_Nm**2))


def prior(has_law, friction=0.0):
    return Prior(Considered(friction, 0.0), 0.03 if has_law else 0.0, 0.0 if has_law else WANDER)


def estimate_exactly(response, theta, stiffness, transmission=PAIR, initial=EVEN, has_law=None):
    """The exact solver's run on noise-free torque; a spring of zero stiffness is no law."""
    has_law = stiffness > 0 if has_law is None else has_law
    return exact.run(transmission, stiffness, initial, drive_side(theta, response.tau_in_Nm), prior(has_law))


def estimate_generally(response, theta, stiffness, mechanisms=()):
    load = SpringLoad(stiffness) if stiffness else TorqueLoad(np.zeros(1))
    given = drive_side(theta, response.tau_in_Nm)
    settings = settings_of(active_of(mechanisms))
    return general.run(PAIR, load, settings, EVEN, TIME_S, given, prior(False))


def errors(run, response):
    """Largest errors of load angle and load torque over peak to peak, where the drive sees the load and elsewhere."""
    visible = run.trace[BY_MISFIT] > 0
    true = np.array([response.theta_out_rad, response.tau_out_Nm])
    share = np.abs(run.out - true) / np.ptp(true, axis=1)[:, None]
    return share[:, visible].max(axis=1), share[:, ~visible].max(axis=1)


def recording(response, theta, torque=None, **options):
    """The run as a recording of sensors without steps, noise and zeros."""
    channels = {
        "theta_in_rad": theta,
        "tau_in_Nm": response.tau_in_Nm if torque is None else torque,
        "theta_out_rad": response.theta_out_rad,
        "tau_out_Nm": response.tau_out_Nm,
    }
    return Recording("b", "r", "virtual-rig", TIME_S, channels, dict.fromkeys(channels, "made"), T0, PATH, **options)
