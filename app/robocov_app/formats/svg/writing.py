"""SVG at true scale: boundary and obstacles by their ids, to be seen, printed and drawn on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
from shapely import Polygon

from robocov.arrays import Array
from robocov.environment import CircleObstacle, Environment, Obstacle, Ring, WallObstacle
from robocov.files.atomic import written
from robocov_app.formats.geometry.cells import not_held
from robocov_app.formats.geometry.polygons import decimal, free_area
from robocov_app.formats.geometry.primitives import with_numbers
from robocov_app.formats.options import Exporter, ExportReport, WriteOptions
from robocov_app.render.theme import DARK, LIGHT, Theme

DIGITS = 3
"""Decimals of millimetres by default: as fine as the free space is known at true scale."""

_MARGIN = 0.03  # of the longer side, around the map


@dataclass(frozen=True)
class _Pen:
    """Writes shapes in millimetres of the drawing, y down."""

    scale: float
    digits: int

    def length(self, metres: float) -> str:
        return decimal(metres / self.scale, self.digits)

    def rounded(self, metres: float) -> float:
        """Return what a reader will make of a length."""
        return round(metres / self.scale, self.digits) * self.scale

    def ring(self, ring: Ring, end: str = "Z") -> str:
        places = (f"{self.length(x)} {self.length(-y)}" for x, y in ring)
        return f"M{' L'.join(places)}{end}"

    def shape(self, obstacle: Obstacle) -> str:
        if isinstance(obstacle, CircleObstacle):
            x, y = obstacle.center
            kind = f'circle cx="{self.length(x)}" cy="{self.length(-y)}" r="{self.length(obstacle.radius)}"'
        elif isinstance(obstacle, WallObstacle):
            line = self.ring(obstacle.points, "")
            kind = f'path class="wall" fill="none" stroke-width="{self.length(obstacle.width)}" d="{line}"'
        else:
            rings = " ".join(self.ring(ring) for ring in (obstacle.vertices, *obstacle.holes))
            kind = f'path fill-rule="evenodd" d="{rings}"'
        title = _plain(obstacle.name or "")
        return f"<{kind}><title>{title}</title></{kind.split(' ', 1)[0]}>" if title else f"<{kind}/>"


def _write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    scale = 0.001 if options.scale is None else options.scale
    pen = _Pen(scale, DIGITS if options.digits is None else options.digits)
    boundary = np.asarray(environment.boundary, dtype=float)
    margin = _MARGIN * float(np.ptp(boundary, axis=0).max())
    low, high = boundary.min(axis=0) - margin, boundary.max(axis=0) + margin
    with written(path) as part:
        part.write_text(_text(environment, pen, low, high), encoding="utf-8")
    written_boundary = Polygon([(pen.rounded(x), pen.rounded(y)) for x, y in environment.boundary])
    obstacles = [with_numbers(obstacle, pen.rounded).polygon for obstacle in environment.obstacles]
    notes = [f"1 mm is {scale:g} m: {(high - low)[0] / scale:.6g} x {(high - low)[1] / scale:.6g} mm"]
    if options.scale is not None:
        notes.append(f"to import it again: --scale {scale:g}")
    return ExportReport(
        EXPORTER.name,
        (path,),
        environment.free_area,
        free_area(written_boundary, obstacles),
        dropped=tuple(thing for thing in not_held(environment) if not thing.startswith("names")),
        notes=tuple(notes),
    )


def _text(environment: Environment, pen: _Pen, low: Array, high: Array) -> str:
    """Return the drawing; `low` and `high`, (2,) m, are corners of the page."""
    x, y = pen.length(low[0]), pen.length(-high[1])
    width, height = pen.length(high[0] - low[0]), pen.length(high[1] - low[1])
    # where the corner is that the box gives with its decimals
    left, bottom = float(x) * pen.scale, -(float(y) + float(height)) * pen.scale
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}mm" height="{height}mm"',
        f'     viewBox="{x} {y} {width} {height}" data-origin="{left!r} {bottom!r}">',
        f"<title>{_plain(environment.name)}</title>",
        f"<desc>{_plain(environment.description)}</desc>",
        "<style>",
        # a window shows all of it, however large it is
        "svg { max-width: 100vw; max-height: 100vh }",
        "#boundary { stroke-width: 1.5px; stroke-linejoin: miter; vector-effect: non-scaling-stroke }",
        ".wall { stroke-linecap: butt; stroke-linejoin: miter; stroke-miterlimit: 4 }",
        *_colours(LIGHT),
        "@media (prefers-color-scheme: dark) {",
        *_colours(DARK),
        "}",
        "</style>",
        f'<path id="boundary" d="{pen.ring(environment.boundary)}"/>',
        '<g id="obstacles">',
        *map(pen.shape, environment.obstacles),
        "</g>",
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def _colours(theme: Theme) -> list[str]:
    ground, page, edge, solid = (
        "#{:02x}{:02x}{:02x}".format(*colour)
        for colour in (theme.panel, theme.background, theme.boundary, theme.obstacle)
    )
    return [
        f"svg {{ background: {ground} }}",
        f"#boundary {{ fill: {page}; stroke: {edge} }}",
        f"#obstacles {{ fill: {solid} }}",
        f".wall {{ fill: none; stroke: {solid} }}",
    ]


def _plain(text: str) -> str:
    return escape("".join(char if char.isprintable() else " " for char in text))


EXPORTER = Exporter(
    name="svg",
    title="SVG at true scale: boundary and obstacles by their ids",
    suffixes=(".svg",),
    write=_write,
    options=frozenset({"digits", "scale"}),
)
