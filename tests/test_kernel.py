"""Compiled code is not taken from the cache once a source it was made from has changed."""

import ast
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numba
import numpy as np
import pytest

import ccmodel
from ccmodel import kernel, provenance
from ccmodel.elementary import quick_exp
from ccmodel.kernel import TESTED_NUMBA, check_numba
from ccmodel.mechanisms.presliding import dahl
from ccmodel.model.exact.run import run
from ccmodel.model.general.march import march
from ccmodel.model.paper import _march


@pytest.mark.parametrize("function", [dahl, march, run, _march])
def test_a_kernels_name_tells_of_its_sources(function):
    assert function.py_func.__qualname__.endswith(
        provenance.source_digest(function.py_func.__module__, discovered=False)
    )


@pytest.fixture
def digest_of_copy(tmp_path, monkeypatch):
    """Digest of a module in a copy of the package, to be edited; and the copy's folder."""
    copy = tmp_path / "ccmodel"
    shutil.copytree(Path(ccmodel.__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(provenance, "_ROOT", tmp_path)

    def digest(module):
        provenance._imports.cache_clear()
        return provenance.source_digest.__wrapped__(module)

    yield digest, copy
    provenance._imports.cache_clear()


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("ccmodel.model.general.march", "mechanisms/presliding.py"),
        ("ccmodel.model.general.march", "mechanisms/stribeck.py"),
        ("ccmodel.model.general.march", "mechanisms/load_cell.py"),  # found by the registry, imported by nobody
        ("ccmodel.model.general.march", "kernel.py"),
        ("ccmodel.model.exact.run", "model/exact/segment.py"),
        ("ccmodel.model.exact.run", "model/exact/path.py"),
    ],
)
def test_a_change_of_an_imported_source_changes_the_digest(digest_of_copy, module, source):
    digest, copy = digest_of_copy
    before = digest(module)
    assert digest(module) == before
    with (copy / source).open("a") as file:
        file.write("# a change\n")
    assert digest(module) != before


def test_a_change_elsewhere_does_not(digest_of_copy):
    digest, copy = digest_of_copy
    before = digest("ccmodel.model.general.march")
    with (copy / "report" / "figures.py").open("a") as file:
        file.write("# a change\n")
    assert digest("ccmodel.model.general.march") == before


CALLS = """
import pathlib, sys, time
from ccmodel.elementary import quick_exp
here = pathlib.Path(sys.argv[1])
(here / sys.argv[2]).touch()
while len(list(here.iterdir())) < 3:
    time.sleep(0.01)
quick_exp(1.0)
"""


def test_processes_that_need_a_kernel_at_once_end_with_one_compilation(tmp_path):
    """Each compilation writes a file of its own; the others load it."""
    package = tmp_path / "source/ccmodel"
    shutil.copytree(Path(ccmodel.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    (ready := tmp_path / "ready").mkdir()
    environment = os.environ | {"PYTHONPATH": str(package.parent)}
    commands = [[sys.executable, "-c", CALLS, str(ready), str(k)] for k in range(3)]
    started = [subprocess.Popen(command, env=environment, cwd=tmp_path) for command in commands]
    assert [process.wait() for process in started] == [0, 0, 0]
    assert len(list((package / "__pycache__").glob("elementary.quick_exp*.nbc"))) == 1


def test_a_kernel_is_compiled_under_a_lock_of_its_own(monkeypatch):
    locked = []
    monkeypatch.setattr(kernel.fcntl, "flock", lambda file, kind: locked.append(Path(file.name).name))
    quick_exp.compile((numba.float32,))
    (name,) = locked
    assert name.startswith("elementary.quick_exp") and name.endswith(".lock")


def test_the_tested_range_of_numba_is_that_of_the_package():
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())
    assert f"numba>={TESTED_NUMBA[0]},<{TESTED_NUMBA[1]}" in project["project"]["dependencies"]
    check_numba(numba.__version__)


@pytest.mark.parametrize("version", ["0.67.9", "0.69.0", "0.69.0rc1", "1.0", "0.9"])
def test_an_untested_numba_is_refused_in_one_sentence(version):
    sentence = f"ccmodel was tested with numba>=0.68,<0.69 only, found {version}: pip install 'numba>=0.68,<0.69'"
    with pytest.raises(ImportError, match=f"^{re.escape(sentence)}$"):
        check_numba(version)


def test_only_the_module_of_kernels_imports_numba():
    """A function compiled by numba itself would be open to the races that `kernel` prevents."""
    package = Path(ccmodel.__file__).parent
    importing = {
        file.relative_to(package).name
        for file in package.rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text()))
        if (isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "numba")
        or (isinstance(node, ast.Import) and any(alias.name.partition(".")[0] == "numba" for alias in node.names))
    }
    assert importing == {"kernel.py"}


@kernel.kernel
def _first(values):
    return values[0]


@kernel.kernel(allocates=True)
def _copy(values):
    return values.copy()


@kernel.kernel
def _first_of_copy(values):
    return values.copy()[0]


def test_only_kernels_that_allocate_count_references():
    values = np.arange(3.0)
    assert _first(values) == 0.0
    assert _copy(values).tolist() == values.tolist()
    for compiled in (_first, _copy):
        compiled.recompile()  # what comes from the cache has no code to look at
    assert all(code for f in (_first, _copy) for code in f.inspect_llvm().values())
    counts = {
        f: any("NRT_incref" in code or "NRT_decref" in code for code in f.inspect_llvm().values())
        for f in (_first, _copy)
    }
    assert counts == {_first: False, _copy: True}


def test_a_kernel_that_does_not_say_that_it_allocates_is_refused():
    with pytest.raises(numba.core.errors.NumbaError, match="NRT required but not enabled"):
        _first_of_copy(np.arange(3.0))
