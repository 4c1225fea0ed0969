"""The list of parts follows from the lock file."""

import importlib.util
import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SPEC = importlib.util.spec_from_file_location("sbom", ROOT / "workflow" / "sbom.py")
sbom = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(sbom)


@pytest.fixture(scope="module")
def parts():
    return list(sbom.parts_of(sbom.LOCK.read_text(encoding="utf-8")))


def test_every_pinned_package_is_a_part_with_its_hashes(parts):
    lock = sbom.LOCK.read_text(encoding="utf-8")
    assert [f"{p.name}=={p.version}" for p in parts] == re.findall(r"^\S+==\S+", lock, re.MULTILINE)
    assert sum(len(p.sha256) for p in parts) == lock.count("--hash=sha256:")
    assert all(p.sha256 for p in parts)


def test_the_document_and_the_page_are_those_of_the_lock_file(parts):
    """`make sbom` makes them again; licences depend on what is installed here, and are not compared."""
    components = json.loads(sbom.SBOM.read_text(encoding="utf-8"))["components"]
    hashes = [tuple(h["content"] for h in c["hashes"]) for c in components]
    assert list(map(sbom.Part, *zip(*((c["name"], c["version"]) for c in components), strict=True), hashes)) == parts
    rows = re.findall(r"^\| (\S+) \| (\S+) \| (.+) \|$", sbom.PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    stated = [row for row in rows if row[0] not in ("package", "---")]
    assert [row[:2] for row in stated] == [(p.name, p.version) for p in parts]


@pytest.mark.parametrize(
    ("metadata", "licence"),
    [
        ({"License-Expression": "MIT"}, "MIT"),
        ({"Classifier": "License :: OSI Approved :: BSD License"}, "BSD License"),
        ({"License": "Apache 2.0\n\nwhole text"}, "Apache 2.0"),
        ({"License": "x" * 100}, sbom.NOT_STATED),
        ({}, sbom.NOT_STATED),
    ],
)
def test_a_licence_is_what_the_metadata_state(monkeypatch, tmp_path, metadata, licence):
    folder = tmp_path / "made_up-1.0.dist-info"
    folder.mkdir()
    lines = {"Metadata-Version": "2.1", "Name": "made-up", "Version": "1.0"} | metadata
    text = "\n".join(f"{key}: {value}".replace("\n", "\n        ") for key, value in lines.items())
    (folder / "METADATA").write_text(text + "\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert sbom.licence_of("made-up") == licence


def test_a_package_that_is_not_installed_is_named_as_such():
    assert sbom.licence_of("no-such-package-here") == sbom.NOT_INSTALLED
