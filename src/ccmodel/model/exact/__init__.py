"""The exact Coulomb solver: tension along a cable as a list of corners of ln T over bend angle, without any grid."""

from ccmodel.model.exact.pair import (
    PHASES,
    CableProfile,
    CableResponse,
    ExactResponse,
    FixedEnd,
    ForceEnd,
    MotionEnd,
    SpringEnd,
    Status,
    simulate_cable,
    simulate_pair,
)

__all__ = [
    "PHASES",
    "CableProfile",
    "CableResponse",
    "ExactResponse",
    "FixedEnd",
    "ForceEnd",
    "MotionEnd",
    "SpringEnd",
    "Status",
    "simulate_cable",
    "simulate_pair",
]
