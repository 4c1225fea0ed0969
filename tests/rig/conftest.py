import pytest
from made_up_batch import Bench


@pytest.fixture
def bench(tmp_path):
    return Bench(tmp_path)
