"""How a model says that it could not be run."""

from ccmodel.failure import ModelError

__all__ = ["ModelError"]
