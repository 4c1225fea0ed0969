"""The page's section on fits: what a reader must not miss."""

from dataclasses import asdict
from math import inf
from pathlib import Path

import pandas as pd
import pytest
from made_pages import diagnosis

from ccmodel.errors import COLUMNS
from ccmodel.inference.fit import FitResult
from ccmodel.inference.intervals import Interval, Scatter, Undetermined
from ccmodel.report.page import write_page
from ccmodel.report.page.formats import about, interval
from ccmodel.report.page.writing import Content, messages_of
from ccmodel.rig.findings import Finding

APART = "friction_coefficient and extra_bend_rad are not determined apart; known is mu + 0.05 x e = 0.16"
FIT = FitResult(
    succeeded=True,
    message="converged",
    values={"stiffness_N_per_m": 7750.0, "extra_bend_rad": 0.1},
    intervals={"stiffness_N_per_m": Interval.about(7750.0, 10.0), "extra_bend_rad": Interval(-inf, inf, inf)},
    profiles={"stiffness_N_per_m": Interval(7731.0, 7772.0, 10.0)},
    own={"b/r0": {"friction_scale": 1.01}},
    own_intervals={"b/r0": {"friction_scale": Interval.about(1.01, 0.002), "friction": Interval.about(0.1576, 3e-4)}},
    scatter={"friction_scale": Scatter(0.01, 0.0123, 0.2)},
    resampled={"stiffness_N_per_m": 11.5, "extra_bend_rad": 0.0},
    undetermined=[Undetermined(["friction_coefficient", "extra_bend_rad"], APART)],
    warnings=["2 of 3 starts ended elsewhere"],
    recordings=["b/r0"],
)


@pytest.fixture
def page(tmp_path):
    def write(result: FitResult) -> str:
        errors = pd.DataFrame([], columns=list(COLUMNS)).astype(COLUMNS)
        fits = [{"fit": "fitted", **result.as_dict()}]
        write_page(tmp_path / "index.html", Content(batches=[], errors=errors, fits=fits))
        return (tmp_path / "index.html").read_text()

    return write


def test_shows_values_with_intervals_profile_and_resampling(page):
    text = page(FIT)
    assert "<td>7750</td><td>7734 to 7766</td>" in text
    assert "7731 to 7772" in text
    assert "<td>10</td><td>11.5</td>" in text


def test_says_what_is_not_determined_and_what_is_known_instead(page):
    text = page(FIT)
    assert APART in text
    assert "<td>0.1</td><td>not determined</td>" in text


def test_shows_each_recordings_own_friction_and_the_scatter(page):
    text = page(FIT)
    assert "1.0100 ± 0.0033" in text
    assert "0.15760 ± 0.00049" in text
    assert "0.0123 (0.01)" in text
    assert "2 of 3 starts ended elsewhere" in text


def test_a_failed_fit_has_its_reason_and_no_table(page):
    text = page(FitResult(False, "stalled: no step lessens the error", recordings=["b/r0"]))
    assert "stalled: no step lessens the error" in text
    assert "90 % interval" not in text


def test_numbers_have_as_many_digits_as_are_known():
    said = {"low": 7741.234567, "high": 7758.9, "sd": 5.0}
    assert interval(said) == "7741.2 to 7758.9"
    assert about({"low": -2e-5, "high": 4e-5, "sd": 2e-5}) == "0.000010 ± 0.000030"
    assert about({"low": None, "high": None, "sd": None}) == "not determined"


def messages(diagnoses, findings=()):
    of = [{"findings": [asdict(f) for f in findings if f.batch == batch]} for batch in ("a", "b")]
    return messages_of(Path("none"), [], of, [], [], diagnoses)


def test_a_batch_that_could_not_be_diagnosed_is_left_out():
    assert messages([diagnosis("a", None)])["left_out"] == ["a: not diagnosed: no recording that can be used"]


@pytest.mark.parametrize(("verdict", "kind"), [("agrees", "warnings"), ("inputs-inconsistent", "inconsistent")])
def test_contradictions_of_a_rig_that_was_diagnosed_are_trusted(verdict, kind):
    contradiction = Finding("a", "a/one.csv", None, None, "inconsistent", "the signs differ")
    found = messages([diagnosis("rig", verdict, batches=["a", "b"])], [contradiction])
    assert found[kind] == [str(contradiction)]
    assert sum(map(len, found.values())) == 1
