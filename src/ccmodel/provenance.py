"""Where a result came from: versions and digests that every file of results carries."""

import hashlib
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import ccmodel

_PACKAGE = Path(ccmodel.__file__).parent


def of_inputs(paths: Iterable[Path]) -> dict[str, str]:
    """Version of the package and the digests of the files that a result was made from."""
    inputs = {f"sha256 {Path(p).name}": hashlib.sha256(Path(p).read_bytes()).hexdigest() for p in paths}
    return {"ccmodel_version": ccmodel.__version__, **inputs}


@cache
def source_digest(*parts: str) -> str:
    """Digest of parts of the package: a room ("rig") or a file ("recording.py").

    Snakemake sees when a script changes, not when the package behind it does; with this among a rule's params, it
    reruns what depends on an edited file.

    Raises
    ------
    FileNotFoundError
        If there is no such part.
    """
    digest = hashlib.sha256()
    for part in sorted(parts):
        place = _PACKAGE / part
        if not place.exists():
            raise FileNotFoundError(f"the package has no part {part}")
        for file in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            digest.update(str(file.relative_to(_PACKAGE)).encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]
