"""The general solver agrees with explicit dynamics for a few effects of `benchmarks/against_dynamics.py`."""

import sys

import pytest
from virtual_runs import ROOT

sys.path.insert(0, str(ROOT / "benchmarks"))

import against_dynamics as benchmark

FEW = {("none", "7.3 N"), ("stribeck", "a 20 %, vs 2 mm/s"), ("conduit-compliance", "70 um/N"), ("backlash", "2 deg")}


@pytest.mark.long
@pytest.mark.parametrize("case", [c for c in benchmark.cases() if (c.name, c.text) in FEW], ids=lambda c: c.name)
def test_solver_agrees_with_the_rig(case):
    rig = benchmark.rig_tensions(case, level=0, cell_m=0.05, rate_Hz=500.0)
    error = benchmark.difference_percent(benchmark.solver_tensions(case, rate_Hz=500.0), rig).max()
    assert error < 1.0
    if case.mechanisms:
        without = benchmark.solver_tensions(benchmark.Case("none", ""), rate_Hz=500.0)
        assert error < benchmark.difference_percent(without, rig).max() / 2
