"""The general solver: the pair of cables with any effects that the paper leaves out, and any load."""

from ccmodel.model.general.run import Active, GeneralResponse, simulate

__all__ = ["Active", "GeneralResponse", "simulate"]
