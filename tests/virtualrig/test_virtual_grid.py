import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from virtualrig.config import Piece
from virtualrig.grid import make_grid

pieces = st.lists(
    st.builds(
        Piece,
        length_m=st.floats(0.01, 2.0),
        bend_rad=st.one_of(st.just(0.0), st.floats(1e-3, 10.0)),
    ),
    min_size=1,
    max_size=5,
)


@given(pieces)
def test_cells_keep_length_and_bend_within_the_limits(conduit):
    grid = make_grid(conduit, 0.0125, 0.05)
    assert grid.cell_length_m.max() <= 0.0125 * (1 + 1e-9)
    assert grid.cell_bend_rad.max() <= 0.05 * (1 + 1e-9)
    assert grid.cell_length_m.sum() == pytest.approx(sum(p.length_m for p in conduit))
    assert grid.cell_bend_rad.sum() == pytest.approx(sum(p.bend_rad for p in conduit), abs=1e-12)
    assert grid.segment_length_m.sum() == pytest.approx(grid.cell_length_m.sum())


def test_cells_end_where_pieces_end():
    conduit = [Piece(length_m=0.3, bend_rad=0.0), Piece(length_m=0.2, bend_rad=3.0), Piece(length_m=0.7, bend_rad=0.0)]
    grid = make_grid(conduit, 0.0125, 0.05)
    ends = np.cumsum(grid.cell_length_m)
    assert np.abs(ends - 0.3).min() < 1e-12
    assert np.abs(ends - 0.5).min() < 1e-12
    bent = (ends > 0.3 + 1e-9) & (ends < 0.5 + 1e-9)
    assert (grid.cell_bend_rad[bent] > 0).all()
    assert (grid.cell_bend_rad[~bent] == 0).all()


def test_a_whole_ratio_adds_no_cell():
    assert make_grid([Piece(length_m=1.2, bend_rad=0.0)], 0.1, 0.05).cell_length_m.size == 12
