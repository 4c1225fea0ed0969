"""What holds for every mechanism: its contract, no trace at its neutral value, its entry in the documentation."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from ccmodel import mechanisms
from ccmodel.cli import app
from ccmodel.failure import ModelError
from ccmodel.mechanisms import catalogue
from ccmodel.mechanisms.contract import PARAGRAPHS
from ccmodel.model.active import active_of
from ccmodel.model.general import Active
from general_runs import OUTPUTS, rms, run, sine

READ = ("theta_out_rad", "tau_in_Nm", "tau_out_Nm", "F_drive_N", "F_load_N")
DOCS = Path(__file__).parents[2] / "docs"
EVERYWHERE = [(name, place) for name in mechanisms.names() for place in mechanisms.get(name).places]
# Within a recording a drift does nothing (`tests/model/test_session.py`).
DRIFTS = [name for name in mechanisms.names() if mechanisms.get(name).drift]
# Nor does what needs a channel that a run has only on request (`test_drive_train.py`).
INERT = DRIFTS + [name for name in mechanisms.names() if mechanisms.get(name).needs]
# Where the equation excludes the neutral value: a parameter, a value near its neutral one, and the largest root mean
# square difference of a channel from the paper's model there, as a share of peak to peak. A kink of no bend still puts
# a node at its place, which is another grid.
NEARLY_NEUTRAL = {
    "kink": ("beta", 1e-6, 1e-6),
    "presliding": ("z0", 1e-10, 1e-6),
    "strand-settling": ("T_scale", 1e-2, 1e-8),
    "termination-compliance": ("compliance", 1e-12, 1e-7),
}
DOI = re.compile(r"doi:10\.\d{4,}/\S+")


@pytest.fixture(scope="module")
def base():
    return run(sine())


def deviation(response, base):
    """Largest root mean square difference of a channel, as a share of its peak to peak."""
    return max(rms(response.read[c], base.read[c]) / np.ptp(base.read[c]) for c in READ)


@pytest.mark.parametrize("name", mechanisms.names())
def test_contract(name):
    mechanism = mechanisms.get(name)
    assert mechanism.summary
    assert all(mechanism.paragraphs[name] for name in PARAGRAPHS)
    assert mechanism.mistaken_for
    assert name not in mechanism.mistaken_for
    source = mechanism.paragraphs["Source"]
    assert re.search(r"\b(19|20)\d\d\b", source)
    assert "doi" not in source.lower() or DOI.search(source)
    for p in mechanism.parameters:
        assert p.low < p.high, p.name
        assert p.low <= p.start <= p.high, p.name
        assert p.unit, p.name
        assert p.meaning, p.name
        assert p.scale == "linear" or p.low > 0, p.name


def test_an_unknown_name_is_answered_with_the_nearest():
    with pytest.raises(mechanisms.UnknownMechanismError, match="nearest are presliding"):
        mechanisms.get("pre-sliding")


def declared_with(monkeypatch, *changed):
    """A registry of these mechanisms in place of those of their names."""
    others = [mechanisms.get(name) for name in mechanisms.names() if name not in {m.name for m in changed}]
    monkeypatch.setattr(mechanisms, "_declared", lambda: [(mechanism, "") for mechanism in (*others, *changed)])
    return mechanisms._registry.__wrapped__()


def test_a_look_alike_that_does_not_exist_is_refused(monkeypatch):
    odd = replace(mechanisms.get("presliding"), mistaken_for=("presliding-of-the-load",))
    with pytest.raises(ValueError, match="presliding is mistaken for what does not exist: presliding-of-the-load"):
        declared_with(monkeypatch, odd)


def test_two_mechanisms_of_one_name_are_refused(monkeypatch):
    with pytest.raises(ValueError, match="two mechanisms are called kink"):
        declared_with(monkeypatch, mechanisms.get("kink"), mechanisms.get("kink"))


def test_two_mechanisms_with_one_setting_are_refused(monkeypatch):
    odd = replace(mechanisms.get("kink"), structures={"half_gap": 0.0})
    found = declared_with(monkeypatch, odd)
    monkeypatch.setattr(mechanisms, "_registry", lambda: found)
    with pytest.raises(ValueError, match="kink declares settings of another mechanism: half_gap"):
        mechanisms._neutral.__wrapped__()


def test_a_setting_that_no_mechanism_declares_is_refused():
    with pytest.raises(AttributeError, match="no mechanism declares the setting 'haf_gap'"):
        mechanisms.neutral_settings().haf_gap = 1.0


def test_the_documentation_is_up_to_date():
    """Names, parameters and ranges are a format: a change of them shows in the difference of these pages."""
    found = [DOCS / "mechanisms.md", *(DOCS / "mechanisms").glob("*.md")]
    assert {page.relative_to(DOCS).as_posix(): page.read_text(encoding="utf-8") for page in found} == catalogue.pages()


def test_pages_are_written_beside_what_is_there(tmp_path):
    (tmp_path / "mechanisms").mkdir()
    (tmp_path / "mechanisms" / "of-a-person.md").write_text("# mine")
    assert CliRunner().invoke(app, ["mechanisms", "--markdown", str(tmp_path)]).exit_code == 0
    assert {page.stem for page in (tmp_path / "mechanisms").glob("*.md")} == {*mechanisms.names(), "of-a-person"}


@pytest.mark.parametrize("name", mechanisms.names())
def test_the_command_line_shows_the_whole_entry(name):
    shown = CliRunner().invoke(app, ["mechanisms", name]).output
    mechanism = mechanisms.get(name)
    facts = (mechanism.summary, *mechanism.paragraphs.values(), *mechanism.mistaken_for)
    assert all(text in shown for text in (*facts, *(p.meaning for p in mechanism.parameters)))


def test_the_command_line_lists_every_name(monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    shown = CliRunner().invoke(app, ["mechanisms"]).output
    assert all(name in shown for name in mechanisms.names())


@pytest.mark.parametrize(("name", "place"), [one for one in EVERYWHERE if one[0] not in INERT])
def test_it_acts(base, name, place):
    start = mechanisms.get(name).start
    # The two cables of an asymmetry start alike in one of its ratios, and their friction barely differs.
    values = start | {"ratio": 1.2} if name == "cable-asymmetry" else start
    r = run(sine(), [Active(name, place, values)])
    assert any(np.abs(r.read[channel] - base.read[channel]).max() > 1e-6 for channel in READ)
    for channel in READ:
        assert np.isfinite(r.read[channel]).all()


@pytest.mark.parametrize(("name", "place"), EVERYWHERE)
def test_at_its_neutral_value_it_leaves_no_trace(base, name, place):
    r = run(sine(), [Active(name, place, mechanisms.get(name).neutral)])
    if name == "kink":  # keeps a node at its place
        assert deviation(r, base) < 1e-11
        return
    for output in OUTPUTS:
        assert (getattr(r, output) == getattr(base, output)).all(), output
    for channel in READ:
        assert (r.read[channel] == base.read[channel]).all(), channel


@pytest.mark.parametrize(("name", "place"), [one for one in EVERYWHERE if one[0] in NEARLY_NEUTRAL])
def test_near_its_neutral_value_it_tends_to_the_papers_model(base, name, place):
    parameter, near, error = NEARLY_NEUTRAL[name]
    values = [mechanisms.get(name).neutral | {parameter: value} for value in (near, 100 * near)]
    errors = [deviation(run(sine(), [Active(name, place, v)]), base) for v in values]
    assert errors[0] <= min(error, errors[1] / 10)


@pytest.mark.parametrize(("name", "place"), EVERYWHERE)
def test_refining_the_grid_changes_little(name, place):
    active = [Active(name, place, mechanisms.get(name).start)]
    coarse, fine = run(sine(), active), run(sine(), active, elements=128)
    for channel in READ:
        assert rms(coarse.read[channel], fine.read[channel]) < 2e-3 * np.ptp(fine.read[channel]), channel


def everything():
    return [Active(name, place, mechanisms.get(name).start) for name, place in EVERYWHERE]


def test_all_of_them_together():
    r = run(sine(), everything())
    fine = run(sine(), everything(), elements=128)
    for channel in READ:
        assert rms(r.read[channel], fine.read[channel]) < 5e-3 * np.ptp(fine.read[channel]), channel


@pytest.mark.parametrize("seed", range(3))
def test_all_of_them_together_bear_a_jumping_drive(seed):
    rng = np.random.default_rng(seed)
    theta = np.concatenate([[0.0], rng.uniform(-0.6, 0.6, 300)])
    r = run(theta, everything())
    for channel in READ:
        assert np.isfinite(r.read[channel]).all()


@pytest.mark.parametrize("seed", range(4))
def test_any_pair_of_them(seed):
    rng = np.random.default_rng(seed)
    for _ in range(12):
        picked = [everything()[i] for i in rng.choice(len(EVERYWHERE), 2, replace=False)]
        values = []
        for a in picked:
            drawn = {p.name: rng.uniform(p.low, p.high) for p in mechanisms.get(a.name).parameters}
            values.append(Active(a.name, a.place, drawn))
        r = run(sine(cycles=1), values, T=rng.uniform(0.7, 10))
        assert all(np.isfinite(r.read[channel]).all() for channel in READ), values


@pytest.mark.parametrize(
    ("name", "place", "parameter"),
    [
        ("presliding", "conduit", "spread"),
        ("relaxation", "cable", "spread"),
        ("pulley-friction", "drive-pulley", "presliding"),
    ],
)
def test_a_length_or_ratio_of_zero_is_refused(name, place, parameter):
    values = mechanisms.get(name).start | {parameter: 0.0}
    with pytest.raises(ModelError, match=f"{parameter} = 0 .* must be above 0"):
        active_of([Active(name, place, values)])
