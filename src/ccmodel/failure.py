"""The error of a model that cannot be run."""


class ModelError(ValueError):
    """The model cannot be run, or its step has no solution; the text says where, and what to do."""
