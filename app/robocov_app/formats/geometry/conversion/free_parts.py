"""The connected parts of a free space: which of them stay, and which obstacles in them are noise."""

from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon

from robocov.errors import MapError, format_area, format_count
from robocov.typing import BoolArray
from robocov_app.formats.geometry.conversion.conversion_options import Conversion
from robocov_app.formats.geometry.conversion.validity import MAX_CRUMB_M2
from robocov_app.formats.geometry.crossings import extract_sides

MAX_FILE_ROBOTS = 1000
"""Number of robots in a file that are considered."""
_TINY_AREA_M2 = 0.01
_MANY_TINY_OBSTACLES = 10
"""This many obstacles smaller than `_TINY_AREA_M2` are probably noise, and the report says so."""
_MIN_KEPT_SHARE = 0.5
"""If a smaller share of the free area is kept, the report offers other parts."""
_LARGE_PART_SHARE = 0.1
"""If a dropped part is a larger share of the free area, the report offers it, too."""
_MAX_OFFERED_PARTS = 3
_MIN_OFFERED_SHARE = 0.01
"""The report offers no part below this fraction of the largest dropped one, such as the inside of letters."""
_MAX_POSITION_DECIMALS = 8
"""Positions that need more decimals are not rounded."""
_MIN_PAGE_EDGE_SHARE = 0.2
"""The largest part may be the paper around a plan if it borders on this fraction of the edge of the page."""
_MIN_PLAN_SHARE = 0.05
"""Minimum area of a plan, as a fraction of the paper's. A smaller part is the inside of an obstacle."""
_HOLLOW_SHARE = 0.1
"""An obstacle may be the walls of a plan if its bounding box covers at least this fraction of the page."""
_MAX_HOLLOW_FILL = 0.5
"""Walls of a plan fill at most this fraction of their bounding box."""


class PartSelection(NamedTuple):
    """The parts of a free space that stay.

    Attributes
    ----------
    parts : list of Polygon, m
    offered_positions : tuple of (x, y), m
        A position in each large part that was dropped, for the option ``inside``.
    is_enclosed : bool
        Whether an enclosed part is kept because the largest part is the paper around a plan.
    """

    parts: list[Polygon]
    offered_positions: tuple[tuple[float, float], ...] = ()
    is_enclosed: bool = False


def select_parts(free: MultiPolygon, conversion: Conversion) -> PartSelection:
    """Select the parts of a free space that stay, and report the others.

    Parameters
    ----------
    free : MultiPolygon, m
        The largest part first.
    conversion : Conversion

    Returns
    -------
    PartSelection

    Raises
    ------
    MapError
        If the position of the option ``inside`` is solid, or if no part is large enough.
    """
    parts = np.array(free.geoms, dtype=object)
    area = shapely.area(parts)
    is_enclosed = False
    if conversion.shaping.keep == "all":
        min_area = max(conversion.min_obstacle_area, min(MAX_CRUMB_M2, area[0]))
        is_kept = area >= min_area
    elif conversion.shaping.inside is not None:
        is_kept = np.arange(len(parts)) == _find_part_at(
            conversion.shaping.inside, parts, conversion.source_name
        )
    else:
        index = _find_enclosed_part(parts, conversion)
        is_enclosed = index is not None
        if index is None:
            index = _find_main_part(parts, conversion)
        is_kept = np.arange(len(parts)) == index
    kept: list[Polygon] = parts[is_kept].tolist()
    if not kept:
        largest = f"no part of the free space is larger than {format_area(area[0], 3)}"
        min_size = f"{conversion.min_obstacle_area:g} m²"
        raise MapError(f"{conversion.source_name}: {largest}, expected one of at least {min_size}")
    offered_positions = _report_dropped_parts(parts, is_kept, conversion)
    if len(kept) > 1:
        conversion.notes.append(
            f"the free space consists of {len(kept)} separate parts: robots cannot pass between them"
        )
    return PartSelection(kept, offered_positions, is_enclosed)


def drop_specks(parts: list[Polygon], conversion: Conversion) -> list[Polygon]:
    """Fill the holes that are too small to be obstacles, and report them.

    Specks are holes below the minimum area that the user or the format sets; crumbs are even smaller and due
    to rounding.
    """
    cell = conversion.foreign.cell
    min_area = conversion.min_obstacle_area
    max_crumb = MAX_CRUMB_M2 if cell is None else min(MAX_CRUMB_M2, cell * cell / 2)
    result = []
    specks: list[Polygon] = []
    crumbs: list[Polygon] = []
    tiny_count = 0
    for part in parts:
        holes = np.array([Polygon(hole) for hole in part.interiors], dtype=object)
        area = shapely.area(holes)
        specks += holes[(area < min_area) & (area >= max_crumb)].tolist()
        crumbs += holes[area < max_crumb].tolist()
        is_kept = area >= max(max_crumb, min_area)
        tiny_count += int(np.count_nonzero(is_kept & (area < _TINY_AREA_M2)))
        rings = shapely.get_exterior_ring(holes[is_kept]).tolist()
        if is_kept.all():
            result.append(part)
        else:
            result.append(Polygon(part.exterior, rings))
    if specks:
        count = f"{format_count(len(specks), 'obstacle')} smaller than {format_area(min_area, 3)}"
        conversion.dropped.append(f"{count}, {_format_total_area(specks)} (--specks 0 keeps them)")
    if crumbs:
        count = format_count(len(crumbs), "hole")
        conversion.dropped.append(f"{count}, {_format_total_area(crumbs)}, due to rounding")
    if tiny_count >= _MANY_TINY_OBSTACLES and min_area < _TINY_AREA_M2:
        conversion.notes.append(
            f"{tiny_count} obstacles are smaller than {_TINY_AREA_M2:g} m² "
            f"(--specks {_TINY_AREA_M2:g} drops them)"
        )
    return result


def _find_part_at(position: tuple[float, float], parts: NDArray[np.object_], source_name: str) -> int:
    """Return the index of the part that contains a position; raise MapError if none does."""
    distance = shapely.distance(parts, shapely.Point(position))
    nearest = int(np.argmin(distance))
    if distance[nearest] > 0.0:
        x, y = position
        free_x, free_y = _choose_position_in(parts[nearest])
        raise MapError(
            f"{source_name}: inside: {x:.10g} {y:.10g} is solid, expected a free position; "
            f"{free_x:.10g} {free_y:.10g} is one in the nearest part, {distance[nearest]:.3g} m away"
        )
    return nearest


def _find_main_part(parts: NDArray[np.object_], conversion: Conversion) -> int:
    """Return the index of the part with the most robots or, in a file without robots, of the largest part."""
    robots = conversion.foreign.robots[:MAX_FILE_ROBOTS]
    if not robots:
        return 0
    shapely.prepare(parts)
    positions = shapely.points(np.array(robots).reshape(-1, 2))
    index = int(np.argmax([shapely.contains(part, positions).sum() for part in parts]))
    if index:
        note = "kept the part of the free space with the most robots, which is not the largest"
        conversion.notes.append(note)
    return index


def _find_enclosed_part(parts: NDArray[np.object_], conversion: Conversion) -> int | None:
    """Return the index of the plan if the largest part is the paper around it; None in all other cases.

    The plan is the largest enclosed part, that is, the largest that does not touch the edge of the page. If
    there is one, a note reports the decision. If there is none, but the walls of a plan seem to have an
    opening, a note suggests that.

    Parameters
    ----------
    parts : array of Polygon, m
        The largest first.
    conversion : Conversion
    """
    page = conversion.foreign.page
    if page is None or conversion.foreign.robots:
        return None
    largest = parts[0]
    edge_lengths = [_measure_length_along(part, page) for part in parts]
    edge_share = edge_lengths[0] / page.length
    if edge_share < _MIN_PAGE_EDGE_SHARE:
        return None
    edge = f"{100 * edge_share:.0f}% of the edge of the image"
    description = f"{format_area(largest.area, 3)}, runs along {edge}"
    enclosed = [k for k, length in enumerate(edge_lengths) if length == 0.0]
    if enclosed and parts[enclosed[0]].area >= _MIN_PLAN_SHARE * largest.area:
        x, y = _choose_position_in(largest)
        conversion.notes.append(
            f"the largest part of the free space, {description}: treated as the paper around a plan; the "
            f"largest enclosed part is kept (--inside {x:.10g} {y:.10g}: the part along the edge)"
        )
        return enclosed[0]
    if _has_hollow_obstacle(largest, _HOLLOW_SHARE * page.area):
        conversion.notes.append(
            f"the largest part of the free space, {description}: if that is the paper around a plan, "
            "an outer door may be open"
        )
    return None


def _report_dropped_parts(
    parts: NDArray[np.object_], is_kept: BoolArray, conversion: Conversion
) -> tuple[tuple[float, float], ...]:
    """Report the parts that were dropped; return a position in each one that the report offers."""
    dropped: list[Polygon] = parts[~is_kept].tolist()
    if not dropped:
        return ()
    largest = ""
    if len(dropped) > 1:
        largest = f" (the largest {format_area(dropped[0].area, 3)})"
    count = format_count(len(dropped), "separate part")
    conversion.dropped.append(f"{count} of the free space, {_format_total_area(dropped)}{largest}")
    area = shapely.area(parts)
    share = area[is_kept].sum() / area.sum()
    is_minor = share >= _MIN_KEPT_SHARE and dropped[0].area / area.sum() <= _LARGE_PART_SHARE
    # If all parts are requested, those that are dropped are too small to be offered.
    if is_minor or conversion.shaping.keep == "all":
        return ()
    min_area = _MIN_OFFERED_SHARE * dropped[0].area
    offered = [part for part in dropped[:_MAX_OFFERED_PARTS] if part.area >= min_area]
    positions = tuple(_choose_position_in(part) for part in offered)
    choices = [
        f"--inside {x:.10g} {y:.10g} ({format_area(part.area, 3)})"
        for (x, y), part in zip(positions, offered, strict=True)
    ]
    only = "only " if share < _MIN_KEPT_SHARE else ""
    conversion.notes.append(
        f"{only}{100 * share:.2g}% of the free area is kept: {' or '.join(choices)} keeps another part, "
        "--keep all keeps every part"
    )
    return positions


def _has_hollow_obstacle(part: Polygon, min_box_area: float) -> bool:
    """Return whether a part has a hole that fills little of its bounding box.

    Only holes whose bounding box has at least the area `min_box_area`, m², are considered.
    """
    holes = shapely.polygons(shapely.get_rings(part)[1:])
    low_x, low_y, high_x, high_y = shapely.bounds(holes).reshape(-1, 4).T
    box_areas = (high_x - low_x) * (high_y - low_y)
    is_hollow = (box_areas >= min_box_area) & (shapely.area(holes) < _MAX_HOLLOW_FILL * box_areas)
    return bool(is_hollow.any())


def _measure_length_along(part: Polygon, page: Polygon) -> float:
    """Return the length of the outline of a part, m, that runs along the edge of a rectangular page."""
    sides = extract_sides(part)
    low_x, low_y, high_x, high_y = page.bounds
    slack = 1e-6 * max(high_x - low_x, high_y - low_y)
    length = np.hypot(*(sides[:, 1] - sides[:, 0]).T)
    total = 0.0
    for axis, edge in ((0, low_x), (0, high_x), (1, low_y), (1, high_y)):
        is_on_edge = (np.abs(sides[:, :, axis] - edge) <= slack).all(axis=1)
        total += float(length[is_on_edge].sum())
    return total


def _choose_position_in(part: Polygon) -> tuple[float, float]:
    """Return a position in a part, rounded to centimeters, or more finely in a narrow part."""
    point = shapely.point_on_surface(part)
    for decimals in range(2, _MAX_POSITION_DECIMALS + 1):
        # Adding 0 turns -0 into 0.
        x = round(point.x, decimals) + 0.0
        y = round(point.y, decimals) + 0.0
        if shapely.contains_xy(part, x, y):
            return x, y
    return point.x, point.y


def _format_total_area(parts: list[Polygon]) -> str:
    suffix = " in total" if len(parts) > 1 else ""
    return f"{format_area(sum(part.area for part in parts), 3)}{suffix}"
