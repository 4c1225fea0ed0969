"""What stands inside the page."""

import json

from ccmodel.report.embedding import as_json, with_figures


def test_figures_stand_in_the_page_and_keep_their_names(tmp_path):
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures/a.png").write_bytes(b"picture")
    html = '<img alt="a" src="figures/a.png"> <img src="data:image/png;base64,AAAA"> <a href="figures/a.png">'
    found = with_figures(html, tmp_path)
    assert '<img alt="a" data-file="figures/a.png" src="data:image/png;base64,cGljdHVyZQ==">' in found
    assert '<img src="data:image/png;base64,AAAA"> <a href="figures/a.png">' in found


def test_no_text_ends_the_script_that_it_stands_in():
    hostile = {"id": "</script><!--<script>"}
    assert "<" not in as_json(hostile)
    assert json.loads(as_json(hostile)) == hostile
