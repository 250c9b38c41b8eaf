"""Selected obstacles combined into polygons, with the place, the name and the note of the lowest."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial, reduce
from typing import Any

import shapely

from robocov.environment import GRID_M, CircleObstacle, Obstacle, PolygonObstacle
from robocov.errors import MapError, format_count
from robocov.mapfile.models import MAX_SIZE_M, MIN_SIZE_M
from robocov_app.editor.model import require
from robocov_app.editor.model.geometry import extract_polygons, round_length
from robocov_app.editor.model.selection import Change, Selection, replace_obstacles
from robocov_app.editor.model.sketch import Item, Sketch

_difference = partial(shapely.difference, grid_size=GRID_M)
_intersection = partial(shapely.intersection, grid_size=GRID_M)


def unite(sketch: Sketch, selection: Selection) -> Change:
    items = _require_solid_items(sketch, selection, "unite")
    return _replace_items(sketch, items, [_union(items)], f"{format_count(len(items), 'obstacle')} united")


def subtract(sketch: Sketch, selection: Selection) -> Change:
    """Cut the upper ones of the selected obstacles out of the lowest, as drawing programs do."""
    lowest, *uppers = items = _require_solid_items(sketch, selection, "subtract")
    left = _difference(lowest.geometry, _union(uppers))
    what = sketch.display_name(lowest.key)
    words = f"{format_count(len(uppers), 'obstacle')} cut out of {what}"
    return _replace_items(sketch, items, [left], words, f"nothing is left of {what}")


def intersect(sketch: Sketch, selection: Selection) -> Change:
    items = _require_solid_items(sketch, selection, "intersect")
    common = reduce(_intersection, (item.geometry for item in items))
    words = f"{format_count(len(items), 'obstacle')} intersected"
    return _replace_items(sketch, items, [common], words, "they have nothing in common")


def divide(sketch: Sketch, selection: Selection) -> Change:
    """Cut the lowest of the selected obstacles along the upper ones: the parts inside and outside them."""
    lowest, *uppers = items = _require_solid_items(sketch, selection, "divide")
    parts = [cut(lowest.geometry, _union(uppers)) for cut in (_difference, _intersection)]
    return _replace_items(sketch, items, parts, f"{sketch.display_name(lowest.key)} divided")


def offset(sketch: Sketch, selection: Selection, by: float) -> Change:
    """Grow the selected obstacles by so many metres on every side, with sharp corners; shrink with by < 0."""
    require(MIN_SIZE_M <= abs(by) <= MAX_SIZE_M, f"expected a length of at least {1000 * MIN_SIZE_M:g} mm")
    require(selection.items, "select obstacles first")
    shapes: dict[int, Sequence[Obstacle]] = {}
    for item in selection.list_items(sketch):
        if isinstance(item.shape, CircleObstacle):
            radius = round_length(item.shape.radius + by)
            shapes[item.key] = [replace(item.shape, radius=radius)] if radius >= MIN_SIZE_M else []
        else:
            # corners sharper than a right angle would reach far out: they are cut off
            buffered = item.geometry.buffer(by, join_style="mitre", mitre_limit=1.5)
            shapes[item.key] = extract_polygons(buffered, item.shape.name)
        require(shapes[item.key], f"nothing would be left of the {sketch.display_name(item.key)}")
    words = f"{Selection(items=selection.items).describe(sketch)} {'grown' if by > 0 else 'shrunk'}"
    return replace_obstacles(sketch, shapes, f"{words} by {abs(round_length(by)):g} m")


def clip_to_boundary(sketch: Sketch, selection: Selection) -> Change:
    """Cut off what sticks out of the boundary of the selected obstacles, of all if none is selected."""
    if sketch.boundary is None or len(sketch.boundary) < 3 or not shapely.Polygon(sketch.boundary).is_valid:
        raise MapError("the boundary must be sound first")
    inside = shapely.Polygon(sketch.boundary)
    shapely.prepare(inside)
    shapes: dict[int, Sequence[Obstacle]] = {
        item.key: extract_polygons(_intersection(item.geometry, inside), item.shape.name)
        for item in sketch.obstacles
        if (not selection.items or item.key in selection.items) and not inside.covers(item.geometry)
    }
    require(shapes, "nothing sticks out of the boundary")
    return replace_obstacles(
        sketch, shapes, f"{format_count(len(shapes), 'obstacle')} cut off at the boundary"
    )


def repair_outlines(sketch: Sketch, selection: Selection) -> Change:
    """Make crossing outlines valid, of what is selected or of all; the boundary keeps its largest part."""
    everything = not (selection.items or selection.boundary)
    shapes: dict[int, Sequence[Obstacle]] = {}
    for item in sketch.obstacles:
        shape = item.shape
        if not isinstance(shape, PolygonObstacle) or not (everything or item.key in selection.items):
            continue
        if min(map(len, (shape.vertices, *shape.holes))) < 3 or not shape.polygon.is_valid:
            shapes[item.key] = extract_polygons(item.geometry, shape.name)
    boundary = sketch.boundary
    meant = everything or selection.boundary
    if meant and boundary is not None and len(boundary) >= 3 and not shapely.Polygon(boundary).is_valid:
        parts = extract_polygons(shapely.make_valid(shapely.Polygon(boundary)))
        boundary = parts[0].vertices if parts else None
    redrawn = boundary is not sketch.boundary
    require(shapes or redrawn, "there is nothing to repair: no outline crosses itself")
    words = f"{format_count(len(shapes) + redrawn, 'outline')} repaired"
    change = replace_obstacles(replace(sketch, boundary=boundary), shapes, words)
    return replace(change, selection=replace(change.selection, boundary=redrawn and boundary is not None))


def _union(items: Sequence[Item]) -> shapely.Geometry:
    return shapely.union_all([item.geometry for item in items], grid_size=GRID_M)


def _require_solid_items(sketch: Sketch, selection: Selection, verb: str) -> list[Item]:
    items = selection.list_items(sketch)
    require(len(items) >= 2, f"select two or more obstacles to {verb}")
    for item in items:
        if not item.geometry.area > 0.0:
            raise MapError(f"the {sketch.display_name(item.key)} covers nothing: repair or delete it first")
    return items


def _replace_items(
    sketch: Sketch, items: list[Item], parts: list[Any], words: str, empty: str = ""
) -> Change:
    """Put the polygons of some geometries in the place of obstacles, the first of which is the lowest."""
    lowest, *others = items
    shapes = [shape for part in parts for shape in extract_polygons(part, lowest.shape.name)]
    require(shapes, empty or "nothing is left")
    return replace_obstacles(sketch, {lowest.key: shapes, **{item.key: () for item in others}}, words)
