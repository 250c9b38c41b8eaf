"""Windows of maps of a room of 6 m by 4 m, for tests of graphs, lines of sight, candidates and routes."""

from __future__ import annotations

import math

import numpy as np

from robocov.observation.region import Region
from robocov.planning.discovered_map import FREE, WALL, DiscoveredMap
from robocov.planning.map_window import MapWindow
from robocov.planning.raster import Raster
from robocov.planning.window import Window

REGION = Region(np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 4.0], [0.0, 4.0]]))
RASTER = Raster(REGION, 0.1)


def build_whole_window(max_nodes: int = 150) -> Window:
    """Build a window of the whole room."""
    return Window.build_around(RASTER, np.array([3.0, 2.0]), math.inf, max_nodes)


def build_map_window(is_blocked: np.ndarray, clearance: float = 0.15, max_nodes: int = 150) -> MapWindow:
    """Build the window of a map in which some cells are known to be walls, and all others to be free."""
    state = np.where(is_blocked, WALL, FREE).astype(np.uint8)
    return MapWindow(DiscoveredMap(RASTER, state), build_whole_window(max_nodes), clearance)


def build_open_room() -> np.ndarray:
    """Return the blocked cells of a room without walls: none."""
    return np.zeros(RASTER.shape, dtype=bool)


def build_wall_with_door(door: slice = slice(30, 37)) -> np.ndarray:
    """Return the blocked cells of a wall in the middle with a door."""
    is_blocked = build_open_room()
    is_blocked[:, 29:31] = True
    is_blocked[door, 29:31] = False
    return is_blocked


def build_random_blocks(seed: int) -> np.ndarray:
    """Return the blocked cells of up to seven rectangles at random positions."""
    rng = np.random.default_rng(seed)
    is_blocked = build_open_room()
    for _ in range(rng.integers(0, 8)):
        row = rng.integers(0, 36)
        column = rng.integers(0, 56)
        is_blocked[row : row + rng.integers(1, 12), column : column + rng.integers(1, 12)] = True
    return is_blocked
