"""The whole diagnosis, stage by stage: a batch's recordings in, a judgement and its report out."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from threadpoolctl import threadpool_limits

from ccmodel.diagnose import settings
from ccmodel.diagnose.calibration import model_in_question
from ccmodel.diagnose.candidate import CandidateFit, fit
from ccmodel.diagnose.hypothesis import single_mechanisms, stated_hypothesis
from ccmodel.diagnose.observations import observations_of
from ccmodel.diagnose.result import report
from ccmodel.diagnose.selection import Progress, Selection, silent
from ccmodel.diagnose.verdict import Judgement, judge
from ccmodel.diagnose.whitening import whiten
from ccmodel.inference.observations import Tolerance
from ccmodel.inference.pool import each
from ccmodel.model.parameters import Parameters
from ccmodel.recording import Recording


@dataclass(frozen=True)
class Options:
    """What a diagnosis compares, and what it fits.

    Attributes
    ----------
    tolerance : float or mapping of str to float
        Standard deviation of the model discrepancy that counts as noise, as a share of a channel's peak to peak.
    step_s : float
        Least time between compared samples, s.
    cycles : int, optional
        Compared cycles of a sine after its start-up transient; None: all.
    forced_candidates : sequence of sequence of str
        Candidates of one or two mechanisms, each as "name at place", that are fitted whatever their screening score.
    without : collection of str
        Mechanisms that are not considered, to see the verdict when the true mechanism is unknown.
    freeze : bool
        Whether a baseline keeps its values, except for sensor zeros that are not observed at rest. The question is
        then what has changed since it was fitted.
    """

    tolerance: Tolerance = 0.0
    step_s: float = settings.STEP_S
    cycles: int | None = None
    forced_candidates: Sequence[Sequence[str]] = ()
    without: Collection[str] = ()
    freeze: bool = False


@dataclass(frozen=True)
class Diagnosis:
    """A diagnosis.

    Attributes
    ----------
    report : dict
        The content of diagnosis.json.
    judgement : Judgement
    estimates : Parameters
        Values of everything that is not fitted.
    """

    report: dict
    judgement: Judgement
    estimates: Parameters

    def model(self, candidate: CandidateFit) -> Parameters:
        """A candidate's fitted model, for any recording."""
        return candidate.model(self.estimates)


# BLAS stays on one thread: recordings are worked on in parallel, and sums over several threads differ in their last
# digits with the number of threads.
@threadpool_limits.wrap(limits=1, user_api="blas")
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
        The batch's own.
    options : Options
    baseline : Parameters, optional
        A model fitted earlier, in place of the paper's. Its mechanisms are fitted again with everything else.
    not_judged : sequence of {"what", "why"}
        What could not be judged, as far as is known already.
    progress : callable
        Takes a line for each step of the work.

    Raises
    ------
    ModelError
        If the model cannot be run on any of the recordings.
    """
    observations, missing = observations_of(recordings, estimates, options.tolerance, options.step_s, options.cycles)
    not_judged = [*map(dict, not_judged), *missing]
    if options.freeze:
        why = "frozen at the baseline's values, as requested"
        not_judged.append({"what": "stiffness, friction and everything else that a calibration would fit", "why": why})
    question_name = "the baseline" if baseline else "the paper's model"
    progress(f"calibrating {question_name} on {len(observations)} recordings")
    question = model_in_question(observations, estimates, baseline, options.freeze)
    at_estimates = [o.with_parameters(question.estimates) for o in observations]
    whitened = each(at_estimates, lambda i, o: whiten(o, question.model))
    base = fit(whitened, question.hypothesis, question.free, question.start)
    mechanisms = single_mechanisms(options.without, question.hypothesis)
    forced = [stated_hypothesis(stated) for stated in options.forced_candidates]
    selection = Selection(question.free, mechanisms, forced, progress)
    judgement = judge(*selection.run(whitened, base))
    found = report(recordings[0].batch, judgement, question.estimates, not_judged)
    return Diagnosis(found, judgement, question.estimates)
