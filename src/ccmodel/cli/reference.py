"""The page ``docs/command-line.md``: conventions, and each command with its options."""

HEAD = "# Command line\n"


def page() -> str:
    """The page, Markdown."""
    return HEAD
