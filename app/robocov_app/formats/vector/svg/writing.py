"""Writing maps as SVG drawings at true scale."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
from shapely import Polygon

from robocov.environment import CircleObstacle, Environment, Obstacle, Ring, WallObstacle
from robocov.files.writing import replace_file
from robocov_app.formats.geometry.cells.rasterize import describe_unsupported
from robocov_app.formats.geometry.conversion.primitives import transform_numbers
from robocov_app.formats.geometry.polygons import compute_free_area, format_decimal
from robocov_app.formats.options import WriteOptions, get_or_default
from robocov_app.formats.reports import ExportReport
from robocov_app.look.theme import DARK, LIGHT, Theme

DEFAULT_DIGITS = 3
"""Decimals of coordinates in millimeters: at true scale, they are rounded to a micrometer."""
DEFAULT_SCALE = 0.001
"""Length, in meters, that a millimeter of the drawing represents: true scale."""
_MARGIN = 0.03
"""Margin around the map, as a fraction of its longer side."""
# max-width and max-height make a browser window show the whole map, regardless of its size.
_PAGE = """\
<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" {size}
     {box}>
<title>{title}</title>
<desc>{text}</desc>
<style>
svg {{ max-width: 100vw; max-height: 100vh }}
#boundary {{ stroke-width: 1.5px; stroke-linejoin: miter; vector-effect: non-scaling-stroke }}
.wall {{ stroke-linecap: butt; stroke-linejoin: miter; stroke-miterlimit: 4 }}
{light}
@media (prefers-color-scheme: dark) {{
{dark}
}}
</style>
<path id="boundary" d="{boundary}"/>
<g id="obstacles">
{obstacles}</g>
</svg>
"""


@dataclass(frozen=True)
class _ShapeWriter:
    """Writes shapes in millimeters of the drawing, whose y axis points down.

    Attributes
    ----------
    scale : float
        Length, in meters, that a millimeter represents.
    digits : int
        Number of decimals.
    """

    scale: float
    digits: int

    def format_length(self, length: float) -> str:
        """Format a length, m, in millimeters of the drawing."""
        return format_decimal(length / self.scale, self.digits)

    def round_length(self, length: float) -> float:
        """Round a length, m, as it is rounded when written."""
        return round(length / self.scale, self.digits) * self.scale

    def format_ring(self, ring: Ring, end: str = "Z") -> str:
        """Return the path data of a ring, or of an open line if `end` is empty."""
        points = [f"{self.format_length(x)} {self.format_length(-y)}" for x, y in ring]
        return f"M{' L'.join(points)}{end}"

    def format_obstacle(self, obstacle: Obstacle) -> str:
        """Return an obstacle as an SVG element, with its name as the title."""
        if isinstance(obstacle, CircleObstacle):
            x = self.format_length(obstacle.center[0])
            y = self.format_length(-obstacle.center[1])
            tag = "circle"
            attributes = f'cx="{x}" cy="{y}" r="{self.format_length(obstacle.radius)}"'
        elif isinstance(obstacle, WallObstacle):
            line = self.format_ring(obstacle.points, "")
            width = self.format_length(obstacle.width)
            tag = "path"
            attributes = f'class="wall" fill="none" stroke-width="{width}" d="{line}"'
        else:
            rings = " ".join(self.format_ring(ring) for ring in (obstacle.vertices, *obstacle.holes))
            tag = "path"
            attributes = f'fill-rule="evenodd" d="{rings}"'
        title = _escape(obstacle.name or "")
        if not title:
            return f"<{tag} {attributes}/>"
        return f"<{tag} {attributes}><title>{title}</title></{tag}>"


def write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    """Write a map as an SVG drawing; raise OutputError if the file cannot be written."""
    scale = get_or_default(options.scale, DEFAULT_SCALE)
    writer = _ShapeWriter(scale, get_or_default(options.digits, DEFAULT_DIGITS))
    vertices = np.asarray(environment.boundary, dtype=float)
    margin = _MARGIN * float(np.ptp(vertices, axis=0).max())
    low = vertices.min(axis=0) - margin
    high = vertices.max(axis=0) + margin
    with replace_file(path) as temporary:
        temporary.write_text(_build_page(environment, writer, low, high), encoding="utf-8")
    width, height = ((high - low) / scale).tolist()
    notes = [f"1 mm in the drawing is {scale:g} m; the drawing measures {width:.6g} x {height:.6g} mm"]
    if options.scale is not None:
        notes.append(f"import it again with --scale {scale!r}")
    return _build_report(environment, path, writer, notes)


def _build_report(
    environment: Environment, path: Path, writer: _ShapeWriter, notes: Sequence[str]
) -> ExportReport:
    """Build the report about a written drawing, with notes for the user."""
    # The area of the map as it is written, with rounded coordinates.
    obstacles = [transform_numbers(obstacle, writer.round_length) for obstacle in environment.obstacles]
    boundary = Polygon([(writer.round_length(x), writer.round_length(y)) for x, y in environment.boundary])
    return ExportReport(
        format="svg",
        files=(path,),
        area=environment.free_area,
        area_written=compute_free_area(boundary, [obstacle.polygon for obstacle in obstacles]),
        dropped=describe_unsupported(environment, names=False),
        notes=tuple(notes),
    )


def _build_page(environment: Environment, writer: _ShapeWriter, low: np.ndarray, high: np.ndarray) -> str:
    """Return the SVG text of the map between two corners, m."""
    x = writer.format_length(low[0])
    y = writer.format_length(-high[1])
    width = writer.format_length(high[0] - low[0])
    height = writer.format_length(high[1] - low[1])
    # The lower left corner of the view box as written, so that it can be imported at the same position.
    left = float(x) * writer.scale
    bottom = -(float(y) + float(height)) * writer.scale
    obstacles = [f"{writer.format_obstacle(obstacle)}\n" for obstacle in environment.obstacles]
    return _PAGE.format(
        size=f'width="{width}mm" height="{height}mm"',
        box=f'viewBox="{x} {y} {width} {height}" data-origin="{left!r} {bottom!r}"',
        title=_escape(environment.name),
        text=_escape(environment.description),
        light=_build_rules(LIGHT),
        dark=_build_rules(DARK),
        boundary=writer.format_ring(environment.boundary),
        obstacles="".join(obstacles),
    )


def _build_rules(theme: Theme) -> str:
    """Return the style rules for a theme."""
    outside = _format_color(theme.panel)
    page = _format_color(theme.background)
    edge = _format_color(theme.boundary)
    solid = _format_color(theme.obstacle)
    return (
        f"svg {{ background: {outside} }}\n#boundary {{ fill: {page}; stroke: {edge} }}\n"
        f"#obstacles {{ fill: {solid} }}\n.wall {{ fill: none; stroke: {solid} }}"
    )


def _format_color(color: tuple[int, int, int]) -> str:
    return "#{:02x}{:02x}{:02x}".format(*color)


def _escape(text: str) -> str:
    """Replace unprintable characters by blanks, and special ones by entities."""
    return escape("".join(character if character.isprintable() else " " for character in text))
