"""How a model says that it could not be run."""


class ModelError(ValueError):
    """The model cannot be run, or its step has no solution; the text says where and what to do."""
