"""Do the licence texts in the packages' files have the wording of the licences in docs/dependencies.md?

    python -m benchmarks.licence_texts

A licence is recognised by a sentence or title that no other kind of licence has. Packages that are not installed here
are not read. Those whose text has another wording, or that have no text, are printed; they are for a person to read.
"""

import re
from importlib.metadata import Distribution, PackageNotFoundError, distribution

from benchmarks.sbom import PAGE

# By what the table calls a licence, what its text says.
WORDING = {
    "MIT": "permission is hereby granted, free of charge",
    "BSD": "redistribution and use in source",
    "Apache": "apache license",
    "MPL": "mozilla public license",
    "LGPL": "(lesser|library) general public license",
    "GPL": "gnu general public license",
    "PSF|Python": "python software foundation",
    "ISC|HPND|0BSD": "permission to use, copy, modify",
    "Unlicense": "unencumbered",
    "Zlib": "provided 'as-is'",
    "CC0": "cc0",
}
TEXT = re.compile(r"(licen[cs]e|copying|notice)", re.IGNORECASE)
CODE = (".py", ".pyc", ".json")


def rows(page: str) -> list[tuple[str, str, str]]:
    """Name, version and licence of each package in the table."""
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in page.splitlines() if line[:2] == "| "]
    return [(name, version, licence) for name, version, _, licence in cells if name != "package"]


def text_of(package: Distribution) -> str:
    """The licence texts among a package's files, in lower case, without line ends."""
    named = [f for f in package.files or [] if TEXT.search(f.name) and not f.name.endswith(CODE)]
    texts = [file.locate() for file in named]
    return " ".join(" ".join(t.read_text(errors="replace").lower().split()) for t in texts if t.is_file())


def has_wording(licence: str, text: str) -> bool:
    """Whether a text has the wording of every licence that the table names; not if it names none that is known."""
    named = [wording for name, wording in WORDING.items() if re.search(rf"\b({name})", licence, re.IGNORECASE)]
    return bool(named) and all(re.search(wording, text) for wording in named)


def main() -> None:
    """Print how many texts agree, and the others."""
    agree, differ, without, not_installed = [], [], [], []
    for name, version, licence in rows(PAGE.read_text(encoding="utf-8")):
        try:
            package = distribution(name)
        except PackageNotFoundError:
            package = None
        if package is None or package.version != version:
            not_installed.append(name)
        elif not (text := text_of(package)):
            without.append(f"{name}: {licence}; no text")
        elif has_wording(licence, text):
            agree.append(name)
        else:
            differ.append(f"{name}: {licence}; the text begins: {text[:100]}")
    print(
        f"{len(agree)} agree, {len(differ)} differ, {len(without)} without a text, {len(not_installed)} not installed"
    )
    print("\n".join(differ + without))


if __name__ == "__main__":
    main()
