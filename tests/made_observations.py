"""Whitened observations of the paper's model with noise, without logs."""

from dataclasses import replace

import numpy as np

from builders import recording
from ccmodel.diagnosis.candidate import fit
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.whitening import whiten
from ccmodel.inference.observations import Observations
from ccmodel.inference.problem import Free
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import ModelInput, simulate

PARAMETERS = Parameters(9000.0, 1.2, 0.15, 0.006, 0.006, 0.05)
NOISE = {"tau_in_Nm": 1e-4, "tau_out_Nm": 1e-4, "F_drive_N": 0.05, "F_load_N": 0.05, "theta_out_rad": 1e-3}
ACCURACY = {"tau_in_Nm": 1e-4, "tau_out_Nm": 1e-4, "F_drive_N": 0.1, "F_load_N": 0.1}


def whitened(amplitude=0.6, frequency=1.0, pretension_N=7.0, seed=0, spoil=lambda simulated: {}, truth=PARAMETERS):
    """One recording of the model with `truth`; `spoil` returns errors to be added, by channel."""
    random = np.random.default_rng(seed)
    drive = recording(
        id=f"r{seed}",
        pretension_N=pretension_N,
        theta_in_rad=lambda t: amplitude * np.sin(2 * np.pi * frequency * np.clip(t - 0.3, 0, None)),
    )
    simulated = simulate(ModelInput.of(drive), truth)
    added = spoil(simulated)
    channels = {c: v + added.get(c, 0.0) for c, v in simulated.channels.items()}
    channels |= {c: channels[c] + sd * random.standard_normal(channels[c].size) for c, sd in NOISE.items()}
    measured = replace(
        simulated,
        channels=channels,
        origin="virtual-rig",
        derived_from=dict.fromkeys(channels, "made by hand"),
        accuracy=ACCURACY,
        rest_s=0.3,
    )
    return whiten(Observations.of(measured, PARAMETERS), PARAMETERS)


def batch(spoil=lambda simulated: {}, truth=PARAMETERS):
    """Four recordings of different motions and pretensions."""
    conditions = ((0.6, 1.0, 7.0), (0.4, 0.7, 7.0), (0.6, 1.0, 5.0), (0.5, 1.3, 6.0))
    return [whitened(*condition, seed=k, spoil=spoil, truth=truth) for k, condition in enumerate(conditions)]


def calibrated(recordings):
    """The paper's model, fitted to recordings."""
    free = {
        "stiffness_N_per_m": Free(PARAMETERS.stiffness_N_per_m, 1e2, 1e7),
        "friction_coefficient": Free(PARAMETERS.friction_coefficient, 0.005, 1.5),
        "load_stiffness_Nm_per_rad": Free(PARAMETERS.load_stiffness_Nm_per_rad, 1e-4, 10.0),
    }
    return fit(recordings, Hypothesis(), free, {name: one.start for name, one in free.items()})
