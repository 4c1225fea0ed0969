"""The accepted accuracy: a file in version control, one line for each channel so that a change can be read."""

import json
import platform
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import ValidationError

from ccmodel import inputs
from ccmodel.accuracy.comparison import Limits, intervals
from ccmodel.accuracy.measure import Batches
from ccmodel.outputs import new_file
from ccmodel.typed import InputError, TypedModel
from ccmodel.version import __version__

FORMAT: Final = 1
ACCEPT = 'ccmodel accuracy accept --reason "..."'
LIBRARIES = ("numpy", "scipy", "numba")


class Baseline(TypedModel):
    """What was accepted, when, at which commit and why."""

    format: Literal[1]
    date: str
    commit: str
    reason: str
    versions: dict[str, str]
    limits: Limits
    unit: str = "% of peak to peak"
    batches: Batches


def read_baseline(file: Path) -> Baseline:
    """Read a baseline.

    Raises
    ------
    InputError
        In one line, if there is none or it cannot be read.
    """
    try:
        inputs.check_file(file, inputs.LOG)
        content = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{file}: there is no baseline of the model's accuracy; accept one: {ACCEPT}") from None
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{file}: not a baseline ({error}); restore it, or accept a new one: {ACCEPT}") from None
    found = content.get("format") if isinstance(content, dict) else None
    if found != FORMAT:
        raise InputError(f"{file}: format {found!r}, and this version reads {FORMAT}; accept a new baseline: {ACCEPT}")
    try:
        return Baseline.model_validate_json(json.dumps(content))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise InputError(f"{file}: {where}: {first['msg']}; restore it, or accept a new one: {ACCEPT}") from None


def versions() -> dict[str, str]:
    """Versions of the package, of Python and of the libraries that decide numbers."""
    return {"ccmodel": __version__, "python": platform.python_version()} | {n: version(n) for n in LIBRARIES}


def make_baseline(
    batches: Batches, limits: Limits, date: str, commit: str, reason: str, measured_with: dict[str, str] | None = None
) -> Baseline:
    """Accept the accuracy of a run; `measured_with` are its `versions`, without it the present ones."""
    batches = {name: batch.model_copy(deep=True) for name, batch in sorted(batches.items())}
    for batch, parameters, channel, accepted in intervals(batches, limits):
        rounded = {name: [None if v is None else float(f"{v:.3g}") for v in row] for name, row in accepted.items()}
        channels = batches[batch].sets[parameters].channels
        channels[channel] = channels[channel].model_copy(update={"accepted": rounded})
    return Baseline(
        format=FORMAT,
        date=date,
        commit=commit,
        reason=reason,
        versions=measured_with or versions(),
        limits=limits,
        batches=batches,
    )


def write_baseline(file: Path, baseline: Baseline) -> None:
    """Write a baseline as JSON: a line for each recording and each channel."""
    with new_file(file) as fresh:
        fresh.write_text(_text(baseline.model_dump(mode="json")) + "\n", encoding="utf-8")


def _text(data: Any, depth: int = 0) -> str:
    """JSON whose innermost lists and mappings are on one line."""
    if not isinstance(data, dict) or "errors" in data or all(not isinstance(v, dict | list) for v in data.values()):
        return json.dumps(data, ensure_ascii=False)
    pad = " " * (depth + 1)
    rows = [f"{pad}{json.dumps(key, ensure_ascii=False)}: {_text(value, depth + 1)}" for key, value in data.items()]
    return "{\n" + ",\n".join(rows) + "\n" + " " * depth + "}"
