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
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.layers.known_obstacles import get_discovered_map
from robocov_app.render.sensed_points import SensedPoints


def build_discovered_scene(selected: int | None = 0):
    """A scene in which the first robot knows a wall, a presumed one, and free cells on the left."""
    raster = Raster(SQUARE.region, 0.1)
    state = np.zeros(raster.shape, dtype=np.uint8)
    columns = raster.shape[1]
    state[:, : columns // 2] = FREE
    state[20:25, 10:20] = WALL
    state[30:35, 10:20] = PRESUMED_WALL
    known = DiscoveredMap(raster, state)
    plain = build_scene(ONE)
    memory = Atlas().begin(SQUARE.region, Team.homogeneous(len(plain.team)))
    memory = replace(memory, states=(replace(memory.states[0], known_map=known), *memory.states[1:]))
    snapshot = replace(plain.snapshot, decision=replace(plain.snapshot.decision, memory=memory))
    return known, replace(plain, snapshot=snapshot, sensed=SensedPoints(), selected=selected)


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_walls_and_unknown_cells_are_visible(theme):
    known, shown = build_discovered_scene()
    assert get_discovered_map(shown) is known
    frame, painter = render_layers(shown, "sensed", theme=theme)
    at = {
        name: painter.camera.to_pixels(known.raster.compute_centers(np.array(row), np.array(column)))
        for name, (row, column) in {
            "wall": (22, 15),
            "presumed": (32, 15),
            "free": (40, 15),
            "unknown": (40, known.raster.shape[1] - 6),
        }.items()
    }
    color = theme.forces["repulsion_obstacle"]
    assert measure_error(frame, at["free"], theme.background) == 0
    assert measure_error(frame, at["wall"], mix(theme.background, color, 0.85)) < 6
    assert measure_error(frame, at["presumed"], mix(theme.background, color, 0.45)) < 6
    assert measure_error(frame, at["unknown"], mix(theme.background, theme.obstacle, 0.28)) < 6


def test_without_a_selected_robot_or_map_nothing_is_drawn():
    _, shown = build_discovered_scene(selected=None)
    assert get_discovered_map(shown) is None
    assert get_discovered_map(replace(build_scene(ONE), selected=0)) is None
    assert get_discovered_map(replace(shown, snapshot=None, selected=0)) is None
