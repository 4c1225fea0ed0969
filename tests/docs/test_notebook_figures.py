"""Figures of the Python interface in a notebook: each is shown once, and later figures of pyplot are shown too."""

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

BATCH = Path(__file__).parents[2] / "data" / "raw" / "half-loop"


@pytest.fixture(scope="module")
def cells():
    sources = [
        f"import ccmodel as cc; batch = cc.load({str(BATCH)!r})",
        "batch.plot('theta_in_rad')",
        "import matplotlib.pyplot as plt; lines = plt.plot([1, 2])",
    ]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source) for source in sources])
    NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    return notebook.cells


@pytest.mark.parametrize("k", [1, 2])
def test_a_cell_shows_its_figure_once(cells, k):
    assert ["image/png" in output.get("data", {}) for output in cells[k].outputs] == [True]
