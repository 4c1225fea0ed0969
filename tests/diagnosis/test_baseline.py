"""A baseline with its mechanisms: what it keeps when it is tested, or frozen, on other recordings."""

from dataclasses import replace

import numpy as np
import pytest

from ccmodel import mechanisms as registry
from ccmodel.diagnosis import calibration as stage
from ccmodel.failure import ModelError
from ccmodel.model.active import Active
from ccmodel.model.run import simulate
from made_observations import PARAMETERS, batch

LAWS = {
    "learned-sensor-map-tau-out-by-reading": (-0.08, 0.08, 0.01),
    "learned-sliding-friction-by-tension": (1.0, 12.0, 0.1),
}


@pytest.fixture(scope="module")
def observations():
    return [w.observations for w in batch()]


def with_law(name):
    """A model with a learned law over the range that its recordings had."""
    law = registry.laws()[name]
    values = dict(zip(("first", "last", "scale"), LAWS[name], strict=True)) | dict.fromkeys(law.coefficients, 1.5)
    return replace(PARAMETERS, mechanisms=(Active(name, law.place, values),))


@pytest.mark.parametrize("freeze", [False, True])
@pytest.mark.parametrize("name", LAWS)
def test_a_learned_law_of_the_baseline_keeps_its_range(observations, name, freeze):
    baseline = with_law(name)
    model = stage.tested_model(observations, PARAMETERS, baseline, freeze).model
    given = observations[0].given
    for channel, readings in simulate(given, baseline).channels.items():
        np.testing.assert_allclose(simulate(given, model)[channel], readings, rtol=1e-9, atol=1e-12)


def test_a_frozen_baseline_keeps_what_these_recordings_would_not_free(observations):
    """With load cells no extra bend, radius or spring beside the load is an unknown of the calibration."""
    own = {"extra_bend_rad": 0.5, "load_radius_m": 0.0066, "spring_beside_load_Nm_per_rad": 0.01}
    tested = stage.tested_model(observations, PARAMETERS, replace(PARAMETERS, **own), freeze=True)
    assert not own.keys() & tested.free.keys()
    assert {name: getattr(tested.model, name) for name in own} == own


def test_a_drift_of_another_session_is_not_replayed(observations):
    drift = Active("friction-drift", "conduit", {"change": 0.2})
    baseline = replace(PARAMETERS, mechanisms=(drift,), session_start_s=0.0, session_end_s=3600.0)
    assert stage.tested_model(observations, PARAMETERS, baseline, freeze=True).model.mechanisms == ()
    # Fitted again, it is an unknown.
    assert stage.tested_model(observations, PARAMETERS, baseline, freeze=False).model.mechanisms == (drift,)


def test_a_baseline_that_lacks_a_value_is_refused(observations):
    baseline = replace(PARAMETERS, mechanisms=(Active("kink", "conduit", {"s": 0.5}),))
    with pytest.raises(ModelError, match="kink has the parameters .*; got s"):
        stage.tested_model(observations, PARAMETERS, baseline, freeze=False)
