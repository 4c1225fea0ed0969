"""The page's sections on fits and errors: what a reader must not miss, and its numbers by hand."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from math import inf
from pathlib import Path

import pandas as pd
import pytest
from made_pages import diagnosis

from ccmodel.channels import TABLE_ONE
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
    def write(result: FitResult, errors: Sequence[dict] = ()) -> str:
        errors = pd.DataFrame(errors, columns=list(COLUMNS)).astype(COLUMNS)
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


def error_row(recording: str, channel: str, rmse: float, parameters: str = "fitted") -> dict:
    """A row of errors of a recording with a peak to peak of 4, a maximum of 2.5 and a root mean square of 2."""
    return dict.fromkeys(COLUMNS, 0.0) | {
        "batch": "b", "recording": recording, "origin": "rig", "parameters": parameters, "channel": channel,
        "unit": "N", "rmse": rmse, "peak_to_peak": 4.0, "maximum": 2.5, "rms": 2.0, "nrmse_percent": 100 * rmse / 4.0,
    }  # fmt: skip


def test_beside_table_one_are_the_errors_of_the_fitted_recordings_over_three_norms(page):
    fitted_to = replace(FIT, recordings=["b/r0", "b/r1"])
    rows = [error_row(r, c, e) for r, e in (("r0", 0.1), ("r1", 0.3), ("other", 5.0)) for c in TABLE_ONE]
    text = page(fitted_to, [*rows, *(error_row("r0", c, 7.0, "estimated") for c in TABLE_ONE)])
    # The mean of 0.1 and 0.3 over 4, 2.5 and 2.
    for norm, percent in (("peak to peak", "5.0"), ("maximum", "8.0"), ("rms", "10.0")):
        assert f'<th scope="row" class="t">{norm}</th>' + f"<td>{percent}</td>" * 7 in text


def test_errors_by_batch_are_means_and_the_headline_has_the_median(page):
    """Errors of 10, 22 and 60 % in three recordings of one channel, and of 25, 35 and 40 % of another."""
    errors = {"tau_in_Nm": (0.4, 0.88, 2.4), "F_load_N": (1.0, 1.4, 1.6)}
    text = page(FIT, [error_row(f"r{k}", channel, e) for channel, of in errors.items() for k, e in enumerate(of)])
    assert "the median error of the model in a recording is 30 % of peak to peak" in text
    assert "recordings of a batch is 33 %, in F_load of batch b" in text
    assert "<td>3</td>\n<td>30.67</td><td>33.33</td>" in text


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


def test_a_fit_that_failed_is_left_out():
    fits = [{"fit": name, "succeeded": name == "good", "message": "stalled"} for name in ("good", "bad")]
    assert messages_of(Path("none"), [], [], fits, [], [])["left_out"] == ["fit bad: stalled"]


def test_a_batch_that_could_not_be_diagnosed_is_left_out():
    assert messages([diagnosis("a", None)])["left_out"] == ["a: not diagnosed: no recording that can be used"]


@pytest.mark.parametrize(("verdict", "kind"), [("agrees", "warnings"), ("inputs-inconsistent", "inconsistent")])
def test_contradictions_of_a_rig_that_was_diagnosed_are_trusted(verdict, kind):
    contradiction = Finding("a", "a/one.csv", None, None, "inconsistent", "the signs differ")
    found = messages([diagnosis("rig", verdict, batches=["a", "b"])], [contradiction])
    assert found[kind] == [str(contradiction)]
    assert sum(map(len, found.values())) == 1
