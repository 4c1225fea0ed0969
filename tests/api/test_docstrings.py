"""The examples in the docstrings of the interface run and give what they show."""

import doctest
import importlib
import pkgutil
from pathlib import Path

import pytest

from ccmodel import api

ROOT = Path(__file__).parents[2]
FLAGS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
MODULES = sorted(f"ccmodel.api.{module.name}" for module in pkgutil.iter_modules(api.__path__))
LONG = ("ccmodel.api.diagnosis",)


def examples_of(module: str, **names) -> list[doctest.DocTest]:
    """Examples of a module's own docstrings; `names` are what they use without making it."""
    found = doctest.DocTestFinder(exclude_empty=True).find(importlib.import_module(module), extraglobs=names)
    return [one for one in found if one.examples]


@pytest.mark.parametrize("module", [pytest.param(m, marks=[pytest.mark.long] * (m in LONG)) for m in MODULES])
def test_examples_in_docstrings_run(module, monkeypatch, tmp_path):
    monkeypatch.chdir(ROOT)
    runner, said = doctest.DocTestRunner(optionflags=FLAGS), []
    for one in examples_of(module, folder=tmp_path):
        runner.run(one, out=said.append)
    assert not said, "".join(said)


def test_every_function_has_an_example():
    named = {one.name.rpartition(".")[2] for module in MODULES for one in examples_of(module)}
    assert {"load", "fit", "diagnose", "simulate", "predict", "estimate", "compensate", "read_model"} <= named
