"""How often the model was run: a measure of work that depends neither on the machine nor on its load."""

from threading import Lock

_lock = Lock()
_runs = 0


def count_run() -> None:
    """Count a run of the model on one recording."""
    global _runs
    with _lock:
        _runs += 1


def model_runs() -> int:
    """Runs of this process so far, on whatever thread."""
    return _runs
