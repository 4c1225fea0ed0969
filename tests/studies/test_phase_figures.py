"""What the figures of the simulated example say of themselves; the pictures are looked at by people."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

from ccmodel.config import load_config
from ccmodel.studies.phases.study import DRAW, study_of

EXAMPLE = load_config(Path(__file__).parents[2] / "config/config.yaml").phases
STUDY = study_of(EXAMPLE)


@pytest.fixture(params=DRAW)
def figure(request):
    drawn = DRAW[request.param](STUDY)
    yield drawn
    plt.close(drawn)


def test_each_says_that_it_is_simulated_and_names_its_units(figure):
    assert "simulated (no recording)" in figure.get_suptitle()
    for ax in figure.axes:
        for label in (ax.get_xlabel(), ax.get_ylabel()):
            assert not label or label.endswith(")")


def test_the_torque_loop_names_every_phase_and_instant():
    figure = DRAW["torque-loop"](STUDY)
    said = [t.get_text() for t in figure.axes[0].texts]
    assert sorted(said) == sorted(2 * ["I", "II", "III", "IV"] + list("12345678"))
    plt.close(figure)


def test_profiles_are_drawn_curved_as_friction_curves_them():
    figure = DRAW["profiles"](STUDY)
    line = figure.axes[0].lines[0]
    x, tension = line.get_data()
    m = EXAMPLE.friction_coefficient * EXAMPLE.conduit_bend_rad * x / EXAMPLE.conduit_length_m
    assert tension == pytest.approx(tension[0] * np.exp(-m), rel=1e-12)
    plt.close(figure)


def test_profiles_are_those_of_the_instants_of_each_stroke():
    figure = DRAW["profiles"](STUDY)
    columns = [figure.axes[k].get_legend().get_texts() for k in (2, 3)]
    assert [[text.get_text() for text in texts if text.get_text().isdigit()] for texts in columns] == [
        ["1", "2", "3", "4", "5"],
        ["5", "6", "7", "8", "1"],
    ]
    plt.close(figure)


def test_a_motion_without_all_phases_is_drawn_too():
    small = study_of(EXAMPLE.model_copy(update={"amplitude_rad": 0.05, "samples_per_cycle": 80}))
    for draw in DRAW.values():
        figure = draw(small)
        assert all(axes.lines for axes in figure.axes)
        plt.close(figure)
