"""The frame of every job of the pipeline: its log and its threads."""

import logging
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr

from ccmodel.inference.pool import set_threads
from ccmodel.progress import Progress, log_lines


@contextmanager
def logged(file: str, threads: int = 1) -> Iterator[Progress]:
    """Run a job with `threads` threads; write progress, warnings, log lines and a traceback to its log file.

    A job that fails exits with 1.
    """
    set_threads(threads)
    with open(file, "w") as log, redirect_stderr(log):
        logging.basicConfig(stream=log, level=logging.INFO, force=True)
        try:
            progress = log_lines(log)
            progress("started", 0.0)
            yield progress
            progress("ended", 1.0)
        except Exception:
            traceback.print_exc(file=log)
            log.flush()
            sys.exit(1)
