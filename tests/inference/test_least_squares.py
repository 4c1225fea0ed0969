"""The search's own bookkeeping of derivatives."""

from types import SimpleNamespace

import numpy as np

from ccmodel.inference.least_squares import _Reduced


def test_derivatives_are_computed_where_they_were_carried_along_or_belong_to_another_point():
    asked = []
    reduced = object.__new__(_Reduced)
    reduced.problem = SimpleNamespace(blocks=lambda x, difference: asked.append(x.tolist()) or ["computed"])
    reduced.how = SimpleNamespace(difference=None)
    for is_computed, at in ((True, 1.0), (False, 1.0), (True, 2.0)):
        reduced.point, reduced.blocks, reduced.is_computed = np.array([1.0]), ["stored"], is_computed
        reduced.blocks_at(np.array([at]))
    assert asked == [[1.0], [2.0]]
