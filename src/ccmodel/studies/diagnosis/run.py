"""A batch, or several of one rig -> a diagnosis: diagnosis.json, a page, and the models that were compared."""

import traceback
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path

from ccmodel import mechanisms as registry
from ccmodel import provenance
from ccmodel.diagnosis.run import Diagnosis, Options
from ccmodel.diagnosis.run import diagnose as run
from ccmodel.failure import ModelError
from ccmodel.model.files import Model, RigConditions
from ccmodel.model.parameters import Parameters
from ccmodel.outputs import new_files
from ccmodel.progress import Progress, silent
from ccmodel.recording import Recording
from ccmodel.report.verdict import headline
from ccmodel.rig.consistency.fitted import contradicted_by_fit
from ccmodel.rig.ingest import Ingested
from ccmodel.rig.joint import together
from ccmodel.steps.files import write_json
from ccmodel.steps.ingest import read_ingested
from ccmodel.studies.diagnosis import inconsistent
from ccmodel.studies.diagnosis.page import write_diagnosis, write_inconsistent, write_not_diagnosed
from ccmodel.studies.diagnosis.settings import MODEL_FILES, Diagnosing
from ccmodel.typed import InputError

VERDICT, PAGE_FILE = "diagnosis.json", "report.html"
# All that a diagnosis writes into its folder.
FILES = (VERDICT, PAGE_FILE, *MODEL_FILES.values())
# The page of a run of the pipeline, seen from the report of a diagnosis.
PAGE_OF_RUN = "../../index.html"
# Shares of the time at which the batch is read, and at which the page is written; measured as in `ccmodel.diagnosis`.
INGEST, PAGE = 0.05, 0.95


@dataclass(frozen=True)
class Outcome:
    """What a diagnosis of a batch has found, and what its files are made of.

    Attributes
    ----------
    content : dict
        The content of diagnosis.json.
    recordings : sequence of Recording
        Of the batch.
    found : Diagnosis or None
        None if the inputs contradict one another, so that there is no verdict on the physics.
    """

    content: dict
    recordings: Sequence[Recording]
    found: Diagnosis | None = None

    @property
    def models(self) -> dict[str, Model]:
        """The models, by the names of `MODEL_FILES`; without those that this verdict does not have."""
        if self.found is None:
            return {}
        judged = self.found.judgement
        has_further = judged.best is not judged.calibrated
        candidates = {"calibrated": self.found.calibrated}
        candidates["extended"] = judged.best if has_further else self.found.calibrated
        if self.content["nearest"] and judged.nearest is not None:
            candidates["nearest"] = judged.nearest
        rig, inputs = RigConditions.of(self.recordings), self.content["provenance"]
        return {name: Model(self.found.model(one), rig, provenance=inputs) for name, one in candidates.items()}


def diagnosed(
    ingested: Ingested,
    inputs: dict,
    options: Options = Options(),  # noqa: B008
    baseline: Parameters | None = None,
    progress: Progress = silent,
    trust_inputs: bool = False,
) -> Outcome:
    """Diagnose a batch that was read, or several of one rig (`ccmodel.rig.joint`); nothing is written.

    Parameters
    ----------
    ingested : Ingested
        With recordings, or with contradictions that nobody trusts.
    inputs : dict
        Version and digests of its files (`ccmodel.provenance.of_inputs`).
    options : Options
    baseline : Parameters, optional
        Model to start from, instead of the batch's own estimates.
    progress : Progress
    trust_inputs : bool
        Whether to diagnose even if the inputs contradict one another.

    Raises
    ------
    ModelError, ValueError
        If the model cannot be run on any of the recordings.
    """
    findings = ingested.findings
    if ingested.contradicts and not trust_inputs:
        report = inconsistent.report(ingested.stated.batch, findings, options.freeze, bool(ingested.parts))
        return Outcome(_complete(_with_batches(report, ingested), inputs), ingested.recordings)
    estimates = Parameters.estimated(ingested.stated.rig)
    found = run(ingested.recordings, estimates, options, baseline, _not_judged(ingested), progress)
    fitted = found.model(found.calibrated).stiffness_N_per_m
    if not trust_inputs and (wrong := contradicted_by_fit(fitted, ingested.stated)):
        report = inconsistent.report(ingested.stated.batch, [*findings, *wrong], options.freeze, bool(ingested.parts))
        return Outcome(_complete(_with_batches(report, ingested), inputs), ingested.recordings)
    found = replace(found, report=_with_batches(found.report, ingested))
    return Outcome(_complete(found.report, inputs), ingested.recordings, found)


def _with_batches(report: dict, ingested: Ingested) -> dict:
    """A report that names its batches after its name, if there are several."""
    if not ingested.parts:
        return report
    return {"format": report["format"], "batch": report["batch"], "batches": list(ingested.parts)} | report


def _complete(report: dict, inputs: dict) -> dict:
    """The content of diagnosis.json: a report with its headline and the digests of its inputs."""
    return report | {"headline": headline(report), "provenance": inputs}


def write(outcome: Outcome, out: Path, page: str | None = None) -> None:
    """Write diagnosis.json, the page and the models; the file of a model that there is not states why.

    Parameters
    ----------
    outcome : Outcome
    out : Path
        Folder of the files.
    page : str, optional
        Address of the page of the run, relative to `out`.
    """
    with _new_files(out) as fresh:
        _write(outcome, fresh, page)


def write_alone(outcome: Outcome, out: Path) -> None:
    """Write the files of a diagnosis that no run of the pipeline reads: without the file of a nearest model if none."""
    with _new_files(out) as fresh:
        _write(outcome, fresh, None)
        if not outcome.content["nearest"]:
            (fresh / MODEL_FILES["nearest"]).unlink()


def _new_files(out: Path) -> AbstractContextManager[Path]:
    """Files of a diagnosis, which take the place of an earlier one's together; its verdict goes first."""
    return new_files(out, last=VERDICT, without=(PAGE_FILE, *MODEL_FILES.values()))


def _write(outcome: Outcome, out: Path, page: str | None) -> None:
    write_json(out / VERDICT, outcome.content)
    _write_models(out, outcome.models, _without(outcome.content["verdict"]))
    if outcome.found is None:
        write_inconsistent(out / PAGE_FILE, outcome.content, outcome.recordings, page)
    else:
        write_diagnosis(out / PAGE_FILE, outcome.found, page)


def check_options(options: Options, has_baseline: bool) -> None:
    """Raise `InputError` if an excluded name is no mechanism, or a baseline is to be frozen that there is not."""
    try:
        for name in options.without:
            registry.get(name)
            if name in registry.laws():
                raise InputError(f"without: {name} is a learned law; only a listed mechanism can be excluded")
    except registry.UnknownMechanismError as error:
        raise InputError(f"without: {error}") from None
    if options.freeze and not has_baseline:
        raise InputError("freeze: there is no baseline to freeze; state its file, baseline=FILE or --baseline FILE")


def diagnose_recordings(
    recordings_files: Sequence[Path],
    out: Path,
    settings: Diagnosing | None = None,
    progress: Progress = silent,
) -> None:
    """Diagnose a batch that the pipeline has read, or all batches of a rig, which has the name of the folder `out`.

    What cannot be diagnosed has files with the reason.
    """
    settings, inputs = settings or Diagnosing(), provenance.of_inputs(recordings_files)
    name = recordings_files[0].stem if len(recordings_files) == 1 else out.name
    try:
        ingested = _read([(file.stem, read_ingested(file)) for file in recordings_files], name)
        if ingested.batch is None or not (ingested.recordings or (ingested.contradicts and not settings.trust_inputs)):
            raise ModelError("no recording that can be used")
        outcome = diagnosed(ingested, inputs, options_of(settings), None, progress, settings.trust_inputs)
    except Exception as error:  # an error that one batch causes must not stop the others
        reason = str(error)
        if not isinstance(error, InputError | ModelError):
            traceback.print_exc()
            reason = f"an unexpected error ({type(error).__name__}: {error}); the log of the job has its traceback"
        batches = {"batches": [file.stem for file in recordings_files]} if len(recordings_files) > 1 else {}
        with _new_files(out) as fresh:
            write_json(fresh / VERDICT, {"batch": name, **batches, "verdict": None, "why": reason})
            _write_models(fresh, {}, dict.fromkeys(MODEL_FILES, reason))
            write_not_diagnosed(fresh / PAGE_FILE, name, reason, PAGE_OF_RUN)
        return
    write(outcome, out, PAGE_OF_RUN)


def _read(batches: Sequence[tuple[str, Ingested]], name: str) -> Ingested:
    """A batch, or those of a rig together, without the ones that are refused as a whole."""
    usable = [(batch, ingested) for batch, ingested in batches if ingested.batch is not None]
    if len(batches) == 1 or not usable:
        return batches[0][1]
    refused = [f for _, ingested in batches if ingested.batch is None for f in ingested.findings]
    found = together(usable, name)
    return replace(found, findings=[*found.findings, *refused])


def _not_judged(ingested: Ingested) -> list[dict]:
    """Files that were refused, and contradictions of inputs that are trusted, with the reason.

    Of several batches also their estimates, if these differ.
    """
    findings, several = ingested.findings, bool(ingested.parts)
    refused = [replace(f, row=None, column=None) for f in findings if f.is_refused]
    trusted = [f for f in findings if f.severity == "inconsistent"]
    differing = [f for f in findings if several and f.batch == ingested.stated.batch]
    return [
        *({"what": f.place_in(several), "why": f.text, "refused": True} for f in refused),
        *({"what": f.place_in(several), "why": f.text, "confidence": f.confidence} for f in trusted),
        *({"what": f"{f.file}, {f.column}", "why": f.text} for f in differing),
    ]


def options_of(settings: Diagnosing, without: Sequence[str] = (), freeze: bool = False) -> Options:
    """Options of a diagnosis from the configuration's."""
    stated = settings.model_dump(exclude_none=True, exclude={"trust_inputs"})
    return Options(**stated, without=without, freeze=freeze)


def _write_models(out: Path, models: Mapping[str, Model], reasons: Mapping[str, str]) -> None:
    """Write the model files; one without a model states the reason."""
    for name, file in MODEL_FILES.items():
        none = {"succeeded": False, "message": reasons[name]}
        write_json(out / file, models[name].as_dict() if name in models else none)


def _without(verdict: str) -> dict[str, str]:
    """Why a verdict lacks a model, by the model's name."""
    return {name: f"verdict '{verdict}': the diagnosis has no {name} model" for name in MODEL_FILES}
