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


def ends_of(line):
    """Tension at both ends of a cable, as drawn."""
    return line.get_ydata()[[0, -1]]


def test_each_row_of_profiles_is_its_own_cable_and_the_black_one_lies_halfway():
    """The ends of every profile are the tensions at drive and load at that sample."""
    figure = DRAW["profiles"](STUDY)
    for axes, (at_drive, at_load) in zip(figure.axes, (("T1_N", "T2_N"),) * 2 + (("T3_N", "T4_N"),) * 2, strict=True):
        for line in axes.lines:
            label = line.get_label()
            sample = STUDY.instants[int(label)] if label.isdigit() else STUDY.halfway[int(label.partition("–")[0])]
            ends = [getattr(STUDY.response, channel)[sample] for channel in (at_drive, at_load)]
            assert ends_of(line) == pytest.approx(ends, abs=1e-9), label
    assert sum("–" in line.get_label() for axes in figure.axes for line in axes.lines) == 4
    plt.close(figure)


def test_each_part_of_the_torque_loop_has_the_name_of_its_phase():
    figure = DRAW["torque-loop"](STUDY)
    first, names = STUDY.first_reversal, ("I", "II", "III", "IV")
    for line in figure.axes[0].lines:
        if line.get_label().startswith("phase "):
            last = first + line.get_xdata().size - 1
            assert {f"phase {names[k]}" for k in STUDY.phase[first + 1 : last + 1]} == {line.get_label()}
            assert line.get_xdata() == pytest.approx(1e3 * STUDY.response.tau_in_Nm[first : last + 1])
            first = last
    assert first == STUDY.phase.size - 1
    plt.close(figure)


def test_torques_over_time_are_in_the_unit_of_their_axis():
    figure = DRAW["response"](STUDY)
    assert figure.axes[5].get_ylabel() == "torque (mN·m)"
    assert figure.axes[5].lines[0].get_ydata() == pytest.approx(1e3 * STUDY.response.tau_in_Nm)
    plt.close(figure)
