"""How many examples the tests with damaged or random input draw: few in every run, many with FUZZ (`make fuzz`)."""

import os


def examples(few: int) -> int:
    """Number of examples, `FUZZ` times as many as in every run."""
    return few * int(os.environ.get("FUZZ", "1"))
