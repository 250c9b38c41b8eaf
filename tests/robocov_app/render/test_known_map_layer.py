"""The map that the selected robot has discovered."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_pixels import ONE, measure_error, render_layers
from drawn_run import SQUARE, build_scene

from robocov.controllers.exploration.atlas import Atlas
from robocov.planning.discovered_map import FREE, PRESUMED_WALL, WALL, DiscoveredMap
from robocov.planning.raster import Raster
from robocov.team import Team
from robocov_app.look.colors import mix
from robocov_app.look.theme import DARK, LIGHT, Theme
from robocov_app.render.layers.known_obstacles import get_discovered_map
from robocov_app.render.scene import Scene
from robocov_app.render.sensed_points import SensedPoints

WALL_CELL = (22, 15)
PRESUMED_WALL_CELL = (32, 15)
FREE_CELL = (40, 15)
UNKNOWN_CELL = (40, 74)
"""Rows and columns of cells of the discovered map."""


def build_discovered_map() -> DiscoveredMap:
    """Return a map with a wall, a presumed wall and free cells in its left half."""
    raster = Raster(SQUARE.region, 0.1)
    _, n_columns = raster.shape
    state = np.zeros(raster.shape, dtype=np.uint8)
    state[:, : n_columns // 2] = FREE
    state[20:25, 10:20] = WALL
    state[30:35, 10:20] = PRESUMED_WALL
    return DiscoveredMap(raster, state)


def build_discovered_scene(discovered_map: DiscoveredMap, selected: int | None = 0) -> Scene:
    """Return a scene in which the first robot knows a map."""
    scene = build_scene(ONE)
    assert scene.snapshot is not None
    memory = Atlas().begin(SQUARE.region, Team.homogeneous(len(scene.team)))
    first_state = replace(memory.states[0], known_map=discovered_map)
    memory = replace(memory, states=(first_state, *memory.states[1:]))
    decision = replace(scene.snapshot.decision, memory=memory)
    snapshot = replace(scene.snapshot, decision=decision)
    return replace(scene, snapshot=snapshot, sensed=SensedPoints(), selected=selected)


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_walls_and_unknown_cells_of_the_discovered_map_are_visible(theme: Theme) -> None:
    discovered_map = build_discovered_map()
    frame, painter = render_layers(build_discovered_scene(discovered_map), "sensed", theme=theme)
    rows, columns = np.array([WALL_CELL, PRESUMED_WALL_CELL, FREE_CELL, UNKNOWN_CELL]).T
    centers = discovered_map.raster.compute_centers(rows, columns)
    wall, presumed_wall, free, unknown = painter.camera.to_pixels(centers)
    wall_color = theme.forces["repulsion_obstacle"]
    assert measure_error(frame, free, theme.background) == 0
    assert measure_error(frame, wall, mix(theme.background, wall_color, 0.85)) < 6
    assert measure_error(frame, presumed_wall, mix(theme.background, wall_color, 0.45)) < 6
    assert measure_error(frame, unknown, mix(theme.background, theme.obstacle, 0.28)) < 6


def test_the_discovered_map_is_that_of_the_selected_robot() -> None:
    discovered_map = build_discovered_map()
    assert get_discovered_map(build_discovered_scene(discovered_map, selected=0)) is discovered_map


def test_without_a_selected_robot_no_discovered_map_is_drawn() -> None:
    scene = build_discovered_scene(build_discovered_map(), selected=None)
    assert get_discovered_map(scene) is None


def test_a_controller_that_discovers_no_map_has_none() -> None:
    assert get_discovered_map(replace(build_scene(ONE), selected=0)) is None


def test_before_the_first_step_no_discovered_map_is_drawn() -> None:
    scene = build_discovered_scene(build_discovered_map(), selected=0)
    assert get_discovered_map(replace(scene, snapshot=None)) is None
