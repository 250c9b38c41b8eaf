"""The locational cost (4) of cells: its derivatives, and the point from which each cell's is best."""

from __future__ import annotations

from robocov.locational.cost import (
    CellSides,
    Distance,
    OverEdge,
    Performance,
    Seen,
    Sensing,
    SquaredDistance,
    gradient,
    hessian,
    value,
)

__all__ = [
    "CellSides",
    "Distance",
    "OverEdge",
    "Performance",
    "Seen",
    "Sensing",
    "SquaredDistance",
    "gradient",
    "hessian",
    "value",
]
