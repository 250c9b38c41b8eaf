"""A hall of 8 m by 4 m, with walls that tests choose, for tests of plans."""

from __future__ import annotations

import math

import numpy as np

from robocov.observation.region import Region
from robocov.planning.discovered_map import FREE, WALL, DiscoveredMap
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.raster import Raster
from robocov.planning.window import Window

REGION = Region(np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 4.0], [0.0, 4.0]]))
RASTER = Raster(REGION, 0.1)
WINDOW = Window.build_around(RASTER, np.array([4.0, 2.0]), math.inf, 250)

HALVES = (slice(0, 28), slice(39, 41))
"""A wall between a left and a right room, with a passage above."""


def build_map(*walls: tuple[slice, slice]) -> DiscoveredMap:
    """Build a map in which everything is free except for walls."""
    state = np.full(RASTER.shape, FREE, dtype=np.uint8)
    for wall in walls:
        state[wall] = WALL
    return DiscoveredMap(RASTER, state)


def build_planner(*walls: tuple[slice, slice]) -> GridPlanner:
    """Build a planner for such a map."""
    return GridPlanner(build_map(*walls), WINDOW, 0.15)
