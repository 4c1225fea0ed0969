"""Options that several functions take: what is compared, and how progress is shown."""

import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from pydantic import ValidationError

from ccmodel.channels import MEASURED
from ccmodel.diagnosis.run import Options
from ccmodel.progress import Progress, log_lines, shown, silent
from ccmodel.recording import Recording, stride
from ccmodel.studies.diagnosis.run import check_options, options_of
from ccmodel.studies.diagnosis.settings import Diagnosing
from ccmodel.typed import InputError

# Samples of a recording that a fit needs at least: a motion there and back again, coarsely.
FEWEST_SAMPLES = 20
# Standard deviation of the model discrepancy that counts as noise, as a share of a channel's peak to peak.
Tolerance = float | Mapping[str, float]
# Candidates that are fitted whatever the screening says: one, or several, each of them one to four mechanisms together.
Candidates = str | Sequence[str | Sequence[str]]


def diagnosis_options(
    tolerance: Tolerance | None = None,
    step_s: float | None = None,
    cycles: int | None = None,
    candidates: Candidates = (),
    without: str | Collection[str] = (),
    freeze: bool = False,
    has_baseline: bool = False,
    run_limit: int | None = None,
    time_limit_s: float | None = None,
) -> Options:
    """Checked options of a diagnosis.

    Raises
    ------
    InputError
        A line for each option that cannot be used.
    """
    names = (without,) if isinstance(without, str) else tuple(without)
    stated = settings_of(tolerance, step_s, cycles, candidates, run_limit, time_limit_s)
    options = options_of(stated, names, freeze)
    check_options(options, has_baseline)
    return options


def settings_of(
    tolerance: Tolerance | None = None,
    step_s: float | None = None,
    cycles: int | None = None,
    candidates: Candidates = (),
    run_limit: int | None = None,
    time_limit_s: float | None = None,
) -> Diagnosing:
    """Checked settings of a fit or a diagnosis.

    Parameters
    ----------
    tolerance, step_s, cycles, candidates, run_limit, time_limit_s
        As of `ccmodel.diagnose`.

    Raises
    ------
    InputError
        A line for each setting that cannot be used.
    """
    stated_candidates = [candidates] if isinstance(candidates, str) else candidates
    forced = [_together(one) if isinstance(one, str) else list(one) for one in stated_candidates]
    stated: dict[str, Any] = {"step_s": step_s, "cycles": cycles, "forced_candidates": forced}
    limits = {"run_limit": run_limit, "time_limit_s": time_limit_s}
    stated |= {name: limit for name, limit in limits.items() if limit is not None}
    if isinstance(tolerance, Mapping):
        if unknown := [repr(name) for name in tolerance if name not in MEASURED]:
            text = f"a channel is one of {', '.join(MEASURED)}; got {', '.join(unknown)}"
            raise InputError(f"tolerance: {text}")
        stated["tolerance"] = dict(tolerance)
    elif tolerance is not None:
        stated["tolerance"] = tolerance
    try:
        return Diagnosing(**stated)
    except ValidationError as error:
        # A tolerance is a number or a mapping; the error on the form that was not used is of no interest.
        wrong = [e for e in error.errors() if e["type"] not in ("float_type", "dict_type")] or error.errors()[:1]
        raise InputError("\n".join(map(_line, wrong))) from None


def _together(candidate: str) -> list[str]:
    """One mechanism, or several with commas between them."""
    return [one.strip() for one in candidate.split(",")]


def _line(error: Mapping[str, Any]) -> str:
    name = str(error["loc"][0]) if error["loc"] else "candidates"
    return f"{name}: {error['msg'].removeprefix('Value error, ').removeprefix('forced_candidates: ')}"


def check_step(recordings: Sequence[Recording], step_s: float | None) -> None:
    """Raise `InputError` if a step between compared samples leaves too few of a recording."""
    for recording in recordings:
        left = -(-recording.time_s.size // stride(recording, step_s))
        if step_s is not None and left < FEWEST_SAMPLES:
            text = f"{step_s:g} s leaves {left} of the {recording.time_s.size} samples of {recording.id}"
            raise InputError(f"step_s: {text}; {FEWEST_SAMPLES} are needed")


@contextmanager
def progress_of(progress: bool | Progress) -> Iterator[Progress]:
    """How progress is shown: not at all, on standard error (True), or by a function of the user's.

    Standard error is a bar on a terminal, and a line for each stage anywhere else, as in a notebook.
    """
    if progress is True and sys.stderr.isatty():
        with shown() as bar:
            yield bar
    elif progress is True:
        yield log_lines(sys.stderr)
    else:
        yield progress or silent
