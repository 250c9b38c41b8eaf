"""Simplification of a free space: fewer vertices, but the same passages and sizes.

Walls move by at most the tolerance. Checks then ensure that no outline meets itself or another one, that
obstacles and parts as thin as the tolerance keep their sizes, and that a robot fits through the same passages
as before. If a check fails, the tolerance is reduced around that position, and the import report mentions it.

The outline of cells along an oblique wall consists of stairs, which are replaced by the midpoints of their
steps (see `stairs`). Then the algorithm of Douglas and Peucker drops vertices within the tolerance, between
vertices that must stay.

D. H. Douglas, T. K. Peucker, Algorithms for the reduction of the number of points required to represent
a digitized line or its caricature, Cartographica 10 (1973), 112-122.
"""

from collections import Counter
from typing import NamedTuple

import numpy as np
from shapely import MultiPolygon

from robocov.errors import format_count
from robocov.typing import BoolArray, FloatArray
from robocov_app.formats.geometry.simplification.checks import (
    MAX_AREA_CHANGE,
    MAX_OUTLINE_CHANGE,
    SimplificationCheck,
)
from robocov_app.formats.geometry.simplification.original_outline import OriginalOutline

DEFAULT_TOLERANCE_M = 0.02
"""Distance by which walls may move by default in vector formats."""
_MIN_CELLS = 16
"""Rings of fewer cells are not simplified: the cells describe them best."""
_MAX_HALVINGS = 3
"""Number of times that the tolerance at a vertex is halved before it becomes 0, so that the vertex stays."""
_PATIENT_ROUNDS = 24
"""Number of rounds after which whole walls, not only single vertices, are excluded from simplification."""
_MAX_ROUNDS = 60
_MAX_VERTEX_ROUNDS = 1_000_000
"""Limit on the number of rounds times the number of vertices, after which the space is not simplified."""


class SimplifiedSpace(NamedTuple):
    """A simplified free space.

    Attributes
    ----------
    free : MultiPolygon, m
    tolerance : float, m
        Distance by which walls may have moved.
    changed : tuple of str
        Lines of the import report about where and why less was simplified.
    """

    free: MultiPolygon
    tolerance: float
    changed: tuple[str, ...] = ()


def simplify_free_space(
    free: MultiPolygon, tolerance: float, cell: float | None, radius: float
) -> SimplifiedSpace:
    """Reduce the number of vertices of a free space.

    Parameters
    ----------
    free : MultiPolygon, m
        Must be valid.
    tolerance : float, m
        Distance by which walls may move.
    cell : float or None, m
        Side of the cells, if the free space consists of cells.
    radius : float, m
        Radius of a robot, which must fit through the same passages as before.

    Returns
    -------
    SimplifiedSpace
    """
    if tolerance == 0.0 or free.is_empty:
        return SimplifiedSpace(free, 0.0)
    outline = OriginalOutline(list(free.geoms), cell)
    allowed = np.full(len(outline.points), tolerance)
    if cell is not None:
        is_small = np.abs(outline.areas) < _MIN_CELLS * cell * cell
        allowed[is_small[outline.ring]] = 0.0
    is_fixed = np.zeros(len(outline.points), dtype=bool)
    thin = outline.find_thin_parts(free, tolerance)
    problems: Counter[str] = Counter()
    for attempt in range(min(_MAX_ROUNDS, 1 + _MAX_VERTEX_ROUNDS // len(allowed))):
        simplified = outline.restore_areas(outline.simplify_outline(allowed, is_fixed), allowed)
        simplified = outline.limit_movement(simplified, allowed)
        check = SimplificationCheck(
            outline,
            simplified,
            allowed=allowed,
            tolerance=tolerance,
            width=2 * radius,
            problems=problems,
        )
        is_wrong, is_too_far = check.find_area_and_distance_errors()
        is_wrong |= check.find_thin_part_errors(thin)
        parts = None
        if not (is_wrong.any() or is_too_far.any()):
            parts, is_wrong = check.find_crossings()
        if parts is None or is_wrong.any():
            _tighten(check, is_wrong, is_too_far, is_fixed, whole_walls=attempt >= _PATIENT_ROUNDS)
            continue
        closed = check.find_closed_gaps(parts)
        if closed is None:
            note = "not simplified: too many narrow gaps to check"
            return SimplifiedSpace(free, 0.0, (note,))
        if not closed.any():
            return SimplifiedSpace(parts, tolerance, _describe_problems(problems, radius))
        allowed[closed] = 0.0
    return SimplifiedSpace(
        free, 0.0, ("not simplified: walls would have touched, or passages would have closed",)
    )


def _tighten(
    check: SimplificationCheck,
    is_wrong: BoolArray,
    is_too_far: BoolArray,
    is_fixed: BoolArray,
    *,
    whole_walls: bool,
) -> None:
    """Reduce the tolerance at the vertices in `is_wrong`, and fix those in `is_too_far`, for the next round.

    With `whole_walls`, all vertices that share a side of the simplified outline with one of these stay.
    """
    allowed: FloatArray = check.allowed
    is_wrong |= is_too_far & is_fixed
    is_fixed |= is_too_far
    if whole_walls:
        allowed[np.isin(check.side_of_vertex, check.side_of_vertex[is_wrong | is_too_far])] = 0.0
    allowed[is_wrong] /= 2
    allowed[allowed < 0.75 * check.tolerance * 0.5**_MAX_HALVINGS] = 0.0


def _describe_problems(problems: Counter[str], radius: float) -> tuple[str, ...]:
    """Return the lines of the import report about places that were simplified less."""
    reasons = {
        "narrow passage": f"so that a robot of radius {radius:g} m still fits through",
        "thin part": f"whose area would have changed by more than {100 * MAX_OUTLINE_CHANGE:g}%",
        "outline": f"whose area would have changed by more than {100 * MAX_OUTLINE_CHANGE:g}%",
        "point": "where walls would have touched",
    }
    lines = []
    for kind, reason in reasons.items():
        if problems[kind]:
            lines.append(f"simplified less at {format_count(problems[kind], kind)}, {reason}")
    if problems["area"]:
        limit = f"{100 * MAX_AREA_CHANGE:g}%"
        lines.append(f"simplified less, so that the free area changes by less than {limit}")
    return tuple(lines)
