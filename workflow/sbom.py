"""List of parts of the project: a CycloneDX document and a table of licences, from requirements.lock.

    python workflow/sbom.py          writes sbom.json and docs/dependencies.md

Both follow from the lock file and the metadata of the installed packages alone, so that the same lock gives the same
bytes. A package that this platform does not need has no metadata here; its licence is not stated.
"""

import json
import re
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
LOCK, SBOM, PAGE = ROOT / "requirements.lock", ROOT / "sbom.json", ROOT / "docs" / "dependencies.md"
NOT_INSTALLED, NOT_STATED = "only on another platform", "not stated"
# Of a licence that is given as its whole text, the first line is its name; longer than this, it is none.
LONGEST_NAME = 60
_PINNED = re.compile(r"^(?P<name>[A-Za-z0-9._-]+)==(?P<version>\S+)")
_HASH = re.compile(r"--hash=sha256:([0-9a-f]{64})")


class Part(NamedTuple):
    """A package that the lock file pins."""

    name: str
    version: str
    sha256: tuple[str, ...]


def parts_of(lock: str) -> Iterator[Part]:
    """The packages of a lock file, in its order."""
    for entry in re.split(r"\n(?=\S)", lock):
        if pinned := _PINNED.match(entry):
            yield Part(pinned["name"], pinned["version"], tuple(_HASH.findall(entry)))


def licence_of(name: str) -> str:
    """Licence of an installed package by its metadata: the expression, else the classifiers, else the free text."""
    try:
        metadata = distribution(name).metadata
    except PackageNotFoundError:
        return NOT_INSTALLED
    classifiers = [c.rpartition(" :: ")[2] for c in metadata.get_all("Classifier", []) if c.startswith("License ::")]
    stated = metadata.get("License-Expression") or "; ".join(c for c in classifiers if c != "OSI Approved")
    first_line = (stated or metadata.get("License") or "").strip().partition("\n")[0]
    return first_line if 0 < len(first_line) <= LONGEST_NAME else NOT_STATED


def document(parts: list[Part], licences: dict[str, str]) -> str:
    """The parts as a CycloneDX document; one line for each."""

    def component(part: Part) -> dict:
        known = licences[part.name] not in (NOT_INSTALLED, NOT_STATED)
        return {
            "type": "library",
            "name": part.name,
            "version": part.version,
            "hashes": [{"alg": "SHA-256", "content": content} for content in part.sha256],
            "licenses": [{"license": {"name": licences[part.name]}}] if known else [],
        }

    lines = ",\n".join(json.dumps(component(part)) for part in parts)
    head = '{"bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1,\n'
    about = '"metadata": {"component": {"type": "application", "name": "ccmodel"}},\n'
    return f'{head}{about}"components": [\n{lines}\n]}}\n'


def page(parts: list[Part], licences: dict[str, str]) -> str:
    """The parts and their licences as Markdown."""
    rows = "\n".join(f"| {part.name} | {part.version} | {licences[part.name]} |" for part in parts)
    return f"""# Dependencies and their licences

Made by `make sbom` from `requirements.lock`, which pins each package by version and hash. `sbom.json` is the same list
with all hashes, as CycloneDX 1.5. A licence is what the package's own metadata states.

| package | version | licence |
|---|---|---|
{rows}
"""


def main() -> None:
    """Write both files."""
    parts = list(parts_of(LOCK.read_text(encoding="utf-8")))
    licences = {part.name: licence_of(part.name) for part in parts}
    SBOM.write_text(document(parts, licences), encoding="utf-8")
    PAGE.write_text(page(parts, licences), encoding="utf-8")


if __name__ == "__main__":
    main()
