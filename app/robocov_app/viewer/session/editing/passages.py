"""Effects of a map edit on passages: areas that are cut off, and gaps that become too narrow."""

from collections.abc import Sequence

import numpy as np
import shapely

from robocov.environment import Environment, Point, find_narrow_gaps
from robocov.typing import BoolArray, FloatArray, IntArray

_WIDTH_TOLERANCE = 1e-6
"""Relative amount by which a gap may be narrower than a robot and still count as wide enough."""
_QUARTER_SEGMENTS = 4
"""Number of line segments that approximate a quarter of a circle around a corner."""
_MIN_WHOLE_AREA_M2 = 10.0  # larger areas are rounded to whole numbers


def describe_passage_changes(
    before: Environment, after: Environment, radius: float, robots: FloatArray | Sequence[Point] = ()
) -> str:
    """Describe the areas that an edit cuts off from robots, and a gap that it makes too narrow for them.

    Parameters
    ----------
    before, after : Environment
        The map before and after the edit.
    radius : float, m
        Radius of the robots.
    robots : (n, 2) array_like, m
        Positions of the robots.

    Returns
    -------
    str
        The descriptions, separated by semicolons; empty if no passage has changed.
    """
    positions = shapely.points(np.asarray(robots, dtype=float).reshape(-1, 2))
    descriptions = []
    components_after = _find_center_components(after, radius)
    is_occupied = _find_occupied_components(components_after, positions, radius)
    for indices in _split_components(before, components_after, radius):
        components = components_after[indices]
        is_reachable = is_occupied[indices]
        group_count = is_reachable.sum()
        if group_count > 1:
            descriptions.append(f"the team is split into {group_count} groups")
        elif group_count == 0:
            # Without robots, the largest component counts as the reachable one.
            areas = shapely.area(components)
            is_reachable = areas == areas.max(initial=0.0)
        lost_centers = shapely.union_all(components[~is_reachable])
        lost_area = shapely.area(shapely.intersection(after.free, shapely.buffer(lost_centers, radius)))
        # Smaller areas, such as corners, are not worth a message.
        if lost_area > radius * radius:
            descriptions.append(f"about {_format_area(lost_area)} cut off")
    descriptions += _describe_narrow_gap(before, after, radius)
    return "; ".join(descriptions)


def _format_area(area: float) -> str:
    """Round an area, m²; exact areas follow later, when the cost is computed."""
    digits = 0 if area >= _MIN_WHOLE_AREA_M2 else 1
    return f"{area:.{digits}f} m²"


def _find_occupied_components(components: np.ndarray, positions: np.ndarray, radius: float) -> BoolArray:
    """Return which components of the free positions contain a robot.

    A robot close to a wall may be outside all components, and close to several: it belongs to the nearest.
    """
    is_occupied = np.zeros(len(components), dtype=bool)
    if len(components) > 0:
        distances = shapely.distance(components[:, None], positions)
        is_inside = distances.min(axis=0) <= radius
        is_occupied[distances.argmin(axis=0)[is_inside]] = True
    return is_occupied


def _split_components(before: Environment, components_after: np.ndarray, radius: float) -> list[IntArray]:
    """Find the components into which an edit splits each component of the free positions.

    Returns
    -------
    list of arrays of int
        For each component before the edit, the indices of the components of it that remain after the edit.
    """
    components_before = _find_center_components(before, radius)
    tree = shapely.STRtree(components_before)
    after_indices, before_indices = tree.query(
        shapely.point_on_surface(components_after), predicate="intersects"
    )
    return [after_indices[before_indices == index] for index in range(len(components_before))]


def _find_center_components(environment: Environment, radius: float) -> np.ndarray:
    """Return the connected components of all center positions at which a robot overlaps no obstacle."""
    centers = environment.free.buffer(-radius, quad_segs=_QUARTER_SEGMENTS)
    components: np.ndarray = shapely.get_parts(centers)
    return components


def _describe_narrow_gap(before: Environment, after: Environment, radius: float) -> list[str]:
    """Return the description of the first gap that an edit has made too narrow; empty if there is none."""
    width = 2 * radius * (1 - _WIDTH_TOLERANCE)
    old_gaps = {gap.between for gap in find_narrow_gaps(before.free, width)}
    for gap in find_narrow_gaps(after.free, width):
        if gap.between not in old_gaps:
            return [f"a passage of {100 * gap.width:.0f} cm, too narrow for a robot"]
    return []
