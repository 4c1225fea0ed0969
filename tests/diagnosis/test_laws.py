"""A law that is on no list is found from recordings: its slot, its argument and its curve."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

import builders
from builders import spoil, write_batch
from ccmodel import cli
from ccmodel.channels import T1
from ccmodel.deadline import UNLIMITED
from ccmodel.diagnosis import laws as proposing
from ccmodel.diagnosis.equation_error import INERTIA
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.laws import _missing_mass, _unit_of, proposals, visited
from ccmodel.diagnosis.selection import finer_laws
from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.mechanisms import laws
from ccmodel.mechanisms.law_forms import ADDED_BEND, DRAG
from ccmodel.model.files import read_model_file
from ccmodel.model.general import Active, simulate
from ccmodel.model.parameters import mechanism_key
from made_observations import PARAMETERS, batch, calibrated

MASS, ZETA = mechanism_key(*INERTIA, "J"), mechanism_key(*INERTIA, "zeta")
K_TORQUE = 0.0234
# Enough for a single law, and less than a diagnosis has: sets of listed mechanisms take most runs.
RUNS = "5000"
COGGING_NM, PERIOD_RAD = 2e-3, 0.4


def cogging(table):
    """A motor that pulls to the next of its poles, which no listed mechanism does."""
    theta = 0.6 * np.sin(2 * np.pi * np.maximum(table["time_s"].to_numpy() - 0.5, 0))
    table["drive_current_A"] += COGGING_NM * np.sin(2 * np.pi * theta / PERIOD_RAD) / K_TORQUE
    return table


def test_laws_with_more_knots_are_fitted_once():
    """Those of an angle are among the first already, and may be behind the ones that are refined."""
    by_angle, by_time = "learned-sliding-friction-by-drive-angle", "learned-sensor-map-tau-in-by-time"
    places = {by_angle: "conduit", f"{by_angle}-fine": "conduit", by_time: "drive-sensor"}
    every = [Hypothesis(((name, places[name]),)) for name in (by_angle, by_time, f"{by_angle}-fine")]
    assert [law.name for law in finer_laws(every)] == [f"{by_time}-fine"]
    assert [law.name for law in finer_laws(every[:2])] == [f"{by_angle}-fine", f"{by_time}-fine"]
    assert finer_laws(every[2:]) == []


def test_the_size_of_a_bend_or_drag_is_that_of_all_recordings():
    """The first recording may have a straight conduit."""
    paths = [ConduitPath([1.0], [bend]) for bend in (0.0, 6.0)]
    observations = [
        SimpleNamespace(parameters=None, given=SimpleNamespace(recording=SimpleNamespace(path=p))) for p in paths
    ]
    whitened = [SimpleNamespace(observations=one) for one in observations]
    base = SimpleNamespace(whitened=whitened, model=lambda _: SimpleNamespace(friction_coefficient=0.1))
    motions = [SimpleNamespace(channels={T1: np.array([4.0, 6.0])})] * 2

    def unit(form):
        return _unit_of(SimpleNamespace(channel=None, form=form), base, motions)

    assert unit(ADDED_BEND) == 3.0
    assert unit(DRAG) == pytest.approx(0.1 * 5.0 * 3.0)


def diagnosed(batch, out, *options):
    done = CliRunner().invoke(cli.app, ["diagnose", str(batch), "--out", str(out), *options])
    assert done.exit_code == 0, done.output
    return json.loads((out / "diagnosis.json").read_text())


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    folder = tmp_path_factory.mktemp("raw")
    batch = spoil(write_batch(folder / "cogging", pretensions=(7.0, 6.0, 5.0)), cogging)
    diagnosed(batch, folder / "out", "--run-limit", RUNS, "--keep-law", "cogging-motor")
    return batch, folder / "out"


def test_the_law_is_named_by_its_slot_and_argument(learned):
    said = json.loads((learned[1] / "diagnosis.json").read_text())
    assert said["verdict"] == "learned"
    assert said["mechanisms"] == [], "nothing that is listed acts"
    (law,) = said["laws"]
    assert (law["slot"], law["place"], law["arguments"]) == ("bearing-torque", "drive-pulley", ["drive-angle"])
    assert law["confidence"] > 0.8
    assert "The torque at the drive pulley depends on the drive pulley's angle" in said["headline"]


def test_its_curve_is_the_true_one_up_to_what_a_calibration_absorbs(learned):
    (law,) = json.loads((learned[1] / "diagnosis.json").read_text())["laws"]
    x, y, low, high = np.array(law["curve"]).T
    true = COGGING_NM * np.sin(2 * np.pi * x / PERIOD_RAD)
    # What it adds on average, and in proportion to the angle, belongs to the calibration.
    absorbed = np.polyval(np.polyfit(x, y - true, 1), x)
    assert np.abs(y - true - absorbed).max() < 0.25 * COGGING_NM
    assert np.mean((true + absorbed >= low) & (true + absorbed <= high)) >= 0.9
    assert law["formula"] == "a + b cos(2 pi x/p) + c sin(2 pi x/p)"
    assert law["parameters"][-1]["value"] == pytest.approx(PERIOD_RAD, rel=0.03)


def test_no_listed_law_is_near(learned):
    """An eccentric pulley repeats once a turn, the motor's poles sixteen times."""
    (law,) = json.loads((learned[1] / "diagnosis.json").read_text())["laws"]
    assert law["nearest_listed"]["name"] == "pulley-eccentricity"
    assert law["nearest_listed"]["distance"] > 2 * law["nearest_listed"]["limit"]


def test_the_error_falls_and_the_model_file_has_the_law(learned, tmp_path):
    batch, out = learned
    error = json.loads((out / "diagnosis.json").read_text())["fit"]["error"]["tau_in"]
    assert error["before"] > 4 * error["after"]
    model = read_model_file(out / "model.json")
    assert [m.name for m in model.parameters.mechanisms] == ["learned-bearing-torque-by-drive-angle-fine"]
    done = CliRunner().invoke(
        cli.app, ["predict", str(batch), "--model", str(out / "model.json"), "--out", str(tmp_path / "p")]
    )
    assert done.exit_code == 0, done.output
    assert pd.read_csv(next((tmp_path / "p").glob("*.csv")))["tau_in_Nm"].abs().max() > 0


def test_the_law_is_kept_as_a_mechanism(learned):
    text = (learned[1] / "cogging_motor.py").read_text()
    assert 'name="cogging-motor"' in text
    assert 'laws()["learned-bearing-torque-by-drive-angle-fine"]' in text
    compile(text, "cogging_motor.py", "exec")


def test_the_page_shows_the_curve(learned):
    page = (learned[1] / "report.html").read_text()
    assert "a law learned from the recordings" in page
    assert "The learned law: added to" in page


@pytest.mark.long
def test_a_mechanism_that_is_taken_off_the_list_is_recognised_in_the_curve(tmp_path):
    def gain(table):
        table["drive_current_A"] *= 1.1
        return table

    batch = spoil(write_batch(tmp_path / "gain", pretensions=(7.0, 6.0, 5.0)), gain)
    said = diagnosed(batch, tmp_path / "out", "--run-limit", RUNS, "--without", "torque-scale")
    (law,) = said["laws"]
    assert (law["slot"], law["channel"], law["arguments"]) == ("sensor-map", "tau_in_Nm", ["reading"])
    assert law["nearest_listed"]["name"] == "torque-scale"
    assert law["nearest_listed"]["distance"] < law["nearest_listed"]["limit"]
    assert "this is the law of torque-scale" in said["headline"]


@pytest.mark.long
def test_friction_by_tension_is_learned_inside_the_solver(tmp_path, monkeypatch):
    power = Active("load-dependent-friction", "conduit", {"n": -0.3})

    def pair(transmission, load, theta_in, initial):
        return simulate(transmission, load, np.arange(theta_in.size) / 250, theta_in, initial, [power])

    monkeypatch.setattr(builders, "simulate_pair", pair)
    batch = spoil(write_batch(tmp_path / "power", pretensions=(9.0, 6.0, 3.5, 2.0)))
    (law,) = diagnosed(batch, tmp_path / "out", "--without", power.name)["laws"]
    assert (law["slot"], law["place"], law["arguments"]) == ("sliding-friction", "conduit", ["tension"])
    assert (law["formula"], law["nearest_listed"]["name"]) == ("a x^n", power.name)
    assert law["parameters"][-1]["value"] == pytest.approx(-0.3, abs=0.02)


@pytest.mark.long
def test_a_listed_mechanism_is_named_beside_a_law(tmp_path):
    def both(table):
        table["load_current_A"] *= 1.08
        return cogging(table)

    said = diagnosed(spoil(write_batch(tmp_path / "both", pretensions=(7.0, 6.0, 5.0)), both), tmp_path / "out")
    assert said["verdict"] == "learned"
    assert [law["name"] for law in said["laws"]] == ["learned-bearing-torque-by-drive-angle-fine"]
    (gain,) = said["mechanisms"]
    assert (gain["name"], gain["place"]) == ("torque-scale", "load-sensor")
    assert gain["parameters"][0]["value"] == pytest.approx(0.08, abs=0.012)
    assert "Listed mechanisms that act as well: the load's torque sensor reads" in said["headline"]


@pytest.mark.long
def test_a_second_law_is_learned_beside_the_first(tmp_path):
    def both(table):
        theta_out = (table["load_encoder_counts"] + 40) * 2 * np.pi / 2000
        table["load_load_cell_V"] += 0.1 * 0.5 * np.sin(2 * np.pi * theta_out / 0.5)
        return cogging(table)

    said = diagnosed(spoil(write_batch(tmp_path / "two", pretensions=(7.0, 6.0, 5.0)), both), tmp_path / "out")
    assert {(law["slot"], *law["arguments"]) for law in said["laws"]} == {
        ("bearing-torque", "drive-angle"),
        ("sensor-map", "load-angle"),
    }
    assert "The torque at the drive pulley depends" in said["headline"]
    assert "The error of F_load depends" in said["headline"]


@pytest.mark.parametrize("place", [0.15, 0.85])
def test_a_drag_is_proposed_where_it_acts(place):
    """A drag cannot be negative, so that about none only half of each direction of its law acts."""
    law = laws()["learned-sliding-friction-drag-by-position-along-conduit"]
    x = np.linspace(0.0, 1.0, len(law.basis))
    wanted = np.exp(-(((x - place) / 0.2) ** 2))
    z = np.linalg.lstsq(law.basis, wanted, rcond=None)[0]
    values = {"first": 0.0, "last": 1.0, "scale": 1.0} | dict(zip(law.coefficients, z.tolist(), strict=True))
    truth = replace(PARAMETERS, mechanisms=(Active(law.name, law.place, values),))
    base = calibrated(batch(truth=truth))
    (proposal,) = proposals(base, [law], UNLIMITED)
    assert set(visited(base, law)) == {0.0, 1.0}
    scale = dict(proposal.hypothesis.fixed)[mechanism_key(law.name, law.place, "scale")]
    assert scale * law.basis @ list(proposal.values.values()) == pytest.approx(wanted, abs=0.35)


def test_a_mass_is_proposed_about_the_one_that_a_regression_shows():
    """About no mass, the first order says nothing of a load that rings."""
    law, J = laws()["learned-load-by-acceleration"], 2e-4
    truth = replace(PARAMETERS, mechanisms=(Active("load-inertia", "load", {"J": J, "zeta": 0.05}),))
    base = calibrated(batch(truth=truth))
    (about_none,), *found = (
        proposals(base, [law], UNLIMITED, known=k) for k in ({}, {MASS: 0.9 * J}, {MASS: 1.08 * J})
    )
    for (proposal,) in found:
        assert proposal.evidence > about_none.evidence + 100
        fixed = {name.rsplit("/", 1)[1]: value for name, value in proposal.hypothesis.fixed}
        x, torque = law.at_knots(fixed | {"z1": next(iter(proposal.values.values()))})
        assert torque[-1] / x[-1] == pytest.approx(J, rel=0.1)


def test_a_mass_that_the_model_cannot_be_run_with_leaves_the_law_about_none(monkeypatch):
    real, law = proposing._proposed, laws()["learned-load-by-acceleration"]

    def proposed(base, law, motions, nothing, about):
        if about:
            raise ModelError("no balance")
        return real(base, law, motions, nothing, about)

    monkeypatch.setattr(proposing, "_proposed", proposed)
    said = []
    base = calibrated(batch())
    found = proposals(base, [law], UNLIMITED, lambda text, done=None: said.append(text), known={MASS: 2e-4})
    assert [one.hypothesis.acting[0][0] for one in found] == [law.name]
    assert all("no balance" in text for text in said)
    assert len(said) == len(proposing.MASSES_TRIED)


def test_a_mass_that_the_model_has_already_is_not_proposed_again():
    law, J = laws()["learned-load-by-acceleration"], 2e-4
    with_mass = replace(PARAMETERS, mechanisms=(Active("load-inertia", "load", {"J": J, "zeta": 0.05}),))
    base = calibrated(batch(truth=with_mass))
    has_it = replace(base, hypothesis=Hypothesis((INERTIA,)), values=base.values | {ZETA: 0.05, MASS: J})
    assert _missing_mass(base, {MASS: J}) == J
    assert _missing_mass(has_it, {MASS: 1.02 * J}) == 0.0
    assert _missing_mass(has_it, {MASS: 2 * J}) == pytest.approx(J)
    assert law.mechanism.parameter("z1").low == 0.0, "no mass is negative"


def test_a_law_of_a_quantity_that_does_not_vary_is_left_out_with_a_message():
    law = laws()["learned-sliding-friction-by-time"]
    constant = replace(law, argument=replace(law.argument, of=lambda motion: np.ones_like(motion.time_s)))
    said = []
    found = proposals(calibrated(batch()), [constant, law], UNLIMITED, lambda text, done=None: said.append(text))
    assert len(found) == 1
    assert said == [f"{law.name} at conduit: not proposed (its argument does not vary)"]
