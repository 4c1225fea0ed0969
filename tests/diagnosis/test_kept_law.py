"""A learned law that is kept is a mechanism: with it a model predicts what the model with the law predicts."""

import importlib.util
from dataclasses import dataclass, replace

import numpy as np
import pytest
from typer.testing import CliRunner

from builders import write_batch
from ccmodel import cli, mechanisms
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.kept_law import check_name, file_of, mechanism_file
from ccmodel.mechanisms import catalogue, laws
from ccmodel.mechanisms.contract import PARAGRAPHS
from ccmodel.model.parameters import mechanism_key
from ccmodel.typed import InputError
from general_runs import run, sine

NAME = "stick-in-seal"
RANGES = {
    "tension": (1.0, 12.0),
    "position-along-conduit": (0.0, 1.0),
    "distance-since-reversal": (1e-4, 1e-2),
    "drive-angle": (-0.7, 0.7),
    "load-angle": (-0.6, 0.6),
}
SCALES = {"end-stretch": 5e-5, "bearing-torque": 3e-3, "load": 3e-3}
KEPT = [law for law in laws().values() if not law.name.endswith("fine")]


@dataclass(frozen=True)
class Fitted:
    """What the file of a law needs of a fitted candidate."""

    hypothesis: Hypothesis
    values: dict[str, float]


def drawn(law):
    """A law with coefficients drawn from their prior: a fitted candidate, its statement and its values."""
    first, last = RANGES.get(law.argument.name, (-1.0, 1.0))
    fixed = {"first": first, "last": last, "scale": SCALES.get(law.slot, 0.1)}
    z = np.random.default_rng(5).standard_normal(len(law.coefficients))
    z[0] = 1.0 + abs(z[0])  # the mean of a compliance, which is none where it is negative
    values = dict(zip(law.coefficients, z.tolist(), strict=True))
    keys = [
        {mechanism_key(law.name, law.place, name): value for name, value in some.items()} for some in (fixed, values)
    ]
    candidate = Fitted(Hypothesis(((law.name, law.place),), fixed=tuple(keys[0].items())), keys[1])
    stated = {
        "name": law.name,
        "slot": law.slot,
        "channel": law.channel,
        "arguments": [law.argument.name],
        "argument_is": law.argument.meaning,
        "argument_unit": law.argument.unit,
        "curve_is": law.curve_is,
        "confidence": 0.93,
        "formula": "a + b x",
        "parameters": [{"name": "a", "value": 0.12, "low": 0.11, "high": 0.13}],
        "nearest_listed": None,
    }
    return candidate, stated, fixed | values


def mechanism_of(text, folder, name=NAME):
    """The mechanism that a file declares."""
    file = folder / file_of(name)
    file.write_text(text, encoding="utf-8")
    spec = importlib.util.spec_from_file_location("kept", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.MECHANISM


@pytest.fixture
def listed(monkeypatch):
    """Put a mechanism into the registry until the test is over."""

    def put(mechanism):
        declared = list(mechanisms._declared())
        monkeypatch.setattr(mechanisms, "_declared", lambda: [*declared, (mechanism, "kept")])
        mechanisms._registry.cache_clear()
        mechanisms._neutral.cache_clear()

    yield put
    monkeypatch.undo()
    mechanisms._registry.cache_clear()
    mechanisms._neutral.cache_clear()


@pytest.mark.parametrize("law", KEPT, ids=lambda law: law.name)
def test_the_mechanism_of_the_file_reproduces_the_law(law, tmp_path, listed):
    candidate, stated, values = drawn(law)
    kept = mechanism_of(mechanism_file(NAME, stated, candidate, "bench"), tmp_path)
    listed(kept)
    theta_in = sine(cycles=1)
    without, learned = run(theta_in), run(theta_in, (law.name, law.place, values))
    assert kept.looks_ahead == law.looks_ahead
    found = run(theta_in, (NAME, law.place, {"strength": 1.0}))
    neutral = run(theta_in, (NAME, law.place, {"strength": 0.0}))
    for channel, reading in learned.read.items():
        np.testing.assert_array_equal(found.read[channel], reading)
        np.testing.assert_array_equal(neutral.read[channel], without.read[channel])
    assert any(np.abs(learned.read[c] - without.read[c]).max() > 1e-6 for c in learned.read)


def test_its_file_is_complete_and_readable(tmp_path, listed):
    law = laws()["learned-sensor-map-theta-out-by-reading"]
    candidate, stated, values = drawn(law)
    text = mechanism_file(NAME, stated, candidate, "bench")
    kept = mechanism_of(text, tmp_path)
    listed(kept)
    assert max(map(len, text.splitlines())) <= 120
    assert set(PARAGRAPHS) <= kept.paragraphs.keys()
    assert "a + b x with a = 0.12 (0.11 to 0.13)" in kept.paragraphs["Equation"]
    assert "bench with a confidence of 0.93" in kept.paragraphs["Source"]
    assert set(kept.mistaken_for) <= {*mechanisms.names(), "mu", "K"}
    assert catalogue.entry(NAME).startswith(NAME)
    (curve,) = kept.curves
    x, y = law.at_knots(values)
    np.testing.assert_allclose(curve.of(x, {"strength": 2.0}), 2 * y)


def test_the_nearest_listed_mechanism_is_its_look_alike(tmp_path):
    candidate, stated, _ = drawn(laws()["learned-sliding-friction-by-tension"])
    stated |= {"nearest_listed": {"name": "constant-drag", "distance": 4.0}}
    assert mechanism_of(mechanism_file(NAME, stated, candidate, "b"), tmp_path).mistaken_for == ("constant-drag",)


@pytest.mark.parametrize("name", ["Stick", "stick_in_seal", "kink", "learned-load-by-speed", "-a", ""])
def test_a_name_that_no_new_mechanism_can_have_is_refused(name):
    with pytest.raises(InputError, match="keep-law"):
        check_name(name)


def test_two_laws_of_one_slot_stand_beside_each_other_where_they_add(listed):
    """Friction by speed and by time are additions to one factor, and two tables have a sum; not so other settings."""
    for law in ("learned-sliding-friction-by-speed", "learned-sliding-friction-by-time"):
        listed(replace(laws()[law].mechanism, name=f"kept-{law}", mistaken_for=("mu",)))
    mechanisms.neutral_settings()
    law = laws()["learned-load-by-load-angle"]
    for name in ("one", "two"):
        listed(replace(law.mechanism, name=name, mistaken_for=("mu",)))
    values = {"first": -1.0, "last": 1.0, "scale": 0.005} | dict.fromkeys(law.coefficients, 0.3)
    both = run(sine(), [(name, "load", values) for name in ("one", "two")])
    twice = run(sine(), (law.name, "load", values | {"scale": 0.01}))
    np.testing.assert_allclose(both.tau_out_Nm, twice.tau_out_Nm, atol=1e-9)
    listed(replace(mechanisms.get("running-in"), name="again", mistaken_for=("mu",)))
    with pytest.raises(ValueError, match="again.* declares settings of another mechanism|running-in declares settings"):
        mechanisms.neutral_settings()


def test_a_diagnosis_without_a_law_says_that_it_keeps_none(tmp_path):
    batch = write_batch(tmp_path / "clean")
    arguments = ["diagnose", str(batch), "--out", str(tmp_path / "out"), "--keep-law", NAME]
    done = CliRunner().invoke(cli.app, arguments)
    assert done.exit_code == 1, done.output
    assert f"--keep-law {NAME}: no law was learned" in done.output
    assert not (tmp_path / "out" / file_of(NAME)).exists()
