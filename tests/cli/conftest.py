"""The command line, run within this process as a shell would run it."""

import sys
from typing import NamedTuple

import pytest

from ccmodel import cli


class Ended(NamedTuple):
    """How a command ended, and what it printed."""

    code: int
    out: str
    err: str


@pytest.fixture
def run(monkeypatch, capsys):
    """``run("check", folder)``: its exit code, standard output and standard error."""

    def call(*arguments) -> Ended:
        monkeypatch.setattr(sys, "argv", ["ccmodel", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return Ended(ended.value.code, *capsys.readouterr())

    return call
