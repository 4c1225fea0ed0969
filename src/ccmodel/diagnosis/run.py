"""The whole diagnosis, stage by stage, from a batch's recordings to a verdict and its report.

docs/diagnosis.md describes the stages and why they decide as they do.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from threadpoolctl import threadpool_limits

from ccmodel.deadline import Deadline
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.calibration import TestedModel, tested_model
from ccmodel.diagnosis.candidate import CandidateFit, fit
from ccmodel.diagnosis.equation_error import LOAD_SPRING, largest_inertia, load_values
from ccmodel.diagnosis.hypothesis import single_mechanisms, stated_hypothesis
from ccmodel.diagnosis.laws import first_laws
from ccmodel.diagnosis.observations import NotJudged, observations_of
from ccmodel.diagnosis.repeatability import estimated
from ccmodel.diagnosis.result import report
from ccmodel.diagnosis.selection import Selection
from ccmodel.diagnosis.verdict import Judgement, judge, with_discretisation
from ccmodel.diagnosis.whitening import Whitened, relinearised, whiten
from ccmodel.inference.observations import Tolerance
from ccmodel.inference.pool import each
from ccmodel.model.parameters import Parameters
from ccmodel.model.session import with_session
from ccmodel.progress import Progress, silent, within
from ccmodel.recording import Recording, in_order

# Shares of the time at which the model is calibrated, the mechanisms are selected and the verdict is decided; and share
# of the first fit in the time of a calibration. Measured on two batches, data/raw/loops and half-loop.
CALIBRATED, SELECTED, JUDGED = 0.04, 0.88, 0.95
FIRST_FIT = 0.5


@dataclass(frozen=True)
class Options:
    """Options of a diagnosis: which samples are compared, and which candidate models are fitted.

    Attributes
    ----------
    tolerance : float or mapping of str to float
        Standard deviation of the model discrepancy that counts as noise, as a share of a channel's peak to peak.
    step_s : float
        Least time between compared samples, s.
    cycles : int, optional
        Number of cycles of a sine that are compared, counted from the end of its start-up transient; None: all.
    forced_candidates : sequence of sequence of str
        Candidates of one to four mechanisms, each as "name at place", that are fitted whatever their screening score.
    without : collection of str
        Mechanisms that are excluded from the candidates. The proof excludes the true one to imitate unknown physics.
    freeze : bool
        Whether a baseline keeps its values, except for sensor zeros that are not observed at rest. The diagnosis then
        finds what has changed on the rig since the baseline was fitted.
    run_limit : int
        Runs of the model, each on one recording, after which no further candidate is fitted: the verdict is on what was
        fitted until then. It does not depend on the machine.
    time_limit_s : float
        The same as a time, s.
    """

    tolerance: Tolerance = 0.0
    step_s: float = settings.STEP_S
    cycles: int | None = None
    forced_candidates: Sequence[Sequence[str]] = ()
    without: Collection[str] = ()
    freeze: bool = False
    run_limit: int = settings.RUN_LIMIT
    time_limit_s: float = settings.TIME_LIMIT_S

    def deadline(self, share: float = 1.0) -> Deadline:
        """When a share of both limits is over, counted from now."""
        return Deadline.after(share * self.time_limit_s, share * self.run_limit)


@dataclass(frozen=True)
class Calibration:
    """The calibrated model of a batch, which every candidate model is compared to.

    Attributes
    ----------
    tested : TestedModel
        The model that is tested, with its unknowns and their values from a first fit.
    whitened : list of Whitened
        The observations, their errors whitened with the spreads that they show.
    fit : CandidateFit
        The calibrated model.
    not_judged : list of {"what", "why"}
        What the recordings do not let a fit judge.
    """

    tested: TestedModel
    whitened: list[Whitened]
    fit: CandidateFit
    not_judged: NotJudged

    @property
    def model(self) -> Parameters:
        """The calibrated model, which can simulate any recording of the rig."""
        return self.fit.model(self.tested.estimates)


@dataclass(frozen=True)
class Diagnosis:
    """Result of a diagnosis.

    Attributes
    ----------
    report : dict
        The content of diagnosis.json.
    judgement : Judgement
        The verdict with the fitted candidates and their probabilities.
    calibrated : CandidateFit
        The calibrated model before any candidate was fitted.
    estimates : Parameters
        Values of the parameters that are not fitted; the fitted ones are replaced by `model`.
    """

    report: dict
    judgement: Judgement
    calibrated: CandidateFit
    estimates: Parameters

    def model(self, candidate: CandidateFit) -> Parameters:
        """A candidate's fitted model, which can simulate any recording of the rig."""
        return candidate.model(self.estimates)


# BLAS stays on one thread: recordings are worked on in parallel, and sums over several threads differ in their last
# digits with the number of threads.
_one_thread = threadpool_limits.wrap(limits=1, user_api="blas")


@_one_thread
def calibrate(
    recordings: Sequence[Recording],
    estimates: Parameters,
    options: Options = Options(),
    baseline: Parameters | None = None,
    progress: Progress = silent,
    only: Collection[str] | None = None,
) -> Calibration:
    """Fit the paper's model, or a baseline, to recordings; parameters as of `diagnose`.

    Three fits: a first one gives the model about which the errors are linearised and whitened. A fit of the whitened
    errors shows how much friction and zeros differ from run to run; whitened with these spreads, about each recording's
    own friction and initial tensions, they give the calibrated model.

    Parameters
    ----------
    only : collection of str, optional
        Unknowns that are fitted, of those that these recordings determine; all of them if none is stated.

    Raises
    ------
    ModelError
        If the model cannot be run on any of the recordings, or `only` has another name.
    """
    recordings, estimates = in_order(recordings), with_session(estimates, recordings)
    observations, missing = observations_of(recordings, estimates, options.tolerance, options.step_s, options.cycles)
    tested_name = "the baseline" if baseline else "the paper's model"
    progress(f"calibrating {tested_name} on {len(observations)} recordings", 0.0)
    tested = tested_model(observations, estimates, baseline, options.freeze, only)
    at_estimates = [o.with_parameters(tested.estimates) for o in observations]
    progress("calibrating with whitened errors", FIRST_FIT)
    whitened = each(at_estimates, lambda i, o: whiten(o, tested.model))
    first = fit(whitened, tested.hypothesis, tested.free, tested.start)
    repeatability = estimated(first.whitened, first.residuals)
    whitened = each(whitened, lambda i, w: relinearised(w, first.model(tested.estimates, w.session), repeatability))
    return Calibration(tested, whitened, fit(whitened, tested.hypothesis, tested.free, first.values), missing)


def _recorded_by_all(recordings: Sequence[Recording]) -> set[str]:
    """Channels that every recording has."""
    return set.intersection(*(set(recording.channels) for recording in recordings))


@_one_thread
def diagnose(
    recordings: Sequence[Recording],
    estimates: Parameters,
    options: Options = Options(),
    baseline: Parameters | None = None,
    not_judged: Sequence[Mapping[str, str]] = (),
    progress: Progress = silent,
) -> Diagnosis:
    """Decide whether a calibrated model explains recordings, and if not, where it fails and which physics is missing.

    Parameters
    ----------
    recordings : sequence of Recording
        Of one batch.
    estimates : Parameters
        Estimates that `batch.yaml` states. They are the start of the calibration and the values of what is not fitted.
    options : Options
    baseline : Parameters, optional
        A model fitted earlier, which is tested instead of the paper's. Its parameters, and those of its mechanisms, are
        fitted again, unless the options freeze it.
    not_judged : sequence of {"what", "why"}
        What is left out already, such as refused recordings, with the reason; the report lists it.
    progress : Progress

    Raises
    ------
    ModelError
        If the model cannot be run on any of the recordings.
    """
    deadline, sets_until = options.deadline(), options.deadline(settings.SETS_SHARE)
    reported_by = options.deadline(settings.REPORT_SHARE)
    found = calibrate(recordings, estimates, options, baseline, within(progress, 0.0, CALIBRATED))
    tested, whitened = found.tested, found.whitened
    unjudged = [*map(dict, not_judged), *found.not_judged]
    if options.freeze:
        why = "frozen at the baseline's values, as requested"
        unjudged.append({"what": "stiffness, friction and everything else that a calibration would fit", "why": why})
    used = {w.name for w in whitened}
    compared = [r for r in recordings if f"{r.batch}/{r.id}" in used] or recordings
    mechanisms = single_mechanisms(options.without, tested.hypothesis, _recorded_by_all(compared))
    forced = [stated_hypothesis(stated) for stated in options.forced_candidates]
    of_selection = within(progress, CALIBRATED, SELECTED)
    has_spring = LOAD_SPRING in tested.free
    known, limits = (load_values(recordings), largest_inertia(recordings)) if has_spring else ({}, {})
    selection = Selection(
        tested.free, mechanisms, forced, first_laws(), of_selection, known, limits, deadline, sets_until
    )
    comparison, scores = selection.run(whitened, found.fit)
    if deadline.has_passed:
        limit = f"the limit of {options.run_limit:,} model runs"
        if deadline.is_late:
            limit = f"the time limit of {options.time_limit_s:g} s"
        why = f"{limit} was reached before all of them were fitted"
        unjudged.append({"what": "further candidates", "why": why})
    progress("deciding the verdict", SELECTED)
    judgement, not_computed = with_discretisation(judge(comparison, scores))
    unjudged += not_computed
    progress("designing an experiment", JUDGED)
    content = report(recordings[0].batch, judgement, found.fit, tested.estimates, unjudged, reported_by)
    return Diagnosis(content, judgement, found.fit, tested.estimates)
