"""The general solver against explicit dynamics, effect by effect: ``python benchmarks/against_dynamics.py``.

Each effect alone, with the same parameters and in the same form in both: the virtual rig (masses, springs and bristles
in small explicit steps) and ``ccmodel.model.general`` (implicit, without inertia, at its default of 32 elements). They
share no code. The rig is refined: cells, bristles and the masses of cable and pulley are halved together, so that what
is compared tends to the same physics. Where that still changes it by more than a third of the limit, it chatters.

Prints a table of the rms difference of the four cable-end tensions in percent of their peak to peak, next to what the
rig's last refinement still changed, and writes it to ``docs/verification.md``. Effects of sensors are no dynamics and
are not in it.
"""

import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from datetime import date
from pathlib import Path

import numpy as np

from ccmodel.geometry import ConduitPath
from ccmodel.mechanisms.stribeck import RENEWAL_M
from ccmodel.model.general import Active
from ccmodel.model.general import simulate as solve
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.transmission import Transmission
from virtualrig.config import Cable, Estimates, Load, Numerics, Piece, Rig
from virtualrig.dynamics import simulate as run_rig
from virtualrig.effects import Effects
from virtualrig.grid import make_grid
from virtualrig.motion import Sine
from virtualrig.trajectory import Preparation

TENSIONS = ("T1_N", "T2_N", "T3_N", "T4_N")
LIMIT_PERCENT = 0.3
FINEST = 1
COARSEST_CELL_M = 0.0125
SAMPLE_RATE_HZ = 1000.0
RADIUS_M, SPRING_NM_PER_RAD, STIFFNESS_N_PER_M, LENGTH_M, MU = 0.006, 0.05, 7750.0, 1.2, 0.156
PAGE_PATH = Path(__file__).parents[1] / "docs" / "verification.md"
PAGE = """# The general solver against explicit dynamics

Written by `python benchmarks/against_dynamics.py` on {today}. The script overwrites this page.

Each mechanism acts alone, with the same equation and parameters in two solvers that share no code:

- the virtual rig: masses, springs and bristles in small explicit time steps, refined by halving its cells, bristles and
  masses together;
- the general solver: implicit, without inertia, 32 elements, one sample per millisecond.

The transmission is a half loop of 1.2 m with 7.3 N of pretension. The drive is a sine of 0.7 rad at 1 Hz. A row states
where it differs. Effects of sensors are not part of the dynamics and are not in the table.

| column | meaning |
|---|---|
| T1 to T4 | rms difference of each tension, % of its peak to peak; the limit is {limit} % |
| effect | rms change that the mechanism makes in the general solver, same unit, largest of the four tensions |
| last refinement | rms change by the last refinement of the rig, same unit, largest of the four tensions |
| cells | cells of the refined rig |
| result | `agree` within the limit; `the rig chatters` if its last refinement exceeds a third of the limit |

{table}

## Friction that falls with speed

In both solvers the friction of a contact follows its speed over 20 µm of sliding (the renewal length). If friction
followed the speed at once, a light cable would have no unique motion: sliding at a speed at which friction falls is
unstable within microseconds, and the grid determines the result. The rows with a renewal length of 0.025 µm, the length
of a bristle, show this on the rig. With 20 µm the rig still chatters if friction falls strongly over a wide range of
speeds. The general solver has no inertia and gives a solution without chatter; the difference in these rows contains
the rig's chatter.
"""


@dataclass(frozen=True)
class Case:
    """One comparison: an effect as the rig takes it and as the solver does, and the run it is seen in.

    Attributes
    ----------
    name, text : str
        The effect, and its parameters for the table.
    effects : mapping
        Fields of `virtualrig.effects.Effects`.
    mechanisms : sequence of (str, str, mapping)
        Name, place and values of the solver's mechanisms.
    pretension_N, amplitude_rad, frequency_Hz : float
    """

    name: str
    text: str
    effects: Mapping = field(default_factory=dict)
    mechanisms: Sequence = ()
    pretension_N: float = 7.3
    amplitude_rad: float = 0.7
    frequency_Hz: float = 1.0

    @property
    def drive(self) -> Sine:
        """A rest, a start over a quarter of a cycle and one and a quarter cycles."""
        return Sine(
            wave="sine",
            amplitude_rad=self.amplitude_rad,
            frequency_Hz=self.frequency_Hz,
            rest_s=0.02,
            start_up_cycles=0.25,
            cycles=1.25,
        )


def _in_the_cable(name, place, text, effects, values, **run) -> Case:
    return Case(name, text, effects, [(name, place, values)], **run)


def cases() -> list[Case]:
    """Every effect that changes the motion, alone."""
    return [
        Case("none", "7.3 N"),
        Case("none", "3.5 N, 1 rad, slack in part", pretension_N=3.5, amplitude_rad=1.0),
        *(
            _in_the_cable(
                "presliding",
                "conduit",
                f"z0 {z0 * 1e6:g} um",
                {"presliding": {"law": "dahl", "length_m": z0}},
                {"z0": z0},
            )
            for z0 in (20e-6, 150e-6)
        ),
        *(
            _in_the_cable(
                "viscous-friction",
                "conduit",
                f"c {c:g} N s/m^2",
                {"viscous_Ns_per_m2": c},
                {"c": c},
            )
            for c in (50.0, 400.0)
        ),
        *(
            _in_the_cable(
                "load-dependent-friction",
                "conduit",
                f"n {n:g}",
                {"load_dependent_friction": {"exponent": n}},
                {"n": n},
            )
            for n in (-0.15, -0.35)
        ),
        _in_the_cable("constant-drag", "conduit", "f0 1 N", {"drag_N": 1.0}, {"f0": 1.0}),
        *(
            _in_the_cable(
                "kink",
                "conduit",
                f"beta {beta:g} rad, s {s:g}",
                {"kinks": [{"bend_rad": beta, "place_share": s}]},
                {"beta": beta, "s": s},
            )
            for beta, s in ((0.6, 0.5), (1.2, 0.23))
        ),
        _in_the_cable(
            "running-in",
            "conduit",
            "change 30 %, tau 2 s",
            {"running_in": {"change": 0.3, "scale": 2.0}},
            {"change": 0.3, "tau": 2.0},
        ),
        _in_the_cable(
            "cable-asymmetry",
            "cable",
            "mu 1.3, K 0.8",
            {"cable_asymmetry": {"friction_ratio": 1.3, "stiffness_ratio": 0.8}},
            {"ratio": 1.3, "K_ratio": 0.8},
        ),
        _in_the_cable(
            "relaxation",
            "cable",
            "r 15 %, tau 2 s",
            {"relaxation": [{"share": 0.15, "time_constant_s": 2.0}]},
            {"r": 0.15, "tau": 2.0},
        ),
        *(
            _in_the_cable(
                "strand-settling",
                "cable",
                f"T_scale 2 N at {T:g} N",
                {"strand_settling": {"law": "exponential", "tension_scale_N": 2.0}},
                {"T_scale": 2.0},
                pretension_N=T,
            )
            for T in (7.3, 3.5)
        ),
        _in_the_cable(
            "termination-compliance",
            "drive-end",
            "drive, 60 um/N",
            {"termination_compliance": {"drive_m_per_N": 60e-6}},
            {"compliance": 60e-6},
        ),
        _in_the_cable(
            "termination-compliance",
            "load-end",
            "load, 60 um/N",
            {"termination_compliance": {"load_m_per_N": 60e-6}},
            {"compliance": 60e-6},
        ),
        *(
            _in_the_cable(
                "conduit-compliance",
                "conduit",
                f"{c * 1e6:g} um/N",
                {"conduit_compliance_m_per_N": c},
                {"compliance": c},
            )
            for c in (20e-6, 70e-6)
        ),
        _in_the_cable(
            "pulley-friction",
            "load-pulley",
            "load, 5 mN m",
            {"load_pulley": {"friction": {"torque_Nm": 5e-3, "presliding_rad": 2e-3}}},
            {"friction_torque": 5e-3},
        ),
        *(
            _in_the_cable(
                "pulley-eccentricity",
                f"{side}-pulley",
                f"{side}, e 6 %, psi 0.7 rad",
                {f"{side}_pulley": {"eccentricity": {"share": 0.06, "phase_rad": 0.7}}},
                {"e": 0.06, "psi": 0.7},
            )
            for side in ("drive", "load")
        ),
        _in_the_cable("backlash", "load-pulley", "2 deg", {"load": {"half_gap_rad": 0.035}}, {"half_gap": 0.035}),
        _in_the_cable(
            "load-stiffening",
            "load",
            "K3 0.1 N m/rad^3",
            {"load": {"cubic_Nm_per_rad3": 0.1}},
            {"K3": 0.1},
        ),
        _in_the_cable(
            "load-inertia", "load", "J 5e-4 kg m^2", {"load": {"inertia_kg_m2": 5e-4}}, {"J": 5e-4, "zeta": 0.0}
        ),
        *stribeck_cases(),
    ]


def stribeck_cases() -> list[Case]:
    """Friction that falls with speed: first where the answer is one, then where the rig itself chatters."""
    return [
        stribeck(0.05, 2e-3),
        stribeck(0.2, 2e-3),
        stribeck(0.2, 1e-4),
        stribeck(0.2, 2e-3, presliding_m=40e-6),
        stribeck(0.2, 10e-3, presliding_m=40e-6),
        stribeck(0.4, 2e-3),
        stribeck(0.2, 10e-3),
        stribeck(0.2, 2e-3, renewal_m=2.5e-8),
        stribeck(0.2, 10e-3, renewal_m=2.5e-8),
    ]


def stribeck(rise: float, speed: float, renewal_m: float = RENEWAL_M, presliding_m: float = 0.0) -> Case:
    """Friction that falls with speed (m/s), alone or with presliding; the solver's renewal length is always its own."""
    effects = {"stribeck": {"rise": rise, "speed_m_per_s": speed, "exponent": 2.0, "renewal_m": renewal_m}}
    mechanisms = [("stribeck", "conduit", {"a": rise, "vs": speed})]
    text = f"a {100 * rise:g} %, vs {1e3 * speed:g} mm/s"
    if presliding_m:
        effects["presliding"] = {"law": "dahl", "length_m": presliding_m}
        mechanisms.append(("presliding", "conduit", {"z0": presliding_m}))
        text += f", with presliding {1e6 * presliding_m:g} um"
    if renewal_m != RENEWAL_M:
        text += f", in the rig renewed over {1e6 * renewal_m:g} um"
    return Case("stribeck", text, effects, mechanisms)


def rig_tensions(
    case: Case, level: int, cell_m: float = COARSEST_CELL_M, rate_Hz: float = SAMPLE_RATE_HZ
) -> np.ndarray:
    """Tensions of the virtual rig at a level of refinement, N, shape (4, samples)."""
    finer = 0.5**level
    rig = Rig(
        pulley_radius_m=RADIUS_M,
        cable=Cable(
            stiffness_N_per_m=STIFFNESS_N_PER_M,
            length_m=LENGTH_M,
            friction_coefficient=MU,
            density_kg_per_m=1.1e-3 * finer,
        ),
        estimates=Estimates(stiffness_N_per_m=STIFFNESS_N_PER_M, length_m=LENGTH_M, friction_coefficient=MU),
        load=Load(
            spring_stiffness_Nm_per_rad=SPRING_NM_PER_RAD,
            inertia_kg_m2=2e-8 * finer,
            damping_Nms_per_rad=1e-5 * finer,
        ),
        effects=Effects.model_validate(case.effects),
    )
    numerics = Numerics(
        cell_length_m=cell_m * finer,
        cell_bend_rad=1.0,
        bristle_length_m=2.5e-8 * finer,
        wave_damping=0.1,
        drag_rate_per_s=40.0,
        courant=0.8,
        tension_limit_N=40.0,
    )
    time_s = sample_times(case, rate_Hz)
    conduit = [Piece(length_m=LENGTH_M, bend_rad=np.pi)]
    grid = make_grid(conduit, numerics.cell_length_m, numerics.cell_bend_rad)
    preparation = Preparation(MU, case.pretension_N, (0.0, 0.0))
    trajectory = run_rig(rig, grid, numerics, preparation, time_s, *case.drive.angle_and_rate(time_s))
    return np.stack([getattr(trajectory, name) for name in TENSIONS])


def solver_tensions(case: Case, elements: int = 32, rate_Hz: float = SAMPLE_RATE_HZ) -> np.ndarray:
    """Tensions of the general solver, N, shape (4, samples)."""
    path = ConduitPath([LENGTH_M], [np.pi])
    transmission = Transmission(path, STIFFNESS_N_PER_M * LENGTH_M, MU, RADIUS_M, RADIUS_M)
    time_s = sample_times(case, rate_Hz)
    initial = InitialTension.uniform(path, case.pretension_N)
    active = [Active(*mechanism) for mechanism in case.mechanisms]
    theta_in = case.drive.angle_and_rate(time_s)[0]
    response = solve(transmission, SpringLoad(SPRING_NM_PER_RAD), time_s, theta_in, initial, active, elements)
    return np.stack([getattr(response.complete(), name) for name in TENSIONS])


def sample_times(case: Case, rate_Hz: float) -> np.ndarray:
    """Times of the samples, s."""
    return np.arange(round(case.drive.duration_s * rate_Hz) + 1) / rate_Hz


def difference_percent(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Rms difference of each tension in percent of its peak to peak in `b`, shape (4,)."""
    return 100 * np.sqrt(np.mean((a - b) ** 2, axis=1)) / np.ptp(b, axis=1)


@dataclass(frozen=True)
class Row:
    """A line of the table, in percent as `difference_percent` has it.

    Attributes
    ----------
    case : Case
    error : ndarray, shape (4,)
        Solver against the finest rig.
    effect : float
        What the effect does to the solver's tensions, the largest of four.
    change : float
        What the rig's last refinement still changed, the largest of four.
    level : int
        How often the rig was refined.
    """

    case: Case
    error: np.ndarray
    effect: float
    change: float
    level: int

    @property
    def verdict(self) -> str:
        """Whether they agree, as far as the rig has an answer."""
        if self.change > LIMIT_PERCENT / 3:
            return "the rig chatters"
        return "agree" if self.error.max() <= LIMIT_PERCENT else "**differ**"


def compare(case: Case) -> Row:
    """Refine the rig until it changes little more, and hold the solver against it."""
    finer = rig_tensions(case, 0)
    for level in range(1, FINEST + 1):
        coarse, finer = finer, rig_tensions(case, level)
        change = difference_percent(coarse, finer).max()
        if change < LIMIT_PERCENT / 3:
            break
    solved = solver_tensions(case)
    effect = difference_percent(solver_tensions(replace(case, mechanisms=())), solved).max()
    return Row(case, difference_percent(solved, finer), float(effect), float(change), level)


HEAD = """| mechanism | parameters | T1 | T2 | T3 | T4 | effect | last refinement | cells | result |
|---|---|---|---|---|---|---|---|---|---|"""


def line(row: Row) -> str:
    """A row of the table as Markdown."""
    errors = " | ".join(f"{e:.3f}" for e in row.error)
    cells = round(LENGTH_M / COARSEST_CELL_M) * 2**row.level
    numbers = f"{errors} | {row.effect:.2f} | {row.change:.3f} | {cells}"
    return f"| {row.case.name} | {row.case.text} | {numbers} | {row.verdict} |"


def report(lines: Sequence[str]) -> str:
    """The page that holds the table."""
    return PAGE.format(today=date.today(), limit=LIMIT_PERCENT, table="\n".join([HEAD, *lines]))


def main() -> None:
    """Compare every effect, or those named, printing each line as it is known; all of them together make the page."""
    wanted = sys.argv[1:]
    lines = []
    print(HEAD, flush=True)
    with ProcessPoolExecutor(2) as pool:
        for row in pool.map(compare, [c for c in cases() if not wanted or c.name in wanted]):
            lines.append(line(row))
            print(lines[-1], flush=True)
    if not wanted:
        PAGE_PATH.write_text(report(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
