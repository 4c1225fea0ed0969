"""The general solver against explicit dynamics, effect by effect: ``python benchmarks/against_dynamics.py``.

Each effect is simulated alone, with the same law and parameters, by the virtual rig (masses, springs and bristles in
small explicit steps) and by ``ccmodel.model.general`` (implicit, without inertia, 32 elements). They share no code. The
rig is refined by halving its cells, bristles and the masses of cable and pulley together, so that both converge to the
same physics. If the last refinement changes the rig by more than a third of the limit, the rig chatters.

Prints a table of the rms difference of the four end tensions in percent of their peak to peak, with the change by the
rig's last refinement, and writes it to ``docs/verification.md``. Sensor faults do not change the motion and are not
compared.
"""

import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path

import numpy as np
from dynamics_cases import Case, cases

from ccmodel.geometry import ConduitPath
from ccmodel.model.general import Active
from ccmodel.model.general import simulate as solve
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.transmission import Transmission
from virtualrig.config import Cable, Estimates, Load, Numerics, Piece, Rig
from virtualrig.dynamics import simulate as run_rig
from virtualrig.effects import Effects
from virtualrig.grid import make_grid
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

The transmission is a half loop of 1.2 m with 7.3 N of pretension. The drive is a sine of 0.7 rad at 1 Hz. The column
"parameters" states other values where a row has them. Effects of sensors are not part of the dynamics and are not in
the table.

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
    preparation = Preparation(MU, (case.pretension_N,) * 2, (0.0, 0.0))
    trajectory = run_rig(rig, grid, numerics, preparation, time_s, case.drive.angle_and_rate(time_s))
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
    """A row of the table, in percent (`difference_percent`).

    Attributes
    ----------
    case : Case
    error : ndarray, shape (4,)
        Difference of the solver from the finest rig.
    effect : float
        Change of the solver's tensions by the effect, the largest of four.
    change : float
        Change of the rig's tensions by its last refinement, the largest of four.
    level : int
        Number of refinements of the rig.
    """

    case: Case
    error: np.ndarray
    effect: float
    change: float
    level: int

    @property
    def verdict(self) -> str:
        """Whether both agree; undecided if the rig has not converged."""
        if self.change > LIMIT_PERCENT / 3:
            return "the rig chatters"
        return "agree" if self.error.max() <= LIMIT_PERCENT else "**differ**"


def compare(case: Case) -> Row:
    """Refine the rig until it converges, and compare the solver with it."""
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
    """The page as Markdown."""
    return PAGE.format(today=date.today(), limit=LIMIT_PERCENT, table="\n".join([HEAD, *lines]))


def main() -> None:
    """Compare the effects named as arguments, or all; prints each row, and writes the page after a run of all."""
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
