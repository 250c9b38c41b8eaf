"""Previews: recorded runs and outlines of maps, which are drawn without a simulation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pygame
from numpy.typing import NDArray
from pygame import Rect, Surface

from robocov_app.look.colors import Color
from robocov_app.look.theme import Theme
from robocov_app.render import sprites
from robocov_app.render.surface_cache import cache_surfaces

PREVIEW_FILE = Path(__file__).with_name("assets") / "previews.npz"
"""Recorded by ``python -m robocov_app.viewer.start.recording``."""
FRAMES_PER_SECOND = 4.0
"""Recorded frames per second of a preview; positions between them are interpolated."""
LAST_FRAME_HOLD_S = 2.0
"""Time for which a preview stays at its last frame."""
MAX_LARGE_ROBOTS = 9
"""Maximum number of robots that are drawn at full size."""

_CENTIMETERS = 100.0
_SUPERSAMPLING = 3
"""Outlines are drawn larger by this factor and then scaled down, which smooths their edges."""
_TRANSPARENT = (0, 0, 0, 0)
_EDGE_SMOOTHINGS = 2
"""Number of times that the grid of owners is doubled; slanted edges lose their steps."""
_OUTLINE_CACHE_BYTES = 12_000_000

_MIN_WIDTH_IN_RADII = 26
"""Minimum width of a preview, in robot radii."""

# Lengths in pixels at scale 1.
_ROBOT_PX = 5.0
_SMALL_ROBOT_PX = 2.6
_BOUNDARY_PX = 1.4


@dataclass(frozen=True)
class Outline:
    """The outline of a map.

    Attributes
    ----------
    name : str
        Name of the bundled map.
    rings : tuple of (k, 2) array, m
        The boundary, and then the free space: the exterior of each component, counter-clockwise, followed by
        its obstacles, clockwise.
    """

    name: str
    rings: tuple[NDArray[Any], ...]

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Left, bottom, right and top of the boundary, m."""
        low = self.rings[0].min(axis=0)
        high = self.rings[0].max(axis=0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])

    @property
    def aspect(self) -> float:
        """Width divided by height."""
        left, bottom, right, top = self.bounds
        return (right - left) / (top - bottom)


@dataclass(frozen=True)
class RunPreview:
    """A recorded run.

    Attributes
    ----------
    outline : Outline
        Its map.
    positions : (frames, n, 2) array, m
    owners : (frames, rows, columns) array
        Row of the robot that covers each cell of a grid over the map; the first row is at the top.
    hues : (n,) array
        Hue of each robot.
    """

    outline: Outline
    positions: NDArray[Any]
    owners: NDArray[Any]
    hues: NDArray[Any]

    @property
    def duration(self) -> float:
        """Time until the preview repeats, s."""
        return (len(self.positions) - 1) / FRAMES_PER_SECOND + LAST_FRAME_HOLD_S

    def interpolate(self, seconds: float) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return the positions, (n, 2) m, and the owners, (rows, columns), at a time of the preview."""
        last = len(self.positions) - 1
        frame = min((seconds % self.duration) * FRAMES_PER_SECOND, float(last))
        index = min(int(frame), last - 1)
        fraction = frame - index
        positions = (1.0 - fraction) * self.positions[index] + fraction * self.positions[index + 1]
        return positions, self.owners[round(frame)]


class PreviewStore:
    """All previews.

    Parameters
    ----------
    path : Path
        File of the recorded arrays.

    Attributes
    ----------
    outlines : dict of str to Outline
        Outlines of the bundled maps by name.
    runs : dict of str to RunPreview
        Recorded runs by name.
    """

    def __init__(self, path: Path = PREVIEW_FILE) -> None:
        with np.load(path, allow_pickle=False) as arrays:
            self.outlines = _read_outlines(arrays)
            self.runs = _read_runs(arrays, self.outlines)


@cache
def load_previews() -> PreviewStore:
    """Load the previews that are bundled with robocov."""
    return PreviewStore()


def _read_outlines(arrays: Any) -> dict[str, Outline]:
    rings: dict[str, list[NDArray[Any]]] = {}
    for key in arrays.files:
        kind, name, _ = key.split("/")
        if kind == "map":
            rings.setdefault(name, []).append(arrays[key] / _CENTIMETERS)
    return {name: Outline(name, tuple(found)) for name, found in rings.items()}


def _read_runs(arrays: Any, outlines: dict[str, Outline]) -> dict[str, RunPreview]:
    names = dict.fromkeys(key.split("/")[1] for key in arrays.files if key.startswith("run/"))
    runs: dict[str, RunPreview] = {}
    for name in names:
        runs[name] = RunPreview(
            outline=outlines[str(arrays[f"run/{name}/map"])],
            positions=arrays[f"run/{name}/positions"] / _CENTIMETERS,
            owners=arrays[f"run/{name}/owners"],
            hues=arrays[f"run/{name}/hues"],
        )
    return runs


def fit_outline(outline: Outline, box: Rect) -> Rect:
    """Return the largest rectangle with the shape of a map in the middle of a box."""
    width = min(float(box.width), box.height * outline.aspect)
    fitted = Rect(0, 0, max(round(width), 1), max(round(width / outline.aspect), 1))
    fitted.center = box.center
    return fitted


def draw_outline(
    screen: Surface, outline: Outline, box: Rect, theme: Theme, scale: float, *, outside: Color
) -> None:
    """Draw the outline of a map in the middle of a box, over the existing content.

    Parameters
    ----------
    screen : Surface
    outline : Outline
    box : Rect
    theme : Theme
    scale : float
        Scale of the lines.
    outside : Color
        Color outside the boundary.
    """
    fitted = fit_outline(outline, box)
    line_px = max(1, round(_BOUNDARY_PX * scale))
    colors = (theme.obstacle, theme.boundary, outside)
    picture = _render_outline(outline.name, fitted.size, line_px, colors)
    screen.blit(picture, fitted, special_flags=pygame.BLEND_PREMULTIPLIED)


@cache_surfaces(_OUTLINE_CACHE_BYTES)
def _render_outline(
    name: str, size: tuple[int, int], line_px: int, colors: tuple[Color, Color, Color]
) -> Surface:
    """Render a map, transparent where it is free; the colors are those of obstacles, boundary and outside."""
    obstacle, boundary, outside = colors
    outline = load_previews().outlines[name]
    width = size[0] * _SUPERSAMPLING
    height = size[1] * _SUPERSAMPLING
    large = Surface((width, height), pygame.SRCALPHA, 32)
    large.fill(outside)
    left, bottom, right, top = outline.bounds
    inset = line_px * _SUPERSAMPLING
    factor = np.array([(width - inset - 1) / (right - left), -(height - inset - 1) / (top - bottom)])
    shift = np.array([inset / 2 - left * factor[0], inset / 2 - top * factor[1]])
    rings = [(ring * factor + shift).tolist() for ring in outline.rings]
    pygame.draw.polygon(large, obstacle, rings[0])
    for ring, points in zip(outline.rings[1:], rings[1:], strict=True):
        color = _TRANSPARENT if _is_counter_clockwise(ring) else obstacle
        pygame.draw.polygon(large, color, points)
        # Thin walls would be invisible without an edge.
        pygame.draw.lines(large, obstacle, True, points, _SUPERSAMPLING)
    pygame.draw.lines(large, boundary, True, rings[0], inset)
    return pygame.transform.smoothscale(large.premul_alpha(), size)


def _is_counter_clockwise(ring: NDArray[Any]) -> bool:
    """Return whether the signed area of a closed ring, (k, 2), is positive."""
    x = ring[:, 0]
    y = ring[:, 1]
    return bool((x[:-1] * y[1:] - x[1:] * y[:-1]).sum() > 0)


def draw_run(
    screen: Surface,
    run: RunPreview,
    box: Rect,
    theme: Theme,
    scale: float,
    *,
    seconds: float,
    outside: Color,
) -> None:
    """Draw a recorded run in the middle of a box.

    Parameters
    ----------
    screen : Surface
    run : RunPreview
    box : Rect
    theme : Theme
    scale : float
        Scale of robots and lines.
    seconds : float
        Time of the preview.
    outside : Color
        Color outside the boundary.
    """
    positions, owners = run.interpolate(seconds)
    fitted = fit_outline(run.outline, box)
    screen.blit(_render_cells(owners, run.hues, fitted.size, theme), fitted)
    draw_outline(screen, run.outline, box, theme, scale, outside=outside)
    left, bottom, right, top = run.outline.bounds
    is_small = len(run.hues) > MAX_LARGE_ROBOTS
    radius = (_SMALL_ROBOT_PX if is_small else _ROBOT_PX) * scale
    radius = min(radius, max(fitted.width / _MIN_WIDTH_IN_RADII, 2.0))
    for hue, (x, y) in zip(run.hues.tolist(), positions.tolist(), strict=True):
        disc = sprites.render_disc(
            radius,
            (0, 0),
            fill=theme.robots[hue],
            ring=theme.robot_ring,
            ring_width=max(scale, 1.0),
            edge=theme.ink,
        )
        center_x = fitted.left + (x - left) / (right - left) * fitted.width
        center_y = fitted.top + (top - y) / (top - bottom) * fitted.height
        screen.blit(disc, disc.get_rect(center=(round(center_x), round(center_y))))


def _render_cells(owners: NDArray[Any], hues: NDArray[Any], size: tuple[int, int], theme: Theme) -> Surface:
    """Render the cells of all robots, with smooth edges."""
    palette = np.array([theme.get_cell_color(hue) for hue in hues.tolist()], dtype=np.uint8)
    pixels = palette[owners.T]
    cells = pygame.surfarray.make_surface(pixels)
    for _ in range(_EDGE_SMOOTHINGS):
        cells = pygame.transform.scale2x(cells)
    return pygame.transform.smoothscale(cells, size)
