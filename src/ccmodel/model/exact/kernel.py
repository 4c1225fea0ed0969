"""Compiling the kernels, with a cache on disk that knows of all their sources."""

import hashlib
from pathlib import Path

from numba import njit

# numba looks at the time stamp of a kernel's own file alone: one that calls kernels of another file would be taken from
# the cache though that file has changed. The cache goes by a kernel's name, so the name tells of all the sources.
_SOURCES = hashlib.sha256(b"".join(p.read_bytes() for p in sorted(Path(__file__).parent.glob("*.py")))).hexdigest()[:12]


def kernel(function):
    """Compile `function`, cached until any source of this package changes."""
    function.__qualname__ += f"_{_SOURCES}"
    return njit(cache=True)(function)


def small_kernel(function):
    """As `kernel`, and made part of whatever calls it: for what every sample goes through."""
    function.__qualname__ += f"_{_SOURCES}"
    return njit(cache=True, forceinline=True)(function)
