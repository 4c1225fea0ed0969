"""The report of a diagnosis: what it must not leave unsaid."""

import numpy as np
import pytest
from made_pages import content, diagnosis

from ccmodel.figures import subplots
from ccmodel.report.page import write_page
from ccmodel.studies.diagnosis.page import (
    MARKS,
    _caution,
    _map_in_words,
    _mark_visited,
    repeatability_in_words,
    write_not_diagnosed,
)

YELLOW = {"tau_in": {"at rest": 0.9, "after a reversal": 2.4, "under way": 1.0}}
QUIET = {"tau_in": {"at rest": 0.9, "after a reversal": 1.2, "under way": float("nan")}}


def test_agrees_over_yellow_cells_says_why():
    said = _caution(diagnosis("b", "agrees"), YELLOW)
    assert "although τ_in after a reversal (2.4) exceeds the noise floor" in said
    assert "mean square of the whitened residuals is 1.1" in said


@pytest.mark.parametrize(("verdict", "errors"), [("agrees", QUIET), ("explained", YELLOW)])
def test_no_other_map_needs_it(verdict, errors):
    assert _caution(diagnosis("b", verdict), errors) is None


def test_the_map_is_told_to_readers_who_do_not_see_it():
    assert _map_in_words(YELLOW).endswith("τ_in at rest 0.9, after a reversal 2.4, under way 1.0")


def test_the_page_says_what_repeats_show_and_what_was_assumed():
    friction = {"what": "friction from run to run", "value": 0.0123, "unit": "1", "from": "repeats", "recordings": 2}
    zero = {"what": "zero of F_load from run to run", "value": 0.1, "unit": "N", "from": "assumed", "recordings": 0}
    assert repeatability_in_words([friction, zero]) == (
        "Standard deviations that count as noise, estimated: friction from run to run 1.2 % (2 recordings that repeat a"
        " condition); assumed: zero of F_load from run to run 0.1 N."
    )
    assert repeatability_in_words([zero]).endswith("as noise, assumed: zero of F_load from run to run 0.1 N.")


def test_a_batch_that_was_not_diagnosed_has_a_report_with_a_way_back(tmp_path):
    file = tmp_path / "report.html"
    write_not_diagnosed(file, "b", "no <recording> that can be used", "../../index.html")
    text = file.read_text()
    assert "no &lt;recording&gt; that can be used" in text
    assert '<a href="../../index.html">' in text
    write_page(tmp_path / "index.html", content(diagnosis("b", None), reports={"b": text}))
    assert (
        "<h3>b: not diagnosed</h3>\n<p>no &lt;recording&gt; that can be used.</p>"
        in (tmp_path / "index.html").read_text()
    )


def test_what_the_recordings_visited_is_marked_by_equal_shares_within_the_curve():
    _, axes = subplots(1, 1, squeeze=False)
    values = np.concatenate([np.linspace(0.0, 1.0, 9000), np.full(1000, 5.0)])
    _mark_visited(axes[0][0], values, np.array([0.0, 2.0]))
    (marks,) = axes[0][0].lines
    assert marks.get_xdata() == pytest.approx((np.arange(MARKS) + 0.5) / MARKS, abs=1e-3)
