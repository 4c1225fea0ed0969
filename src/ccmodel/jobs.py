"""The log file of a pipeline job."""

import logging
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr


@contextmanager
def logged(file: str) -> Iterator[None]:
    """Write warnings, log lines and the traceback of a failure to the log file; exit with 1 on failure."""
    with open(file, "w") as log, redirect_stderr(log):
        logging.basicConfig(stream=log, level=logging.INFO, force=True)
        try:
            yield
        except Exception:
            traceback.print_exc(file=log)
            log.flush()
            sys.exit(1)
