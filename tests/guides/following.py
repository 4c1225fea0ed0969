"""Following a page to the letter: its blocks are run in their order, and what it prints is compared with what comes.

- A ``sh`` block is run by bash. It must exit with 0, or with N after a comment ``<!-- exits: N -->``.
- A ``text`` block is output of the last ``sh`` block. Its lines must come in this order; numbers may differ by 5 %. A
  line ``...`` and an end `` ...`` of a line stand for what is left out.
- A ``python`` or ``yaml`` block whose first line is ``# path/of/a/file`` is this file. Other ``python`` blocks are run,
  with one namespace a page; other ``yaml`` blocks must be YAML.
- A comment ``<!-- skip: next "reason" -->`` omits the next block; ``<!-- invisible-code-block: sh`` is run unseen.
"""

import contextlib
import os
import re
import subprocess
import sys
from pathlib import Path
from unittest import SkipTest

from ruamel.yaml import YAML
from sybil import Document, Example, Region
from sybil.parsers.markdown import CodeBlockParser, SkipParser
from sybil.parsers.markdown.lexers import DirectiveInHTMLCommentLexer

ROOT = Path(__file__).parents[2]
NUMBER = re.compile(r"(?<![\w.])[-+−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
FILE = re.compile(r"# ([\w./-]+\.\w+)\n")
NUMBERS_AGREE_WITHIN = 0.05


class Guide:
    """A page, and the folder in which it is followed.

    Attributes
    ----------
    page, folder : Path
    skipped : list of str
        Reasons of the blocks that were not run.
    output : str
        What the last ``sh`` block printed.
    """

    def __init__(self, page: Path, folder: Path, source: Path | None = None):
        self.page, self.folder = page, folder
        self.skipped, self.output, self._exits = [], "", 0
        self.environment = os.environ | {"MPLBACKEND": "Agg", "COLUMNS": "100", "NO_COLOR": "1"}
        self.environment["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        if source:
            self.environment["PYTHONPATH"] = str(source)

    def follow(self) -> dict:
        """Run every block, and return the names of the Python blocks."""
        evaluators = {"sh": self._run, "text": self._compare, "python": self._python, "yaml": self._yaml}
        parsers = [CodeBlockParser(language, evaluator) for language, evaluator in evaluators.items()]
        document = Document.parse(str(self.page), *parsers, SkipParser(), self._expected_exits)
        for example in document.examples():
            try:
                example.evaluate()
            except SkipTest as reason:
                self.skipped.append(str(reason))
        return document.namespace

    def _expected_exits(self, document):
        lexer = DirectiveInHTMLCommentLexer("exits", arguments=r"\d+")
        for region in lexer(document):
            yield Region(region.start, region.end, region.lexemes["arguments"], self._note_exit)

    def _note_exit(self, example: Example) -> None:
        self._exits = int(example.parsed)

    def _run(self, example: Example) -> None:
        command = ["bash", "-euo", "pipefail", "-c", example.parsed]
        pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        run = subprocess.run(command, cwd=self.folder, env=self.environment, text=True, check=False, **pipes)
        expected, self._exits = self._exits, 0
        self.output = run.stdout
        where = f"{self.page.name}:{example.line}"
        assert run.returncode == expected, f"{where}: exits with {run.returncode}\n{example.parsed}\n{self.output}"

    def _compare(self, example: Example) -> None:
        missing = first_missing(example.parsed, self.output)
        assert missing is None, f"{self.page.name}:{example.line}: {missing!r} is not in\n{self.output}"

    def _python(self, example: Example) -> None:
        if self._write(example.parsed):
            return
        with contextlib.chdir(self.folder):
            exec(compile(example.parsed, f"{self.page.name}:{example.line}", "exec"), example.document.namespace)

    def _yaml(self, example: Example) -> None:
        YAML(typ="safe").load(example.parsed)
        self._write(example.parsed)

    def _write(self, text: str) -> bool:
        """Write a block that is a file."""
        named = FILE.match(text)
        if named:
            file = self.folder / named[1]
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")
        return bool(named)


def first_missing(expected: str, output: str) -> str | None:
    """The first line of `expected` that does not come in `output` after the ones above it."""
    lines = iter(output.splitlines())
    for line in expected.splitlines():
        if line.strip() and line.strip() != "..." and not any(_alike(line, other) for other in lines):
            return line
    return None


def _alike(expected: str, line: str) -> bool:
    expected, line = (" ".join(text.split()) for text in (expected, line))
    beginning = expected.removesuffix(" ...")
    words, found = NUMBER.sub("#", beginning), NUMBER.sub("#", line)
    if not (found.startswith(words) if beginning != expected else found == words):
        return False
    pairs = zip(NUMBER.findall(beginning), NUMBER.findall(line), strict=False)
    return all(abs(_value(a) - _value(b)) <= NUMBERS_AGREE_WITHIN * abs(_value(a)) for a, b in pairs)


def _value(number: str) -> float:
    return float(number.replace("−", "-"))
