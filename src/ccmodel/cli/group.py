"""Groups of commands: former names of options and commands, examples in the help."""

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import typer
from typer.core import TyperGroup

from ccmodel.cli.output import say

PREPARE, MODEL, RESULTS, PROJECT = "Recordings", "Model and verdict", "Results and reference", "Project"


class FormerOptions(TyperGroup):
    """Accepts former names of options, with a message on the current name; other command lines state their own."""

    renamed: ClassVar = {
        "--allowance": "--tolerance",
        "--suspect": "--candidate",
        "--beside": "--baseline",
        "--hold": "--freeze",
    }
    # Former names of one command's options, by the name of the command.
    renamed_in: ClassVar[dict[str, dict[str, str]]] = {}

    # Typer does not export the class of a command's context.
    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse with every option under its current name; without arguments, print the help."""
        if not args and not ctx.resilient_parsing:
            typer.echo(ctx.get_help())
            ctx.exit(2)
        renamed = self.renamed | self.renamed_in.get(next(iter(args), ""), {})
        current = []
        for word in args:
            option, equals, value = word.partition("=")
            if option in renamed:
                say(f"{option} is now called {renamed[option]}", "yellow")
            current.append(renamed.get(option, option) + equals + value)
        return super().parse_args(ctx, current)


class Commands(FormerOptions):
    """The groups of `ccmodel`."""

    renamed_in: ClassVar = {"import-mis-tool": {"--batch": "--name"}, "history": {"--file": "--history"}}
    # The way of a batch from logs to a verdict, and then everything else.
    order = (
        "init",
        "import",
        "check",
        "fit",
        "simulate",
        "predict",
        "estimate",
        "compensate",
        "diagnose",
        "accuracy",
        "mechanisms",
        "report",
    )

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of the commands, in the order of the help."""
        known = {name: k for k, name in enumerate(self.order)}
        return sorted(super().list_commands(ctx), key=lambda name: known.get(name, len(known)))


def command(app: typer.Typer, name: str, panel: str | None = None, examples: Sequence[str] = ()) -> Callable:
    """Decorator: a command with examples at the end of its help."""
    words = "Example" if len(examples) == 1 else "Examples"
    epilog = "\n\n".join([f"{words}:", *(f"  {example}" for example in examples)]) if examples else None
    return app.command(name, rich_help_panel=panel, epilog=epilog)
