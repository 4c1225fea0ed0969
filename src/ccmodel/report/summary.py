"""The outcome of a run, or of one diagnosis: verdicts, held-out errors, what was left out, where the page is."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel

from ccmodel.report.page.writing import left_out_of
from ccmodel.report.verdict import INPUTS_INCONSISTENT, SYMBOL, errors_in_words, sentence
from ccmodel.steps.files import read_json
from ccmodel.typed import InputError, OneOf, Positive, load_json_model

DIAGNOSIS, WRITER = "diagnosis.json", "a diagnosis"


class _Error(BaseModel):
    before: float
    after: float
    noise: Positive
    unit: str


class _Fit(BaseModel):
    held_out: list[str] = []
    error: dict[Annotated[str, OneOf(tuple(SYMBOL))], _Error] = {}


class _NotJudged(BaseModel):
    what: str
    why: str
    refused: bool = False


class _Diagnosis(BaseModel):
    """What is shown of a diagnosis.json by itself; its sentence is made of more."""

    batch: str
    verdict: str | None
    fit: _Fit | None = None
    not_judged: list[_NotJudged] = []


@dataclass(frozen=True)
class Verdict:
    """Verdict on a batch.

    Attributes
    ----------
    batch : str
    verdict : str or None
        None if the batch could not be diagnosed.
    sentence : str
    held_out_error : dict of str to dict
        By channel: ``before``, ``after``, ``noise``, in the ``unit`` that is stated there.
    held_out : list of str
        Recordings of which these are the errors; none if there was one recording only, and the errors are of its fit.
    page : Path or None
        Report of the diagnosis.
    """

    batch: str
    verdict: str | None
    sentence: str
    held_out_error: dict[str, dict]
    held_out: list[str]
    page: Path | None


@dataclass(frozen=True)
class Summary:
    """Outcome of a run or of a diagnosis.

    Attributes
    ----------
    verdicts : sequence of Verdict
    left_out, inconsistent, warnings : sequence of str
        Lines, as in `ccmodel.report.page.writing.messages_of`.
    page : Path or None
        Page of the run or of the diagnosis.
    """

    verdicts: Sequence[Verdict]
    left_out: Sequence[str] = ()
    inconsistent: Sequence[str] = ()
    warnings: Sequence[str] = field(default=())
    page: Path | None = None

    def as_dict(self) -> dict:
        """Plain data."""
        return asdict(self)

    def lines(self) -> list[str]:
        """The verdicts with their held-out errors, and where the page is."""
        lines = []
        for one in self.verdicts:
            verdict = f"{one.verdict}. " if one.verdict else ""
            lines.append(f"{one.batch}: {verdict}{one.sentence}")
            if one.held_out_error:
                lines.append(f"  {errors_in_words({'error': one.held_out_error, 'held_out': one.held_out})}")
        return lines + ([f"page: {self.page}"] if self.page else [])


def summary_of(folder: Path) -> Summary:
    """Outcome of the run, or of the diagnosis, that wrote a folder.

    Raises
    ------
    InputError
        If the folder is of neither, or the run did not come to its end.
    """
    if (folder / DIAGNOSIS).exists():
        return _of_diagnosis(folder)
    of_run = left_out_of(folder)
    # Verdicts of earlier runs, on batches that the configuration no longer has, stay in the folder.
    files = [
        file
        for file in sorted(folder.glob(f"diagnoses/*/{DIAGNOSIS}"))
        if of_run.diagnosed is None or file.parent.name in of_run.diagnosed
    ]
    page = _if_there(folder / "index.html")
    return Summary([_verdict(file) for file in files], of_run.left_out, of_run.inconsistent, of_run.warnings, page)


def _of_diagnosis(folder: Path) -> Summary:
    verdict = _verdict(folder / DIAGNOSIS)
    stated = load_json_model(folder / DIAGNOSIS, _Diagnosis, WRITER)
    refused, lines = ([f"{n.what}: {n.why}" for n in stated.not_judged if n.refused is kind] for kind in (True, False))
    if verdict.verdict == INPUTS_INCONSISTENT:
        return Summary([verdict], refused, inconsistent=lines, page=verdict.page)
    left_out = refused if verdict.verdict else [f"{verdict.batch}: {verdict.sentence}", *refused]
    return Summary([verdict], left_out, warnings=[f"not judged: {line}" for line in lines], page=verdict.page)


def _verdict(file: Path) -> Verdict:
    stated = load_json_model(file, _Diagnosis, WRITER)
    error = {channel: one.model_dump() for channel, one in stated.fit.error.items()} if stated.fit else {}
    page = _if_there(file.parent / "report.html")
    try:
        held_out = stated.fit.held_out if stated.fit else []
        return Verdict(stated.batch, stated.verdict, sentence(read_json(file)), error, held_out, page)
    except (LookupError, TypeError, AttributeError, ValueError, ArithmeticError):
        raise InputError(f"{file}: is not what {WRITER} wrote") from None


def _if_there(file: Path) -> Path | None:
    return file if file.exists() else None
