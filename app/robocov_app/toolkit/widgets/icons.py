"""Line icons of buttons, drawn from strokes on a grid of 24 by 24 units."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from math import cos, dist, hypot, radians, sin
from types import MappingProxyType
from typing import TypeAlias

import pygame
from pygame import Surface

from robocov_app.look.colors import Color
from robocov_app.render.surface_cache import cache_surfaces

GRID = 24.0
"""Number of units of the grid along a side of an icon."""
_LINE_UNITS = 1.9
"""Width of the lines, in units of the grid."""
_SUPERSAMPLING = 4
"""Icons are drawn larger by this factor and then scaled down, which smooths their edges."""
_ARC_STEP_DEG = 12.0
_CACHE_BYTES = 1_000_000

GridPoint: TypeAlias = tuple[float, float]


@dataclass(frozen=True)
class Stroke:
    """A line or an area of an icon.

    Attributes
    ----------
    points : tuple of (x, y)
        Corners, in units of the grid; y points down.
    is_filled : bool
        Whether it is the area between the corners instead of a line.
    """

    points: tuple[GridPoint, ...]
    is_filled: bool = False


def _line(*points: GridPoint) -> Stroke:
    return Stroke(points)


def _outline(*points: GridPoint) -> Stroke:
    return Stroke((*points, points[0]))


def _area(*points: GridPoint) -> Stroke:
    return Stroke(points, is_filled=True)


def _list_arc_points(center: GridPoint, radius: float, start: float, end: float) -> tuple[GridPoint, ...]:
    """Return points of an arc from an angle to a larger one, in degrees; 90 degrees is down."""
    count = max(int((end - start) / _ARC_STEP_DEG), 2)
    points = []
    for k in range(count + 1):
        angle = radians(start + (end - start) * k / count)
        points.append((center[0] + radius * cos(angle), center[1] + radius * sin(angle)))
    return tuple(points)


def _arc(center: GridPoint, radius: float, start: float, end: float) -> Stroke:
    return Stroke(_list_arc_points(center, radius, start, end))


def _circle(center: GridPoint, radius: float) -> Stroke:
    return Stroke(_list_arc_points(center, radius, 0.0, 360.0))


def _disc(center: GridPoint, radius: float) -> Stroke:
    return Stroke(_list_arc_points(center, radius, 0.0, 360.0), is_filled=True)


_MAGNIFIER = (_circle((10.5, 10.5), 6.5), _line((15.4, 15.4), (20.5, 20.5)))
_ARROW = (
    _outline((6.0, 3.0), (6.0, 18.5), (10.0, 14.9), (12.6, 21.0), (15.2, 19.9), (12.7, 14.0), (18.0, 14.0)),
)
_RULER = (
    _outline((2.5, 16.0), (16.0, 2.5), (21.5, 8.0), (8.0, 21.5)),
    _line((6.3, 12.2), (8.8, 14.7)),
    _line((10.0, 8.5), (12.5, 11.0)),
    _line((13.7, 4.8), (16.2, 7.3)),
)

ICONS: Mapping[str, tuple[Stroke, ...]] = MappingProxyType(
    {
        # Top bar.
        "undo": (
            _line((8.5, 13.5), (4.0, 9.0), (8.5, 4.5)),
            _line((4.0, 9.0), (14.5, 9.0)),
            _arc((14.5, 14.25), 5.25, -90.0, 90.0),
            _line((14.5, 19.5), (10.5, 19.5)),
        ),
        "redo": (
            _line((15.5, 13.5), (20.0, 9.0), (15.5, 4.5)),
            _line((20.0, 9.0), (9.5, 9.0)),
            _arc((9.5, 14.25), 5.25, 90.0, 270.0),
            _line((9.5, 19.5), (13.5, 19.5)),
        ),
        "back": (_line((11.0, 5.0), (4.0, 12.0), (11.0, 19.0)), _line((4.5, 12.0), (20.5, 12.0))),
        "new": (
            _outline((5.0, 3.0), (14.0, 3.0), (19.0, 8.0), (19.0, 21.0), (5.0, 21.0)),
            _line((14.0, 3.5), (14.0, 8.0), (18.5, 8.0)),
        ),
        "open": (_outline((3.0, 5.5), (9.0, 5.5), (11.0, 8.0), (21.0, 8.0), (21.0, 19.0), (3.0, 19.0)),),
        "save": (
            _outline((4.0, 4.0), (16.5, 4.0), (20.0, 7.5), (20.0, 20.0), (4.0, 20.0)),
            _line((8.0, 4.5), (8.0, 9.0), (15.0, 9.0), (15.0, 4.5)),
            _line((7.5, 19.5), (7.5, 13.5), (16.5, 13.5), (16.5, 19.5)),
        ),
        "play": (_area((8.0, 4.5), (20.0, 12.0), (8.0, 19.5)),),
        "pause": (
            _area((6.5, 5.0), (10.2, 5.0), (10.2, 19.0), (6.5, 19.0)),
            _area((13.8, 5.0), (17.5, 5.0), (17.5, 19.0), (13.8, 19.0)),
        ),
        "step": (_area((5.5, 5.0), (15.0, 12.0), (5.5, 19.0)), _line((18.0, 5.5), (18.0, 18.5))),
        "settle": (
            _area((3.0, 6.0), (10.5, 12.0), (3.0, 18.0)),
            _area((10.5, 6.0), (18.0, 12.0), (10.5, 18.0)),
            _line((20.0, 6.5), (20.0, 17.5)),
        ),
        # Back to the start: a bar, and a triangle that points to it.
        "restart": (_line((5.5, 5.5), (5.5, 18.5)), _area((18.5, 4.5), (7.5, 12.0), (18.5, 19.5))),
        "help": (
            _circle((12.0, 12.0), 9.0),
            _arc((12.0, 9.8), 2.8, -170.0, 60.0),
            _line((13.4, 12.2), (12.0, 13.6), (12.0, 14.4)),
            _disc((12.0, 17.3), 1.3),
        ),
        "theme": (
            _circle((12.0, 12.0), 8.0),
            Stroke(_list_arc_points((12.0, 12.0), 8.0, -90.0, 90.0), is_filled=True),
        ),
        "panel": (
            _outline((3.0, 5.0), (21.0, 5.0), (21.0, 19.0), (3.0, 19.0)),
            _area((14.5, 5.0), (21.0, 5.0), (21.0, 19.0), (14.5, 19.0)),
        ),
        "lesson": (
            _outline((1.5, 9.5), (12.0, 4.5), (22.5, 9.5), (12.0, 14.5)),
            _line(
                (6.0, 12.0), (6.0, 17.0), (9.0, 18.8), (12.0, 19.4), (15.0, 18.8), (18.0, 17.0), (18.0, 12.0)
            ),
        ),
        "search": _MAGNIFIER,
        "share": (
            _circle((18.0, 5.5), 2.6),
            _circle((6.0, 12.0), 2.6),
            _circle((18.0, 18.5), 2.6),
            _line((8.4, 10.8), (15.6, 6.9)),
            _line((8.4, 13.2), (15.6, 17.1)),
        ),
        "tune": (
            _line((3.5, 7.0), (20.5, 7.0)),
            _disc((8.5, 7.0), 3.0),
            _line((3.5, 16.5), (20.5, 16.5)),
            _disc((15.5, 16.5), 3.0),
        ),
        # Tools.
        "hand": _ARROW,
        "select": _ARROW,
        "pan": (
            _line((12.0, 3.0), (12.0, 21.0)),
            _line((3.0, 12.0), (21.0, 12.0)),
            _line((9.0, 6.0), (12.0, 3.0), (15.0, 6.0)),
            _line((9.0, 18.0), (12.0, 21.0), (15.0, 18.0)),
            _line((6.0, 9.0), (3.0, 12.0), (6.0, 15.0)),
            _line((18.0, 9.0), (21.0, 12.0), (18.0, 15.0)),
        ),
        "polygon": (
            _outline((12.0, 3.5), (20.5, 10.0), (17.3, 19.5), (6.7, 19.5), (3.5, 10.0)),
            _disc((12.0, 3.5), 2.2),
            _disc((20.5, 10.0), 2.2),
            _disc((17.3, 19.5), 2.2),
            _disc((6.7, 19.5), 2.2),
            _disc((3.5, 10.0), 2.2),
        ),
        "wall": (
            _outline((3.0, 6.0), (21.0, 6.0), (21.0, 18.0), (3.0, 18.0)),
            _line((3.0, 12.0), (21.0, 12.0)),
            _line((9.0, 6.0), (9.0, 12.0)),
            _line((15.0, 6.0), (15.0, 12.0)),
            _line((12.0, 12.0), (12.0, 18.0)),
        ),
        "circle": (_circle((12.0, 12.0), 8.5),),
        "brush": (
            _line((20.5, 3.5), (11.5, 12.5)),
            _outline((9.0, 12.0), (12.0, 15.0), (10.5, 19.0), (3.5, 20.5), (5.5, 17.5), (6.0, 14.0)),
        ),
        "eraser": (
            _outline((3.5, 15.0), (13.5, 4.0), (20.5, 10.5), (11.5, 20.0), (8.0, 20.0)),
            _line((8.5, 9.5), (15.8, 16.0)),
            _line((11.5, 20.0), (21.0, 20.0)),
        ),
        "robot": (
            _circle((9.5, 14.0), 6.5),
            _line((18.5, 2.5), (18.5, 10.5)),
            _line((14.5, 6.5), (22.5, 6.5)),
        ),
        "failure": (
            _circle((12.0, 12.0), 8.5),
            _line((8.8, 8.8), (15.2, 15.2)),
            _line((15.2, 8.8), (8.8, 15.2)),
        ),
        "ruler": _RULER,
        "measure": _RULER,
        "boundary": (
            _outline((3.0, 3.5), (21.0, 3.5), (21.0, 20.5), (12.0, 20.5), (12.0, 13.5), (3.0, 13.5)),
        ),
        "door": (
            _line((3.0, 20.5), (21.0, 20.5)),
            _line((6.5, 20.5), (6.5, 3.5), (17.5, 3.5), (17.5, 20.5)),
            _disc((14.0, 12.5), 1.5),
        ),
        "rectangle": (_outline((3.0, 6.0), (21.0, 6.0), (21.0, 18.0), (3.0, 18.0)),),
        "disc": (
            _circle((12.0, 12.0), 9.0),
            _disc((12.0, 8.0), 1.9),
            _disc((8.6, 14.2), 1.9),
            _disc((15.4, 14.2), 1.9),
        ),
        "places": (
            _circle((7.0, 7.0), 3.2),
            _circle((17.6, 9.4), 3.2),
            _circle((9.4, 17.6), 3.2),
        ),
        "density": (_circle((12.0, 12.0), 9.0), _circle((12.0, 12.0), 5.2), _disc((12.0, 12.0), 1.9)),
        "path": (
            _outline((3.0, 14.5), (9.5, 14.5), (9.5, 21.0), (3.0, 21.0)),
            _line((11.5, 12.5), (20.5, 3.5)),
            _line((14.0, 3.5), (20.5, 3.5), (20.5, 10.0)),
        ),
        "background": (
            _outline((3.0, 4.5), (21.0, 4.5), (21.0, 19.5), (3.0, 19.5)),
            _line((3.5, 17.0), (9.0, 11.0), (13.0, 15.0), (16.0, 12.5), (20.5, 17.0)),
            _disc((16.3, 8.6), 1.7),
        ),
        # View.
        "fit": (
            _line((3.5, 9.0), (3.5, 3.5), (9.0, 3.5)),
            _line((15.0, 3.5), (20.5, 3.5), (20.5, 9.0)),
            _line((20.5, 15.0), (20.5, 20.5), (15.0, 20.5)),
            _line((9.0, 20.5), (3.5, 20.5), (3.5, 15.0)),
        ),
        "zoom:in": (*_MAGNIFIER, _line((10.5, 7.5), (10.5, 13.5)), _line((7.5, 10.5), (13.5, 10.5))),
        "zoom:out": (*_MAGNIFIER, _line((7.5, 10.5), (13.5, 10.5))),
        # Panel.
        "close": (_line((6.5, 6.5), (17.5, 17.5)), _line((17.5, 6.5), (6.5, 17.5))),
        "add": (_line((12.0, 4.5), (12.0, 19.5)), _line((4.5, 12.0), (19.5, 12.0))),
        "reset": (_arc((12.5, 12.5), 7.0, -140.0, 120.0), _line((5.2, 4.0), (6.2, 8.6), (10.8, 7.9))),
    }
)
"""Strokes of each icon, by its name."""


@cache_surfaces(_CACHE_BYTES)
def render_icon(name: str, side: int, color: Color) -> Surface:
    """Render an icon on a transparent square with premultiplied alpha.

    Parameters
    ----------
    name : str
        Key of `ICONS`.
    side : int, px
        Side of the square.
    color : Color

    Returns
    -------
    pygame.Surface
        The surface is cached, so callers must not draw on it.
    """
    unit = side * _SUPERSAMPLING / GRID
    large = Surface((side * _SUPERSAMPLING, side * _SUPERSAMPLING), pygame.SRCALPHA, 32)
    for stroke in ICONS[name]:
        points = [(x * unit, y * unit) for x, y in stroke.points]
        if stroke.is_filled:
            pygame.draw.polygon(large, color, points)
        else:
            _draw_line(large, points, color, _LINE_UNITS * unit)
    return pygame.transform.smoothscale(large.premul_alpha(), (side, side))


def _draw_line(surface: Surface, points: list[GridPoint], color: Color, width: float) -> None:
    """Draw a line through points, with round ends and corners."""
    for point in points:
        pygame.draw.circle(surface, color, point, width / 2)
    for start, end in pairwise(points):
        if dist(start, end) > 0.0:
            pygame.draw.polygon(surface, color, _list_band_corners(start, end, width))


def _list_band_corners(start: GridPoint, end: GridPoint, width: float) -> list[GridPoint]:
    """Return the corners of a line with a width."""
    x0, y0 = start
    x1, y1 = end
    length = hypot(x1 - x0, y1 - y0)
    side_x = -(y1 - y0) / length * width / 2
    side_y = (x1 - x0) / length * width / 2
    return [
        (x0 + side_x, y0 + side_y),
        (x1 + side_x, y1 + side_y),
        (x1 - side_x, y1 - side_y),
        (x0 - side_x, y0 - side_y),
    ]
