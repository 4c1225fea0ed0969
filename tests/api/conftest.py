"""A batch with known truth, and what the interface makes of it."""

import pytest

import ccmodel as cc
from builders import spoil, write_batch

TRUTH = {"stiffness_N_per_m": 7750.0, "friction_coefficient": 0.156, "load_stiffness_Nm_per_rad": 0.05}


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    return spoil(write_batch(tmp_path_factory.mktemp("raw") / "known", pretensions=(7.0, 6.0, 5.0)))


@pytest.fixture(scope="session")
def batch(folder):
    return cc.load(folder)


@pytest.fixture(scope="session")
def fitted(batch):
    return cc.fit(batch)


@pytest.fixture(scope="session")
def found(batch):
    return cc.diagnose(batch)


@pytest.fixture(scope="session")
def truth():
    return TRUTH
