"""pyproject.toml names every dependency, and the conda environment of the jobs has the same list."""

import ast
import re
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from ruamel.yaml import YAML

from ccmodel.rig.readers import registry

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
# The conda environment is that of a job, which Snakemake starts from outside; pip and hatchling install the package.
INSTALLS = {"pip", "hatchling"}
# A reader of a log format imports its library where it needs it, and names the extra that installs it.
READERS = "src/ccmodel/rig/readers"


def by_name(requirements):
    parsed = [Requirement(text) for text in requirements]
    return {canonicalize_name(r.name): r.specifier for r in parsed}


def imported(package, files=None):
    """Top-level names of other packages that a package imports, anywhere in its modules."""
    names = set()
    for file in files or (ROOT / "src" / package).rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Import):
                names |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                names.add(node.module.partition(".")[0])
    return names - set(sys.stdlib_module_names) - {package}


@pytest.mark.parametrize("package", ["ccmodel", "virtualrig"])
def test_what_a_package_imports_is_a_dependency(package):
    folder = ROOT / "src" / package
    files = [file for file in folder.rglob("*.py") if not file.is_relative_to(ROOT / READERS)]
    assert unknown(imported(package, files), PROJECT["dependencies"]) == set()


def test_what_a_reader_imports_is_a_dependency_or_its_extra():
    extras = {f.extra for f in registry().values() if f.extra}
    assert set(PROJECT["optional-dependencies"]["formats"]) == {f"ccmodel[{','.join(sorted(extras))}]"}
    for name, format in registry().items():
        extra = PROJECT["optional-dependencies"][format.extra] if format.extra else []
        module = imported("ccmodel", [ROOT / READERS / f"{name}.py"])
        assert unknown(module, PROJECT["dependencies"] + extra) == set()


def unknown(names, requirements):
    """Imported names that no requirement installs."""
    distributions = packages_distributions()
    wanted = by_name(requirements).keys()
    return {name for name in names if not {canonicalize_name(d) for d in distributions[name]} & wanted}


def test_the_conda_environment_has_the_same_dependencies():
    listed = by_name(YAML(typ="safe").load(ROOT / "workflow/envs/ccmodel.yaml")["dependencies"])
    assert listed.pop("python") == Requirement(f"python{PROJECT['requires-python']}").specifier
    wanted = by_name(PROJECT["dependencies"])
    assert {name: listed[name] for name in listed.keys() - INSTALLS} == wanted
    assert listed.keys() >= INSTALLS


def test_the_installer_is_pinned_with_its_hash():
    lines = [line for line in (ROOT / "pip.lock").read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    assert re.fullmatch(r"pip==[\d.]+ \\( +--hash=sha256:[0-9a-f]{64})+", "".join(lines))


def test_container_and_proof_install_the_locked_packages_by_hash():
    for file in ("Containerfile", "proof/environment.post-deploy.sh", "Makefile"):
        installs = re.findall(r"pip install (?:[^\n]*\\\n)*[^\n]*", (ROOT / file).read_text(encoding="utf-8"))
        assert any("--require-hashes" in line and "requirements.lock" in line for line in installs), file
        # The package itself: nothing is fetched for it.
        assert all("--require-hashes" in line or "--no-deps --no-build-isolation" in line for line in installs), file
