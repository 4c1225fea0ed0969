"""Parts of sentences."""

from collections.abc import Sequence
from unicodedata import category

# Unicode's categories of characters that steer a terminal or end a line, and of bytes that are no text.
_CONTROLS = ("Cc", "Cs", "Zl", "Zp")


def controls_in(text: str) -> bool:
    """Whether a text, such as the name of a file, holds line ends, codes that steer a terminal, or bytes of no text."""
    return any(category(c) in _CONTROLS for c in text)


def shown(text: object) -> str:
    """A text in one line, with what `controls_in` finds written as escape sequences."""
    return "".join(c.encode("unicode_escape").decode() if controls_in(c) else c for c in str(text))


def joined(names: Sequence[str], last: str = "and") -> str:
    """Names in a row: ``a, b and c``."""
    return f" {last} ".join((", ".join(names[:-1]), names[-1])) if len(names) > 1 else "".join(names)
