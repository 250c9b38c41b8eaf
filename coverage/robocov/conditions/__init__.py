"""Conditions of a run: what goes wrong or changes, and what robots then hear and know."""

from __future__ import annotations

from robocov.conditions.parameters import (
    FAILING,
    LIMITS,
    LOSS,
    POSITION,
    QUANTITIES,
    SCANNING,
    SENSING,
    SOON,
    UNITS,
    Conditions,
    Failure,
    Join,
    parsed_failure,
    parsed_join,
)

__all__ = [
    "FAILING",
    "LIMITS",
    "LOSS",
    "POSITION",
    "QUANTITIES",
    "SCANNING",
    "SENSING",
    "SOON",
    "UNITS",
    "Conditions",
    "Failure",
    "Join",
    "parsed_failure",
    "parsed_join",
]
