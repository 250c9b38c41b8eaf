"""Interpretation of a drawing: find the boundary, classify the other shapes, and subtract the obstacles.

Closed outlines are either all *free space*, or they are all *solid*, except for the boundary.
Lines and pillars are obstacles in both cases. The boundary is, in this order,

1. the shape whose name, id, class or layer is that of the option ``boundary``, or else "boundary". Lines of
   that name are the boundary if they enclose an area. Outlines around the boundary are frames, and left out;
2. the largest closed outline, with its continuations, if it is the only shape, or if it contains more than
   half of the others. Continuations are other parts of its geometry, as when it is cut at the antimeridian,
   and outlines next to it, edge to edge, that contain other outlines;
3. the outer edge of the walls, if they enclose an area that is mostly open;
4. a rectangle around everything, at the distance of the option ``around``.

If the colors of a drawing are known, a fill covers the shapes that were painted before it, and fills of a
color that the user declares free are free. Pale fills are free, as floors, in three cases: something darker
is painted on them, or they have the color of such a fill or the size of a room; they have the color of the
background and no stroke; or the boundary is dark, which makes the boundary itself solid. If the option
``outlines`` is "nested", outlines are alternately free and solid, from the outside in.

In drawings whose outlines are free by default, rule 2 is different: if some outlines lie in larger ones, the
boundary consists of all outlines that are not in another one, and those that are become obstacles.

If walls separate the free space from the boundary, the map ends at the walls: see
`geometry.conversion.environment`.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import compress

import numpy as np
import shapely
from shapely import MultiPolygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import GRID_M, CircleObstacle
from robocov.errors import MapError, format_count
from robocov.mapfile.models import MAX_SIZE_M
from robocov_app.formats.foreign_map import Primitive
from robocov_app.formats.geometry.crossings import CrossingCounter
from robocov_app.formats.geometry.polygons import to_multipolygon, unite
from robocov_app.formats.geometry.shapes.boundary_search import find_boundary, find_surrounding
from robocov_app.formats.geometry.shapes.drawings import (
    Boundary,
    Drawing,
    Interpretation,
    InterpretationReport,
    fill_area_holes,
    get_outlines,
)
from robocov_app.formats.geometry.shapes.drawn_shapes import ClosedOutline, WallLine
from robocov_app.formats.geometry.shapes.floors import (
    Floors,
    build_solid_layer,
    find_floors,
    find_nested_areas,
    is_background,
)
from robocov_app.formats.geometry.shapes.painting import PaintLayer, uncover

_MAX_EXTENT_M = 10.0 * MAX_SIZE_M
"""Maximum extent of all shapes together. Shapes farther apart cannot be one map."""


def interpret(drawing: Drawing, *, solid: bool, overlap: bool) -> Interpretation:
    """Interpret a drawing by the rules in the docstring of this module.

    Parameters
    ----------
    drawing : Drawing
    solid : bool
        Whether the format draws closed outlines as solid; the option ``outlines`` takes precedence. If False,
        outlines are free, except for those within a boundary that rule 1 or 2 finds.
    overlap : bool
        Whether outlines may overlap and all count as free, as in JuPedSim's accessible areas. Rule 2 then
        applies only if the largest outline contains all others entirely.

    Returns
    -------
    Interpretation

    Raises
    ------
    MapError
        If the boundary has no area, or if shapes are too far apart or cross too often.
    """
    _require_measurable(drawing)
    report = InterpretationReport()
    boundary = find_boundary(drawing, solid=solid, overlap=overlap)
    are_solid = _are_solid(drawing, boundary, solid=solid)
    nested = None
    if drawing.options.outlines == "nested":
        nested = find_nested_areas(drawing, boundary, report)
    if nested is not None:
        boundary = nested.boundary
    floors = find_floors(drawing, boundary, report, are_solid=are_solid)
    if are_solid and boundary is None:
        boundary = find_surrounding(drawing, floors.outlines)
    region = _build_region(drawing, boundary, report, are_solid=are_solid)
    if nested is None:
        obstacles = _find_obstacles(drawing, boundary, region, floors, are_solid=are_solid)
        solid_layer = build_solid_layer(boundary, region, floors)
    else:
        obstacles = _find_obstacles(drawing, boundary, region, floors, are_solid=False)
        solid_layer = nested.solid
    layers = [*obstacles.layers]
    if solid_layer is not None:
        layers.append(solid_layer)
    free = _subtract(region, uncover(layers, floors.layers))
    _describe(drawing, boundary, obstacles, report, are_solid=are_solid)
    return Interpretation(
        free=free,
        boundary=_choose_outer(drawing, boundary, region, free, obstacles, are_solid=are_solid),
        has_named_boundary=boundary is not None and boundary.is_named,
        boundary_source=boundary.source if boundary is not None and are_solid else "",
        primitives=obstacles.primitives,
        outside=obstacles.outside_count,
        page=drawing.page if is_background(drawing, boundary) else None,
        repaired=report.repaired,
        notes=report.notes,
    )


def require_size(bounds: Iterable[float], source_name: str, maximum: float = MAX_SIZE_M) -> None:
    """Raise MapError if bounds (left, bottom, right, top), m, are larger than a map may be."""
    x, y, right, top = bounds
    if max(right - x, top - y) > maximum:
        expected = f"expected at most {MAX_SIZE_M / 1000:g} km"
        raise MapError(
            f"{source_name}: {expected}, got {right - x:.6g} x {top - y:.6g} m: is the scale right?"
        )


def _require_measurable(drawing: Drawing) -> None:
    """Raise MapError if shapes are too far apart or cross too often to compute their union in time."""
    everything = [*drawing.areas, *drawing.paths]
    if drawing.world is not None:
        everything.append(drawing.world)
    # The shapes may extend beyond the size of a map, because only one of several parts need become the map.
    require_size(shapely.total_bounds(everything), drawing.source_name, _MAX_EXTENT_M)
    rings = shapely.get_rings(shapely.get_parts(drawing.areas))
    CrossingCounter(drawing.source_name).add([*rings, *drawing.paths])


def _are_solid(drawing: Drawing, boundary: Boundary | None, *, solid: bool) -> bool:
    """Return whether closed outlines are solid, except for the boundary."""
    if drawing.options.outlines is not None:
        return drawing.options.outlines != "free"
    if solid or not drawing.outlines:
        return True
    return boundary is not None and len(drawing.outlines) > len(boundary.outlines)


def _build_region(
    drawing: Drawing, boundary: Boundary | None, report: InterpretationReport, *, are_solid: bool
) -> MultiPolygon:
    """Return the area that would be free without obstacles, m; raise MapError if it is empty."""
    if are_solid:
        assert boundary is not None
        region = boundary.area
    else:
        used = get_outlines(boundary)
        outlines = [outline for outline in drawing.outlines if outline.role != "solid"]
        areas = [outline.area for outline in outlines if outline not in used]
        region = MultiPolygon()
        if areas:
            region = report.join_areas(areas, drawing.snap)
        elif boundary is not None:
            region = boundary.area
    if region.is_empty:
        message = "expected a closed outline around free space, got none"
        raise MapError(f"{drawing.source_name}: {message}")
    require_size(region.geoms[0].bounds, drawing.source_name)
    return region


@dataclass(frozen=True, eq=False)
class _Obstacles:
    """Obstacles in a region.

    Attributes
    ----------
    outlines : sequence of ClosedOutline
    walls : sequence of WallLine
    pillars : sequence of CircleObstacle
    layers : sequence of PaintLayer
        The paint of all obstacles.
    outline_count : int
        Number of outlines, without those that surround the whole region.
    outside_count : int
        Number of shapes outside the region, and of outlines that surround all of it.
    """

    outlines: Sequence[ClosedOutline]
    walls: Sequence[WallLine]
    pillars: Sequence[CircleObstacle]
    layers: Sequence[PaintLayer]
    outline_count: int
    outside_count: int

    @property
    def primitives(self) -> tuple[Primitive, ...]:
        """The circles, walls and pillars as obstacles of a map."""
        circles = [outline.circle for outline in self.outlines if outline.circle is not None]
        walls = [wall for line in self.walls if (wall := line.wall) is not None]
        return (*circles, *walls, *self.pillars)


def _find_obstacles(
    drawing: Drawing, boundary: Boundary | None, region: MultiPolygon, floors: Floors, *, are_solid: bool
) -> _Obstacles:
    """Collect the obstacles inside a region. `boundary` is None if the drawing has no boundary.

    Outlines are obstacles if `are_solid`; otherwise only those whose color the user declared solid are.
    """
    region_boundary = Boundary(region) if boundary is None else boundary
    excluded = region_boundary.outlines | floors.outlines
    candidates = [outline for outline in drawing.outlines if outline not in excluded]
    outlines = [outline for outline in candidates if are_solid or outline.role == "solid"]
    # A floor is free, but the line around it is a wall.
    edges = [edge for outline in drawing.outlines if outline in floors.outlines for edge in outline.edges]
    lines = [line for line in drawing.lines if line not in region_boundary.lines]
    walls = [line for line in (*lines, *edges) if line.role != "free"]
    areas = np.array([outline.area for outline in outlines], dtype=object)
    shapely.prepare(region)
    # An outline that covers the whole region is a frame around the map, not an obstacle in it.
    is_frame = shapely.covered_by(region, areas)
    layers = [outline.paint_layer for outline in compress(outlines, ~is_frame)]
    layers += [line.paint_layer for line in walls]
    # Nothing is painted over pillars, so their order is infinite.
    layers += [PaintLayer(pillar.polygon, np.inf) for pillar in drawing.pillars]
    is_inside = shapely.intersects(region, [layer.area for layer in layers])
    return _Obstacles(
        outlines=outlines,
        walls=walls,
        pillars=drawing.pillars,
        layers=layers,
        outline_count=int((~is_frame).sum()),
        outside_count=int((~is_inside).sum() + is_frame.sum()),
    )


def _subtract(region: MultiPolygon, solids: Sequence[BaseGeometry]) -> MultiPolygon:
    if not solids:
        return region
    return to_multipolygon(shapely.difference(region, unite(solids), grid_size=GRID_M))


def _choose_outer(
    drawing: Drawing,
    boundary: Boundary | None,
    region: MultiPolygon,
    free: MultiPolygon,
    obstacles: _Obstacles,
    *,
    are_solid: bool,
) -> MultiPolygon | None:
    """Return the boundary of the map without holes, or None if it is the outline of the free space."""
    world = drawing.world
    # A free space with holes or several parts comes from a grid; its outline is the boundary.
    is_grid = world is not None and (len(world.geoms) > 1 or len(world.geoms[0].interiors) > 0)
    if boundary is not None and not is_grid and (are_solid or boundary.area is not region):
        return fill_area_holes(boundary.area)
    has_walls = bool(obstacles.walls or obstacles.pillars)
    if has_walls and len(region.geoms) == len(free.geoms) == 1:
        # Walls that start at the edge cut notches into the free space; they are not part of the boundary.
        return fill_area_holes(region)
    return None


def _describe(
    drawing: Drawing,
    boundary: Boundary | None,
    obstacles: _Obstacles,
    report: InterpretationReport,
    *,
    are_solid: bool,
) -> None:
    """Report gaps that were closed in the boundary, and the interpretation of the other shapes."""
    if boundary is not None and boundary.gaps:
        report.repaired.append(boundary.gaps)
    # If the format defines the boundary, it also defines what outlines are: no note is needed.
    is_found = boundary is None or boundary.source != ""
    if is_found and obstacles.outline_count:
        count = format_count(obstacles.outline_count, "closed outline")
        report.notes.append(f"{count} treated as solid (--outlines free: as free space)")
    elif not are_solid and len(drawing.outlines) > 1:
        count = format_count(len(drawing.outlines), "closed outline")
        report.notes.append(f"{count} treated as free space (--outlines solid: as obstacles)")
    if obstacles.walls:
        lines = format_count(len(obstacles.walls), "line")
        walls = "a wall" if len(obstacles.walls) == 1 else "walls"
        widths = _format_widths(obstacles.walls)
        report.notes.append(f"{lines} treated as {walls}, {widths} m wide (--thickness)")
    if obstacles.pillars:
        points = format_count(len(obstacles.pillars), "point")
        pillars = "a pillar" if len(obstacles.pillars) == 1 else "pillars"
        report.notes.append(f"{points} treated as {pillars}")


def _format_widths(walls: Sequence[WallLine]) -> str:
    widths = [width for line in walls for width in line.measure_widths()]
    narrowest = f"{min(widths):.3g}"
    widest = f"{max(widths):.3g}"
    return narrowest if narrowest == widest else f"{narrowest} to {widest}"
