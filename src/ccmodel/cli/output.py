"""What a command prints: its result on standard output, as text or JSON; messages and progress on standard error."""

import json
import math
import sys
from collections.abc import Collection
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, dataclass, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from ccmodel.progress import Progress, shown, silent
from ccmodel.sentences import shown as as_shown

if TYPE_CHECKING:
    from rich.console import RenderableType

    from ccmodel.rig.findings import Finding, Severity

# Style of the word before a line on a finding, by its severity.
_STYLE: "dict[Severity, str]" = {"warning": "yellow", "refused": "red", "inconsistent": "red"}
# Columns of a table that no terminal shows, so that none of its lines is broken.
_WIDE = 10_000


@dataclass(frozen=True)
class Output:
    """How a command prints.

    Attributes
    ----------
    as_json : bool
        One JSON document on standard output, and no other result.
    quiet : bool
        The result alone: no progress, hints or warnings.
    """

    as_json: bool = False
    quiet: bool = False

    def result(self, data: Any, *printed: "RenderableType") -> None:
        """Print the result: `data` as JSON, or lines and tables for a person."""
        if self.as_json:
            typer.echo(as_json(data))
            return
        for one in printed:
            typer.echo(_lines_shown(one)) if isinstance(one, str) else print_table(one)

    def hint(self, text: str) -> None:
        """Print what can be done next, at the end of the result for a person."""
        if not (self.as_json or self.quiet):
            typer.echo(text)

    def finding(self, line: str, severity: "Severity") -> None:
        """Print a line on a finding; JSON has the findings in its document."""
        if self.as_json or (self.quiet and severity == "warning"):
            return
        from ccmodel.rig.findings import WORD

        say(f"{WORD[severity]}: ", _STYLE[severity], end="")
        say(line)

    def findings(self, findings: "Collection[Finding]", left_out: Collection[str] = ()) -> None:
        """Print findings and what was left out; the command ends with 1 if something was, or is refused."""
        for finding in findings:
            self.finding(str(finding), finding.severity)
        for line in left_out:
            self.finding(line, "refused")
        if left_out or any(finding.is_refused for finding in findings):
            raise typer.Exit(1)

    def message(self, text: str, style: str | None = None) -> None:
        """Print a message beside the result."""
        if not (self.as_json or self.quiet):
            say(text, style)

    def progress(self) -> AbstractContextManager[Progress]:
        """The progress of the work, on a terminal."""
        return nullcontext(silent) if self.quiet else shown()


def say(text: str, style: str | None = None, end: str = "\n") -> None:
    """Print on standard error, in colour on a terminal; a line is never broken, and no text of a file controls it."""
    from rich.console import Console

    Console(stderr=True, soft_wrap=True, highlight=False, emoji=False).print(
        _lines_shown(text), style=style, markup=False, end=end
    )


def _lines_shown(text: str) -> str:
    """Lines in which no text of a file steers the terminal."""
    return "\n".join(map(as_shown, text.split("\n")))


def print_table(table: "RenderableType") -> None:
    """Print a table at the width of the terminal; in a pipe or a file, each row in one line."""
    from rich.console import Console
    from rich.text import Text

    if sys.stdout.isatty():
        Console(highlight=False, emoji=False).print(table, soft_wrap=isinstance(table, Text), markup=False)
        return
    console = Console(width=_WIDE, highlight=False, emoji=False, color_system=None)
    with console.capture() as captured:
        console.print(table, markup=False)
    typer.echo(_lines_shown("\n".join(line.rstrip() for line in captured.get().split("\n"))).rstrip("\n"))


def as_json(data: Any) -> str:
    """One JSON document; what is not finite becomes null."""
    return json.dumps(_plain(data), indent=1, ensure_ascii=False, allow_nan=False)


def _plain(data: Any) -> Any:
    if is_dataclass(data) and not isinstance(data, type):
        return _plain(asdict(data))
    if isinstance(data, dict):
        return {str(key): _plain(value) for key, value in data.items()}
    if isinstance(data, list | tuple | set):
        return [_plain(value) for value in data]
    if hasattr(data, "item"):  # a number of numpy
        data = data.item()
    if isinstance(data, float) and not math.isfinite(data):
        return None
    return str(data) if isinstance(data, Path) else data
