"""Diagnoses: whether the calibrated model explains a batch, and which physics is missing."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from ccmodel.api.batch import Batch, as_batch
from ccmodel.api.model import read_model
from ccmodel.api.options import Tolerance, progress_of, settings_of
from ccmodel.failure import ModelError
from ccmodel.model.files import Model
from ccmodel.progress import Progress
from ccmodel.report.verdict import SYMBOL, nearest_sentence, sentence
from ccmodel.studies.diagnosis.page import candidates_of
from ccmodel.studies.diagnosis.run import Outcome, check_options, diagnosed, options_of, write_alone
from ccmodel.typed import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis:
    """The diagnosis of a batch.

    Attributes
    ----------
    batch : Batch
    outcome : Outcome
        The result as ``ccmodel.studies.diagnosis`` has it; private, as everything below this interface.
    """

    batch: Batch
    outcome: Outcome

    @property
    def report(self) -> dict[str, Any]:
        """The content of diagnosis.json (docs/diagnosis.md)."""
        return self.outcome.content

    @property
    def verdict(self) -> str:
        """One of ``agrees``, ``explained``, ``undecided``, ``unexplained`` and ``inputs-inconsistent``."""
        return self.report["verdict"]

    @property
    def headline(self) -> str:
        """The verdict in a line."""
        return self.report["headline"]

    @property
    def confidence(self) -> float | None:
        """Probability of what the verdict names, 0 to 1.

        Of the least certain of the mechanisms (``explained``), of the most probable alternative (``undecided``), of the
        surest contradiction (``inputs-inconsistent``); None for the verdicts that name nothing.
        """
        named = {
            "explained": self.report["mechanisms"],
            "undecided": self.report["alternatives"][:1],
            "inputs-inconsistent": self.report["not_judged"][:1],
        }
        return min((one["confidence"] for one in named.get(self.verdict, ())), default=None)

    @property
    def model(self) -> Model | None:
        """The best model: with the mechanisms that are named or most probable, otherwise the calibrated one.

        None if no model was fitted.
        """
        return self.outcome.models.get("extended")

    @property
    def calibrated(self) -> Model | None:
        """The paper's model (or the baseline), calibrated to the batch; None if no model was fitted."""
        return self.outcome.models.get("calibrated")

    @property
    def nearest(self) -> Model | None:
        """The best candidate of an ``unexplained`` batch, which was not accepted; None with another verdict."""
        return self.outcome.models.get("nearest")

    def to_frame(self) -> pd.DataFrame:
        """Candidate models, a row each, those with the smallest mean square first.

        Columns ``mean_square`` (of the leave-one-out residuals over their noise; 1 is noise), ``lack_of_fit`` (share of
        these residuals that a regression predicts from the other recordings), ``probability`` (among the candidates)
        and ``why`` it was selected or not.
        """
        rows = [] if self.outcome.found is None else candidates_of(self.outcome.found)
        columns = ["candidate", "mean_square", "lack_of_fit", "probability", "why"]
        return pd.DataFrame(rows, columns=columns).set_index("candidate").astype({"lack_of_fit": float})

    def errors(self) -> pd.DataFrame:
        """Root mean square error on held-out recordings, a row for each channel.

        Columns ``before`` (calibrated model), ``after`` (best model), with an unexplained batch ``nearest`` (the model
        that was not accepted), and ``noise`` (the noise floor), all in ``unit``.
        """
        frame = pd.DataFrame.from_dict(self.report["fit"]["error"], orient="index").rename_axis("channel")
        nearest = (self.report["nearest"] or {}).get("error")
        if nearest:
            frame.insert(2, "nearest", pd.Series({channel: one["after"] for channel, one in nearest.items()}))
        return frame

    def plot(self) -> "Figure":
        """Held-out errors by channel over the noise floor, before and after.

        Raises
        ------
        InputError
            If no model was fitted.
        """
        from ccmodel.api import figures

        if self.outcome.found is None:
            raise InputError(
                f"{self.batch.name}: verdict '{self.verdict}': no model was fitted, so there are no errors"
            )
        return figures.errors(self.errors(), self.batch, self.verdict)

    def save(self, folder: str | Path) -> None:
        """Write diagnosis.json, report.html and the models, as ``ccmodel diagnose --out`` does."""
        try:
            write_alone(self.outcome, Path(folder))
        except OSError as error:
            raise InputError(f"{folder}: cannot be written ({error.strerror})") from None

    def __repr__(self) -> str:
        parts = [f"Diagnosis of {self.headline}", f"verdict: {self.verdict}{self._with_confidence}"]
        if nearest := nearest_sentence(self.report):
            parts.append(nearest)
        if self.outcome.found is not None:
            parts.append("held-out error over the noise floor: " + "; ".join(self._falls))
        return "\n".join(parts)

    def _repr_html_(self) -> str:
        said = [f"<strong>{escape(self.batch.name)}</strong>: {escape(sentence(self.report))}"]
        said.append(f"Verdict: <strong>{self.verdict}</strong>{self._with_confidence}")
        if nearest := nearest_sentence(self.report):
            said.append(escape(nearest))
        paragraphs = "".join(f"<p>{line}</p>" for line in said)
        if self.outcome.found is None:
            return paragraphs
        errors = self.errors()
        ratios = errors.drop(columns=["noise", "unit"]).div(errors["noise"], axis=0).rename(index=SYMBOL)
        caption = f"<p>held-out error over the noise floor, {self._recorded}</p>"
        return paragraphs + caption + ratios.to_html(float_format="{:.1f}".format, border=0)

    @property
    def _recorded(self) -> str:
        n = len(self.batch)
        return f"{n} recording{'' if n == 1 else 's'}, {'measured' if self.batch.file.origin == 'rig' else 'simulated'}"

    @property
    def _with_confidence(self) -> str:
        return "" if self.confidence is None else f", confidence {self.confidence:.2f}"

    @property
    def _falls(self) -> list[str]:
        """Error over the noise floor by channel, before and after."""
        return [
            f"{SYMBOL[channel]} {e['before'] / e['noise']:.1f}"
            + (f" to {e['after'] / e['noise']:.1f}" if e["after"] != e["before"] else "")
            for channel, e in self.report["fit"]["error"].items()
        ]


def diagnose(
    batch: Batch | str | Path,
    out: str | Path | None = None,
    *,
    baseline: Model | str | Path | None = None,
    freeze: bool = False,
    without: Collection[str] = (),
    tolerance: Tolerance | None = None,
    step_s: float | None = None,
    cycles: int | None = None,
    candidates: Sequence[str | Sequence[str]] = (),
    trust_inputs: bool = False,
    progress: bool | Progress = False,
) -> Diagnosis:
    """Decide whether the calibrated model explains a batch; if not, locate and name the physics left out.

    It takes half a minute to three minutes.

    Parameters
    ----------
    batch : Batch, str or Path
        A batch, or its folder.
    out : str or Path, optional
        Folder for diagnosis.json, the page and the models; `Diagnosis.save` writes them later.
    baseline : Model, str or Path, optional
        Model to start from, or its file, instead of the estimates of ``batch.yaml``.
    freeze : bool
        Whether the baseline keeps all its values: finds what has changed since it was fitted.
    without : collection of str
        Mechanisms that are no candidates.
    tolerance, step_s, cycles, trust_inputs, progress
        As of `ccmodel.fit`. A batch whose inputs contradict one another has the verdict ``inputs-inconsistent`` unless
        they are trusted.
    candidates : sequence of str or of sequence of str
        As ``"kink at conduit"``, or two of these together: fitted in full whatever the screening says.

    Raises
    ------
    InputError
        If the batch, the baseline or an option cannot be used, or `out` cannot be written.

    Examples
    --------
    >>> import ccmodel as cc
    >>> found = cc.diagnose("data/raw/half-loop", step_s=0.04)
    >>> found.verdict
    'unexplained'
    >>> found.report["location"]["place"]
    'conduit'
    >>> found.nearest
    Model: ...; pulley-friction at drive-pulley, fitted to half-loop, recording (virtual rig, simulated)
    """
    batch = as_batch(batch)
    if out is not None:
        _try_folder(Path(out))
    options = options_of(settings_of(tolerance, step_s, cycles, candidates), tuple(without), freeze)
    check_options(options, baseline is not None)
    known = None if baseline is None else (baseline if isinstance(baseline, Model) else read_model(baseline)).parameters
    batch.ingested.check_usable(batch.folder, trust_inputs)
    with progress_of(progress) as report:
        try:
            outcome = diagnosed(batch.ingested, dict(batch.provenance), options, known, report, trust_inputs)
        except (ModelError, ValueError) as error:
            raise InputError(f"{batch.folder}: {error}") from None
        found = Diagnosis(batch, outcome)
        if out is not None:
            found.save(out)
    return found


def _try_folder(folder: Path) -> None:
    """Make a folder before the work whose results it takes."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made a folder ({error.strerror})") from None
