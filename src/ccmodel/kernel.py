"""Compiling kernels, with a cache on disk that knows of all their sources."""

from functools import partial
from uuid import uuid4

from numba import njit, types
from numba.extending import intrinsic

from ccmodel.provenance import source_digest

# numba numbers the files of a kernel's variants 1, 2, ... and two processes that compile at once, each another variant,
# give both the same name: one would then run the other's code. With a name of each process this cannot be.
_PROCESS = uuid4().hex[:8]


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
    compiled = njit(cache=True, nogil=True, no_cfunc_wrapper=True, **options)(function)
    if hasattr(compiled, "get_call_template"):  # not where numba is switched off
        _take_values(compiled)
    if cache := getattr(compiled, "_cache", None):
        files = cache._cache_file
        files._data_name_pattern = files._data_name_pattern.replace("{", f"{_PROCESS}-{{")
    return compiled


def _take_values(compiled):
    """Have one variant of a kernel serve all constants that others call it with.

    numba would compile a cable's kernels anew for cable 0, cable 1 and either of them, and likewise for its ends.
    """
    template_of = compiled.get_call_template

    def by_type(args, kws):
        return template_of(
            tuple(map(types.unliteral, args)), {name: types.unliteral(kind) for name, kind in kws.items()}
        )

    compiled.get_call_template = by_type


# Made part of whatever calls it: for what every sample goes through.
small_kernel = kernel(forceinline=True)


@intrinsic
def borrowed(typing_context, value):
    """`value`, an array or a tuple with arrays in it, without a share in its memory; for use inside kernels.

    Else every kernel that is handed an array counts itself in and out, with locked instructions that take longer than
    its arithmetic. Whoever calls the outermost kernel keeps the arrays alive.
    """

    def generate(context, builder, signature, arguments):
        return _disowned(context, builder, value, arguments[0])

    return value(value), generate


def _disowned(context, builder, kind, value):
    """LLVM value of the numba type `kind` with no owner named in any of its arrays."""
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder, value)
        array.meminfo = array.meminfo.type(None)
        return array._getvalue()
    if isinstance(kind, types.BaseTuple):
        parts = [_disowned(context, builder, part, builder.extract_value(value, i)) for i, part in enumerate(kind)]
        return context.make_tuple(builder, kind, parts)
    return value
