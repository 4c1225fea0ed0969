"""All results of a run in one compressed file, so that a page can be scored again and a run resumed in another clone.

The archive holds ``result.json`` of every case, which is everything that the score needs. Reports and model files are
not archived; they follow from the seed.
"""

import gzip
import json
from pathlib import Path


def pack(cases: Path, file: Path) -> int:
    """Write ``result.json`` of every folder in `cases` to a gzipped file, one JSON object a line.

    Equal results give equal bytes.

    Returns
    -------
    int
        The number of results written.
    """
    lines = []
    for result in sorted(cases.glob("*/result.json")):
        numbered = {"number": result.parent.name} | json.loads(result.read_text(encoding="utf-8"))
        lines.append(json.dumps(numbered, sort_keys=True) + "\n")
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(gzip.compress("".join(lines).encode(), mtime=0))
    return len(lines)


def unpack(file: Path, cases: Path, made_by: dict[str, str]) -> int:
    """Restore archived results with the given digests; results that exist already are kept.

    Parameters
    ----------
    file : Path
        The archive. A missing file counts as an empty one.
    cases : Path
        Folder that gets one folder a case.
    made_by : dict
        Digests of the diagnosis and of the builder, as `proof.conceal.made_by` gives them.

    Returns
    -------
    int
        The number of results restored.
    """
    if not file.exists():
        return 0
    restored = 0
    for line in gzip.decompress(file.read_bytes()).decode().splitlines():
        result = json.loads(line)
        target = cases / result.pop("number") / "result.json"
        if made_by.items() <= result.items() and not target.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(json.dumps(result, indent=1), encoding="utf-8")
            restored += 1
    return restored
