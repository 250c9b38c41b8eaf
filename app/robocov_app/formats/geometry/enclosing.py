"""The outer boundary of a foreign map."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import GRID
from robocov.errors import MapError, counted, shown
from robocov.mapfile.models import LARGEST
from robocov_app.formats.foreign import ForeignMap
from robocov_app.formats.geometry.polygons import Crossings, polygons_of, united
from robocov_app.formats.geometry.shapes import Line, Outline, Shapes, polygonised

BOUNDARY = "boundary"
"""A shape of this name, id, class or layer is the boundary."""

AROUND = 1.0
"""Room left around the shapes where none of them is the boundary, in metres."""

# a boundary holds more than this part of the other shapes; walls that are one leave so much of it open
_MOST = 0.5
# shapes that are farther from each other, in metres, are of no map: unions of such take seconds
_FARTHEST_PARTS = 10.0 * LARGEST


class _Enclosure(NamedTuple):
    """A boundary that was found: its area with whatever holes it has, and the shapes that made it."""

    area: MultiPolygon
    words: str
    outlines: frozenset[Outline] = frozenset()
    lines: frozenset[Line] = frozenset()


def foreign_map(
    shapes: Shapes,
    format: str,  # noqa: A002 - as of a `ForeignMap`
    name: str,
    description: str,
    *,
    solid: bool,
    accessible: bool = False,
    world: MultiPolygon | None = None,
) -> ForeignMap:
    """Return the map that the shapes of a file stand for.

    Closed outlines are either *free space*, all of them together; or they are *solid*, but for one which is
    the boundary. Lines and pillars are obstacles in both. The boundary is, in this order,

    1. the shape whose name, id, class or layer the option ``boundary`` gives, else the one called "boundary";
       lines of that name are one when they enclose an area; outlines around it are frames, and left out;
    2. the largest closed outline, if it is the only shape, or more than half of the others lie in it;
    3. the outer edge of the walls, if they close and what they enclose is mostly open;
    4. a rectangle around everything, at the distance of the option ``around``.

    `solid`: what closed outlines are unless the option ``outlines`` says it: True is solid; False is free,
    but solid where 1 or 2 (of outlines alone) finds a boundary of others, or where there are only lines.
    `accessible`: outlines may overlap and are all free, as JuPedSim's accessible area: then 2 holds only
    where all others lie wholly in the largest. `world`, m: what is free before the shapes stand in it, where
    the format says so. Raises MapError when there are no shapes, the boundary has no area, or they cross too
    often; ParameterError when a name in the options is none of the file's.
    """
    shapes.require_known_names()
    if world is None and not shapes.outlines and not shapes.lines:
        dropped = f" ({'; '.join(shapes.dropped)} left out)" if shapes.dropped else ""
        raise MapError(f"{shapes.where}: no closed outline and no line{dropped}, but a drawing was wanted")
    everything = [*shapes.areas, *shapes.paths, *([] if world is None else [world])]
    # one of many parts may be a map, if they are not all too far from each other
    _require_size(shapely.total_bounds(everything), shapes.where, _FARTHEST_PARTS)
    # nor may they cross each other so often that what is free among them cannot be computed
    Crossings(shapes.where).add([*shapely.get_rings(shapely.get_parts(shapes.areas)), *shapes.paths])
    asked = shapes.options.outlines
    boundary = _named(shapes) if world is None else _Enclosure(world, "")
    if boundary is None and asked != "free":
        boundary = _largest(shapes, solid or asked == "solid", wholly=accessible and asked is None)
    if asked is not None:
        solid = asked == "solid"
    elif not solid:
        others = boundary is not None and len(shapes.outlines) > len(boundary.outlines)
        solid = not shapes.outlines or others
    if solid:
        boundary = boundary or _walled(shapes) or _rectangle(shapes)
        area = boundary.area
    else:
        area = _together([o.area for o in shapes.outlines if not boundary or o not in boundary.outlines])
        if area.is_empty and boundary is not None:
            area = boundary.area
    if area.is_empty:
        raise MapError(f"{shapes.where}: no closed outline, but one that encloses free space was wanted")
    _require_size(area.geoms[0].bounds, shapes.where)
    used = boundary or _Enclosure(area, "")
    inner = [outline for outline in shapes.outlines if solid and outline not in used.outlines]
    walls = [line for line in shapes.lines if line not in used.lines]
    blocks = np.array([outline.area for outline in inner], dtype=object)
    shapely.prepare(area)
    around = shapely.covered_by(area, blocks)
    solids = [*blocks[~around], *(line.solid for line in walls), *(each.polygon for each in shapes.pillars)]
    outside = int((~shapely.intersects(area, solids)).sum() + around.sum())
    if outside:
        shapes.leave_out("shape", "outside of the boundary", outside)
    free = area
    if solids:
        free = polygons_of(shapely.difference(area, united(solids), grid_size=GRID))
    outer = None
    # what is free of a grid has its own outline
    plain = world is None or (len(world.geoms) == 1 and not world.geoms[0].interiors)
    if boundary is not None and (solid or boundary.area is not area) and plain:
        outer = Polygon(boundary.area.geoms[0].exterior)
    elif (walls or shapes.pillars) and len(area.geoms) == len(free.geoms) == 1:
        # walls that begin at the edge are no part of it
        outer = Polygon(area.geoms[0].exterior)
    return ForeignMap(
        name=name,
        description=description,
        format=format,
        free=free,
        boundary=outer,
        vertices_read=shapes.vertices,
        cell=shapes.cell,
        primitives=(
            *(outline.circle for outline in inner if outline.circle is not None),
            *(wall for line in walls if (wall := line.wall) is not None),
            *shapes.pillars,
        ),
        robots=tuple(shapes.robots),
        repaired=shapes.repaired,
        dropped=shapes.dropped,
        notes=(*shapes.notes, *_words(shapes, solid, boundary, int((~around).sum()))),
    )


def surrounding(shapes: Shapes) -> tuple[MultiPolygon, str]:
    """Return what the shapes enclose as walls, else a rectangle around them, m; and that in words."""
    found = _walled(shapes) or _rectangle(shapes)
    return found.area, f"the boundary is {found.words}"


def _require_size(bounds: Iterable[float], where: str, most: float = LARGEST) -> None:
    """Refuse what no map may be, before it is computed with."""
    x, y, right, top = bounds
    if max(right - x, top - y) > most:
        size = f"{right - x:.6g} x {top - y:.6g} m"
        wanted = f"at most {LARGEST / 1000:g} km was wanted: is the scale right?"
        raise MapError(f"{where}: {size}, but {wanted}")


def _words(shapes: Shapes, solid: bool, boundary: _Enclosure | None, blocks: int) -> list[str]:
    told = [f"the boundary is {boundary.words}"] if boundary and boundary.words and solid else []
    if blocks and (boundary is None or boundary.words):  # else the format says what all of it is
        told.append(f"{counted(blocks, 'closed outline')} taken as solid (--outlines free: as free space)")
    elif not solid and len(shapes.outlines) > 1:
        many = counted(len(shapes.outlines), "closed outline")
        told.append(f"{many} taken as free space (--outlines solid: as obstacles)")
    used = boundary.lines if boundary is not None else ()
    widths = sorted(line.width for line in shapes.lines if line not in used)
    if widths:
        narrow, wide = f"{widths[0]:.3g}", f"{widths[-1]:.3g}"
        span = narrow if narrow == wide else f"{narrow} to {wide}"
        told.append(f"{counted(len(widths), 'line')} taken as walls, {span} m wide (--thickness)")
    if shapes.pillars:
        told.append(f"{counted(len(shapes.pillars), 'point')} taken as pillars")
    return told


def _named(shapes: Shapes) -> _Enclosure | None:
    wanted = shapes.options.boundary
    key = (wanted or BOUNDARY).casefold()
    outlines = frozenset(o for o in shapes.outlines if key in map(str.casefold, o.labels))
    lines = frozenset(line for line in shapes.lines if key in map(str.casefold, line.labels))
    area = _together([*(o.area for o in outlines), polygonised(lines)])
    if area.is_empty:
        if wanted is None:
            return None
        what = f"boundary {shown(wanted)}: encloses no area, but a closed outline was wanted"
        raise MapError(f"{shapes.where}: {what}")
    return _Enclosure(area, f"what is called {shown(wanted or BOUNDARY)}", outlines, lines)


def _largest(shapes: Shapes, solid: bool, *, wholly: bool) -> _Enclosure | None:
    """Return the largest closed outline if most others lie in it, or all wholly; if solid, lines too."""
    if not shapes.outlines:
        return None
    outline = max(shapes.outlines, key=_filled)
    inner = [area for area in shapes.areas if area is not outline.area]
    if solid:
        inner += [*shapes.paths, *(pillar.polygon for pillar in shapes.pillars)]
        # walls as one shape have rooms as holes
        if outline.area.area < _MOST * _filled(outline):
            return None
    if wholly:
        holds = bool(shapely.covers(outline.area, inner).all())
    else:
        holds = not inner or _holds(outline.area, inner)
    if not holds:
        return None
    called = f", {shown(outline.labels[0])}," if outline.labels else ""
    words = f"the largest closed outline{called} of {_filled(outline):.4g} m²"
    return _Enclosure(outline.area, words if inner else "the only closed outline", frozenset([outline]))


def _filled(outline: Outline) -> float:
    return float(sum(Polygon(part.exterior).area for part in outline.area.geoms))


def _walled(shapes: Shapes) -> _Enclosure | None:
    solid = _together([*shapes.areas, *(line.solid for line in shapes.lines)])
    fills = [Polygon(part.exterior) for part in solid.geoms]
    if not fills:  # what there is is thinner than the grid
        return None
    k = int(np.argmax([fill.area for fill in fills]))
    if solid.geoms[k].area > (1.0 - _MOST) * fills[k].area or not _holds(fills[k], list(solid.geoms)):
        return None
    return _Enclosure(MultiPolygon([fills[k]]), f"the outer edge of the walls, around {fills[k].area:.4g} m²")


def _rectangle(shapes: Shapes) -> _Enclosure:
    around = AROUND if shapes.options.around is None else shapes.options.around
    x, y, right, top = shapely.total_bounds([*shapes.areas, *(line.solid for line in shapes.lines)])
    box = shapely.box(x - around, y - around, right + around, top + around)
    words = f"a rectangle {around:g} m around everything (--around): no shape holds the others"
    return _Enclosure(MultiPolygon([box]), words)


def _holds(outer: BaseGeometry, inner: Sequence[BaseGeometry]) -> bool:
    """Return whether most of the inner shapes lie in the outer one, each by a place on it."""
    shapely.prepare(outer)
    return bool(shapely.covers(outer, shapely.point_on_surface(inner)).mean() > _MOST)


def _together(areas: Sequence[BaseGeometry]) -> MultiPolygon:
    """Return areas as one; a single one stays exactly as it is."""
    areas = [area for area in areas if not area.is_empty]
    if len(areas) == 1:
        return polygons_of(areas[0])
    # to unite first and round then takes a tenth of the time
    return polygons_of(shapely.set_precision(united(areas), GRID))
