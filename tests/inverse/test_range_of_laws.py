"""What a prediction says of laws that are asked beyond what they were learned from."""

from dataclasses import replace

import numpy as np
import pytest
from inverse_runs import EVEN, GROWING, K_E, PAIR, PARAMETERS, recording

from ccmodel.mechanisms import laws
from ccmodel.model.active import Active
from ccmodel.model.exact import simulate_pair
from ccmodel.model.load import SpringLoad
from ccmodel.steps.predict import predicted


@pytest.mark.parametrize(("last_rad", "is_said"), [(0.3, True), (0.9, False)])
@pytest.mark.parametrize("name", ["learned-pulley-radius-drive-by-drive-angle", "learned-load-by-load-angle"])
def test_a_law_that_is_asked_beyond_its_range_is_named(name, last_rad, is_said):
    law = laws()[name]
    values = {"first": -last_rad, "last": last_rad, "scale": 1e-3} | dict.fromkeys(law.coefficients, 0.1)
    response = simulate_pair(PAIR, SpringLoad(K_E), GROWING, EVEN)
    model = replace(PARAMETERS, mechanisms=(Active(name, law.place, values),))
    found = predicted([recording(response, GROWING)], model)
    assert len(found.notes) == is_said
    for note in found.notes:
        assert law.argument.meaning in note and "-0.3 to 0.3 rad" in note
        assert f"to {np.max(GROWING):.1f}"[:5] in note or "load" in name
