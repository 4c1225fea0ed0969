"""What changes slowly from recording to recording of a session: friction, stiffness, and the zero of a load cell."""

from ccmodel.mechanisms.contract import Mechanism, Parameter


def _change(what: str, below: float) -> tuple[Parameter, ...]:
    meaning = f"change of {what} from the session's first recording to its last, over its middle"
    return (Parameter("change", "1", 0.03, 0.5, 0.1, meaning, signed=True, above=-below, below=below),)


def friction_drift() -> Mechanism:
    """Friction drifts from recording to recording of a session.

    Equation: The friction coefficient is mu (1 + change x) throughout a recording at the position x in its session,
    -1/2 to 1/2 from the first to the last. The position is the time at which the recording started, if all recordings
    of the session state theirs; a later recording is then extrapolated, to x = 1 at most. Otherwise the position is the
    recording's place in the order of the batch file: that this is the order of recording is a hypothesis. A recording
    of unknown position has x = 0, as one of another batch than the model was fitted to.

    Signature: The loss of each recording is even, and grows or falls from recording to recording whatever their
    conditions.

    Separated by: the first condition recorded again at the session's end.

    Source: Blau, On the nature of running-in, Tribology International 38(11-12), 1007-1012, 2005,
    doi:10.1016/j.triboint.2005.07.020.
    """
    return Mechanism(
        name="friction-drift",
        text=friction_drift.__doc__ or "",
        tex=r"\mu(x) = \mu\,(1 + \mathrm{change}\,x), \qquad -0.5 \le x \le 0.5",
        sentence="friction [rises|falls] by {change:%} from the first recording to the last",
        places=("conduit",),
        parameters=_change("friction", 2.0),
        mistaken_for=("running-in", "mu"),
        depends_on_time=False,
        drift="friction_scale",
    )


def stiffness_drift() -> Mechanism:
    """The cables' stiffness drifts from recording to recording of a session.

    Equation: The stiffness is k (1 + change x) throughout a recording at the position x in its session, as for
    friction-drift: by the stated times, or by the order of the batch file as a hypothesis.

    Signature: The lost motion of each recording is even, and grows or falls from recording to recording whatever their
    conditions.

    Separated by: the first condition recorded again at the session's end.

    Source: Feyrer, Wire Ropes, Springer, 2nd edition, 2015, doi:10.1007/978-3-642-54996-0, Section 1.4: a new rope
    stiffens with its load cycles.
    """
    return Mechanism(
        name="stiffness-drift",
        text=stiffness_drift.__doc__ or "",
        tex=r"k(x) = k\,(1 + \mathrm{change}\,x), \qquad -0.5 \le x \le 0.5",
        sentence="the cables' stiffness [rises|falls] by {change:%} from the first recording to the last",
        places=("cable",),
        parameters=_change("stiffness", 2.0),
        mistaken_for=("strand-settling", "K"),
        depends_on_time=False,
        drift="stiffness_N_per_m",
    )


def zero_drift() -> Mechanism:
    """A load cell's zero drifts from recording to recording of a session.

    Equation: The cell reads F + change x throughout a recording at the position x in its session, as for
    friction-drift: by the stated times, or by the order of the batch file as a hypothesis.

    Signature: One force sum disagrees with all other channels, also with the torque on the same side, by a constant
    that grows or falls from recording to recording.

    Separated by: the first condition recorded again at the session's end; the cell without load between recordings.

    Source: JCGM 200:2012, International vocabulary of metrology, 2012, doi:10.59161/JCGM200-2012, 4.21 (instrumental
    drift).
    """
    meaning = "change of the zero from the session's first recording to its last"
    return Mechanism(
        name="zero-drift",
        text=zero_drift.__doc__ or "",
        tex=r"F_\mathrm{read}(x) = F + \mathrm{change}\,x, \qquad -0.5 \le x \le 0.5",
        sentence="the zero of the {side}'s load cell [rises|falls] by {change} from the first recording to the last",
        places=("drive-sensor", "load-sensor"),
        parameters=(Parameter("change", "N", 0.2, 3.0, 0.5, meaning, signed=True),),
        mistaken_for=("load-cell-offset", "load-cell-drift"),
        depends_on_time=False,
        drift="load-cell-offset",
    )


MECHANISMS = (friction_drift(), stiffness_drift(), zero_drift())
