"""sbom.json and docs/dependencies.md list what requirements.lock pins, no more and no less."""

import json
import re
import tomllib
from importlib.metadata import PathDistribution

import pytest

from benchmarks import sbom

TEXT = sbom.LOCK.read_text(encoding="utf-8")
COMPONENTS = json.loads(sbom.SBOM.read_text(encoding="utf-8"))["components"]
HASHES = " \\\n    --hash=sha256:" + "b" * 64 + " \\\n    --hash=sha256:" + "a" * 64 + "\n    # via c\n"


def test_the_list_has_what_the_lock_file_pins():
    # Counted in the text, not with the parser that made the list.
    pins = re.findall(r"^([\w.-]+)==([^\s;]+)", TEXT, flags=re.MULTILINE)
    assert sorted(pins) == sorted((c["name"], c["version"]) for c in COMPONENTS)
    hashes = re.findall(r"--hash=sha256:([0-9a-f]{64})", TEXT)
    assert sorted(hashes) == sorted(h["content"] for c in COMPONENTS for h in c["hashes"])


def test_each_package_has_its_own_hashes_and_marker():
    for package, written in zip(sbom.locked(TEXT), COMPONENTS, strict=True):
        assert (package.name, package.version, package.reference) == (
            written["name"],
            written["version"],
            written["purl"],
        )
        assert list(package.hashes) == [h["content"] for h in written["hashes"]]
        assert [package.marker] * bool(package.marker) == [p["value"] for p in written.get("properties", [])]


def test_the_files_are_those_that_the_script_writes():
    project = tomllib.loads((sbom.ROOT / "pyproject.toml").read_text())["project"]
    assert sbom.document(COMPONENTS, project) == sbom.SBOM.read_text(encoding="utf-8")
    page = sbom.PAGE.read_text(encoding="utf-8")
    assert sbom.page(page, COMPONENTS) == page


def test_every_locked_package_is_in_the_table_with_a_licence():
    rows = sbom.PAGE.read_text(encoding="utf-8").splitlines()
    for package in sbom.locked(TEXT):
        (row,) = [line for line in rows if line.startswith(f"| {package.name} | {package.version} |")]
        assert not row.endswith("|  |")


def test_the_list_names_no_place_and_no_time():
    text = sbom.SBOM.read_text(encoding="utf-8")
    assert not re.search(r"https?://|file:|timestamp|serialNumber", text)


def test_a_lock_file_is_read_with_markers_and_sorted_hashes():
    two = sbom.locked("b==2 ; python_full_version < '3.12'" + HASHES + "a==1.0" + HASHES)
    assert [(p.name, p.version, p.marker) for p in two] == [
        ("a", "1.0", ""),
        ("b", "2", "python_full_version < '3.12'"),
    ]
    assert two[0].hashes == ("a" * 64, "b" * 64)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a>=1" + HASHES, "line 1: 'a>=1"),
        ("a==1\n", "a 1 has no hash"),
        ("a @ b.whl\n", "line 1: 'a @ b.whl' pins nothing"),
    ],
)
def test_what_is_not_pinned_is_refused(text, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        sbom.locked(text)


@pytest.mark.parametrize(
    ("metadata", "licences"),
    [
        ("License-Expression: MIT\nLicense: other", [{"expression": "MIT"}]),
        ("License: BSD\nClassifier: License :: OSI Approved :: BSD License", [{"license": {"name": "BSD"}}]),
        ("License: UNKNOWN\nClassifier: License :: OSI Approved :: X", [{"license": {"name": "X"}}]),
        (f"License: {'text ' * 20}\nClassifier: License :: Y", [{"license": {"name": "Y"}}]),
        ("Classifier: Topic :: Z", []),
    ],
)
def test_the_licence_is_what_the_package_states_first(metadata, licences, tmp_path):
    (tmp_path / "METADATA").write_text(f"Metadata-Version: 2.4\nName: a\nVersion: 1\n{metadata}\n")
    assert sbom.licences_of(PathDistribution(tmp_path)) == licences


def test_a_package_that_is_not_installed_keeps_the_licence_of_the_earlier_list():
    package = sbom.Package("no-such-package", "1", "", ("a" * 64,))
    known = {package.reference: [{"expression": "MIT"}]}
    assert sbom.component(package, known)["licenses"] == [{"expression": "MIT"}]
    assert "licenses" not in sbom.component(package, {})
