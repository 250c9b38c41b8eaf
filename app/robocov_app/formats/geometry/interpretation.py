"""What the shapes of a drawing stand for: find the boundary, classify the rest, subtract it, report.

Closed outlines are either *free space*, all of them together; or they are *solid*, except for the boundary.
Lines and pillars are obstacles in both cases. The boundary is, in this order,

1. the shape whose name, id, class or layer the option ``boundary`` gives, or that is called so. Lines of that
   name are one if they enclose an area. Outlines around it are frames, and left out;
2. the largest closed outline, together with what continues it, if it is the only shape, or if more than half
   of the others lie in it. What continues it are the other parts of its geometry, as of one that is cut at
   the antimeridian, and outlines beside it, edge to edge, in which other outlines lie;
3. the outer edge of the walls, if they close and what they enclose is mostly open;
4. a rectangle around everything, at the distance of the option ``around``.

If the colours of a drawing are known, what is painted later covers what was painted before, and what was
declared free is so. Pale fills with something darker painted on them are floors, and so are others of their
colour or of the size of a room; pale fills in the colour of the ground, without a stroke; and all pale fills
on a dark boundary, which is solid itself. With the option ``outlines`` as "nested", outlines are free and
solid by turns, from the outside in.

In drawings whose outlines are free by default, 2 is: all outlines that do not lie in a larger one, if any
does; then those that do are obstacles.

Where walls separate the free space from the boundary found here, it ends at the walls: see
`robocov_app.formats.geometry.conversion`.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov.environment import GRID_M, CircleObstacle
from robocov.errors import MapError, format_count, quote
from robocov.mapfile.models import MAX_SIZE_M
from robocov_app.formats.base import Primitive, ReadOptions, square_metres
from robocov_app.formats.colours import WHITE, count_colours
from robocov_app.formats.geometry.figures import BOUNDARY, ClosedOutline, WallLine
from robocov_app.formats.geometry.painting import (
    PaintLayer,
    alternate,
    find_evident_floors,
    is_dark,
    is_pale,
    uncover,
)
from robocov_app.formats.geometry.polygons import CrossingCounter, to_multipolygon, unite
from robocov_app.formats.geometry.snapping import (
    are_edge_to_edge,
    close_gaps,
    compute_default_snap,
    join_line_ends,
    union_on_grid,
)

DEFAULT_AROUND_M = 1.0  # distance from the shapes to the rectangle around them
MAJORITY = 0.5  # a boundary holds more of the other shapes; walls that are one leave so much of it open
_SAME = 0.999  # of two outlines one of which lies in the other: ratio of areas from which on they are one
_BACKGROUND_SHARE = 0.98  # of the page, which its background covers at least
_MAX_APART_M = 10.0 * MAX_SIZE_M  # shapes farther from each other are of no map: unions take seconds


@dataclass(frozen=True, eq=False)
class Boundary:
    """A boundary that was found.

    Attributes
    ----------
    area : MultiPolygon, m
        With whatever holes it has.
    source : str
        What it is, for the report; empty where the format says what all of it is.
    outlines, lines : frozenset
        The shapes that it is made of.
    is_named : bool
        Whether the file or the user calls it the boundary.
    gaps : str
        What was closed between its outlines, for the report.
    is_guess : bool
        Whether nothing in the drawing marks it.
    """

    area: MultiPolygon
    source: str = ""
    outlines: frozenset[ClosedOutline] = frozenset()
    lines: frozenset[WallLine] = frozenset()
    is_named: bool = False
    gaps: str = ""
    is_guess: bool = False


@dataclass(frozen=True, eq=False)
class Drawing:
    """The shapes of a file.

    Attributes
    ----------
    where : str
        The file, for messages.
    outlines, lines, pillars : sequences
        Pillars are obstacles whatever outlines are.
    world : MultiPolygon or None, m
        What is free before the shapes stand in it, if the format says so.
    options : ReadOptions
    page : Polygon or None, m
        The sheet that was drawn on, a rectangle, if the format says so.
    """

    where: str
    outlines: Sequence[ClosedOutline]
    lines: Sequence[WallLine]
    pillars: Sequence[CircleObstacle]
    options: ReadOptions
    world: MultiPolygon | None = None
    page: Polygon | None = None

    @property
    def areas(self) -> list[BaseGeometry]:
        return [outline.area for outline in self.outlines]

    @property
    def paths(self) -> list[BaseGeometry]:
        return [shapely.linestrings(line.points) for line in self.lines]

    @property
    def snap(self) -> float:
        """The snapping tolerance, m."""
        if self.options.snap is not None:
            return self.options.snap
        return compute_default_snap([*self.areas, *self.paths])


@dataclass(eq=False)
class Interpretation:
    """What a drawing stands for.

    Attributes
    ----------
    free : MultiPolygon, m
    boundary : MultiPolygon or None, m
        As of `ForeignMap`.
    has_named_boundary : bool
    boundary_source : str
        What the boundary is, for the report.
    primitives : tuple of obstacles
    outside : int
        Number of shapes outside of the boundary.
    page : Polygon or None, m
        As of `ForeignMap`.
    repaired, notes : list of str
        Lines for the report.
    """

    free: MultiPolygon
    boundary: MultiPolygon | None
    has_named_boundary: bool
    boundary_source: str
    primitives: tuple[Primitive, ...]
    outside: int
    page: Polygon | None = None
    repaired: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def interpret(drawing: Drawing, *, solid: bool, overlap: bool) -> Interpretation:
    """Return what a drawing stands for.

    Parameters
    ----------
    drawing : Drawing
    solid : bool
        What closed outlines are unless the option ``outlines`` says it. True: solid. False: free, but solid
        where 1 or 2 of the rules above finds a boundary of others, or where there are only lines.
    overlap : bool
        Outlines may overlap and are all free, as JuPedSim's accessible areas: then 2 holds only if all others
        lie wholly in the largest one.

    Raises
    ------
    MapError
        If the boundary has no area, or shapes are too far apart or cross too often.
    """
    _require_measurable(drawing)
    report = _Report()
    boundary = find_boundary(drawing, solid=solid, overlap=overlap)
    are_solid = _are_solid(drawing, boundary, solid=solid)
    nested = None
    if drawing.options.outlines == "nested":
        nested = _find_nested_areas(drawing, boundary, report)
    if nested is not None:
        boundary = nested.boundary
    floors = _find_floors(drawing, boundary, report, are_solid=are_solid)
    if are_solid and boundary is None:
        boundary = find_surrounding(drawing, floors.outlines)
    region = _find_region(drawing, boundary, report, are_solid=are_solid)
    if region.is_empty:
        found = "no closed outline, expected one that encloses free space"
        raise MapError(f"{drawing.where}: {found}")
    require_size(region.geoms[0].bounds, drawing.where)
    if nested is not None:
        obstacles = _find_obstacles(drawing, boundary, region, floors, are_solid=False)
        ground: PaintLayer | None = nested.solid
    else:
        obstacles = _find_obstacles(drawing, boundary, region, floors, are_solid=are_solid)
        ground = _find_ground(boundary, region, floors)
    coats = obstacles.coats if ground is None else [*obstacles.coats, ground]
    free = _subtract(region, uncover(coats, floors.coats))
    report.describe(drawing, boundary, obstacles, are_solid=are_solid)
    return Interpretation(
        free=free,
        boundary=_choose_outer(drawing, boundary, region, free, obstacles, are_solid=are_solid),
        has_named_boundary=boundary is not None and boundary.is_named,
        boundary_source=boundary.source if boundary is not None and are_solid else "",
        primitives=obstacles.primitives,
        outside=obstacles.outside,
        page=drawing.page if _is_background(drawing, boundary) else None,
        repaired=report.repaired,
        notes=report.notes,
    )


def require_size(bounds: Iterable[float], where: str, maximum: float = MAX_SIZE_M) -> None:
    """Raise MapError where bounds, m, are larger than any map."""
    x, y, right, top = bounds
    if max(right - x, top - y) > maximum:
        wanted = f"expected at most {MAX_SIZE_M / 1000:g} km"
        raise MapError(f"{where}: {wanted}, got {right - x:.6g} x {top - y:.6g} m: is the scale right?")


def _require_measurable(drawing: Drawing) -> None:
    """Raise MapError where shapes are too far apart, or cross too often, for their union to be computed."""
    everything = [*drawing.areas, *drawing.paths]
    if drawing.world is not None:
        everything.append(drawing.world)
    # one of many parts may be a map, if they are not all too far from each other
    require_size(shapely.total_bounds(everything), drawing.where, _MAX_APART_M)
    rings = shapely.get_rings(shapely.get_parts(drawing.areas))
    CrossingCounter(drawing.where).add([*rings, *drawing.paths])


# --- the boundary ---------------------------------------------------------------------------------------


def find_boundary(drawing: Drawing, *, solid: bool, overlap: bool) -> Boundary | None:
    """Return the boundary by the format, by name, or by what lies in it; None where nothing is one."""
    if drawing.world is not None:
        return Boundary(drawing.world)
    named = _find_named(drawing)
    asked = drawing.options.outlines
    if named is not None or asked in ("free", "nested") or not drawing.outlines:
        return named
    if asked == "solid" or solid:
        return _find_largest(drawing, with_walls=True)
    if overlap:
        return _find_covering(drawing)
    return _find_outermost(drawing)


def _find_named(drawing: Drawing) -> Boundary | None:
    """Return what is called the boundary; MapError where the user names one that encloses nothing."""
    wanted = drawing.options.boundary
    key = (wanted or BOUNDARY).casefold()
    outlines = frozenset(each for each in drawing.outlines if key in map(str.casefold, each.labels))
    lines = frozenset(each for each in drawing.lines if key in map(str.casefold, each.labels))
    # in the order of the file: a set has another one each time
    paths = [LineString(line.points) for line in drawing.lines if line in lines]
    noded = shapely.union_all(join_line_ends(paths, drawing.snap))
    rooms = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    areas = [outline.area for outline in drawing.outlines if outline in outlines]
    area = _unite([*areas, shapely.union_all(rooms)])
    if not area.is_empty:
        return Boundary(area, f"what is called {quote(wanted or BOUNDARY)}", outlines, lines, is_named=True)
    if wanted is not None:
        found = "encloses no area, expected a closed outline"
        raise MapError(f"{drawing.where}: boundary {quote(wanted)}: {found}")
    return None


def _find_largest(drawing: Drawing, *, with_walls: bool) -> Boundary | None:
    """Return the largest outline, and what continues it, if most other shapes lie in it."""
    largest = max(drawing.outlines, key=lambda outline: outline.filled_area)
    # walls as one shape have rooms as holes
    if with_walls and largest.area.area < MAJORITY * largest.filled_area:
        return None
    members = _find_continuation(drawing, largest)
    inner = [outline.area for outline in drawing.outlines if outline not in members]
    if with_walls:
        inner += [*drawing.paths, *(pillar.polygon for pillar in drawing.pillars)]
    if not inner and len(members) > 1:
        return None
    boundary = _join_outlines(drawing, largest, members)
    return boundary if not inner or _holds(boundary.area, inner) else None


def _find_continuation(drawing: Drawing, largest: ClosedOutline) -> set[ClosedOutline]:
    """Return the largest outline, the parts of its geometry, and outlines beside it that hold others."""
    outlines = np.array(drawing.outlines, dtype=object)
    areas = np.array(drawing.areas, dtype=object)
    tree = STRtree(areas)
    holders = _find_holders(areas, tree)
    members = {largest}
    fresh = [largest]
    while fresh:
        current = fresh.pop()
        near = np.sort(tree.query(current.area, "dwithin", distance=drawing.snap))
        for k in near.tolist():
            other: ClosedOutline = outlines[k]
            belongs = k in holders or (other.whole != "" and other.whole == largest.whole)
            if other in members or not belongs:
                continue
            if are_edge_to_edge(current.area, other.area, drawing.snap):
                members.add(other)
                fresh.append(other)
    return members


def _find_holders(areas: Array, tree: STRtree) -> set[int]:
    """Return which areas another area lies in."""
    inner, outer = _find_nested(areas, tree)
    return set(outer[inner != outer].tolist())


def _find_nested(areas: Array, tree: STRtree) -> tuple[Array, Array]:
    """Return pairs of areas, by number, of which more than half of the first lies in the larger second."""
    inner, outer = tree.query(areas, "intersects")
    size = shapely.area(areas)
    smaller = size[inner] < _SAME * size[outer]
    inner, outer = inner[smaller], outer[smaller]
    shared = shapely.area(shapely.intersection(areas[inner], areas[outer]))
    is_nested = shared > MAJORITY * size[inner]
    return inner[is_nested], outer[is_nested]


def _find_covering(drawing: Drawing) -> Boundary | None:
    """Return the largest outline if all others lie wholly in it."""
    largest = max(drawing.outlines, key=lambda outline: outline.filled_area)
    members = {each for each in drawing.outlines if each.whole != "" and each.whole == largest.whole}
    if len(members) == len(drawing.outlines):
        members = set()
    members.add(largest)
    inner = [outline.area for outline in drawing.outlines if outline not in members]
    boundary = _join_outlines(drawing, largest, members)
    return boundary if shapely.covers(boundary.area, inner).all() else None


def _find_outermost(drawing: Drawing) -> Boundary | None:
    """Return the outlines that do not lie in a larger one, if any other does or if there is only one."""
    areas = np.array(drawing.areas, dtype=object)
    inner, _ = _find_nested(areas, STRtree(areas))
    lies_in_another = np.zeros(len(areas), dtype=bool)
    lies_in_another[inner] = True
    if not lies_in_another.any() and len(areas) > 1:
        return None
    members = set(np.array(drawing.outlines, dtype=object)[~lies_in_another])
    largest = max(drawing.outlines, key=lambda outline: outline.filled_area)
    return _join_outlines(drawing, largest, members)


def _join_outlines(drawing: Drawing, largest: ClosedOutline, members: set[ClosedOutline]) -> Boundary:
    """Return a boundary of several outlines, one of which is the largest, or of that one alone."""
    if len(members) == 1:
        called = f", {quote(largest.labels[0])}," if largest.labels else ""
        source = f"the largest closed outline{called} of {largest.filled_area:.4g} m²"
        if len(drawing.outlines) == 1:
            source = "the only closed outline"
        return Boundary(largest.area, source, frozenset(members))
    # in the order of the file: a set has another one each time
    areas = [outline.area for outline in drawing.outlines if outline in members]
    joined = close_gaps(areas, drawing.snap)
    source = f"{len(members)} closed outlines that hold the others, together {joined.area.area:.4g} m²"
    gaps = joined.describe() if joined.number else ""
    return Boundary(joined.area, source, frozenset(members), gaps=gaps)


def find_surrounding(drawing: Drawing, floors: frozenset[ClosedOutline] = frozenset()) -> Boundary:
    """Return what the shapes except for floors enclose as walls, else a rectangle around everything."""
    everything = [*drawing.areas, *(line.solid for line in drawing.lines)]
    edges = [edge for outline in drawing.outlines if outline in floors for edge in outline.edges]
    lines = [line for line in (*drawing.lines, *edges) if line.role != "free"]
    areas = [outline.area for outline in drawing.outlines if outline not in floors]
    solid = _unite([*areas, *(line.solid for line in lines)])
    fills = [Polygon(part.exterior) for part in solid.geoms]
    if fills:  # else what there is is thinner than the grid
        k = int(np.argmax([fill.area for fill in fills]))
        fill = fills[k]
        is_open = solid.geoms[k].area <= (1.0 - MAJORITY) * fill.area
        if is_open and _holds(fill, list(solid.geoms)):
            return Boundary(MultiPolygon([fill]), f"the outer edge of the walls, around {fill.area:.4g} m²")
    around = DEFAULT_AROUND_M if drawing.options.around is None else drawing.options.around
    x, y, right, top = shapely.total_bounds(everything)
    box = shapely.box(x - around, y - around, right + around, top + around)
    source = f"a rectangle {around:g} m around everything (--around): no shape holds the others"
    return Boundary(MultiPolygon([box]), source, is_guess=True)


def _holds(outer: BaseGeometry, inner: Sequence[BaseGeometry]) -> bool:
    """Return whether most of the inner shapes lie in the outer one, each by a place on it."""
    shapely.prepare(outer)
    return bool(shapely.covers(outer, shapely.point_on_surface(inner)).mean() > MAJORITY)


def _unite(areas: Sequence[BaseGeometry]) -> MultiPolygon:
    """Return areas as one; a single one stays exactly as it is."""
    areas = [area for area in areas if not area.is_empty]
    if len(areas) == 1:
        return to_multipolygon(areas[0])
    return union_on_grid(areas)


# --- what is free, and what stands in it ----------------------------------------------------------------


def _are_solid(drawing: Drawing, boundary: Boundary | None, *, solid: bool) -> bool:
    """Return whether closed outlines are solid, except for the boundary."""
    if drawing.options.outlines is not None:
        return drawing.options.outlines != "free"
    if solid or not drawing.outlines:
        return True
    return boundary is not None and len(drawing.outlines) > len(boundary.outlines)


def _find_region(
    drawing: Drawing, boundary: Boundary | None, report: "_Report", *, are_solid: bool
) -> MultiPolygon:
    """Return what would be free without any obstacle, m."""
    if are_solid:
        assert boundary is not None
        return boundary.area
    used = frozenset() if boundary is None else boundary.outlines
    outlines = [outline for outline in drawing.outlines if outline.role != "solid"]
    areas = [outline.area for outline in outlines if outline not in used]
    if not areas:
        return MultiPolygon() if boundary is None else boundary.area
    return report.count_gaps(areas, drawing.snap)


@dataclass(frozen=True, eq=False)
class _Floors:
    """Outlines that are free among solid ones, and the paint that uncovers what is below it.

    `is_slab`: whether the boundary is solid itself, except for the floors on it.
    """

    outlines: frozenset[ClosedOutline]
    coats: Sequence[PaintLayer]
    is_slab: bool = False


def _find_floors(
    drawing: Drawing, boundary: Boundary | None, report: "_Report", *, are_solid: bool
) -> _Floors:
    """Return the floors of a drawing: what was declared free, and where nothing was, what is pale."""
    used = frozenset() if boundary is None else boundary.outlines
    others = [outline for outline in drawing.outlines if outline not in used]
    chosen = {outline for outline in others if outline.role == "free"}
    is_slab = are_solid and boundary is not None and _is_slab(drawing, boundary)
    if are_solid and drawing.options.outlines is None:
        chosen |= _find_pale_floors(drawing, boundary, others, report, is_slab=is_slab)
    coats = [outline.coat for outline in others if outline in chosen]
    coats += [line.coat for line in drawing.lines if line.role == "free"]
    return _Floors(frozenset(chosen), coats, is_slab)


def _is_slab(drawing: Drawing, boundary: Boundary) -> bool:
    """Return whether a boundary is a dark area that pale floors are painted on, or declared solid."""
    if boundary.is_named or len(boundary.outlines) != 1:
        return False
    (outline,) = boundary.outlines
    if outline.role is not None:
        return outline.role == "solid"
    later = [each for each in drawing.outlines if each.order > outline.order and each.role != "solid"]
    return is_dark(outline.colour) and any(is_pale(each.colour) for each in later)


def _find_pale_floors(
    drawing: Drawing,
    boundary: Boundary | None,
    outlines: Sequence[ClosedOutline],
    report: "_Report",
    *,
    is_slab: bool,
) -> set[ClosedOutline]:
    """Return the outlines that are floors by their colour, and report all that is pale."""
    undecided = [outline for outline in outlines if outline.role is None and outline.colour is not None]
    chosen = [outline for outline in undecided if is_slab and is_pale(outline.colour)]
    if not is_slab:
        marks = [outline.coat for outline in outlines]
        lines = [*drawing.lines, *(edge for outline in outlines for edge in outline.edges)]
        marks += [PaintLayer(LineString(line.points), line.order, line.colour) for line in lines]
        evident = find_evident_floors([outline.coat for outline in undecided], marks)
        chosen = [outline for outline, is_floor in zip(undecided, evident, strict=True) if is_floor]
        chosen += [each for each in undecided if each not in chosen and _is_unseen(each, boundary)]
    left = [outline for outline in undecided if outline not in chosen]
    pale = [outline.colour for outline in left if is_pale(outline.colour)]
    pale += [line.colour for line in drawing.lines if line.role is None and is_pale(line.colour)]
    if chosen:
        why = "on a dark ground" if is_slab else "as darker paint lies on such"
        if not is_slab and not any(evident):
            why = "in the colour of the ground"
        counts = count_colours(outline.colour for outline in chosen)
        report.notes.append(f"pale fills taken as floor: {counts} {why} (--solid-colour: as obstacles)")
    if pale:
        counts = count_colours(pale)
        report.notes.append(f"pale paint taken as solid: {counts} (--free-colour: as free space)")
    return set(chosen)


def _is_unseen(outline: ClosedOutline, boundary: Boundary | None) -> bool:
    """Return whether an outline has the pale colour of the ground and no stroke: it only covers others."""
    ground = [] if boundary is None else [each.colour for each in boundary.outlines]
    return is_pale(outline.colour) and not outline.edges and outline.colour in (ground or [WHITE])


def _find_ground(boundary: Boundary | None, region: MultiPolygon, floors: _Floors) -> PaintLayer | None:
    """Return the region as paint where only what is painted as a floor is free."""
    if boundary is None:
        return None
    has_declared = any(outline.role == "free" for outline in floors.outlines)
    if floors.is_slab or (boundary.is_guess and has_declared):
        order = min((outline.order for outline in boundary.outlines), default=-1)
        return PaintLayer(region, order)
    return None


def _is_background(drawing: Drawing, boundary: Boundary | None) -> bool:
    """Return whether the boundary is a filled rectangle without a stroke, as large as the page."""
    if drawing.page is None or boundary is None or boundary.is_named or len(boundary.outlines) != 1:
        return False
    (outline,) = boundary.outlines
    is_plain = not outline.edges and outline.role is None and not is_dark(outline.colour)
    covered = shapely.intersection(outline.area, drawing.page).area
    return is_plain and covered > _BACKGROUND_SHARE * drawing.page.area


@dataclass(frozen=True, eq=False)
class _Nested:
    """A boundary in which outlines are free and solid by turns, and what is solid in it."""

    boundary: Boundary
    solid: PaintLayer


def _find_nested_areas(drawing: Drawing, boundary: Boundary | None, report: "_Report") -> _Nested | None:
    """Return what outlines are by turns; None where there are none."""
    used = frozenset() if boundary is None else boundary.outlines
    areas = [each.area for each in drawing.outlines if each not in used and each.role is None]
    if not areas:
        return None
    odd, even = alternate(areas)
    if boundary is not None:
        report.notes.append("what lies in an odd number of outlines within the boundary is solid")
        return _Nested(boundary, PaintLayer(odd, -1))
    is_odd_free = odd.area >= even.area
    free, solid = (odd, even) if is_odd_free else (even, odd)
    whole = to_multipolygon(unite([Polygon(part.exterior) for part in (*odd.geoms, *even.geoms)]))
    number = "an odd number" if is_odd_free else "an even number"
    size = square_metres(free.area, 3)
    report.notes.append(f"what lies in {number} of outlines is free, {size}, as the larger area")
    return _Nested(Boundary(whole, "the outermost outlines"), PaintLayer(solid, -1))


@dataclass(frozen=True, eq=False)
class _Obstacles:
    """What stands in a region: outlines, lines and pillars, and the paint of all of them.

    `outside`: number of shapes that do not meet the region, and of outlines around all of it.
    """

    outlines: Sequence[ClosedOutline]
    walls: Sequence[WallLine]
    pillars: Sequence[CircleObstacle]
    coats: Sequence[PaintLayer]
    count: int
    outside: int

    @property
    def primitives(self) -> tuple[Primitive, ...]:
        """The circles and walls, as obstacles of a map."""
        circles = (outline.circle for outline in self.outlines if outline.circle is not None)
        straight = (wall for line in self.walls if (wall := line.wall) is not None)
        return (*circles, *straight, *self.pillars)


def _find_obstacles(
    drawing: Drawing, boundary: Boundary | None, region: MultiPolygon, floors: _Floors, *, are_solid: bool
) -> _Obstacles:
    """Return what stands in a region, m, that has the given boundary."""
    used = Boundary(region) if boundary is None else boundary
    others = [each for each in drawing.outlines if each not in used.outlines and each not in floors.outlines]
    outlines = [each for each in others if are_solid or each.role == "solid"]
    edges = [edge for outline in drawing.outlines if outline in floors.outlines for edge in outline.edges]
    lines = [line for line in drawing.lines if line not in used.lines]
    walls = [line for line in (*lines, *edges) if line.role != "free"]
    blocks = np.array([outline.area for outline in outlines], dtype=object)
    shapely.prepare(region)
    is_frame = shapely.covered_by(region, blocks)
    coats = [outline.coat for outline, frames in zip(outlines, is_frame, strict=True) if not frames]
    coats += [line.coat for line in walls]
    # pillars are drawn by no paint that could be covered
    coats += [PaintLayer(pillar.polygon, np.inf) for pillar in drawing.pillars]
    outside = int((~shapely.intersects(region, [coat.area for coat in coats])).sum() + is_frame.sum())
    count = int((~is_frame).sum())
    return _Obstacles(outlines, walls, drawing.pillars, coats, count, outside)


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
    """Return the boundary of the map, without holes; None where it is the outline of what is free."""
    world = drawing.world
    # what is free of a grid has its own outline
    is_grid = world is not None and (len(world.geoms) > 1 or len(world.geoms[0].interiors) > 0)
    if boundary is not None and not is_grid and (are_solid or boundary.area is not region):
        return _fill(boundary.area)
    stands = bool(obstacles.walls or obstacles.pillars)
    if stands and len(region.geoms) == len(free.geoms) == 1:
        # walls that begin at the edge are no part of it
        return _fill(region)
    return None


def _fill(area: MultiPolygon) -> MultiPolygon:
    return MultiPolygon([Polygon(part.exterior) for part in area.geoms])


class _Report:
    """Lines for the report of an import."""

    def __init__(self) -> None:
        self.repaired: list[str] = []
        self.notes: list[str] = []

    def count_gaps(self, areas: Sequence[BaseGeometry], snap: float) -> MultiPolygon:
        """Return areas as one, and report the hairline gaps between them that were closed."""
        joined = close_gaps(areas, snap)
        if joined.number:
            self.repaired.append(joined.describe())
        return joined.area

    def describe(
        self, drawing: Drawing, boundary: Boundary | None, obstacles: _Obstacles, *, are_solid: bool
    ) -> None:
        """Report what the boundary is, and what the other shapes were taken for."""
        if boundary is not None and boundary.gaps:
            self.repaired.append(boundary.gaps)
        # where the format says what all of it is, outlines need no word
        is_found = boundary is None or boundary.source != ""
        if is_found and obstacles.count:
            many = format_count(obstacles.count, "closed outline")
            self.notes.append(f"{many} taken as solid (--outlines free: as free space)")
        elif not are_solid and len(drawing.outlines) > 1:
            many = format_count(len(drawing.outlines), "closed outline")
            self.notes.append(f"{many} taken as free space (--outlines solid: as obstacles)")
        if obstacles.walls:
            widths = [width for line in obstacles.walls for width in line.measure_widths()]
            narrow, wide = f"{min(widths):.3g}", f"{max(widths):.3g}"
            span = narrow if narrow == wide else f"{narrow} to {wide}"
            many = format_count(len(obstacles.walls), "line")
            self.notes.append(f"{many} taken as walls, {span} m wide (--thickness)")
        if obstacles.pillars:
            self.notes.append(f"{format_count(len(obstacles.pillars), 'point')} taken as pillars")
