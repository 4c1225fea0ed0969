"""Results of a proof in one small file, so that a page can be scored again, and a proof go on, wherever it is cloned.

Reports and models stay where they were made; a result names all that its score rests on, and the seed makes the rest
again.
"""

import gzip
import json
from pathlib import Path


def pack(cases: Path, file: Path) -> int:
    """Write the ``result.json`` of every folder in `cases` to a file, a line each; returns how many.

    The same results give the same bytes.
    """
    lines = []
    for result in sorted(cases.glob("*/result.json")):
        numbered = {"number": result.parent.name} | json.loads(result.read_text(encoding="utf-8"))
        lines.append(json.dumps(numbered, sort_keys=True) + "\n")
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(gzip.compress("".join(lines).encode(), mtime=0))
    return len(lines)


def unpack(file: Path, cases: Path, made_by: dict[str, str]) -> int:
    """Bring back what `pack` wrote, as far as it is of these sources and this builder and is not there; how many.

    Parameters
    ----------
    file : Path
        One that is not there holds nothing.
    cases : Path
        Folder that gets a folder a case.
    made_by : dict
        Digests under the names that they have in a result.
    """
    if not file.exists():
        return 0
    brought = 0
    for line in gzip.decompress(file.read_bytes()).decode().splitlines():
        result = json.loads(line)
        to = cases / result.pop("number") / "result.json"
        if made_by.items() <= result.items() and not to.exists():
            to.parent.mkdir(parents=True, exist_ok=True)
            to.write_text(json.dumps(result, indent=1), encoding="utf-8")
            brought += 1
    return brought
