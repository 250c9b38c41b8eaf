"""The environment: outer boundary, obstacles, their paths, starts, and the gaps between them."""

from __future__ import annotations

from robocov.environment.geometry import (
    GRID,
    SAGITTA,
    CircleObstacle,
    Environment,
    Obstacle,
    Point,
    PolygonObstacle,
    Ring,
    WallObstacle,
)

__all__ = [
    "GRID",
    "SAGITTA",
    "CircleObstacle",
    "Environment",
    "Obstacle",
    "Point",
    "PolygonObstacle",
    "Ring",
    "WallObstacle",
]
