"""Maps of the kind `mazes`: corridors on a grid of cells, some dead ends, some loops.

The passages are a spanning tree of the grid, grown cell by cell ("growing tree": J. Buck, *Mazes for
Programmers*, 2015, chapter 11). Growing from the newest cell makes long winding corridors, as in a
depth-first search. Growing from a random cell makes many short corridors. After that, some walls are removed,
preferably those at dead ends ("braiding").

A post is a point where two lines of the grid cross. The walls of a maze are stored in a boolean array of
shape (columns + 1, rows + 1, 2), which says for each post whether a vertical wall leads from there upwards,
and whether a horizontal wall leads from there to the right.
"""

import itertools
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from typing import NamedTuple, TypeAlias

import numpy as np
import shapely

from robocov.environment import DiscStart, Obstacle, WallObstacle
from robocov.generator.request import BLOCKED_FRACTION_TOLERANCE, MapRequest
from robocov.typing import BoolArray, IntArray

Post: TypeAlias = tuple[int, int]
"""Indices of the vertical and of the horizontal line that cross at a post."""
GridShape: TypeAlias = tuple[int, int]
"""Number of columns and rows."""

_VERTICAL = 0
_HORIZONTAL = 1
"""Indices of vertical and of horizontal walls on the last axis of an array of walls."""

_ELONGATION_WEIGHT = 0.5
"""Weight of the elongation of cells, relative to the deviation from the requested number of cells."""
_MIN_NEWEST_PROBABILITY = 0.6
_MAX_NEWEST_PROBABILITY = 0.98
"""Range of the probability with which a maze grows from its newest cell; each maze has its own."""
_MIN_OPENED_FRACTION = 0.04
_MAX_OPENED_FRACTION = 0.12
"""Range of the fraction of the walls that are removed to create loops; each maze has its own."""
_MAX_REMOVED_FRACTION = 0.4
"""Maximum fraction of the walls that are removed before a layout is abandoned."""
_DEAD_END_PROBABILITY = 0.7
"""Probability of removing a wall at a dead end, if there is one."""
_FRACTION_TOLERANCE = 0.8 * BLOCKED_FRACTION_TOLERANCE
"""Tolerance of the blocked fraction; the rest of the requested tolerance is left for rounding errors."""
_GAP_TOLERANCE_M = 1e-9
"""Allowance for rounding errors of the width of corridors."""


def build_maze(
    request: MapRequest, corner_disc: DiscStart, rng: np.random.Generator
) -> list[Obstacle] | None:
    """Build walls between corridors of equal width.

    All walls have the rounded thickness with which they block about the requested area. If no rounded
    thickness is near enough, more walls are removed.

    Parameters
    ----------
    request : MapRequest
        Parameters of the map.
    corner_disc : DiscStart
        Disc that stays free of walls.
    rng : numpy.random.Generator
        Random number generator.

    Returns
    -------
    list of Obstacle or None
        The walls. None if the corridors would be narrower than the gap, or too few walls would remain.
    """
    shape = _choose_grid_shape(request)
    walls = find_inner_walls(shape) & ~grow_passages(shape, rng)
    min_wall_count = (1.0 - _MAX_REMOVED_FRACTION) * walls.sum()
    opened_fraction = rng.uniform(_MIN_OPENED_FRACTION, _MAX_OPENED_FRACTION)
    for _ in range(round(walls.sum() * opened_fraction)):
        _remove_wall(walls, rng)
    max_area_error = _FRACTION_TOLERANCE * request.width * request.height
    while walls.any() and walls.sum() >= min_wall_count:
        polylines = list(trace_polylines(walls))
        thickness = _choose_thickness(request, shape, polylines)
        if _compute_corridor_width(request, shape, thickness) < request.gap - _GAP_TOLERANCE_M:
            return None
        obstacles = _build_walls(request, shape, polylines, thickness)
        any_removed = _remove_walls_on_disc(request, shape, walls, thickness, corner_disc)
        if any_removed:
            # There are fewer walls now, so their thickness must be chosen again.
            continue
        area_error = abs(_compute_union_area(obstacles) - request.blocked_area)
        if area_error <= max_area_error:
            return list(obstacles)
        _remove_wall(walls, rng)
    return None


def _choose_grid_shape(request: MapRequest) -> GridShape:
    """Choose the shape of the grid: about the requested number of cells, which are nearly square."""

    def compute_mismatch(shape: GridShape) -> float:
        """Return how far a grid is from the requested number of cells, and its cells from squares."""
        columns, rows = shape
        elongation = abs(math.log(request.width / columns) - math.log(request.height / rows))
        count_error = abs(math.log(columns * rows / request.obstacle_count))
        return count_error + _ELONGATION_WEIGHT * elongation

    cell_count = int(request.obstacle_count)
    shapes = []
    for columns in range(1, cell_count + 1):
        # Shapes with more than twice the requested number of cells are not considered.
        max_rows = 2 * cell_count // columns
        shapes += [(columns, rows) for rows in range(1, max_rows + 1)]
    return min(shapes, key=compute_mismatch)


def _choose_thickness(request: MapRequest, shape: GridShape, polylines: list[list[Post]]) -> float:
    """Choose the rounded thickness, m, at which walls along polylines block nearly the requested area.

    The thickness is found by bisection. It is a whole number of rounding steps.
    """

    def compute_area(steps: int) -> float:
        """Return the area, m², that walls block if their thickness is the given number of rounding steps."""
        thickness = round(steps * request.rounding_step, request.decimals)
        return _compute_union_area(_build_walls(request, shape, polylines, thickness))

    columns, rows = shape
    low = 1
    high = math.ceil(min(request.width / columns, request.height / rows) / request.rounding_step)
    while high - low > 1:
        middle = (low + high) // 2
        if compute_area(middle) < request.blocked_area:
            low = middle
        else:
            high = middle
    low_error = abs(compute_area(low) - request.blocked_area)
    high_error = abs(compute_area(high) - request.blocked_area)
    steps = low if low_error <= high_error else high
    return round(steps * request.rounding_step, request.decimals)


def _build_walls(
    request: MapRequest, shape: GridShape, polylines: list[list[Post]], thickness: float
) -> list[WallObstacle]:
    """Return a wall along each polyline of posts."""
    x = _compute_line_coordinates(request, request.width, shape[0], thickness)
    y = _compute_line_coordinates(request, request.height, shape[1], thickness)
    return [
        WallObstacle(tuple((x[column], y[row]) for column, row in polyline), thickness)
        for polyline in polylines
    ]


def _compute_union_area(walls: list[WallObstacle]) -> float:
    """Return the area that walls block, m²; overlaps are counted once."""
    return float(shapely.union_all([wall.polygon for wall in walls]).area)


def _compute_line_coordinates(
    request: MapRequest, length: float, cell_count: int, thickness: float
) -> list[float]:
    """Return the coordinates, m, of the lines that divide the map's side into `cell_count` columns or rows.

    Walls are centered on the inner lines. The boundary has no thickness. All corridors are equally wide,
    including those along the boundary.
    """
    # The sum of one corridor's width and the thickness of one wall.
    pitch = (length + thickness) / cell_count
    inner_lines = np.arange(1, cell_count, dtype=np.float64) * pitch - thickness / 2.0
    return [0.0, *request.round_points(inner_lines).tolist(), float(length)]


def _compute_corridor_width(request: MapRequest, shape: GridShape, thickness: float) -> float:
    """Return the width of the narrowest corridor, m."""
    widths = []
    for length, cell_count in zip((request.width, request.height), shape, strict=True):
        lines = _compute_line_coordinates(request, length, cell_count, thickness)
        # The boundary is treated as two walls outside the map, whose inner faces are the sides of the map.
        center_lines = [-thickness / 2.0, *lines[1:-1], lines[-1] + thickness / 2.0]
        widths.append(float(np.diff(center_lines).min()) - thickness)
    return min(widths)


def _remove_walls_on_disc(
    request: MapRequest, shape: GridShape, walls: BoolArray, thickness: float, corner_disc: DiscStart
) -> bool:
    """Remove the walls that touch the disc from an array of walls; return whether any were removed."""
    x = _compute_line_coordinates(request, request.width, shape[0], thickness)
    y = _compute_line_coordinates(request, request.height, shape[1], thickness)
    segments = _list_segments(walls)
    starts = np.column_stack([np.take(x, segments.columns), np.take(y, segments.rows)])
    ends = np.column_stack([np.take(x, segments.end_columns), np.take(y, segments.end_rows)])
    # A wall extends half its thickness to either side: in x if it is vertical, in y if it is horizontal.
    # `is_across` says which of the two axes lies across each wall.
    is_across = np.column_stack([~segments.is_horizontal, segments.is_horizontal])
    margins = thickness / 2.0 * is_across
    lower_left = starts - margins
    upper_right = ends + margins
    boxes = shapely.box(*lower_left.T, *upper_right.T)
    disc = shapely.Point(corner_disc.center).buffer(corner_disc.radius)
    is_touched = shapely.intersects(boxes, disc)
    for k in np.flatnonzero(is_touched).tolist():
        segments.remove_from(walls, k)
    return bool(is_touched.any())


class _Segments(NamedTuple):
    """The walls of a maze, each from a post to the next one to the right or above."""

    columns: IntArray
    """(w,) Index of the vertical line through the post where each wall starts."""
    rows: IntArray
    """(w,) Index of the horizontal line through this post."""
    end_columns: IntArray
    """(w,) Index of the vertical line through the post where each wall ends."""
    end_rows: IntArray
    """(w,) Index of the horizontal line through this post."""
    is_horizontal: BoolArray
    """(w,) Whether each wall leads to the right. The other walls lead upwards."""

    def remove_from(self, walls: BoolArray, k: int) -> None:
        """Remove segment k from an array of walls, which is changed in place."""
        direction = _HORIZONTAL if self.is_horizontal[k] else _VERTICAL
        walls[self.columns[k], self.rows[k], direction] = False


def _list_segments(walls: BoolArray) -> _Segments:
    """List the walls of a maze."""
    columns, rows, directions = np.argwhere(walls).T
    is_horizontal = directions == _HORIZONTAL
    return _Segments(
        columns=columns,
        rows=rows,
        end_columns=columns + is_horizontal,
        end_rows=rows + ~is_horizontal,
        is_horizontal=is_horizontal,
    )


def find_inner_walls(shape: GridShape) -> BoolArray:
    """Find all walls between cells, without the boundary.

    Parameters
    ----------
    shape : pair of int
        Number of columns and rows.

    Returns
    -------
    (columns + 1, rows + 1, 2) array of bool
        The walls of a maze that has no passages.
    """
    columns, rows = shape
    walls = np.zeros((columns + 1, rows + 1, 2), dtype=bool)
    walls[1:-1, :-1, _VERTICAL] = True
    walls[:-1, 1:-1, _HORIZONTAL] = True
    return walls


def grow_passages(shape: GridShape, rng: np.random.Generator) -> BoolArray:
    """Grow passages that connect every cell to every other by exactly one path.

    Parameters
    ----------
    shape : pair of int
        Number of columns and rows.
    rng : numpy.random.Generator
        Random number generator.

    Returns
    -------
    (columns + 1, rows + 1, 2) array of bool
        Walls that the passages remove.
    """
    columns, rows = shape
    newest_probability = rng.uniform(_MIN_NEWEST_PROBABILITY, _MAX_NEWEST_PROBABILITY)
    first = (int(rng.integers(columns)), int(rng.integers(rows)))
    unreached = set(itertools.product(range(columns), range(rows)))
    unreached.remove(first)
    # The cells from which passages may grow further, the newest last.
    active = [first]
    passages = np.zeros_like(find_inner_walls(shape))
    while active:
        is_newest = rng.random() < newest_probability
        index = len(active) - 1 if is_newest else int(rng.integers(len(active)))
        column, row = active[index]
        neighbors = [(column + 1, row), (column, row + 1), (column - 1, row), (column, row - 1)]
        unreached_neighbors = [cell for cell in neighbors if cell in unreached]
        if not unreached_neighbors:
            active.pop(index)
            continue
        neighbor = unreached_neighbors[int(rng.integers(len(unreached_neighbors)))]
        # The wall between two cells starts at the lower left post of the right or upper cell.
        post = max((column, row), neighbor)
        direction = _HORIZONTAL if neighbor[0] == column else _VERTICAL
        passages[post[0], post[1], direction] = True
        unreached.remove(neighbor)
        active.append(neighbor)
    return passages


def _remove_wall(walls: BoolArray, rng: np.random.Generator) -> None:
    """Remove a random wall, preferably one that is attached to other walls at both ends.

    The cells on the two sides of a wall with a free end are already connected around this end. With the
    probability `_DEAD_END_PROBABILITY`, a wall at a dead end is removed, if there is any.
    """
    segments = _list_segments(walls)
    # Posts at which walls start and end, as indices into arrays of shape (columns + 1, rows + 1).
    starts = (segments.columns, segments.rows)
    ends = (segments.end_columns, segments.end_rows)
    # Number of walls at each post.
    wall_counts = np.zeros(walls.shape[:2], dtype=int)
    np.add.at(wall_counts, starts, 1)
    np.add.at(wall_counts, ends, 1)
    is_attached = wall_counts > 1
    # Walls that end at the boundary are attached to the boundary.
    is_attached[[0, -1]] = True
    is_attached[:, [0, -1]] = True
    is_candidate = is_attached[starts] & is_attached[ends]
    if not is_candidate.any():
        is_candidate[:] = True
    if rng.random() < _DEAD_END_PROBABILITY:
        opening_counts = _count_openings(walls)
        # The post where a wall starts is the lower left post of one of the two cells that the wall separates.
        # The opposite cell is to the left of a vertical wall, or below a horizontal one.
        opposite_cells = (segments.columns - ~segments.is_horizontal, segments.rows - segments.is_horizontal)
        is_dead_end = (opening_counts[starts] == 1) | (opening_counts[opposite_cells] == 1)
        if (is_candidate & is_dead_end).any():
            is_candidate &= is_dead_end
    candidates = np.flatnonzero(is_candidate)
    chosen = candidates[int(rng.integers(len(candidates)))]
    segments.remove_from(walls, chosen)


def _count_openings(walls: BoolArray) -> IntArray:
    """Return the number of passages that lead from each cell, (columns, rows)."""
    passages = find_inner_walls((walls.shape[0] - 1, walls.shape[1] - 1)) & ~walls
    # A wall from the lower left post of a cell is on the left of the cell, or below it.
    left_and_below = passages[:-1, :-1].sum(axis=2)
    right = passages[1:, :-1, _VERTICAL]
    above = passages[:-1, 1:, _HORIZONTAL]
    return np.asarray(left_and_below + right + above)


def trace_polylines(walls: BoolArray) -> Iterator[list[Post]]:
    """Trace polylines that together contain every wall once.

    At each post, a polyline goes straight on if there is a wall straight ahead. If there is not, it turns if
    exactly one other wall leads from the post, and ends otherwise.

    Parameters
    ----------
    walls : (columns + 1, rows + 1, 2) array of bool
        Walls, which must not form closed rings.

    Yields
    ------
    list of (int, int)
        The posts at the ends and bends of a polyline.
    """
    neighbors: defaultdict[Post, set[Post]] = defaultdict(set)
    segments = _list_segments(walls)
    starts = zip(segments.columns.tolist(), segments.rows.tolist(), strict=True)
    ends = zip(segments.end_columns.tolist(), segments.end_rows.tolist(), strict=True)
    steps: list[tuple[Post, Post]] = []
    for start, end in zip(starts, ends, strict=True):
        neighbors[start].add(end)
        neighbors[end].add(start)
        steps += [(start, end), (end, start)]
    steps.sort()
    traced: set[tuple[Post, Post]] = set()
    for start, second in steps:
        # A polyline may start only where the same polyline, traced in the opposite direction, would end.
        # Elsewhere, it would start in the middle.
        is_end = _find_next_post(neighbors, previous=second, post=start) is None
        if not is_end or (start, second) in traced:
            continue
        polyline = [start]
        previous = start
        post = second
        while True:
            traced.add((previous, post))
            traced.add((post, previous))
            following = _find_next_post(neighbors, previous, post)
            # Only bends and the last post become vertices.
            if following != _step_straight(previous, post):
                polyline.append(post)
            if following is None:
                break
            previous = post
            post = following
        yield polyline


def _find_next_post(neighbors: Mapping[Post, set[Post]], previous: Post, post: Post) -> Post | None:
    """Return the next post of a polyline that comes from `previous` to `post`; None if it ends there."""
    candidates = neighbors[post] - {previous}
    straight = _step_straight(previous, post)
    if straight in candidates:
        return straight
    return candidates.pop() if len(candidates) == 1 else None


def _step_straight(previous: Post, post: Post) -> Post:
    """Return the next post of a polyline that comes from `previous` to `post` and goes straight on."""
    return 2 * post[0] - previous[0], 2 * post[1] - previous[1]
