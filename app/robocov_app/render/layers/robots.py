"""Layers of robots: working ones, failed ones and the selected one."""

from functools import lru_cache, partial

import numpy as np

from robocov.typing import FloatArray, IntArray
from robocov.voronoi import VoronoiPartition
from robocov_app.look import legend
from robocov_app.look.colors import Color, mix
from robocov_app.render import sprites
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas, LegendEntry, Sprite
from robocov_app.render.crowding import fit_radii, is_crowd, measure_spacing, round_to_half
from robocov_app.render.layers.layer import build_legend
from robocov_app.render.scene import Scene

# Lengths in pixels at scale 1.
READABLE_RADIUS_PX = 9.0
"""Radius of robots that are not in a crowd: their numbers are readable."""
MIN_RADIUS_PX = 2.4
"""Minimum radius of robots in large teams."""
_MIN_VISIBLE_RADIUS_PX = 5.0
"""Minimum radius of robots in small teams: their colors are visible even while they overlap."""
_MAX_SMALL_TEAM = 20
MIN_NUMBER_SIZE_PX = 6.6
"""Text size, px of the surface, that digits need to be drawn sharply; smaller numbers are left out."""
MIN_SCALED_NUMBER_SIZE_PX = 5.2
"""Text size at scale 1 that digits need to be read on the fine screen of a phone."""
_MAX_RADIUS_PX = 400.0
"""Maximum radius, px of the surface."""
_RING_WIDTH_PX = 1.6
_MAX_RING_WIDTH_FRACTION = 0.3
"""Maximum width of the ring of a robot, as a fraction of its radius."""
_SYMBOL_RADIUS_PX = 6.5
_SYMBOL_RING_WIDTH_PX = 1.4
_EDGE_INK_FRACTION = 0.55
"""Fraction of ink in the color of the edges of robots; the rest is the background."""
_FAILED_EDGE_INK_FRACTION = 0.75
_FAILED_FILL_INK_FRACTION = 0.3
_FAILED_RING_WIDTH_PX = 1.2
_MAX_FAILED_RING_WIDTH_FRACTION = 0.25
_FAILED_SYMBOL_RADIUS_PX = 6.0
_CROSS_SIZE_FACTOR = 1.1
"""Half the size of the cross on a failed robot, as a fraction of its radius."""
_CROSS_WIDTH_PX = 1.7
_MAX_CROSS_WIDTH_FRACTION = 0.35
SELECTION_GAP_PX = 4.0
"""Space between the selected robot and its ring."""
SELECTION_WIDTH_PX = 2.2
_BELIEVED_CELL_WIDTH_FACTOR = 1.6
"""Width of the outline of the believed cell, compared with other lines."""
_BELIEF_INK_FRACTION = 0.2
_BELIEF_RING_RADIUS_PX = 5.0
_BELIEF_RING_WIDTH_PX = 1.6
_BELIEF_DASH_PX = 3.0
_FAILED_SIZE_FACTOR = 0.85
"""Size of failed robots compared with working ones."""
_NUMBER_GAP_PX = 7.0
"""Space between a failed or selected robot and its number, into which the ring of a selected one fits."""
_INK_HALF_HEIGHT = 0.4
"""Half the height of digits, as a fraction of the text size."""
_NUMBER_SIDES = ((1, 0), (-1, 0), (0, -1), (0, 1))
"""Positions of the number of a failed or selected robot: right, left, above, below."""


def compute_drawn_radii(canvas: Canvas, scene: Scene) -> FloatArray:
    """Compute the radii at which robots are drawn.

    Discs are large enough for readable numbers. In a crowd they are smaller, but not below the true radius.
    Very large discs are limited to `_MAX_RADIUS_PX`. Robots of the same radius have discs of the same size.

    Parameters
    ----------
    canvas : Canvas
    scene : Scene

    Returns
    -------
    (n,) array, px
        In steps of half a pixel.
    """
    return _compute_drawn_radii(scene, canvas.camera, canvas.scale)


# Several layers need the radii in each frame.
@lru_cache(maxsize=8)
def _compute_drawn_radii(scene: Scene, camera: Camera, scale: float) -> FloatArray:
    if scene.snapshot is None:
        return np.empty(0)
    true_radii = scene.team.radius * camera.zoom
    radii = np.maximum(true_radii, _compute_readable_radius(scene, camera, scale))
    return np.asarray(round_to_half(np.minimum(radii, _MAX_RADIUS_PX)))


def _compute_readable_radius(scene: Scene, camera: Camera, scale: float) -> float:
    """Return the radius of the discs of robots that are not larger, px.

    About half of the discs do not overlap, unless the team is so dense that they would be too small to see.
    """
    spacing = scene.spacing
    if spacing is None:
        spacing = measure_spacing(scene.now.positions)
    half_spacing_px = 0.5 * spacing * camera.zoom
    # The more robots overlap, the larger is the area that they cover.
    min_radius_px = _MIN_VISIBLE_RADIUS_PX * np.sqrt(_MAX_SMALL_TEAM / len(scene.team))
    min_radius_px = np.clip(min_radius_px, MIN_RADIUS_PX, _MIN_VISIBLE_RADIUS_PX)
    return float(np.clip(half_spacing_px, min_radius_px * scale, READABLE_RADIUS_PX * scale))


def draw_robots(canvas: Canvas, scene: Scene) -> None:
    """Draw the robots as discs with their numbers; unicycles have a nose that points in their heading."""
    centers = canvas.camera.to_pixels(scene.now.positions)
    radii = compute_drawn_radii(canvas, scene)
    if scene.now.steering is not None:
        # The first column of the steering is the heading, rad.
        headings = scene.now.steering[:, 0]
        _draw_noses(canvas, centers, radii, headings, np.flatnonzero(scene.team.is_unicycle))
    ring_widths = _choose_ring_widths(canvas, radii)
    numbers = _choose_numbers(canvas, scene, radii - ring_widths)
    # Robots that look the same share a sprite, which saves time in a crowd.
    indices_by_look: dict[tuple[float, float, int, int], int] = {}
    looks = zip(radii.tolist(), ring_widths.tolist(), canvas.hues.tolist(), numbers.tolist(), strict=True)
    indices = [indices_by_look.setdefault(look, len(indices_by_look)) for look in looks]
    discs = []
    for radius, ring_width, hue, number in indices_by_look:
        text = str(number) if number else ""
        discs.append(_build_disc(canvas, radius, ring_width, hue, text))
    canvas.draw_sprites(discs, centers, np.array(indices, dtype=int))


def _choose_ring_widths(canvas: Canvas, radii: FloatArray) -> FloatArray:
    """Return the widths of the rings of robots, px, which are narrow on small robots."""
    widths = np.minimum(_RING_WIDTH_PX * canvas.scale, round_to_half(_MAX_RING_WIDTH_FRACTION * radii))
    return np.asarray(widths)


def _choose_numbers(canvas: Canvas, scene: Scene, inner_radii: FloatArray) -> IntArray:
    """Return the number on the disc of each robot; 0 in a crowd, or if it would be too small to read."""
    if is_crowd(scene.now.positions, canvas.camera):
        return np.zeros(len(inner_radii), dtype=int)
    numbers = np.array([scene.get_number(row) for row in range(len(inner_radii))], dtype=int)
    n_digits = 1 + np.digitize(numbers, [10, 100, 1000])
    sizes = sprites.choose_number_size(inner_radii, n_digits)
    min_size = max(MIN_NUMBER_SIZE_PX, MIN_SCALED_NUMBER_SIZE_PX * canvas.scale)
    return np.where(sizes < min_size, 0, numbers)


def _draw_noses(
    canvas: Canvas, centers: FloatArray, radii: FloatArray, headings: FloatArray, robots: IntArray
) -> None:
    """Draw the noses of some robots.

    Parameters
    ----------
    canvas : Canvas
    centers : (n, 2) array, px
    radii : (n,) array, px
    headings : (n,) array, rad
    robots : (k,) int array
        Rows of the robots that have a nose.
    """
    directions = np.rint(headings * (sprites.N_NOSE_DIRECTIONS / (2.0 * np.pi))).astype(int)
    noses = []
    for radius, direction in zip(
        radii.tolist(), (directions % sprites.N_NOSE_DIRECTIONS).tolist(), strict=True
    ):
        nose_radius = min(radius, sprites.MAX_FINE_RADIUS_PX)
        noses.append(
            partial(sprites.render_nose, nose_radius, canvas.theme.ink, canvas.theme.background, direction)
        )
    canvas.draw_sprites(noses, centers[robots], robots)


def _build_disc(canvas: Canvas, radius: float, ring_width: float, hue: int, text: str) -> Sprite:
    """Return the sprite of a working robot, with lengths in px and `text` as its number."""
    theme = canvas.theme
    return partial(
        sprites.render_disc,
        radius,
        fill=theme.robots[hue],
        ring=theme.robot_ring,
        ring_width=ring_width,
        edge=mix(theme.background, theme.ink, _EDGE_INK_FRACTION),
        text=text,
    )


def _draw_robot_symbol(canvas: Canvas, x: float, y: float) -> None:
    radius = _SYMBOL_RADIUS_PX * canvas.scale
    disc = _build_disc(canvas, radius, _SYMBOL_RING_WIDTH_PX * canvas.scale, hue=0, text="")
    canvas.draw_sprite(disc, (x, y))


build_robots_legend = build_legend(legend.ROBOT, _draw_robot_symbol)


def draw_failed_robots(canvas: Canvas, scene: Scene) -> None:
    """Draw failed robots crossed out, with their numbers next to them."""
    # Arrays of all robots contain the failed ones first, then the working ones.
    failed_centers = canvas.camera.to_pixels(np.array(list(scene.failed.values())))
    working_centers = np.empty((0, 2))
    true_radii = [scene.get_failed_radius(number) for number in scene.failed]
    max_readable_radius = _FAILED_SIZE_FACTOR * READABLE_RADIUS_PX * canvas.scale
    if scene.snapshot is not None:
        # Where working robots are small, failed ones are not larger.
        working_radius = _compute_readable_radius(scene, canvas.camera, canvas.scale)
        max_readable_radius = min(max_readable_radius, working_radius)
        working_centers = canvas.camera.to_pixels(scene.snapshot.positions)
        true_radii += scene.team.radius.tolist()
    centers = np.concatenate([failed_centers, working_centers])
    fitted_radii = fit_radii(
        centers,
        np.array(true_radii) * canvas.camera.zoom,
        low=MIN_RADIUS_PX * canvas.scale,
        high=max_readable_radius,
    )
    failed_radii = round_to_half(np.minimum(fitted_radii[: len(failed_centers)], _MAX_RADIUS_PX))
    all_radii = np.concatenate([failed_radii, compute_drawn_radii(canvas, scene)])
    for number, center, radius in zip(scene.failed, failed_centers, failed_radii.tolist(), strict=True):
        _draw_failed_robot(canvas, center[0], center[1], radius)
        position = _choose_number_position(
            canvas, str(number), center=center, radius=radius, centers=centers, radii=all_radii
        )
        size = canvas.theme.small_text
        canvas.draw_text(str(number), position, size=size, bold=True, anchor="middle")


def _choose_number_position(
    canvas: Canvas, text: str, *, center: FloatArray, radius: float, centers: FloatArray, radii: FloatArray
) -> list[float]:
    """Choose the position of the number of a robot, next to its disc.

    The first side with enough space is chosen, so that numbers do not jump when other robots pass by; if no
    side has enough, the one with the most space.

    Parameters
    ----------
    canvas : Canvas
    text : str
        The number.
    center : (2,) array, px
    radius : float, px
    centers : (n, 2) array, px
        Centers of all robots.
    radii : (n,) array, px
        Radii of all robots.

    Returns
    -------
    list of float, px
        Middle of the number.
    """
    size = canvas.theme.small_text
    half_width = canvas.measure_text(text, size, bold=True) / 2
    half_height = _INK_HALF_HEIGHT * canvas.scale_text_size(size)
    gap = _NUMBER_GAP_PX * canvas.scale
    best_space = -np.inf
    best_position: list[float] = []
    for side, down in _NUMBER_SIDES:
        dx = side * (radius + gap + half_width)
        dy = down * (radius + gap + half_height)
        position = center + np.array([dx, dy])
        outside = np.maximum(np.abs(centers - position) - np.array([half_width, half_height]), 0.0)
        space = float((np.hypot(outside[:, 0], outside[:, 1]) - radii).min())
        # All sides with at least half the gap count as equal, so the first of them wins.
        sufficient_space = min(space, 0.5 * gap)
        if sufficient_space > best_space:
            best_space = sufficient_space
            best_position = position.tolist()
    return best_position


def _draw_failed_robot(canvas: Canvas, x: float, y: float, radius: float) -> None:
    """Draw a gray disc with a cross, around a pixel."""
    theme = canvas.theme
    edge = mix(theme.background, theme.ink, _FAILED_EDGE_INK_FRACTION)
    disc = partial(
        sprites.render_disc,
        radius,
        fill=mix(theme.background, theme.ink, _FAILED_FILL_INK_FRACTION),
        ring=edge,
        ring_width=min(_FAILED_RING_WIDTH_PX * canvas.scale, _MAX_FAILED_RING_WIDTH_FRACTION * radius),
        edge=edge,
    )
    canvas.draw_sprite(disc, (x, y))
    # The cross extends beyond the edge; inside, the disc would look like a close button.
    cross = partial(
        sprites.render_cross,
        round_to_half(_CROSS_SIZE_FACTOR * radius),
        color=theme.ink,
        halo=theme.background,
        width=min(_CROSS_WIDTH_PX * canvas.scale, _MAX_CROSS_WIDTH_FRACTION * radius),
        is_diagonal=True,
    )
    canvas.draw_sprite(cross, (x, y))


def _draw_failed_symbol(canvas: Canvas, x: float, y: float) -> None:
    _draw_failed_robot(canvas, x, y, _FAILED_SYMBOL_RADIUS_PX * canvas.scale)


build_failed_robots_legend = build_legend(legend.FAILED_ROBOT, _draw_failed_symbol)


def draw_selection(canvas: Canvas, scene: Scene) -> None:
    """Draw a ring around the selected robot, and its beliefs if robots know others only from messages.

    The beliefs are the cell that it computes, and where it believes itself and its neighbors to be.
    If its disc is too small for its number, the number is drawn next to it.
    """
    assert scene.selected is not None
    robot = scene.selected
    positions = canvas.camera.to_pixels(scene.now.positions).tolist()
    if scene.now.seen.reported_positions is not None:
        _draw_believed_cell(canvas, scene, robot)
        _draw_believed_positions(canvas, scene, robot, positions)
    radii = compute_drawn_radii(canvas, scene)
    ring_radius = radii[robot] + SELECTION_GAP_PX * canvas.scale
    ring = partial(sprites.render_ring, ring_radius, canvas.theme.ink, SELECTION_WIDTH_PX * canvas.scale)
    canvas.draw_sprite(ring, positions[robot])
    inner_radii = radii - _choose_ring_widths(canvas, radii)
    has_number_inside = _choose_numbers(canvas, scene, inner_radii)[robot] > 0
    if not has_number_inside:
        _draw_selected_number(canvas, scene, radii)


def _draw_selected_number(canvas: Canvas, scene: Scene, radii: FloatArray) -> None:
    """Draw the number of the selected robot next to its disc; `radii`, (n,), are those of all robots, px."""
    assert scene.selected is not None
    text = str(scene.get_number(scene.selected))
    centers = canvas.camera.to_pixels(scene.now.positions)
    position = _choose_number_position(
        canvas,
        text,
        center=centers[scene.selected],
        radius=float(radii[scene.selected]),
        centers=centers,
        radii=radii,
    )
    size = canvas.theme.small_text
    canvas.draw_text(text, position, size=size, bold=True, anchor="middle")


def _draw_believed_cell(canvas: Canvas, scene: Scene, robot: int) -> None:
    """Draw the outline of the cell that a robot computes from the messages that it has received."""
    cells = scene.now.decision.cells
    if isinstance(cells, VoronoiPartition) and len(cells.polygons[robot]) > 2:
        corners = canvas.camera.to_pixels(cells.polygons[robot])
        width = canvas.scale_width(_BELIEVED_CELL_WIDTH_FACTOR * canvas.theme.line)
        canvas.draw_outline(corners, canvas.theme.ink, width)


def _draw_believed_positions(
    canvas: Canvas, scene: Scene, robot: int, true_pixels: list[list[float]]
) -> None:
    """Draw where a robot believes itself and its neighbors to be, with lines to their true positions.

    `true_pixels` are the true positions of all robots, px.
    """
    seen = scene.now.seen
    # The first row is that of the robot itself.
    rows = [robot, *seen.neighbors.list_neighbors(robot).tolist()]
    believed = np.concatenate([seen.positions[[robot]], seen.get_neighbor_positions(robot)])
    for row, pixel in zip(rows, canvas.camera.to_pixels(believed).tolist(), strict=True):
        hue = int(canvas.hues[row])
        canvas.draw_dashed_line(true_pixels[row], pixel, _get_belief_color(canvas, hue), dash=_BELIEF_DASH_PX)
        _draw_belief_ring(canvas, hue, pixel[0], pixel[1])


def _get_belief_color(canvas: Canvas, hue: int) -> Color:
    return mix(canvas.theme.robots[hue], canvas.theme.ink, _BELIEF_INK_FRACTION)


def _draw_belief_ring(canvas: Canvas, hue: int, x: float, y: float) -> None:
    color = _get_belief_color(canvas, hue)
    radius = _BELIEF_RING_RADIUS_PX * canvas.scale
    ring = partial(sprites.render_ring, radius, color, _BELIEF_RING_WIDTH_PX * canvas.scale)
    canvas.draw_sprite(ring, (x, y))


def build_selection_legend(scene: Scene) -> list[LegendEntry]:
    """Build the legend of the positions that the selected robot believes.

    It has no entries unless robots know each other's positions only from messages.
    """
    assert scene.selected is not None
    if scene.now.seen.reported_positions is None:
        return []
    text = f"position according to robot {scene.get_number(scene.selected)}"
    return [LegendEntry(text, lambda canvas, x, y: _draw_belief_ring(canvas, 0, x, y))]
