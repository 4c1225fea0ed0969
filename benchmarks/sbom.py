"""The list of the packages that requirements.lock pins: sbom.json and docs/dependencies.md. (`make sbom`)

sbom.json is a CycloneDX 1.6 document. Names, versions, markers and hashes come from requirements.lock alone, licences
from the metadata of the packages that are installed. Neither a time nor a random number is written, so that the same
lock file and the same packages give the same bytes.
"""

import json
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

ROOT = Path(__file__).parents[1]
LOCK, SBOM, PAGE = ROOT / "requirements.lock", ROOT / "sbom.json", ROOT / "docs/dependencies.md"
BEGIN, END = "<!-- made by `make sbom` -->", "<!-- end -->"
NOT_INSTALLED, NOT_STATED = "not read: not installed where the list was made", "not stated in its metadata"
# A longer licence field is the text of a licence, not its name.
LONGEST_NAME = 60
MARKER = "ccmodel:marker"
_PINNED = re.compile(r"(?P<name>[\w.-]+)==(?P<version>[^\s;\\]+)\s*(?:;\s*(?P<marker>[^\\]*?))?\s*\\?")
_HASH = re.compile(r"\s+--hash=sha256:(?P<hash>[0-9a-f]{64})\s*\\?")


@dataclass(frozen=True)
class Package:
    """One entry of the lock file.

    Attributes
    ----------
    name, version : str
    marker : str
        Where it is installed, as the lock file says it; empty if everywhere.
    hashes : tuple of str
        SHA-256 of each file that pip accepts.
    """

    name: str
    version: str
    marker: str
    hashes: tuple[str, ...]

    @property
    def reference(self) -> str:
        """Package URL."""
        return f"pkg:pypi/{self.name}@{self.version}"


def locked(text: str) -> list[Package]:
    """Packages of a lock file, by name and version.

    Parameters
    ----------
    text : str
        Content of requirements.lock.

    Raises
    ------
    ValueError
        If a line is neither a pinned package, a hash nor a comment, or if a package has no hash.
    """
    found: list[tuple[re.Match, list[str]]] = []
    for number, line in enumerate(text.splitlines(), 1):
        if pinned := _PINNED.fullmatch(line):
            found.append((pinned, []))
        elif (hashed := _HASH.fullmatch(line)) and found:
            found[-1][1].append(hashed["hash"])
        elif line.strip() and not line.strip().startswith("#"):
            raise ValueError(
                f"requirements.lock, line {number}: {line.strip()!r} pins nothing: make it with `make lock`"
            )
    packages = [Package(p["name"], p["version"], p["marker"] or "", tuple(sorted(hashes))) for p, hashes in found]
    for package in packages:
        if not package.hashes:
            raise ValueError(f"requirements.lock: {package.name} {package.version} has no hash: use `make lock`")
    return sorted(packages, key=lambda package: (package.name, package.version))


def licences_of(found: Distribution) -> list[dict]:
    """Licences that the metadata of a package states, as CycloneDX writes them; none if it states none.

    The SPDX expression is taken first, then a short licence field, then the classifiers.
    """
    metadata = found.metadata
    if expression := metadata.get("License-Expression"):
        return [{"expression": expression}]
    field = (metadata.get("License") or "").strip()
    classifiers = metadata.get_all("Classifier") or []
    names = sorted({c.rpartition(" :: ")[2] for c in classifiers if c.startswith("License :: ")})
    if field and field != "UNKNOWN" and len(field) <= LONGEST_NAME and "\n" not in field:
        names = [field]
    return [{"license": {"name": name}} for name in names]


def component(package: Package, known: Mapping[str, list[dict]]) -> dict:
    """A package as CycloneDX writes it.

    Parameters
    ----------
    package : Package
    known : mapping of str to list
        Licences by package URL of an earlier list, for packages that are not installed here with this version.
    """
    try:
        installed = distribution(package.name)
        licences = licences_of(installed) if installed.version == package.version else known.get(package.reference)
    except PackageNotFoundError:
        licences = known.get(package.reference)
    written = {
        "type": "library",
        "bom-ref": package.reference,
        "name": package.name,
        "version": package.version,
        "purl": package.reference,
        "hashes": [{"alg": "SHA-256", "content": content} for content in package.hashes],
    }
    if licences is not None:
        written["licenses"] = licences
    if package.marker:
        written["properties"] = [{"name": MARKER, "value": package.marker}]
    return written


def document(components: Sequence[dict], project: Mapping) -> str:
    """Text of sbom.json: a line for each component, so that a change of one is a change of one line.

    Parameters
    ----------
    components : sequence of dict
    project : mapping
        Table `project` of pyproject.toml.
    """
    head = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {
            "component": {
                "type": "application",
                "bom-ref": project["name"],
                "name": project["name"],
                "version": project["version"],
                "licenses": [{"expression": project["license"]}],
            }
        },
    }
    lines = ",\n".join(json.dumps(entry) for entry in components)
    return json.dumps(head)[:-1] + ', "components": [\n' + lines + "\n]}\n"


def table(components: Iterable[Mapping]) -> str:
    """Packages with version, condition and licence as a table in Markdown."""
    lines = ["| package | version | only where | licence |", "|---|---|---|---|"]
    for entry in components:
        marker = next((f"`{p['value']}`" for p in entry.get("properties", ()) if p["name"] == MARKER), "")
        lines.append(f"| {entry['name']} | {entry['version']} | {marker} | {_licence(entry)} |")
    return "\n".join(lines)


def _licence(entry: Mapping) -> str:
    if "licenses" not in entry:
        return NOT_INSTALLED
    named = [one.get("expression") or one["license"]["name"] for one in entry["licenses"]]
    return "; ".join(named).replace("|", "\\|") or NOT_STATED


def page(text: str, components: Iterable[Mapping]) -> str:
    """The page with its table made anew; what stands outside the marks stays."""
    before, rest = text.split(BEGIN)
    return f"{before}{BEGIN}\n\n{table(components)}\n\n{END}{rest.split(END)[1]}"


def main() -> None:
    """Write sbom.json and the table of docs/dependencies.md."""
    earlier = json.loads(SBOM.read_text(encoding="utf-8"))["components"] if SBOM.exists() else []
    known = {entry["bom-ref"]: entry["licenses"] for entry in earlier if "licenses" in entry}
    components = [component(package, known) for package in locked(LOCK.read_text(encoding="utf-8"))]
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    SBOM.write_text(document(components, project), encoding="utf-8")
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8"), components), encoding="utf-8")


if __name__ == "__main__":
    main()
