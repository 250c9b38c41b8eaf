"""The map that a robot has discovered, as a picture: walls it has seen, and where it has not looked yet."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pygame

from robocov.planning.discovered import PRESUMED, UNKNOWN, WALL, DiscoveredMap

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from robocov_app.render.canvas import Canvas
    from robocov_app.render.scene import Scene

_OPACITY = {UNKNOWN: 0.28, PRESUMED: 0.45, WALL: 0.85}
"""Of the colours of cells; free ones are clear."""


def discovered_map(scene: Scene) -> DiscoveredMap | None:
    """Return the map of the robot that is asked about, None where its controller remembers none."""
    if scene.snapshot is None or scene.selected is None:
        return None
    maps = getattr(scene.snapshot.decision.memory, "maps", ())
    known = maps[scene.selected] if scene.selected < len(maps) else None
    return known if isinstance(known, DiscoveredMap) else None


def draw_discovered(canvas: Canvas, known: DiscoveredMap) -> None:
    """Draw what is in view of a discovered map: unknown cells veiled, walls as what is sensed of them.

    Cells outside the region are left clear.
    """
    raster = known.raster
    view = canvas.surface.get_clip()
    corners = np.array([view.topleft, view.bottomright], dtype=float)
    row, column = raster.cells(canvas.camera.to_world(corners))
    first, last = (int(row.min()), int(column.min())), (int(row.max()) + 1, int(column.max()) + 1)
    state = known.state[first[0] : last[0], first[1] : last[1]]
    outside = raster.outside[first[0] : last[0], first[1] : last[1]]
    pixels = np.zeros((*state.shape, 4), dtype=np.uint8)
    theme = canvas.theme
    for value, colour in (
        (UNKNOWN, theme.obstacle),
        (PRESUMED, theme.forces["repulsion_obstacle"]),
        (WALL, theme.forces["repulsion_obstacle"]),
    ):
        pixels[(state == value) & ~outside] = _premultiplied(colour, _OPACITY[value])
    x, y = raster.origin
    low = np.array([x + first[1] * raster.cell, y + first[0] * raster.cell])
    high = np.array([x + last[1] * raster.cell, y + last[0] * raster.cell])
    (left, bottom), (right, top) = canvas.camera.to_pixels(np.array([low, high])).round().astype(int).tolist()
    if right <= left or bottom <= top:
        return
    # the lowest row comes first, in a picture the highest
    upright = np.ascontiguousarray(pixels[::-1])
    picture = pygame.image.frombuffer(upright.tobytes(), (state.shape[1], state.shape[0]), "RGBA")
    scaled = pygame.transform.scale(picture, (right - left, bottom - top))
    canvas.surface.blit(scaled, (left, top), special_flags=pygame.BLEND_PREMULTIPLIED)


def _premultiplied(colour: tuple[int, int, int], opacity: float) -> NDArray[np.uint8]:
    return np.array([*(round(part * opacity) for part in colour), round(255 * opacity)], dtype=np.uint8)
