"""Options that several functions take: what is compared, and how progress is shown."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from pydantic import ValidationError

from ccmodel.progress import Progress, log_lines, shown, silent
from ccmodel.studies.diagnosis.settings import Diagnosing
from ccmodel.typed import InputError

# Standard deviation of the model discrepancy that counts as noise, as a share of a channel's peak to peak.
Tolerance = float | Mapping[str, float]


def settings_of(
    tolerance: Tolerance | None = None,
    step_s: float | None = None,
    cycles: int | None = None,
    candidates: Sequence[str | Sequence[str]] = (),
) -> Diagnosing:
    """Checked settings of a fit or a diagnosis.

    Raises
    ------
    InputError
        A line for each setting that cannot be used.
    """
    forced = [[one] if isinstance(one, str) else list(one) for one in candidates]
    stated: dict[str, Any] = {"step_s": step_s, "cycles": cycles, "forced_candidates": forced}
    if tolerance is not None:
        stated["tolerance"] = dict(tolerance) if isinstance(tolerance, Mapping) else tolerance
    try:
        return Diagnosing(**stated)
    except ValidationError as error:
        # A tolerance is a number or a mapping; the error on the form that was not used is of no interest.
        wrong = [e for e in error.errors() if e["type"] not in ("float_type", "dict_type")] or error.errors()[:1]
        raise InputError("\n".join(map(_line, wrong))) from None


def _line(error: Mapping[str, Any]) -> str:
    name = str(error["loc"][0]) if error["loc"] else "candidates"
    return f"{name}: {error['msg'].removeprefix('Value error, ').removeprefix('forced_candidates: ')}"


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
