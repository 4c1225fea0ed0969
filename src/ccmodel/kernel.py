"""Compilation of kernels with numba, and a cache on disk that is keyed by all of a kernel's sources."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, overload
from uuid import uuid4

import numba
from numba import njit, types
from numba.core.compiler_lock import global_compiler_lock

from ccmodel.provenance import source_digest

try:
    import fcntl
except ImportError:  # Windows: there each process compiles for itself
    fcntl = None  # type: ignore[assignment]

# Versions of numba with which the private attributes used here were tested: from the first, below the second. The range
# in pyproject.toml is the same.
TESTED_NUMBA = ("0.68", "0.69")

# numba numbers the cache files of a kernel's signatures 1, 2, ... Two processes that compile different signatures at
# once give both files the same number, and one process then loads the code of the other. A name for each process
# prevents this.
_PROCESS = uuid4().hex[:8]


def check_numba(version: str) -> None:
    """Refuse a version of numba whose private attributes were not tested.

    Raises
    ------
    ImportError
        If `version` is not within `TESTED_NUMBA`.
    """
    first, end = (tuple(map(int, bound.split("."))) for bound in TESTED_NUMBA)
    if not first <= tuple(map(int, version.split(".")[:2])) < end:
        tested = f"numba>={TESTED_NUMBA[0]},<{TESTED_NUMBA[1]}"
        raise ImportError(f"ccmodel was tested with {tested} only, found {version}: pip install '{tested}'")


check_numba(numba.__version__)


Function = TypeVar("Function", bound=Callable[..., Any])


@overload
def kernel(function: Function, **options: Any) -> Function: ...


@overload
def kernel(**options: Any) -> Callable[[Function], Function]: ...


def kernel(function: Any = None, *, allocates: bool = False, **options: Any) -> Any:
    """Compile `function`; cache it until its module, or a module of the package that it imports, changes.

    numba compares the time stamp of a kernel's own file only: a change in a file that the kernel calls would go
    unnoticed. The cache is keyed by the kernel's name, so the digest of all sources is added to the name.

    Parameters
    ----------
    function : callable, optional
        Absent if the decorator is used with options.
    allocates : bool
        Whether it makes arrays or returns them. Any other kernel counts no references to arrays, which its caller keeps
        alive: numba would count them, with atomic instructions, wherever an array or a tuple with arrays is handed on,
        and these took a third of the time of a march.
    **options
        Options of `numba.njit`.
    """
    if function is None:
        return partial(kernel, allocates=allocates, **options)
    function.__qualname__ += f"_{source_digest(function.__module__, discovered=False)}"
    options |= {"cache": True, "nogil": True, "no_cfunc_wrapper": True, "_nrt": allocates}
    compiled = njit(**options)(function)
    if hasattr(compiled, "get_call_template"):  # absent if numba is switched off
        _ignore_literals(compiled)
    if cache := getattr(compiled, "_cache", None):
        files = cache._cache_file
        files._data_name_pattern = files._data_name_pattern.replace("{", f"{_PROCESS}-{{")
        _compile_once(compiled, Path(cache.cache_path) / f"{files._index_name}.lock")
    return compiled


def _compile_once(compiled: Any, lock: Path) -> None:
    """Let processes that need a kernel at the same time wait for the one that compiles it, and take it from the cache.

    Otherwise each of the first jobs of a pipeline, and each process that runs tests, compiles all kernels.
    """
    compile_here = compiled.compile

    def compile(signature: Any) -> Any:
        # numba's own lock first, as a thread that compiles a caller holds it while it compiles this kernel.
        with global_compiler_lock, _held(lock):
            return compile_here(signature)

    compiled.compile = compile


_HELD: set[Path] = set()


@contextmanager
def _held(lock: Path) -> Iterator[None]:
    """The only process in here, as far as the file system knows locks; a killed process lets go of its own."""
    with ExitStack() as stack:
        if fcntl and lock not in _HELD:
            # On a file system without locks, each process compiles for itself.
            with suppress(OSError):
                lock.parent.mkdir(parents=True, exist_ok=True)
                fcntl.flock(stack.enter_context(lock.open("w")), fcntl.LOCK_EX)
                _HELD.add(lock)
                stack.callback(_HELD.remove, lock)
        yield


def _ignore_literals(compiled: Any) -> None:
    """Compile a kernel once for all literal arguments that other kernels call it with.

    Otherwise numba compiles the kernels of a cable separately for cable 0, for cable 1 and for a variable index, and
    likewise for the ends of the cables.
    """
    template_of = compiled.get_call_template

    def by_type(args: Any, kws: Any) -> Any:
        return template_of(
            tuple(map(types.unliteral, args)), {name: types.unliteral(kind) for name, kind in kws.items()}
        )

    compiled.get_call_template = by_type


# A kernel inlined into its callers, for code that every sample passes. The general solver's kernels with one caller
# are inlined too, beside other options: to hand on a run's arrays and constants copies more than a hundred words.
small_kernel = kernel(forceinline=True)
