"""A folder of results that is replaced as a whole, and only by a complete one."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(out: Path) -> Iterator[Path]:
    """A place for a new folder, which takes the place of `out` at the end if nothing was raised.

    Parameters
    ----------
    out : Path
        The folder; it need not exist.

    Yields
    ------
    Path
        Where to make the new one, of the same name; it does not exist yet.
    """
    out.parent.mkdir(parents=True, exist_ok=True)
    # In the parent of `out`, since a folder can only be renamed within a file system.
    with tempfile.TemporaryDirectory(prefix=".import-", dir=out.parent) as work:
        fresh, earlier = Path(work) / out.name, Path(work) / f"earlier-{out.name}"
        yield fresh
        if out.exists():
            out.rename(earlier)
        try:
            fresh.rename(out)
        except BaseException:
            if earlier.exists():
                earlier.rename(out)
            raise
