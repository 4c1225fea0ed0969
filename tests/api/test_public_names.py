"""The names of the package: what there is, that nothing hides it, and that importing it loads nothing."""

import ast
import importlib
import inspect
import json
import pkgutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import ccmodel as cc

ROOT = Path(__file__).parents[2]


def in_new_interpreter(code: str) -> dict:
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return json.loads(run.stdout)


def test_importing_the_package_loads_no_library():
    loaded = in_new_interpreter("import sys, json, ccmodel; print(json.dumps(sorted(sys.modules)))")
    assert not {"numpy", "numba", "pandas", "xarray", "matplotlib", "pydantic", "typing"} & set(loaded)
    assert [name for name in loaded if name.startswith("ccmodel")] == ["ccmodel"]


def test_a_model_is_read_without_a_figure_library_or_snakemake():
    code = "import sys, json, ccmodel; ccmodel.InputError; ccmodel.Recording; print(json.dumps(sorted(sys.modules)))"
    assert not {"matplotlib", "snakemake", "numba"} & set(in_new_interpreter(code))


def test_dir_shows_the_public_names_alone():
    importlib.import_module("ccmodel.diagnosis.run")
    assert dir(cc) == sorted(cc.__all__)


def test_every_public_name_is_what_it_says():
    for name in cc.__all__:
        value = getattr(cc, name)
        assert not inspect.ismodule(value), name
        assert inspect.getdoc(value), name


def test_no_module_has_the_name_of_a_public_name():
    """A module that is imported becomes an attribute of its package: it would take the place of the function."""
    modules = {module.name for module in pkgutil.iter_modules(cc.__path__)}
    assert not modules & set(cc.__all__)


def test_importing_modules_leaves_the_functions():
    names = ["compensate", "diagnose", "estimate", "fit", "load", "simulate", "predict"]
    code = (
        "import json, ccmodel.diagnosis.run, ccmodel.steps.fit, ccmodel.steps.predict, ccmodel.steps.simulate\n"
        "import ccmodel.inverse.compensate, ccmodel.inverse.estimate\n"
        "import ccmodel as cc\n"
        f"functions = [getattr(cc, name) for name in {names}]\n"
        "print(json.dumps([[callable(f), f.__module__.split('.')[1]] for f in functions]))"
    )
    assert in_new_interpreter(code) == [[True, "api"]] * len(names)


def test_a_wrong_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="diagnoze"):
        cc.diagnoze  # noqa: B018


def test_a_type_checker_sees_every_public_name():
    tree = ast.parse((ROOT / "src/ccmodel/__init__.py").read_text())
    block = next(node for node in tree.body if isinstance(node, ast.If))
    imported = {alias.name for node in block.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert imported == set(cc.__all__)


def test_the_version_is_stated_once():
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert cc.__version__ == stated
    assert stated not in (ROOT / "src/ccmodel/__init__.py").read_text()
