"""Compiling kernels, with a cache on disk that knows of all their sources."""

from functools import partial

from numba import njit

from ccmodel.provenance import source_digest


def kernel(function=None, **options):
    """Compile `function`, cached until its module or anything that this imports from the package changes.

    numba looks at the time stamp of a kernel's own file alone: one that calls kernels of another file would be taken
    from the cache though that file has changed. The cache goes by a kernel's name, so the name tells of the sources.

    Parameters
    ----------
    function : callable, optional
        Left out where the decorator is used with options.
    **options
        Of `numba.njit`.
    """
    if function is None:
        return partial(kernel, **options)
    function.__qualname__ += f"_{source_digest(function.__module__)}"
    return njit(cache=True, **options)(function)


# Made part of whatever calls it: for what every sample goes through.
small_kernel = kernel(forceinline=True)
