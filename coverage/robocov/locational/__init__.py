"""The locational cost (4) of cells: its derivatives, and the point from which each cell's is best."""

from __future__ import annotations

from robocov.locational.cost import Distance, Performance, Sensing, SquaredDistance, gradient, value

__all__ = ["Distance", "Performance", "Sensing", "SquaredDistance", "gradient", "value"]
