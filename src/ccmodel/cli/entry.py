"""The application and its entry point."""

import errno
import os
import signal
import sys
import traceback
from contextlib import suppress
from typing import Annotated, Any

import typer

from ccmodel.cli import (
    accuracy,
    batches,
    diagnose,
    fit,
    importing,
    inverse,
    mechanisms,
    predict,
    project,
    report,
    simulate,
)
from ccmodel.cli.group import Commands
from ccmodel.cli.interruption import Interrupted, Terminated, exit_code, signals
from ccmodel.cli.output import as_json, say
from ccmodel.version import __version__

CODES = """\
Exit codes: 0 done; 1 a finding, or something was left out (diagnose: only with --strict or --keep-law); 2 the input \
cannot be used; 70 an error of the program; 130 interrupted."""
# Typer does not export this class.
_WRONG_USAGE: Any = typer.BadParameter.__base__
INTERRUPTED = "nothing was written"
# EX_SOFTWARE of sysexits.h; and what a shell has for a command that SIGPIPE ended.
PROGRAM_ERROR, CLOSED_PIPE = 70, 128 + signal.SIGPIPE
# Errors of writing. One of a file has its name, so that one without a name is of standard output.
_OF_WRITING = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF}
# Arguments of the Python interface whose options have other words here. No other text has these names.
_OPTION_OF = {
    "step_s": "--step",
    "run_limit": "--run-limit",
    "time_limit_s": "--time-limit",
    "pretension_N": "--pretension",
    "max_speed_rad_per_s": "--max-speed",
    "max_acceleration_rad_per_s2": "--max-acceleration",
}

app = typer.Typer(
    cls=Commands,
    epilog=CODES,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["--help", "-h"]},
    pretty_exceptions_enable=False,
)
for module in (
    batches,
    importing,
    fit,
    simulate,
    predict,
    inverse,
    diagnose,
    accuracy,
    mechanisms,
    report,
    project,
):
    module.add_to(app)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"ccmodel {__version__}")
        raise typer.Exit


@app.callback()
def describe(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Compare recordings of a cable-conduit transmission with a model, and find the physics that it leaves out."""


def main() -> None:
    """Entry point: an error of the user is one line for each problem, without a traceback, and exits with 2.

    An error of the program has its traceback, and exits with a code of its own.
    """
    try:
        with signals():
            _check_words(sys.argv[1:])
            code = app(prog_name="ccmodel", standalone_mode=False)
        # Typer turns an interruption that no command answers into this code.
        lines = [f"interrupted: {INTERRUPTED}"] if code == 130 else []
    except Interrupted as interrupted:
        lines, code = [f"interrupted: {interrupted}"], interrupted.exit_code
    except Terminated as terminated:
        lines, code = [f"interrupted: {INTERRUPTED}"], exit_code(terminated)
    except SystemExit as ended:
        # Typer and rich answer a closed pipe by the code of a finding.
        closed = isinstance(ended.__context__, BrokenPipeError)
        lines, code = [], CLOSED_PIPE if closed else ended.code
    except Exception as error:
        if isinstance(error, OSError) and error.filename is None and error.errno in _OF_WRITING:
            _give_up_output(error)
            sys.exit(2)
        lines, code = _lines_on(error), 2
        if not lines:
            traceback.print_exc()
            lines, code = [f"error of the program, please report it: {type(error).__name__}: {error}"], PROGRAM_ERROR
    if lines:
        _print_error(lines)
    sys.exit(code or 0)


def _give_up_output(error: OSError) -> None:
    """Say that standard output cannot be written to, and drop the rest of it, which Python would write at its end."""
    say(f"standard output: {error.strerror}")
    with suppress(OSError):  # in a test it is no file
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _check_words(words: list[str]) -> None:
    """Raise `InputError` if a word is empty, as a variable that is not set makes it: as a path it means this folder."""
    if "" in words:
        from ccmodel.typed import InputError

        before = " ".join(words[: words.index("")])
        raise InputError(f"the word after 'ccmodel {before}' is empty: is a variable of the shell not set?")


def _lines_on(error: Exception) -> list[str]:
    """Lines on an error of the user; none for an error of the program."""
    from ccmodel.typed import InputError

    if isinstance(error, InputError):
        return list(map(_with_options, str(error).splitlines()))
    if isinstance(error, _WRONG_USAGE):
        command = error.ctx.command_path if error.ctx else "ccmodel"
        return [f"{_text_of(error)} {command} --help shows what there is."]
    if isinstance(error, OSError) and error.filename is not None:
        return [f"{error.filename}: {error.strerror}"]
    return []


def _with_options(line: str) -> str:
    """A line, in which an argument that it is on has the name of the option.

    A line may begin with the name of a file instead. It is on an option only if that option was typed.
    """
    name, colon, text = line.partition(":")
    option = {**_OPTION_OF, "candidates": "--candidate"}.get(name, f"--{name}")
    typed = (word.partition("=")[0] for word in sys.argv[1:])
    if option not in {Commands.renamed.get(word, word) for word in typed}:
        return line
    for other, its_option in _OPTION_OF.items():
        text = text.replace(other, its_option)
    return f"{option}{colon}{text}"


def _text_of(error: Any) -> str:
    """What is wrong with a command line, and the nearest option to one that there is not."""
    option = getattr(error, "option_name", None)
    if option in ("--json", "--quiet") and not error.ctx.parent:
        return f"{option} stands after the name of the command."
    if nearest := getattr(error, "possibilities", None):
        return f"No such option: {error.option_name}. Did you mean {' or '.join(nearest)}?"
    text = error.format_message()
    return text if text.endswith((".", "?")) else f"{text}."


def _print_error(lines: list[str]) -> None:
    if "--json" in sys.argv:
        try:
            typer.echo(as_json({"error": lines}))
            return
        except OSError as error:
            _give_up_output(error)
    for line in lines:
        say(line)
