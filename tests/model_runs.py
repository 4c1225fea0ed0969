"""The cable and the study that tests run the model alone with."""

import numpy as np

from ccmodel.model.parameters import Parameters
from ccmodel.studies.claims.settings import ModelStudies

CABLE = Parameters(7750.0, 1.2, 0.156, 0.006, 0.006, 0.05)
PULLED = Parameters(
    stiffness_N_per_m=9000.0,
    reference_length_m=1.2,
    friction_coefficient=0.15,
    drive_radius_m=0.006,
    load_radius_m=0.006,
    load_stiffness_Nm_per_rad=0.05,
    pretension_N=7.0,
)
STUDY = ModelStudies(
    pretension_N=7.3,
    amplitude_rad=1.0,
    conduit_length_m=1.2,
    bend_rad=np.pi,
    loop_radius_m=0.0635,
    load_stiffness_Nm_per_rad=[0.02, 0.05],
    sections=[8, 32],
    sections_bend_rad=[np.pi],
    sections_error_percent=1.0,
)
