"""The exact Coulomb solver: tension along a cable as a list of corners of ln T over bend angle, without any grid."""

from ccmodel.model.exact.pair import PHASES, ExactResponse, simulate_pair
from ccmodel.model.exact.profile import CableProfile
from ccmodel.model.response import Status

__all__ = [
    "PHASES",
    "CableProfile",
    "ExactResponse",
    "Status",
    "simulate_pair",
]
