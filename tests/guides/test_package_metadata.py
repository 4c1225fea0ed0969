"""What the package and the citation say of themselves."""

import subprocess
import sys
import tomllib
import zipfile
from email import message_from_string
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from ccmodel.mechanisms.contract import PAPER

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CITATION = YAML(typ="safe").load(ROOT / "CITATION.cff")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (file,) = folder.glob("*.whl")
    with zipfile.ZipFile(file) as opened:
        yield opened


def read(wheel: zipfile.ZipFile, ending: str) -> str:
    (name,) = [name for name in wheel.namelist() if name.endswith(ending)]
    return wheel.read(name).decode()


def test_the_wheel_holds_readme_licence_and_authors(wheel):
    metadata = message_from_string(read(wheel, ".dist-info/METADATA"))
    assert metadata["Author"] == "ccmodel developers"
    assert metadata["License-Expression"] == "BSD-3-Clause"
    assert metadata["License-File"] == "LICENSE"
    assert metadata["Description-Content-Type"] == "text/markdown"
    assert metadata.get_payload().strip() == (ROOT / "README.md").read_text(encoding="utf-8").strip()
    assert read(wheel, ".dist-info/licenses/LICENSE") == (ROOT / "LICENSE").read_text()


def test_the_library_needs_no_snakemake(wheel):
    metadata = message_from_string(read(wheel, ".dist-info/METADATA"))
    needed = [name for name in metadata.get_all("Requires-Dist") if name.startswith("snakemake")]
    assert needed
    assert all("extra ==" in name for name in needed)


def test_the_citation_has_the_version_the_licence_and_the_paper():
    assert CITATION["cff-version"] == "1.2.0"
    assert {"message", "title", "authors"} <= CITATION.keys()
    assert (CITATION["version"], CITATION["license"]) == (PROJECT["version"], PROJECT["license"])
    assert CITATION["authors"] == PROJECT["authors"] == [{"name": "ccmodel developers"}]
    paper = CITATION["references"][0]
    volume = f"{paper['volume']}({paper['issue']}), {paper['start']}-{paper['end']}, {paper['year']}"
    for stated in (paper["title"], paper["journal"], volume, paper["doi"]):
        assert stated in PAPER


def test_the_licence_is_stated_alike_and_the_data_keep_their_own():
    assert "Copyright (c) 2026, ccmodel developers" in (ROOT / "LICENSE").read_text()
    for page in ("README.md", "data/README.md"):
        assert "Open Database" in (ROOT / page).read_text(encoding="utf-8")
