"""What every pipeline job does with its log."""

import logging
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr


@contextmanager
def logged(file: str) -> Iterator[None]:
    """Send warnings, log lines and the trace of a failure to a job's log file; end the job when it fails."""
    with open(file, "w") as log, redirect_stderr(log):
        logging.basicConfig(stream=log, level=logging.INFO, force=True)
        try:
            yield
        except Exception:
            traceback.print_exc(file=log)
            log.flush()
            sys.exit(1)
