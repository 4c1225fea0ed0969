"""Files that are read: regular ones, up to a size that is stated here and that the environment can change.

A pipe or a device may have no end, and a few kB may unpack to more than the memory.
"""

import errno
import os
import stat
from pathlib import Path

# Largest sizes, MB, by the variable of the environment that changes them. A log of ten million samples of seven sensors
# has 0.7 GB as text. A batch.yaml of a thousand recordings has 0.3 MB, and the reader of YAML takes 1 s for 0.1 MB.
# A model has 0.1 MB.
LARGEST_MB = {
    "CCMODEL_LARGEST_LOG_MB": 1000.0,
    "CCMODEL_LARGEST_UNPACKED_MB": 1000.0,
    "CCMODEL_LARGEST_YAML_MB": 0.7,
    "CCMODEL_LARGEST_MODEL_MB": 50.0,
}
LOG, UNPACKED, DOCUMENT, MODEL = LARGEST_MB
_KINDS = {
    stat.S_ISFIFO: "a pipe",
    stat.S_ISCHR: "a device",
    stat.S_ISBLK: "a device",
    stat.S_ISSOCK: "a socket",
    stat.S_ISDIR: "a folder",
}


def largest_bytes(limit: str) -> float:
    """A limit of size in bytes.

    Parameters
    ----------
    limit : str
        One of `LARGEST_MB`.
    """
    try:
        return 1e6 * float(os.environ.get(limit, ""))
    except ValueError:
        return 1e6 * LARGEST_MB[limit]


def too_large(limit: str) -> str:
    """What to say of a file above a limit."""
    return f"larger than {largest_bytes(limit) / 1e6:g} MB; if that is right, set {limit} to its MB"


def check_regular(path: Path) -> None:
    """Raise `OSError` if a file does not exist or is no regular file; it is not opened, since that may wait."""
    mode = os.stat(path).st_mode
    if not stat.S_ISREG(mode):
        kind = next((text for is_kind, text in _KINDS.items() if is_kind(mode)), "of another kind")
        raise OSError(errno.EINVAL, f"it is {kind}; a regular file is needed", str(path))


def check_file(path: Path, limit: str) -> None:
    """Raise `OSError` if a file does not exist, is no regular file, or is above a limit."""
    check_regular(path)
    if os.stat(path).st_size > largest_bytes(limit):
        raise OSError(errno.EFBIG, f"it is {too_large(limit)}", str(path))
