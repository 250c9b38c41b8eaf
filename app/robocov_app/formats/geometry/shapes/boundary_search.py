"""Search for the boundary of a drawing: by its name, by the shapes in it, or around everything."""

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from robocov.errors import MapError, format_area, quote
from robocov.typing import FloatArray
from robocov_app.formats.geometry.polygons import to_multipolygon
from robocov_app.formats.geometry.shapes.drawings import Boundary, Drawing
from robocov_app.formats.geometry.shapes.drawn_shapes import BOUNDARY, ClosedOutline
from robocov_app.formats.geometry.shapes.snapping import (
    are_edge_to_edge,
    close_gaps,
    join_line_ends,
    union_on_grid,
)
from robocov_app.formats.options import get_or_default

DEFAULT_AROUND_M = 1.0
"""Distance between the shapes and the rectangle that is built around them."""
_MAJORITY = 0.5
"""A boundary contains more than this fraction of the other shapes. If it is the outer edge of walls, at least
this fraction of its area is open."""
_MAX_AREA_RATIO = 0.999
"""If the areas of two outlines differ by less than this ratio, neither is taken to lie in the other."""


def find_boundary(drawing: Drawing, *, solid: bool, overlap: bool) -> Boundary | None:
    """Find the boundary that the format, a name or the shapes of a drawing determine.

    Parameters
    ----------
    drawing : Drawing
    solid, overlap : bool
        See `interpretation.interpret`.

    Returns
    -------
    Boundary or None

    Raises
    ------
    MapError
        If the boundary that the user names encloses no area.
    """
    if drawing.world is not None:
        return Boundary(drawing.world)
    named = _find_named_boundary(drawing)
    meaning = drawing.options.outlines
    if named is not None or meaning in ("free", "nested") or not drawing.outlines:
        return named
    if meaning == "solid" or solid:
        return _find_largest_outline(drawing)
    if overlap:
        return _find_covering_outline(drawing)
    return _find_outermost_outlines(drawing)


def find_surrounding(drawing: Drawing, floors: frozenset[ClosedOutline] = frozenset()) -> Boundary:
    """Return the outer edge of the walls of a drawing, or a rectangle around everything if there is none.

    Parameters
    ----------
    drawing : Drawing
    floors : frozenset of ClosedOutline
        Outlines that are not walls.

    Returns
    -------
    Boundary
    """
    enclosed = _find_outer_edge(drawing, floors)
    if enclosed is not None:
        source = f"the outer edge of the walls, around {format_area(enclosed.area)}"
        return Boundary(MultiPolygon([enclosed]), source)
    around = get_or_default(drawing.options.around, DEFAULT_AROUND_M)
    everything = [*drawing.areas, *(line.solid for line in drawing.lines)]
    everything += [pillar.polygon for pillar in drawing.pillars]
    x, y, right, top = shapely.total_bounds(everything)
    box = shapely.box(x - around, y - around, right + around, top + around)
    source = f"a rectangle {around:g} m around everything (--around): no shape contains the others"
    return Boundary(MultiPolygon([box]), source, is_guess=True)


def _find_outer_edge(drawing: Drawing, floors: frozenset[ClosedOutline]) -> Polygon | None:
    """Return the area enclosed by the walls of a drawing, if it is mostly open and contains most walls."""
    edges = [edge for outline in drawing.outlines if outline in floors for edge in outline.edges]
    lines = [line for line in (*drawing.lines, *edges) if line.role != "free"]
    areas = [outline.area for outline in drawing.outlines if outline not in floors]
    solid = _unite_exactly([*areas, *(line.solid for line in lines)])
    if solid.is_empty:  # everything is thinner than the precision grid
        return None
    filled_parts = [Polygon(part.exterior) for part in solid.geoms]
    largest = int(np.argmax([part.area for part in filled_parts]))
    filled = filled_parts[largest]
    is_open = solid.geoms[largest].area <= (1.0 - _MAJORITY) * filled.area
    if is_open and _contains_most(filled, list(solid.geoms)):
        return filled
    return None


def _find_named_boundary(drawing: Drawing) -> Boundary | None:
    """Return the boundary with the name that the user gave, or "boundary"; None if there is none.

    Raise MapError if the user gave the name of shapes that enclose no area.
    """
    given_name = drawing.options.boundary
    name = given_name or BOUNDARY
    outlines = frozenset(outline for outline in drawing.outlines if _has_label(outline.labels, name))
    lines = frozenset(line for line in drawing.lines if _has_label(line.labels, name))
    # In the order of the file, because the order of a set differs from run to run.
    paths = [LineString(line.points) for line in drawing.lines if line in lines]
    noded = shapely.union_all(join_line_ends(paths, drawing.snap))
    rooms = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    areas = [outline.area for outline in drawing.outlines if outline in outlines]
    area = _unite_exactly([*areas, shapely.union_all(rooms)])
    if not area.is_empty:
        return Boundary(area, f"the shape called {quote(name)}", outlines, lines, is_named=True)
    if given_name is not None:
        reason = "encloses no area, expected a closed outline"
        raise MapError(f"{drawing.source_name}: boundary {quote(given_name)}: {reason}")
    return None


def _has_label(labels: Sequence[str], name: str) -> bool:
    return name.casefold() in map(str.casefold, labels)


def _find_largest_outline(drawing: Drawing) -> Boundary | None:
    """Return the largest outline and its continuation as the boundary, if most other shapes lie in it."""
    largest = max(drawing.outlines, key=lambda outline: outline.filled_area)
    # An outline with large holes is not a boundary: it is all walls as one shape, with the rooms as holes.
    if largest.area.area < _MAJORITY * largest.filled_area:
        return None
    members = _find_continuation(drawing, largest)
    inner = [outline.area for outline in drawing.outlines if outline not in members]
    inner += [*drawing.paths, *(pillar.polygon for pillar in drawing.pillars)]
    if not inner and len(members) > 1:
        return None
    boundary = _join_outlines(drawing, largest, members)
    if inner and not _contains_most(boundary.area, inner):
        return None
    return boundary


def _find_continuation(drawing: Drawing, largest: ClosedOutline) -> set[ClosedOutline]:
    """Return the largest outline and the outlines that continue it.

    These are other parts of its geometry, and outlines next to it that contain further outlines.
    """
    outlines = np.array(drawing.outlines, dtype=object)
    areas = np.array(drawing.areas, dtype=object)
    tree = STRtree(areas)
    containers = _find_containers(areas, tree)
    members = {largest}
    fresh = [largest]
    while fresh:
        current = fresh.pop()
        neighbors = np.sort(tree.query(current.area, "dwithin", distance=drawing.snap))
        for k in neighbors.tolist():
            neighbor: ClosedOutline = outlines[k]
            has_same_parent = (
                neighbor.parent_location != "" and neighbor.parent_location == largest.parent_location
            )
            if neighbor in members or not (k in containers or has_same_parent):
                continue
            if are_edge_to_edge(current.area, neighbor.area, drawing.snap):
                members.add(neighbor)
                fresh.append(neighbor)
    return members


def _find_containers(areas: FloatArray, tree: STRtree) -> set[int]:
    """Return the indices of the areas that contain another area."""
    inner, outer = _find_nested_pairs(areas, tree)
    return set(outer[inner != outer].tolist())


def _find_nested_pairs(areas: FloatArray, tree: STRtree) -> tuple[FloatArray, FloatArray]:
    """Find all pairs of an area and a larger one that contains most of it.

    Two arrays of indices are returned: of the inner areas, and of the outer areas.
    """
    inner, outer = tree.query(areas, "intersects")
    size = shapely.area(areas)
    is_smaller = size[inner] < _MAX_AREA_RATIO * size[outer]
    inner = inner[is_smaller]
    outer = outer[is_smaller]
    shared = shapely.area(shapely.intersection(areas[inner], areas[outer]))
    is_nested = shared > _MAJORITY * size[inner]
    return inner[is_nested], outer[is_nested]


def _find_covering_outline(drawing: Drawing) -> Boundary | None:
    """Return the largest outline, with other parts of its geometry, if all others lie entirely in it."""
    largest = max(drawing.outlines, key=lambda outline: outline.filled_area)
    members = {
        outline
        for outline in drawing.outlines
        if outline.parent_location != "" and outline.parent_location == largest.parent_location
    }
    if len(members) == len(drawing.outlines):
        members = set()
    members.add(largest)
    inner = [outline.area for outline in drawing.outlines if outline not in members]
    boundary = _join_outlines(drawing, largest, members)
    return boundary if shapely.covers(boundary.area, inner).all() else None


def _find_outermost_outlines(drawing: Drawing) -> Boundary | None:
    """Return the outlines that do not lie in a larger one as the boundary.

    None is returned if there are several outlines and none lies in another.
    """
    areas = np.array(drawing.areas, dtype=object)
    inner, _ = _find_nested_pairs(areas, STRtree(areas))
    is_inner = np.zeros(len(areas), dtype=bool)
    is_inner[inner] = True
    if not is_inner.any() and len(areas) > 1:
        return None
    outermost = np.array(drawing.outlines, dtype=object)[~is_inner].tolist()
    # The outline with the largest filled area may lie inside another one, such as a floor inside a thin ring
    # of walls.
    largest = max(outermost, key=lambda outline: outline.filled_area)
    return _join_outlines(drawing, largest, set(outermost))


def _join_outlines(drawing: Drawing, largest: ClosedOutline, members: set[ClosedOutline]) -> Boundary:
    """Build a boundary from `members`, which are several outlines or the largest one alone."""
    if len(members) == 1:
        source = "the only closed outline"
        if len(drawing.outlines) > 1:
            name = f", {quote(largest.labels[0])}," if largest.labels else ""
            source = f"the largest closed outline{name} of {format_area(largest.filled_area)}"
        return Boundary(largest.area, source, frozenset(members))
    # In the order of the file, because the order of a set differs from run to run.
    areas = [outline.area for outline in drawing.outlines if outline in members]
    joined = close_gaps(areas, drawing.snap)
    source = (
        f"{len(members)} closed outlines that contain the others, together {format_area(joined.area.area)}"
    )
    gaps = joined.describe() if joined.number else ""
    return Boundary(joined.area, source, frozenset(members), gaps=gaps)


def _contains_most(outer: BaseGeometry, inner: Sequence[BaseGeometry]) -> bool:
    """Return whether most of the inner shapes lie in the outer one; one point of each shape decides."""
    shapely.prepare(outer)
    return bool(shapely.covers(outer, shapely.point_on_surface(inner)).mean() > _MAJORITY)


def _unite_exactly(areas: Sequence[BaseGeometry]) -> MultiPolygon:
    """Return the union of areas; a single area is not rounded."""
    areas = [area for area in areas if not area.is_empty]
    if len(areas) == 1:
        return to_multipolygon(areas[0])
    return union_on_grid(areas)
