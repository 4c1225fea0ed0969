from dataclasses import replace

import numpy as np
import pytest

from builders import recording
from ccmodel.model.run import ModelInput


def test_the_drive_motion_comes_with_its_uncertainty():
    step = np.pi / 1000
    counted = replace(
        recording(theta_in_rad=lambda t: np.floor(np.sin(2 * np.pi * t) / step) * step), encoder_step_rad=step
    )
    whole, some = ModelInput.of(counted), ModelInput.of(counted, step_s=0.02)
    assert some.drive.theta_rad == pytest.approx(whole.drive.theta_rad[::2], abs=0)
    assert (some.theta_in == some.drive.theta_rad).all()
    assert some.drive.sigma_rad.shape == some.recording.time_s.shape
    assert some.drive.deviations_rad.shape[1:] == some.recording.time_s.shape


def test_a_drive_that_was_not_counted_is_taken_as_it_is():
    given = ModelInput.of(recording())
    assert given.drive is None
    assert (given.theta_in == given.recording["theta_in_rad"]).all()
