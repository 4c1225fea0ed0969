"""Figures of a session say what they show, in which unit, and whether it was measured."""

import matplotlib
import matplotlib.pyplot as plt
import pandas as pd
import pytest

import ccmodel as cc
from ccmodel.api import figures

matplotlib.use("Agg")


@pytest.fixture(autouse=True)
def _closed():
    yield
    plt.close("all")


def labels(figure):
    return [ax.get_ylabel() for ax in figure.axes], [ax.get_xlabel() for ax in figure.axes if ax.get_xlabel()]


def test_channels_over_time_have_symbols_and_units(batch):
    figure = batch.plot()
    y, x = labels(figure)
    assert len(y) == 6
    assert all("(" in label for label in y)
    assert x == ["time (s)"]
    assert "simulated" in figure.get_suptitle()
    assert [t.get_text() for t in figure.legends[0].get_texts()] == ["t-7N", "t-6N", "t-5N"]


def test_one_channel_can_be_chosen(batch):
    (ax,) = batch.plot("tau_in_Nm").axes
    assert ax.get_ylabel() == r"$\tau_{in}$ (mN·m)"
    drawn = ax.lines[0].get_ydata()
    assert drawn == pytest.approx(1e3 * batch["t-7N"]["tau_in_Nm"])
    with pytest.raises(cc.InputError, match="did you mean 'tau_in_Nm'"):
        batch.plot("tau_in")


def test_a_recording_is_drawn_alone(batch):
    figure = batch["t-7N"].plot("F_drive_N")
    assert labels(figure) == ([r"$F_{drive}$ (N)"], ["time (s)"])
    assert figure.axes[0].lines[0].get_ydata() == pytest.approx(batch["t-7N"]["F_drive_N"])


def test_a_prediction_is_drawn_over_its_recording(fitted, batch):
    prediction = cc.predict(fitted, batch)
    figure = prediction.plot()
    assert len(figure.axes) == 5 * 3
    assert "simulated" in figure.get_suptitle()
    assert [t.get_text() for t in figure.legends[0].get_texts()] == ["recorded", "predicted"]
    (ax,) = prediction.plot("tau_in_Nm", recording="t-6N").axes
    assert ax.get_ylabel() == r"$\tau_{in}$ (mN·m)"
    for line, of in zip(ax.lines, (batch, prediction), strict=True):
        assert line.get_ydata() == pytest.approx(1e3 * of["t-6N"]["tau_in_Nm"])
    with pytest.raises(cc.InputError, match="did you mean 'tau_in_Nm'"):
        prediction.plot("tau_in")


def test_residuals_have_a_panel_for_each_channel_and_recording(fitted):
    figure = fitted.plot_residuals()
    assert len(figure.axes) == 5 * 3
    y, x = labels(figure)
    assert [label for label in y if label] == [f"{tex}\n(noise floors)" for tex in (
        r"$\theta_{out}$", r"$\tau_{in}$", r"$\tau_{out}$", r"$F_{drive}$", r"$F_{load}$")]  # fmt: skip
    assert x == ["time (s)"] * 3
    assert "simulated" in figure.get_suptitle()
    # A right model leaves about a noise floor.
    for ax in figure.axes:
        assert 0.1 < abs(ax.lines[0].get_ydata()).mean() < 2


def test_errors_of_a_diagnosis_are_over_the_noise_floor(found):
    (ax,) = found.plot().axes
    assert ax.get_xlabel() == "root mean square error on held-out recordings (noise floors)"
    assert [t.get_text() for t in ax.get_yticklabels()] == ["θ_out", "τ_in", "τ_out", "F_drive", "F_load"]
    ratios = found.errors["before"] / found.errors["noise"]
    assert [bar.get_width() for bar in ax.patches] == pytest.approx(list(ratios))
    # A number next to the line of the noise floor is not crossed by it.
    assert all(text.get_bbox_patch() is not None and text.get_zorder() > ax.lines[0].get_zorder() for text in ax.texts)


def test_errors_of_the_extended_model_are_called_as_on_the_page(batch):
    table = pd.DataFrame({"before": [3.0], "after": [1.0], "noise": [1.0], "unit": ["rad"]}, index=["theta_out"])
    figure = figures.errors(table, batch, "explained")
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "extended model" in labels and "best model" not in labels


def test_reports_leave_the_backend_of_a_session_alone(found, tmp_path):
    before = matplotlib.get_backend()
    found.save(tmp_path)
    assert matplotlib.get_backend() == before
    assert plt.get_fignums() == []
