"""Edits that combine obstacles.

The result keeps the stacking position, name, note and path of the lowest one.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial, reduce

import shapely

from robocov.environment import GRID_M, CircleObstacle, Obstacle, PolygonObstacle
from robocov.errors import MapError, format_count
from robocov.mapfile.models import MIN_SIZE_M
from robocov_app.editor.edits.paths import describe_lost_paths
from robocov_app.editor.model import require
from robocov_app.editor.model.geometry import extract_polygons, require_size, round_length
from robocov_app.editor.model.selection import Change, Selection, format_numbered_name, replace_obstacles
from robocov_app.editor.model.sketch import Item, Sketch

MITRE_LIMIT = 1.5  # when obstacles grow, corners sharper than right angles are cut off
_difference = partial(shapely.difference, grid_size=GRID_M)
_intersection = partial(shapely.intersection, grid_size=GRID_M)


def unite(sketch: Sketch, selection: Selection) -> Change:
    """Unite the selected obstacles."""
    items = _require_solid_items(sketch, selection, "unite")
    description = f"{format_count(len(items), 'obstacle')} united{describe_lost_paths(items)}"
    return _replace_items(sketch, items, [_unite_geometries(items)], description)


def subtract(sketch: Sketch, selection: Selection) -> Change:
    """Subtract the other selected obstacles from the lowest one."""
    items = _require_solid_items(sketch, selection, "subtract")
    lowest = items[0]
    uppers = items[1:]
    name = sketch.display_name(lowest.key)
    remainder = _difference(lowest.geometry, _unite_geometries(uppers))
    description = f"{format_count(len(uppers), 'obstacle')} cut out of {name}"
    return _replace_items(sketch, items, [remainder], description, f"nothing is left of {name}")


def intersect(sketch: Sketch, selection: Selection) -> Change:
    """Replace the selected obstacles by their common area."""
    items = _require_solid_items(sketch, selection, "intersect")
    common = reduce(_intersection, (item.geometry for item in items))
    description = f"{format_count(len(items), 'obstacle')} intersected{describe_lost_paths(items)}"
    return _replace_items(sketch, items, [common], description, "they have nothing in common")


def divide(sketch: Sketch, selection: Selection) -> Change:
    """Divide the lowest selected obstacle into its parts outside and inside the others, which are removed."""
    items = _require_solid_items(sketch, selection, "divide")
    lowest = items[0].geometry
    uppers = _unite_geometries(items[1:])
    parts = [_difference(lowest, uppers), _intersection(lowest, uppers)]
    return _replace_items(sketch, items, parts, f"{sketch.display_name(items[0].key)} divided")


def offset(sketch: Sketch, selection: Selection, distance: float) -> Change:
    """Grow the selected obstacles on all sides by a distance, m; a negative distance shrinks them."""
    require_size("length", abs(distance))
    require(selection.items, "select obstacles first")
    shapes: dict[int, Sequence[Obstacle]] = {}
    for item in selection.list_items(sketch):
        shapes[item.key] = _offset_item(item, distance)
        require(shapes[item.key], f"nothing would be left of the {sketch.display_name(item.key)}")
    obstacles = Selection(items=selection.items).describe(sketch)
    action = "grown" if distance > 0 else "shrunk"
    description = f"{obstacles} {action} by {abs(round_length(distance)):g} m"
    return replace_obstacles(sketch, shapes, description)


def _offset_item(item: Item, distance: float) -> Sequence[Obstacle]:
    """Return an obstacle grown by a distance, m, as any number of parts; a circle remains a circle."""
    if isinstance(item.shape, CircleObstacle):
        radius = round_length(item.shape.radius + distance)
        if radius < MIN_SIZE_M:
            return []
        return [replace(item.shape, radius=radius)]
    grown = item.geometry.buffer(distance, join_style="mitre", mitre_limit=MITRE_LIMIT)
    return extract_polygons(grown, item.shape)


def clip_to_boundary(sketch: Sketch, selection: Selection) -> Change:
    """Clip the selected obstacles to the boundary, or all obstacles if none is selected."""
    inside = _build_boundary_polygon(sketch)
    if inside is None or not inside.is_valid:
        raise MapError("the boundary must be valid first")
    shapely.prepare(inside)
    items: Sequence[Item] = sketch.obstacles
    if selection.items:
        items = selection.list_items(sketch)
    shapes: dict[int, Sequence[Obstacle]] = {}
    for item in items:
        if not inside.covers(item.geometry):
            remainder = _intersection(item.geometry, inside)
            shapes[item.key] = extract_polygons(remainder, item.shape)
    require(shapes, "no obstacle extends beyond the boundary")
    clipped_count = sum(map(bool, shapes.values()))
    removed_count = len(shapes) - clipped_count
    facts = []
    if clipped_count:
        facts.append(f"{format_count(clipped_count, 'obstacle')} clipped to the boundary")
    if removed_count:
        facts.append(f"{format_count(removed_count, 'obstacle')} outside the boundary removed")
    description = ", ".join(facts)
    return replace_obstacles(sketch, shapes, description)


def repair_outlines(sketch: Sketch, selection: Selection) -> Change:
    """Repair self-intersecting outlines: the selected ones, or all if none are selected.

    An obstacle may become several obstacles. Only the largest part of a boundary is kept. Outlines without an
    area are removed.
    """
    is_all = not selection.items and not selection.boundary
    shapes: dict[int, Sequence[Obstacle]] = {}
    for item in sketch.obstacles:
        if (is_all or item.key in selection.items) and _is_broken(item.shape):
            shapes[item.key] = extract_polygons(item.geometry, item.shape)
    boundary = sketch.boundary
    if is_all or selection.boundary:
        boundary = _repair_boundary(sketch)
    is_boundary_changed = boundary is not sketch.boundary
    outlines = "no outline" if is_all else "no selected outline"
    require(shapes or is_boundary_changed, f"there is nothing to repair: {outlines} crosses itself")
    is_boundary_repaired = is_boundary_changed and boundary is not None
    repaired_count = sum(map(bool, shapes.values())) + is_boundary_repaired
    removed_count = len(shapes) + is_boundary_changed - repaired_count
    description = _describe_repairs(repaired_count, removed_count)
    change = replace_obstacles(replace(sketch, boundary=boundary), shapes, description)
    return replace(change, selection=replace(change.selection, boundary=is_boundary_repaired))


def _describe_repairs(repaired_count: int, removed_count: int) -> str:
    """Return the status message about outlines that were repaired, or removed because they had no area."""
    if removed_count == 0:
        return f"{format_count(repaired_count, 'outline')} repaired"
    if repaired_count == 0:
        return f"{format_count(removed_count, 'outline')} without an area removed"
    return f"{format_count(repaired_count, 'outline')} repaired, {removed_count} without an area removed"


def _is_broken(shape: Obstacle) -> bool:
    if not isinstance(shape, PolygonObstacle):
        return False
    fewest_corners = min(map(len, (shape.vertices, *shape.holes)))
    return fewest_corners < 3 or not shape.polygon.is_valid


def _repair_boundary(sketch: Sketch) -> tuple[tuple[float, float], ...] | None:
    """Return the largest part of a self-intersecting boundary, or None if no part has an area.

    A boundary that is valid, or that has fewer than three corners, is returned unchanged.
    """
    polygon = _build_boundary_polygon(sketch)
    if polygon is None or polygon.is_valid:
        return sketch.boundary
    parts = extract_polygons(shapely.make_valid(polygon))
    if not parts:
        return None
    return parts[0].vertices


def _build_boundary_polygon(sketch: Sketch) -> shapely.Polygon | None:
    """Build the polygon inside the boundary, or return None if the boundary has fewer than three corners."""
    if sketch.boundary is None or len(sketch.boundary) < 3:
        return None
    return shapely.Polygon(sketch.boundary)


def _unite_geometries(items: Sequence[Item]) -> shapely.Geometry:
    return shapely.union_all([item.geometry for item in items], grid_size=GRID_M)


def _require_solid_items(sketch: Sketch, selection: Selection, verb: str) -> list[Item]:
    """Return the selected obstacles, the lowest first.

    Raise MapError if there are fewer than two, or if one has no area.
    """
    items = selection.list_items(sketch)
    require(len(items) >= 2, f"select two or more obstacles to {verb}")
    for item in items:
        if not item.geometry.area > 0.0:
            raise MapError(f"{format_numbered_name(sketch, item.key)} has no area: repair or delete it first")
    return items


def _replace_items(
    sketch: Sketch,
    items: list[Item],
    parts: list[shapely.Geometry],
    description: str,
    error: str = "nothing is left",
) -> Change:
    """Replace obstacles by the polygons of geometries; raise MapError if there are no polygons."""
    lowest = items[0]
    polygons: list[Obstacle] = []
    for part in parts:
        polygons += extract_polygons(part, lowest.shape)
    require(polygons, error)
    shapes: dict[int, Sequence[Obstacle]] = {item.key: () for item in items}
    shapes[lowest.key] = polygons
    return replace_obstacles(sketch, shapes, description)
