"""Parts of sentences."""

from collections.abc import Sequence


def joined(names: Sequence[str], last: str = "and") -> str:
    """Names in a row: ``a, b and c``."""
    return f" {last} ".join((", ".join(names[:-1]), names[-1])) if len(names) > 1 else "".join(names)
