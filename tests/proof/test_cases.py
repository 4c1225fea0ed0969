from dataclasses import replace

import numpy as np
import pytest
import yaml
from scipy.stats import binom
from typer.testing import CliRunner

from ccmodel import mechanisms
from proof import build, convergence
from proof.build import folder_digest, record
from proof.cases import Case, draw
from proof.cli import app, sample_of, seed_of
from proof.plan import read_plan
from virtualrig.effects import TWINS, Effects, merged
from virtualrig.trajectory import Preparation, Trajectory

PLAN = read_plan()


def test_the_plan_has_every_candidate_mechanism_at_all_its_places():
    every = map(mechanisms.get, mechanisms.names())
    listed = {mechanism.name: set(mechanism.places) for mechanism in every if not mechanism.needs}
    assert {name: set(spec.places) for name, spec in PLAN.effects.items()} == listed
    assert TWINS.keys() == {*PLAN.effects, *PLAN.unlisted}


def test_true_values_have_the_names_of_the_mechanisms_parameters():
    for name in PLAN.effects:
        (truth,) = draw(3, "single", name).truth
        assert set(truth.values) <= {p.name for p in mechanisms.get(name).parameters}


def test_true_viscous_friction_includes_the_rigs_own_damping():
    """Forces at the load end at one speed: drag along both cables and damping of the load."""
    cases = (draw(seed, "single", "viscous-friction") for seed in range(3, 20))
    case = next(case for case in cases if not case.truth[0].law)
    (truth,), rig, speed = case.truth, case.campaign.rig, 0.01
    mass_kg = 2 * rig.cable.density_kg_per_m * rig.cable.length_m
    own_N = case.campaign.numerics.drag_rate_per_s * mass_kg * speed
    own_N += rig.load.damping_Nms_per_rad * (speed / rig.pulley_radius_m) / rig.pulley_radius_m
    film_N = 2 * rig.effects.viscous_Ns_per_m2 * rig.cable.length_m * speed
    assert 2 * truth.values["c"] * rig.cable.length_m * speed == pytest.approx(film_N + own_N)
    assert truth.size == rig.effects.viscous_Ns_per_m2


@pytest.mark.parametrize("name", [*PLAN.effects, *PLAN.unlisted])
def test_an_effect_enters_the_rig(name):
    kind = "unlisted" if name in PLAN.unlisted else "single"
    case = draw(11, kind, name)
    effects = case.campaign.rig.effects
    assert effects != Effects()
    (truth,) = case.truth
    low, high = {**PLAN.effects, **PLAN.unlisted}[name].size
    assert low <= abs(truth.size) <= high
    assert truth.place in {**PLAN.effects, **PLAN.unlisted}[name].places
    assert effects.model_dump() != draw(12, kind, name).campaign.rig.effects.model_dump()


@pytest.mark.parametrize("name", [name for name, twin in PLAN.effects.items() if twin.other_laws])
def test_every_law_of_an_effect_is_drawn_and_enters_the_rig(name):
    cases = [draw(seed, "single", name) for seed in range(40)]
    laws = [case.truth[0].law for case in cases]
    assert set(laws) == {"", *TWINS[name].other_laws}
    assert 0.2 < np.mean([law == "" for law in laws]) < 0.8
    assert all(case.campaign.rig.effects != Effects() for case in cases)


def test_a_seed_gives_one_case_and_another_seed_another():
    assert draw(5) == draw(5)
    assert draw(5).digest == draw(5).digest
    assert draw(5).digest != draw(6).digest
    assert draw(5, "clean").name != draw(5, "single").name


def test_kinds_come_in_their_shares():
    kinds = [draw(seed).kind for seed in range(400)]
    for kind, share in PLAN.kinds.items():
        low, high = binom.ppf([1e-4, 1 - 1e-4], len(kinds), share)
        assert low <= kinds.count(kind) <= high


def test_strengths_follow_the_stated_power():
    truths = [draw(seed, "single", "backlash").truth[0] for seed in range(300)]
    even = np.power([t.strength for t in truths], 1 / PLAN.strength_power)
    assert np.histogram(even, 3, (0, 1))[0].min() > 70
    low, high = PLAN.effects["backlash"].size
    middle = low * (high / low) ** (0.5**PLAN.strength_power)
    assert np.median([t.size for t in truths]) == pytest.approx(middle, rel=0.3)


def test_a_pair_is_two_effects_and_a_removed_one_is_no_candidate():
    assert len({t.name for t in draw(4, "pair").truth}) == 2
    removed = draw(4, "removed", "kink")
    assert removed.without == ("kink",)
    assert [t.name for t in removed.truth] == ["unlisted-kink"]
    assert draw(4, "clean").truth == ()


def test_estimates_have_errors_and_some_large_ones():
    off = [draw(s, "clean").campaign.rig for s in range(100)]
    shares = np.array([abs(np.log(r.estimates.stiffness_N_per_m / r.cable.stiffness_N_per_m)) for r in off])
    assert shares.min() > np.log(1.09)
    assert 5 <= (shares > np.log(1.3)).sum() <= 40


def test_two_effects_share_a_pulley_but_no_number():
    friction, eccentricity = {"load_pulley": {"friction": 1}}, {"load_pulley": {"eccentricity": 2}}
    assert merged([friction, eccentricity]) == {"load_pulley": {"friction": 1, "eccentricity": 2}}
    with pytest.raises(ValueError, match="friction"):
        merged([friction, friction])


@pytest.fixture(scope="module")
def poor() -> Case:
    """A case with a single recording."""
    return next(c for c in (draw(s, "poor", "torque-scale") for s in range(50)) if c.protocol == "one")


def test_a_batch_reveals_no_answer(poor, tmp_path):
    record(poor, poor.recordings, tmp_path / poor.name)
    text = (tmp_path / poor.name / "batch.yaml").read_text()
    described = yaml.safe_load(text)
    assert described["origin"] == "virtual-rig"
    assert described["batch"] == poor.name
    assert not any(word in text for word in [*TWINS, *PLAN.kinds, "unlisted"])
    cable = described["rig"]["cable"]
    assert cable["stiffness_N_per_m"] != pytest.approx(poor.campaign.rig.cable.stiffness_N_per_m, rel=0.05)


def test_recording_a_case_is_reproducible(poor, tmp_path):
    for name in ("a", "b"):
        record(poor, poor.recordings, tmp_path / name)
    assert folder_digest(tmp_path / "a") == folder_digest(tmp_path / "b")
    file = next((tmp_path / "b").glob("*.gz"))
    file.write_bytes(file.read_bytes() + b"\0")
    assert folder_digest(tmp_path / "a") != folder_digest(tmp_path / "b")


def test_the_rig_is_fine_enough():
    errors = convergence.measure(2)
    assert max(errors.values()) < 0.5


def test_other_sources_have_other_cases():
    assert seed_of("0123456789abcdef", 3) != seed_of("0123456789abcdee", 3)
    assert seed_of("0123456789abcdef", 3) != seed_of("0123456789abcdef", 4)


def test_a_larger_sample_holds_the_smaller():
    small, large = sample_of("0123456789abcdef", 20), sample_of("0123456789abcdef", 60)
    assert set(small) < set(large)
    assert len(set(large)) == 60
    assert sample_of("0123456789abcdee", 20) != small
    assert sample_of("0123456789abcdef", PLAN.full.cases) == list(range(PLAN.full.cases))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--kind", "sinlge"], "no kind 'sinlge'"),
        (["--kind", "single", "--effect", "dahl"], "no effect 'dahl'"),
        (["--effect", "kink"], "needs --kind"),
        (["--kind", "unlisted", "--effect", "kink"], "not an effect of a case of kind unlisted"),
    ],
)
def test_a_case_that_cannot_be_built_is_refused(arguments, message, tmp_path):
    ran = CliRunner().invoke(app, ["build", "--out", str(tmp_path), *arguments])
    assert ran.exit_code == 2
    assert message in " ".join(ran.output.replace("│", " ").split())
    assert not list(tmp_path.iterdir())


def test_the_noise_floor_adds_sensors_and_repeatability(poor, monkeypatch):
    plan, time_s = poor.kept_back[0], np.linspace(0, 5, 500)
    is_moving = time_s >= plan.excitation.rest_s

    def simulated(campaign, plan, preparation):
        torque = preparation.friction_coefficient * is_moving
        angle, _ = plan.excitation.angle_and_rate(time_s)
        return Trajectory(time_s, angle, angle, *(np.ones_like(time_s) for _ in range(4)), torque, torque)

    monkeypatch.setattr(build, "simulate", simulated)
    campaign = poor.campaign.model_copy(update={"rig": poor.campaign.rig.model_copy(update={"effects": Effects()})})
    prepared = Preparation(1.0, (7.0, 7.0), (0.2, 0.2))
    floor = build.noise_floor(campaign, plan, prepared, simulated(campaign, plan, prepared))
    noise, slow = campaign.sensors.torque.noise_Nm, campaign.sensors.torque.slow_noise.ratio
    expected = np.sqrt(
        is_moving.mean() * campaign.repeatability.friction**2
        + noise**2 * (1 + slow**2)
        + campaign.sensors.torque.accuracy_Nm**2 / 3
    )
    assert floor["tau_in_Nm"] == pytest.approx(expected, rel=1e-6)
    count = 2 * np.pi / 2000 / np.sqrt(12)
    # Two counts of the load and, once the drive moves, one of the drive.
    assert floor["theta_out_rad"] == pytest.approx(np.sqrt(3) * count, rel=0.05)


def test_the_noise_floor_has_what_the_rest_does_not_show_of_the_initial_tension():
    """A model takes the tension from the rest; a curved profile has another mean, which shows once the cables slide."""
    case = draw(3, "clean")
    plan, campaign = case.kept_back[0], case.campaign
    curved = replace(build.prepare(campaign, plan, np.random.default_rng(1)), profile_curvature=(0.3, 0.3))
    even = replace(curved, profile_curvature=(0.0, 0.0))
    floors, at_rest = [], []
    for preparation in (even, curved):
        trajectory = build.simulate(campaign, plan, preparation)
        floors.append(build.noise_floor(campaign, plan, preparation, trajectory)["F_drive_N"])
        at_rest.append(trajectory.T1_N[0] + trajectory.T3_N[0])
    assert np.sqrt(floors[1] ** 2 - floors[0] ** 2) == pytest.approx(abs(at_rest[1] - at_rest[0]), rel=0.5)


def test_the_noise_floor_lacks_what_the_rest_shows_of_the_initial_tension():
    """Cables whose profiles differ hold the load at another angle, which the zero of its encoder takes away."""
    case = draw(5, "clean")
    plan, campaign = case.kept_back[0], case.campaign
    apart = replace(
        build.prepare(campaign, plan, np.random.default_rng(1)), profile_curvature=(-0.3, 0.3), profile_share=(0.0, 0.0)
    )
    even = replace(apart, profile_curvature=(0.0, 0.0))
    trajectory, other = (build.simulate(campaign, plan, preparation) for preparation in (apart, even))
    moved = abs(trajectory.theta_out_rad[0] - other.theta_out_rad[0])
    floor = build.noise_floor(campaign, plan, apart, trajectory)
    assert floor["theta_out_rad"] < 0.3 * moved
    assert floor["tau_out_Nm"] < 0.3 * moved * campaign.rig.load.spring_stiffness_Nm_per_rad


def test_the_repeat_of_the_noise_floor_begins_with_the_tensions_of_the_run():
    """With another profile of the tension and a load with a gap, whose motion another start would change."""
    case = draw(3, "single", "backlash", 0.95)
    spread = case.campaign.repeatability.model_copy(update={"friction": 0.0})
    campaign, plan = case.campaign.model_copy(update={"repeatability": spread}), case.kept_back[0]
    prepared = build.prepare(campaign, plan, np.random.default_rng(1))
    repeated = build._repeat(campaign, plan, prepared, build.simulate(campaign, plan, prepared))
    first, again = (build.simulate(campaign, plan, of) for of in (prepared, repeated))
    for tension in ("T1_N", "T2_N", "T3_N", "T4_N"):
        assert getattr(again, tension)[0] == pytest.approx(getattr(first, tension)[0], rel=1e-4)
    assert again.theta_out_rad[0] == pytest.approx(first.theta_out_rad[0], abs=1e-5)
    assert repeated.profile_curvature != prepared.profile_curvature


@pytest.mark.parametrize("effect", ["friction-drift", "stiffness-drift", "zero-drift"])
def test_a_drift_is_recorded_more_than_once(effect):
    cases = [draw(seed, "poor", effect) for seed in range(20)]
    assert {len(case.recordings) > 1 for case in cases} == {True}
    assert any(len(draw(seed, "poor", "kink").recordings) == 1 for seed in range(20))


def test_a_rig_that_has_some_of_its_effects_is_otherwise_the_same():
    whole = draw(5, "many")
    part = whole.having([1, 3])
    assert part.truth == (whole.truth[1], whole.truth[3])
    assert (part.recordings, part.kept_back) == (whole.recordings, whole.kept_back)
    assert draw(5, **part.requested).digest == part.digest != whole.digest
    assert [whole.having([k]).campaign.rig.effects for k in range(8)] == list(whole.effects)
