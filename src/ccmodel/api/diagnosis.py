"""Diagnoses: whether the calibrated model explains a batch, and which physics is missing."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from ccmodel.api.batch import Batch, joint_batch
from ccmodel.api.model import HasModel, as_model, files_among
from ccmodel.api.options import Candidates, Tolerance, check_step, diagnosis_options, progress_of
from ccmodel.api.recordings import counted
from ccmodel.diagnosis.kept_law import check_name, file_of, mechanism_file
from ccmodel.failure import ModelError
from ccmodel.model.files import Model
from ccmodel.outputs import new_file
from ccmodel.paths import try_folder
from ccmodel.progress import Progress, within
from ccmodel.report.verdict import SYMBOL, error_name, errors_in_words, nearest_sentence, sentence
from ccmodel.studies.diagnosis.page import candidates_of
from ccmodel.studies.diagnosis.run import FILES, INGEST, PAGE, Outcome, diagnosed, write_alone
from ccmodel.typed import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis:
    """The diagnosis of a batch, or of several of one rig.

    Attributes
    ----------
    batch : Batch
        The batch; of several, all their recordings, with ids such as ``loops/loops-1-a``.
    """

    batch: Batch
    _outcome: Outcome

    @property
    def report(self) -> dict[str, Any]:
        """The content of diagnosis.json (docs/diagnosis.md)."""
        return self._outcome.content

    @property
    def verdict(self) -> str:
        """One of ``agrees``, ``explained``, ``learned``, ``undecided``, ``unexplained`` and ``inputs-inconsistent``."""
        return self.report["verdict"]

    @property
    def headline(self) -> str:
        """The verdict in a line."""
        return self.report["headline"]

    @property
    def confidence(self) -> float | None:
        """Probability of what the verdict names, 0 to 1.

        Of the least certain of the mechanisms (``explained``), of the least certain law (``learned``), of the most
        probable mechanism (``undecided``), of the surest contradiction (``inputs-inconsistent``); None for the verdicts
        that name nothing.
        """
        named = {
            "explained": self.report["mechanisms"],
            "learned": self.report["laws"],
            "undecided": [*self.report["mechanisms"], *self.report["alternatives"]][:1],
            "inputs-inconsistent": self.report["not_judged"][:1],
        }
        return min((one["confidence"] for one in named.get(self.verdict, ())), default=None)

    @property
    def model(self) -> Model | None:
        """The best model: with the mechanisms that are named or most probable, otherwise the calibrated one.

        None if no model was fitted.
        """
        return self._outcome.models.get("extended")

    @property
    def calibrated(self) -> Model | None:
        """The paper's model (or the baseline), calibrated to the batch; None if no model was fitted."""
        return self._outcome.models.get("calibrated")

    @property
    def nearest(self) -> Model | None:
        """The best candidate of an ``unexplained`` batch, which was not accepted; None with another verdict."""
        return self._outcome.models.get("nearest")

    def to_frame(self) -> pd.DataFrame:
        """Candidate models that were compared to the end, a row each: the calibrated one, then by mean square.

        Columns ``mean_square`` (of the leave-one-out residuals over their noise; 1 is noise), ``lack_of_fit`` (least
        mean square of a model discrepancy whose evidence is within a factor of 20 of the best), ``probability`` (that
        it is all that is missing) and ``why`` it was selected or not.
        """
        rows = [] if self._outcome.found is None else candidates_of(self._outcome.found)
        columns = ["candidate", "mean_square", "lack_of_fit", "probability", "why"]
        return pd.DataFrame(rows, columns=columns).set_index("candidate").astype({"lack_of_fit": float})

    @property
    def errors(self) -> pd.DataFrame:
        """Root mean square error on held-out recordings, a row for each channel.

        Columns ``before`` (calibrated model), ``after`` (best model, if it has further mechanisms), with an unexplained
        batch ``nearest`` (the model that was not accepted), and ``noise`` (the noise floor), all in ``unit``.
        """
        frame = pd.DataFrame.from_dict(self.report["fit"]["error"], orient="index").rename_axis("channel")
        if "after" in frame and (frame["after"] == frame["before"]).all():
            del frame["after"]
        if nearest := (self.report["nearest"] or {}).get("error"):
            of_nearest = pd.Series({channel: one["after"] for channel, one in nearest.items()})
            frame.insert(frame.columns.get_loc("noise"), "nearest", of_nearest)
        return frame

    def plot(self) -> "Figure":
        """Held-out errors by channel over the noise floor, before and after.

        Raises
        ------
        InputError
            If no model was fitted.
        """
        from ccmodel.api import figures

        if self._outcome.found is None:
            raise InputError(
                f"{self.batch.name}: verdict '{self.verdict}': no model was fitted, so there are no errors"
            )
        return figures.errors(self.errors, self.batch, self.verdict)

    def save(self, folder: str | Path) -> None:
        """Write diagnosis.json, report.html and the models, as ``ccmodel diagnose --out`` does.

        Raises
        ------
        InputError
            If the folder cannot be made or written to.
        """
        write_alone(self._outcome, Path(folder))

    def keep_law(self, name: str, folder: str | Path) -> Path | None:
        """Write the learned law as the file of a mechanism, to be reviewed and added to the list.

        Parameters
        ----------
        name : str
            Of the new mechanism: small letters, with hyphens.
        folder : str or Path

        Returns
        -------
        Path or None
            The file; None with another verdict than ``learned``.

        Raises
        ------
        InputError
            If a mechanism cannot have this name, or the folder cannot be made or written to.
        """
        check_name(name)
        if self.verdict != "learned" or self._outcome.found is None:
            return None
        best, law = self._outcome.found.judgement.best, self.report["laws"][0]
        file = Path(folder).expanduser() / file_of(name)
        with new_file(file) as fresh:
            fresh.write_text(mechanism_file(name, law, best, self.batch.name), encoding="utf-8")
        return file

    def __repr__(self) -> str:
        parts = [f"Diagnosis of {self.headline}", f"verdict: {self.verdict}{self._with_confidence}"]
        if nearest := nearest_sentence(self.report):
            parts.append(nearest)
        if self._outcome.found is not None:
            parts.append(errors_in_words(self.report["fit"]))
        return "\n".join(parts)

    def _repr_html_(self) -> str:
        said = [f"<strong>{escape(self.batch.name)}</strong>: {escape(sentence(self.report))}"]
        said.append(f"Verdict: <strong>{self.verdict}</strong>{self._with_confidence}")
        if nearest := nearest_sentence(self.report):
            said.append(escape(nearest))
        paragraphs = "".join(f"<p>{line}</p>" for line in said)
        if self._outcome.found is None:
            return paragraphs
        errors = self.errors
        ratios = errors.drop(columns=["noise", "unit"]).div(errors["noise"], axis=0).rename(index=SYMBOL)
        caption = f"<p>{error_name(self.report['fit'])} over the noise floor, {self._recorded}</p>"
        return paragraphs + caption + ratios.to_html(float_format="{:.1f}".format, border=0)

    @property
    def _recorded(self) -> str:
        return f"{counted(len(self.batch))}, {'measured' if self.batch.origin == 'rig' else 'simulated'}"

    @property
    def _with_confidence(self) -> str:
        return "" if self.confidence is None else f", confidence {self.confidence:.2f}"


def diagnose(
    batch: Batch | str | Path | Sequence[Batch | str | Path],
    out: str | Path | None = None,
    *,
    baseline: Model | HasModel | str | Path | None = None,
    freeze: bool = False,
    without: str | Collection[str] = (),
    tolerance: Tolerance | None = None,
    step_s: float | None = None,
    cycles: int | None = None,
    candidates: Candidates = (),
    run_limit: int | None = None,
    time_limit_s: float | None = None,
    trust_inputs: bool = False,
    progress: bool | Progress = False,
) -> Diagnosis:
    """Decide whether the calibrated model explains a batch; if not, locate and name the physics left out.

    It takes half a minute to three minutes.

    Parameters
    ----------
    batch : Batch, str, Path or sequence of these
        A batch, or its folder; or all batches of one rig, which are diagnosed together: stiffness, friction, load and
        mechanisms are the rig's, while zeros, initial tensions and a few per cent of friction differ between batches.
    out : str or Path, optional
        Folder for diagnosis.json, the page and the models; `Diagnosis.save` writes them later.
    baseline : Model, Fit, Diagnosis, str or Path, optional
        Model to start from, what has one, or its file, instead of the estimates of ``batch.yaml``.
    freeze : bool
        Whether the baseline keeps its values, but for the sensors' zeros: finds what has changed since it was fitted.
        Its drifts, which are those of another session, are left out.
    without : str or collection of str
        Mechanisms that are no candidates.
    tolerance, step_s, cycles, trust_inputs, progress
        As of `ccmodel.fit`. A batch whose inputs contradict one another has the verdict ``inputs-inconsistent`` unless
        they are trusted.
    candidates : str or sequence
        Mechanisms at their places, which are fitted in full whatever the screening says: ``"kink at conduit"``; or up
        to four together, as ``"kink at conduit, backlash at load-pulley"`` or as a sequence; or a sequence of these.
    run_limit : int, optional
        Runs of the model, each on one recording, after which no further candidate is fitted; by default 50,000, which
        take two cores about two minutes. The report says so. The verdict does not depend on the machine as long as this
        limit comes first.
    time_limit_s : float, optional
        Time after which no further candidate is fitted, s, by default 160.

    Returns
    -------
    Diagnosis
        With the verdict, the best model and its errors.

    Raises
    ------
    InputError
        If the batch, the baseline or an option cannot be used, or `out` cannot be written.

    Examples
    --------
    >>> import ccmodel as cc
    >>> found = cc.diagnose("data/raw/half-loop", step_s=0.06)
    >>> found.verdict
    'explained'
    >>> for one in sorted(found.report["mechanisms"], key=lambda one: (one["name"], one["place"])):
    ...     print(one["name"], "at", one["place"])
    presliding at conduit
    pulley-friction at drive-pulley
    termination-compliance at drive-end
    termination-compliance at load-end
    """
    options = diagnosis_options(
        tolerance,
        step_s,
        cycles,
        candidates,
        without,
        freeze,
        baseline is not None,
        run_limit=run_limit,
        time_limit_s=time_limit_s,
    )
    known = None if baseline is None else as_model(baseline).parameters
    if out is not None:
        try_folder(out, files=FILES, read=files_among(baseline))
    with progress_of(progress) as report:
        several = batch if isinstance(batch, Sequence) and not isinstance(batch, str) else [batch]
        batch = joint_batch(several, within(report, 0.0, INGEST))
        check_step(batch.recordings, step_s)
        batch._ingested.check_usable(batch.folder, trust_inputs)
        part = within(report, INGEST, PAGE)
        try:
            outcome = diagnosed(batch._ingested, dict(batch.provenance), options, known, part, trust_inputs)
        except (ModelError, ValueError) as error:
            raise InputError(f"{batch.name if len(several) > 1 else batch.folder}: {error}") from None
        found = Diagnosis(batch, outcome)
        if out is not None:
            report("writing the page", PAGE)
            found.save(out)
    return found
