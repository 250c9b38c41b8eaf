"""Small pictures of maps and runs as SVG in a page, with the colors of the page: light, dark or paper.

Unlike plots, they are not drawn with matplotlib, for two reasons. Its SVG of a run is four to five times as
large (11 to 18 kB, and a page may have 60 of them) and takes 50 to 240 ms instead of 2 to 9. It also contains
only color codes, which cannot be mapped to the dark theme: the rings of robots and the background are both
white in the light theme, but differ in the dark one.
"""

import base64
import io
from collections.abc import Iterable
from html import escape

import numpy as np
import shapely
from PIL import Image

from robocov.environment import Environment
from robocov.metrics import CostHistory
from robocov.record import Record
from robocov.typing import FloatArray
from robocov_app.look.colors import mix
from robocov_app.look.hues import MAX_OWN_HUES, choose_robot_hues
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.crowding import fit_mark_size, fit_radii
from robocov_app.render.density_shading import list_sample_coordinates, shade_density
from robocov_app.render.moving_obstacles import MovingObstacle, list_moving_obstacles
from robocov_app.report.descriptions import describe_map, describe_run
from robocov_app.runs.saved_runs import build_roster

MAX_ROBOTS = 400
"""Maximum number of robots for which cells and trajectories are drawn. More would make the page too large."""
MAX_TWO_FRAME_SPAN_S = 1.5
"""If a record has only two frames, and they are farther apart, it does not show where the robots went."""
_SIZE_PX = (300.0, 220.0)
_MARGIN_PX = 3.0
_TOLERANCE_PX = 0.2
"""Maximum error of simplified lines."""
_DENSITY_DOTS = 80
"""Number of pixels along the longer side of the image of a density."""
_NUMBER_SIZES = (1.35, 1.15, 0.9, 0.7)
"""Text sizes of numbers with one, two, three and more digits, in radii of the robot."""
_MIN_NUMBER_PX = 6.0
_DIGIT_HEIGHT = 0.72
"""Height of digits, in text sizes."""
_MIN_START_PX = 2.4
_MAX_START_PX = 5.0
"""Diameters of the rings at starts."""
_MIN_RADIUS_PX = 1.5
_MAX_RADIUS_PX = 4.5
_MAX_NUMBERED_RADIUS_PX = 9.0
"""Radii of robots without and with numbers."""
_CROSS_ARM_RADII = 0.62
"""Half the side of the square whose diagonals cross out a failed robot, in radii of the robot."""
_ARROW_HALF_LENGTH_PX = 7.0
"""Half the length of the arrow on a moving obstacle."""
_ARROW_HEAD_WIDTH = 0.45
_ARROW_NECK = 0.2
"""Half the width of the head of this arrow, and the position of its rear, in half lengths of the arrow."""


class PictureFrame:
    """Transform from meters to the pixels of a picture.

    Parameters
    ----------
    environment : Environment
        Map whose region fills the picture.
    width, height : float, px
        Maximum size of the picture.

    Attributes
    ----------
    width, height : float, px
        Size of the picture.
    zoom : float, px/m
    corner : (2,) array, m
        Upper left corner of the region.
    """

    def __init__(self, environment: Environment, width: float, height: float) -> None:
        low_x, low_y, high_x, high_y = environment.region.bounds
        free_width = width - 2 * _MARGIN_PX
        free_height = height - 2 * _MARGIN_PX
        self.zoom = min(free_width / (high_x - low_x), free_height / (high_y - low_y))
        self.corner = np.array([low_x, high_y])
        self.width = round(self.zoom * (high_x - low_x) + 2 * _MARGIN_PX, 1)
        self.height = round(self.zoom * (high_y - low_y) + 2 * _MARGIN_PX, 1)

    def to_pixels(self, points: FloatArray) -> FloatArray:
        """Convert points, (..., 2) m, to pixels from the upper left corner."""
        return np.asarray((points - self.corner) * np.array([self.zoom, -self.zoom]) + _MARGIN_PX)


def build_density_image(environment: Environment) -> str:
    """Build an image of the density over the bounding box of the region.

    Parameters
    ----------
    environment : Environment

    Returns
    -------
    str
        Data URL of an image that is transparent outside the region; empty if the density is uniform.
    """
    if environment.density is None or environment.density.is_uniform:
        return ""
    pixels = shade_density(environment, _DENSITY_DOTS, LIGHT)
    # The same image serves both themes, so its color is between those of the two.
    pixels[..., :3] = mix(LIGHT.density, DARK.density, 0.5)
    x, y = np.meshgrid(*list_sample_coordinates(environment, _DENSITY_DOTS))
    is_inside = environment.region.contains(np.column_stack([x.ravel(), y.ravel()]))
    pixels[~is_inside.reshape(x.shape), 3] = 0
    file = io.BytesIO()
    Image.fromarray(pixels[::-1]).save(file, "PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"


def extract_rings(area: shapely.Geometry) -> list[FloatArray]:
    """Return the rings of polygons, (k, 2) m each, without the repeated first vertex.

    The outer ring of each polygon comes first.
    """
    return [shapely.get_coordinates(ring)[:-1] for ring in shapely.get_rings(shapely.get_parts(area))]


def has_path(record: Record) -> bool:
    """Return whether a record shows where the robots went between the start and the end."""
    if len(record) == 2:
        return float(record.time[1] - record.time[0]) <= MAX_TWO_FRAME_SPAN_S
    return len(record) > 2


def draw_map(environment: Environment, width: float = _SIZE_PX[0], height: float = _SIZE_PX[1]) -> str:
    """Draw a map as an SVG element of at most the given width and height, px."""
    frame = PictureFrame(environment, width, height)
    return _build_svg(frame, _draw_map_shapes(environment, frame, 0.0), describe_map(environment))


def draw_run(
    record: Record,
    history: CostHistory | None,
    width: float = _SIZE_PX[0],
    height: float = _SIZE_PX[1],
    *,
    has_numbers: bool = False,
    is_hidden: bool = False,
) -> str:
    """Draw a run as an SVG element: map, trajectories, and the final positions and cells.

    Parameters
    ----------
    record : Record
    history : CostHistory or None
        Cost over the run, for the description.
    width, height : float, px
        Maximum size.
    has_numbers : bool
        Whether to number the robots.
    is_hidden : bool
        Whether to hide the picture from screen readers, because the text next to it has the same content.

    Returns
    -------
    str
    """
    environment = record.environment
    frame = PictureFrame(environment, width, height)
    shapes = [
        _draw_cells(record, frame),
        _draw_map_shapes(environment, frame, float(record.time[-1])),
        _draw_trajectories(record, frame),
        _draw_starts(record, frame),
        _draw_robots(record, frame, has_numbers=has_numbers),
    ]
    description = None if is_hidden else describe_run(record, history)
    return _build_svg(frame, "".join(shapes), description)


def _draw_cells(record: Record, frame: PictureFrame) -> str:
    """Draw the final Voronoi cells, unless there are too many robots."""
    robots = len(record.team)
    if robots > MAX_ROBOTS:
        return ""
    cells = record.compute_cells()
    working = np.flatnonzero(record.is_working[-1])
    adjacency = None
    if robots > MAX_OWN_HUES:
        adjacency = working[cells.adjacency]
    hues = choose_robot_hues(robots, adjacency).tolist()
    paths = []
    for outline, owner in zip(*cells.outlines, strict=True):
        if len(outline) > 2:
            hue = hues[working[int(owner)]]
            line = _format_path([frame.to_pixels(outline)], is_closed=True)
            paths.append(f'<path class="cell c{hue}" d="{line}"/>')
    return "".join(paths)


def _draw_trajectories(record: Record, frame: PictureFrame) -> str:
    """Draw the trajectories of the robots that joined as one path; each starts where its robot joined."""
    if not has_path(record) or len(record.team) > MAX_ROBOTS:
        return ""
    first_rows = np.argmax(record.is_present, axis=0)
    tracks = np.moveaxis(frame.to_pixels(record.positions), 1, 0)
    lines = []
    for robot in np.flatnonzero(record.is_present.any(axis=0)).tolist():
        track_since_join = tracks[robot, first_rows[robot] :]
        if len(track_since_join) > 1:
            simplified = shapely.simplify(shapely.LineString(track_since_join), _TOLERANCE_PX)
            lines.append(shapely.get_coordinates(simplified))
    return f'<path class="trajectory" d="{_format_path(lines)}"/>'


def _draw_starts(record: Record, frame: PictureFrame) -> str:
    """Draw a ring where each robot started."""
    first_rows = np.argmax(record.is_present, axis=0)
    joined = np.flatnonzero(record.is_present.any(axis=0))
    starts = frame.to_pixels(record.positions[first_rows[joined], joined])
    radius = fit_mark_size(starts, _MIN_START_PX, _MAX_START_PX) / 2
    return "".join(_draw_circle("start", x, y, radius) for x, y in starts)


def _draw_robots(record: Record, frame: PictureFrame, *, has_numbers: bool) -> str:
    """Draw the final positions; failed robots are crossed out."""
    centers = frame.to_pixels(record.positions[-1])
    max_radius = _MAX_NUMBERED_RADIUS_PX if has_numbers else _MAX_RADIUS_PX
    radii = fit_radii(centers, record.team.radius * frame.zoom, _MIN_RADIUS_PX, max_radius)
    numbers = build_roster(record).numbers
    shapes = []
    for robot in np.flatnonzero(record.is_present[-1]).tolist():
        x, y = centers[robot].tolist()
        radius = float(radii[robot])
        if not record.is_working[-1, robot]:
            shapes.append(_draw_circle("failed", x, y, radius))
            shapes.append(_draw_cross(x, y, radius))
            continue
        shapes.append(_draw_circle("robot", x, y, radius))
        if has_numbers:
            shapes.append(_draw_number(numbers[robot], x, y, radius))
    return "".join(shapes)


def _draw_circle(css_class: str, x: float, y: float, radius: float) -> str:
    """Draw a circle in the style of a CSS class."""
    return f'<circle class="{css_class}" cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}"/>'


def _draw_cross(x: float, y: float, radius: float) -> str:
    """Draw the cross on a failed robot."""
    arm = _CROSS_ARM_RADII * radius
    falling = f"M{x - arm:.1f} {y - arm:.1f}L{x + arm:.1f} {y + arm:.1f}"
    rising = f"M{x - arm:.1f} {y + arm:.1f}L{x + arm:.1f} {y - arm:.1f}"
    return f'<path class="failed" d="{falling}{rising}"/>'


def _draw_number(number: int, x: float, y: float, radius: float) -> str:
    """Draw the number of a robot, unless it would be too small to read."""
    digits = min(len(str(number)), len(_NUMBER_SIZES))
    size = radius * _NUMBER_SIZES[digits - 1]
    if size < _MIN_NUMBER_PX:
        return ""
    baseline = y + _DIGIT_HEIGHT / 2 * size
    return f'<text x="{x:.1f}" y="{baseline:.1f}" font-size="{size:.1f}">{number}</text>'


def _build_svg(frame: PictureFrame, content: str, description: str | None) -> str:
    """Build the SVG element. It has no size of its own: the page sets the width, the view box the height."""
    if description is None:
        label = 'aria-hidden="true"'
    else:
        label = f'role="img" aria-label="{escape(description)}"'
    box = f"0 0 {frame.width:g} {frame.height:g}"
    return f'<svg class="robocov-picture" viewBox="{box}" {label}>{content}</svg>'


def _draw_map_shapes(environment: Environment, frame: PictureFrame, time: float) -> str:
    """Draw a map at a time, s: density, obstacles, moving obstacles, and the boundary of the region."""
    shapes = [_draw_density(environment, frame)]
    obstacles = shapely.simplify(environment.at(time).blocked, _TOLERANCE_PX / frame.zoom)
    rings = [frame.to_pixels(ring) for ring in extract_rings(obstacles)]
    if rings:
        shapes.append(f'<path class="blocked" d="{_format_path(rings, is_closed=True)}"/>')
    moving = list_moving_obstacles(environment, time)
    shapes += [_draw_moving_obstacle(obstacle, environment, frame) for obstacle in moving]
    region = _format_path([frame.to_pixels(environment.region.vertices)], is_closed=True)
    shapes.append(f'<path class="region" d="{region}"/>')
    return "".join(shapes)


def _draw_density(environment: Environment, frame: PictureFrame) -> str:
    """Draw the density as an image, if it is not uniform."""
    address = build_density_image(environment)
    if not address:
        return ""
    width = frame.width - 2 * _MARGIN_PX
    height = frame.height - 2 * _MARGIN_PX
    box = f'x="{_MARGIN_PX:g}" y="{_MARGIN_PX:g}" width="{width:g}" height="{height:g}"'
    return f'<image {box} preserveAspectRatio="none" href="{address}"/>'


def _draw_moving_obstacle(obstacle: MovingObstacle, environment: Environment, frame: PictureFrame) -> str:
    """Draw a moving obstacle, its path, and an arrow in the direction of its motion."""
    visible = shapely.intersection(obstacle.polygon, environment.region.polygon)
    rings = [frame.to_pixels(ring) for ring in extract_rings(visible)]
    middle = frame.to_pixels(obstacle.middle)
    # In pixels, y points down.
    along = _ARROW_HALF_LENGTH_PX * obstacle.heading * np.array([1.0, -1.0])
    across = _ARROW_HEAD_WIDTH * along[::-1] * np.array([-1.0, 1.0])
    tip = middle + along
    neck = middle + _ARROW_NECK * along
    shaft = np.array([middle - along, tip])
    head = np.array([neck + across, tip, neck - across])
    return (
        f'<path class="blocked moving" d="{_format_path(rings, is_closed=True)}"/>'
        f'<path class="motion" d="{_format_path([frame.to_pixels(obstacle.path)])}"/>'
        f'<path class="heading" d="{_format_path([shaft, head])}"/>'
    )


def _format_path(lines: Iterable[FloatArray], *, is_closed: bool = False) -> str:
    """Format lines, (k, 2) px each, as SVG path data with relative steps, which are short.

    Positions are rounded to tenths of a pixel before steps are computed, so rounding errors do not add up.
    """
    pieces = []
    for line in lines:
        tenths = np.rint(line * 10).astype(int)
        steps = np.diff(tenths, axis=0)
        steps = steps[(steps != 0).any(axis=1)]
        x, y = (tenths[0] / 10).tolist()
        piece = f"M{x:g} {y:g}"
        if len(steps):
            moves = " ".join(f"{dx / 10:g} {dy / 10:g}" for dx, dy in steps.tolist())
            piece += f"l{moves}"
        else:
            # A line without length appears as a dot.
            piece += "h0"
        if is_closed:
            piece += "z"
        pieces.append(piece)
    return "".join(pieces)
