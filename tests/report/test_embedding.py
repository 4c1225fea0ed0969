"""What stands inside the page."""

import io
import json
import re
from base64 import b64decode

import matplotlib.pyplot as plt
import numpy as np

from ccmodel.report.embedding import as_json, with_figures


def test_figures_stand_in_the_page_and_keep_their_names(tmp_path):
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures/a.svg").write_bytes(b"picture")
    html = '<img alt="a" src="figures/a.svg"> <img src="data:image/png;base64,AAAA"> <a href="figures/a.svg">'
    found = with_figures(html, tmp_path)
    assert '<img alt="a" data-file="figures/a.svg" src="data:image/svg+xml;base64,cGljdHVyZQ==">' in found
    assert '<img src="data:image/png;base64,AAAA"> <a href="figures/a.svg">' in found


def test_a_figure_in_the_page_is_smaller_and_looks_the_same(tmp_path):
    figure, ax = plt.subplots()
    for k in range(7):
        ax.plot(np.sin(np.arange(100) / 9 + k), label=f"line {k}")
    figure.savefig(tmp_path / "a.png", dpi=150)
    plt.close(figure)
    found = re.search('base64,([^"]+)', with_figures('<img src="a.png">', tmp_path))[1]
    inside = b64decode(found)
    assert len(inside) < 0.6 * (tmp_path / "a.png").stat().st_size
    before, after = (plt.imread(file)[..., :3] for file in (tmp_path / "a.png", io.BytesIO(inside)))
    assert np.sqrt(np.mean((before - after) ** 2)) < 0.01


def test_no_text_ends_the_script_that_it_stands_in():
    hostile = {"id": "</script><!--<script>"}
    assert "<" not in as_json(hostile)
    assert json.loads(as_json(hostile)) == hostile
