"""The command line: the functions of the library from a shell. A module for each command, or for a few related ones.

Commands parse options, call one function and print its result. Results go to standard output, as text or as one JSON
document; messages and progress go to standard error. `docs/command-line.md` has the conventions for its users.
"""

from ccmodel.cli.entry import app, main
from ccmodel.cli.group import FormerOptions

__all__ = ["FormerOptions", "app", "main"]
