"""The benchmarks' own versions of the paper's algorithm are the paper's algorithm."""

import sys
from pathlib import Path

import numpy as np
import pytest

from ccmodel.model import paper

pytestmark = pytest.mark.long

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def benchmarks(monkeypatch):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    yield
    for file in BENCHMARKS.glob("*.py"):
        sys.modules.pop(file.stem, None)


@pytest.mark.parametrize("loops", [0.5, 1.5, 3])
@pytest.mark.parametrize("version", ["paper_numpy", "paper_best"])
def test_other_versions_agree_with_the_model(benchmarks, version, loops):
    import cases

    case = cases.paper(loops)
    theta_in = cases.sine(2, samples_a_cycle=200)
    given = (case.transmission, case.load, theta_in, case.initial, 16)
    wanted = paper.simulate_pair(*given)
    got = __import__(version).simulate_pair(*given)
    for name, values in zip(("T1_N", "T2_N", "T3_N", "T4_N", "theta_out_rad"), got, strict=True):
        difference = np.abs(values - getattr(wanted, name))
        scale = np.abs(getattr(wanted, name)).max()
        # At the sample in which moving parts meet, the discretisation may balance at two load angles.
        assert np.quantile(difference, 0.99) < 1e-9 * scale
        assert difference.max() < 1e-2 * scale
