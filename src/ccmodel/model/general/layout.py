"""Rows of the arrays that a run and its steps share, and the numbers of a run.

Everything is packed into a few arrays of rows, since each array that one compiled function hands to another costs time
at every call.
"""

from collections import namedtuple
from typing import TYPE_CHECKING, NamedTuple

from ccmodel import mechanisms as registry
from ccmodel.mechanisms.presliding import MOST_ELEMENTS
from ccmodel.mechanisms.relaxation import BRANCHES
from ccmodel.mechanisms.winding import Pulley

IMPEDANCE, PRESCRIBED_ANGLE = 0, 1

# A slack piece keeps this share of its stiffness, so that its nodes have a position; its tension counts as zero. The
# positions decide how friction builds up once the cable is taut again. Newton's tolerance leaves them open by 0.1 um;
# with a ten-thousandth of this share by 1 mm, and the solution jumps with the least change of a parameter.
SLACK_SHARE = 1e-5

# piece, shape (rows, 2, n + 1): the cable between nodes. Constants (N/m, m, -, -), state, results of the step.
STIFFNESS, LOST, RELAXING, SHARE, STRETCH, ELASTIC, TENSION, TANGENT, PULL, MEMORY = range(10)
# Then the branches of relaxation (N), state.
BRANCH = 10
# node, shape (rows, 2, n): constants (rad, N, N s/m), state, the step's equations and their elimination.
(
    HALF_BEND,
    DRAG,
    VISCOUS,
    BRISTLE,
    RESTED,
    RESTED_NEXT,
    GRIP,
    BRISTLE_NEXT,
    NEAR,
    FAR,
    GIVES,
    EXCESS,
    ALPHA,
    BETA,
    ETA,
    GAMMA,
    GRIP_NOW,
    GRIP_SLOPE,
    DRAG_NOW,
    DRAG_SLOPE,
    SPEED,
    SPEED_BY_SLIDE,
    FILM,
    FILM_SLOPE,
) = range(24)
# Then the elements of presliding friction and its creeping one, -1 to 1: state, and result of the step.
ELEMENT, ELEMENT_NEXT = 24, 25 + MOST_ELEMENTS
# slide, shape (rows, 2, n + 2): drive end, nodes, load end, m. Of this step, of Newton's step, and of those before.
NOW, STEP, SAVED, LAST, BEFORE = range(5)
# mean, shape (rows, 2): mean tension of a cable, which a compliant conduit responds to, N.
(
    MEAN,
    MEAN_NEXT,
    MEAN_LAST,
    MEAN_BEFORE,
    MEAN_STEP,
    MEAN_EXCESS,
    MEAN_SAVED,
    FIXED,
    BY_END,
    END_FIXED,
    END_BY_END,
) = range(11)
# load, shape (rows,): angle (rad), rotation (rad) and duration (s) of the last step, speed (rad/s), speed before that,
# acceleration (rad/s^2), bristle of the bearing; then speed, acceleration, bristle, torque (N m) and torque in the
# bearing (N m) of this step.
(
    ANGLE,
    ROTATION,
    DT,
    OMEGA,
    OMEGA_BEFORE,
    ACCELERATION,
    BEARING,
    OMEGA_NEXT,
    ACCELERATION_NEXT,
    BEARING_NEXT,
    TORQUE,
    IN_BEARING,
) = range(12)
# past, shape (rows,): rotations of the load (rad) and pulls (m) of the last two steps; duration of the last (s).
LAST_ROTATION, ROTATION_BEFORE, LAST_PULL, PULL_BEFORE, LAST_DT = range(5)
PAST_ROWS = 5
# drive pulley, shape (3,): angle, middle of the range that its encoder leaves open (rad); bristle of its bearing.
DRIVE_ANGLE, DRIVE_MIDDLE, DRIVE_BEARING = range(3)
PIECE_ROWS, NODE_ROWS, SLIDE_ROWS, MEAN_ROWS, LOAD_ROWS = 10 + BRANCHES, 26 + 2 * MOST_ELEMENTS, 5, 11, 12
# Then, in a run that has them, tables (`ccmodel.mechanisms.tables`) of compliance and of friction, each by tension; and
# one of drag by speed, from the row `drag_table` of the run's constants. The load may have the tables of `LOAD_LAWS`,
# each from the row of its name in the run's constants.
SPRING_TABLE, FRICTION_TABLE = PIECE_ROWS, NODE_ROWS
BEARING_LAWS = "bearing_by_speed", "bearing_elements"
LOAD_LAWS = "load_by_angle", "load_by_speed", "load_elements", *BEARING_LAWS

# Constants of a run: its own, and every setting of the mechanisms.
if TYPE_CHECKING:

    class Physics(NamedTuple):
        """Of the fields of a mechanism, a type checker knows only that they are numbers."""

        has_settling: bool
        has_relaxation: bool
        relaxing_times_s: tuple[float, ...]
        bristle: float
        presliding: bool
        creep: float
        element_m: tuple[float, ...]
        element_share: tuple[float, ...]
        elements: int
        load_pulley: Pulley
        stiffness_load: float
        load_damping: float
        rings: bool
        kind: int
        general_friction: bool
        has_spring_table: bool
        has_friction_table: bool
        drag_table: int
        has_load_laws: bool
        load_by_angle: int
        load_by_speed: int
        load_elements: int
        bearing_by_speed: int
        bearing_elements: int

        def __getattr__(self, name: str) -> float: ...

else:
    Physics = namedtuple(
        "Physics",
        "has_settling has_relaxation relaxing_times_s bristle presliding creep element_m element_share elements "
        "load_pulley stiffness_load load_damping rings kind general_friction has_spring_table has_friction_table "
        "drag_table " + " ".join(("has_load_laws", *LOAD_LAWS, *registry.march_settings())),
    )

FAST = {"reassoc", "contract", "nsz", "arcp"}  # not nnan: a NaN must be seen
