"""Parts of sentences."""

from collections.abc import Sequence


def shown(text: object) -> str:
    """A text in one line of characters that show: a file name may hold line ends and codes that steer a terminal."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in str(text))


def joined(names: Sequence[str], last: str = "and") -> str:
    """Names in a row: ``a, b and c``."""
    return f" {last} ".join((", ".join(names[:-1]), names[-1])) if len(names) > 1 else "".join(names)
