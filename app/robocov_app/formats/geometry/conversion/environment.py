"""Conversion of a foreign map of any format to an environment."""

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from robocov.environment import Environment
from robocov.errors import MapError, format_area, format_count, to_one_line
from robocov.mapfile import from_json, to_json
from robocov.mapfile.check import MANY_VERTICES, count_vertices, describe_vertex_count
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.cells.corners import sharpen_corners
from robocov_app.formats.geometry.conversion.cleaning import Cleaned, remove_hairs
from robocov_app.formats.geometry.conversion.conversion_options import Conversion, Shaping
from robocov_app.formats.geometry.conversion.deviation import Deviation, measure_deviation
from robocov_app.formats.geometry.conversion.free_parts import PartSelection, drop_specks, select_parts
from robocov_app.formats.geometry.conversion.map_layout import (
    MapLayout,
    build_layout,
    build_polygon_obstacles,
    normalize_ring,
)
from robocov_app.formats.geometry.conversion.primitives import restore_primitives
from robocov_app.formats.geometry.conversion.starts import (
    build_starts,
    find_center_regions,
    require_clearance,
)
from robocov_app.formats.geometry.conversion.validity import build_valid_boundary, build_valid_free_space
from robocov_app.formats.geometry.polygons import round_polygons
from robocov_app.formats.geometry.simplification.simplify import SimplifiedSpace, simplify_free_space
from robocov_app.formats.reports import ImportReport

MAX_OBSTACLES = 8_000
MAX_VERTICES = 50_000
"""Maps with more obstacles or vertices would take many seconds to build."""
_MAX_CHECKED_VERTICES = 10_000
"""In free spaces with more vertices, primitives are not restored and unreachable regions are not reported."""
_MAX_NAME_CHARACTERS = 100
_MAX_DESCRIPTION_CHARACTERS = 10_000
_MIN_REPORTED_MOVE_M = 1e-3


def build_environment(
    foreign: ForeignMap, shaping: Shaping, source_name: str
) -> tuple[Environment, ImportReport]:
    """Convert a foreign map to an environment, and report the changes.

    Parameters
    ----------
    foreign : ForeignMap
    shaping : Shaping
    source_name : str
        The file, for messages.

    Returns
    -------
    environment : Environment
    report : ImportReport
        Repairs, losses and changes.

    Raises
    ------
    MapError
        If no robot fits into the map, or if it is too large.
    """
    conversion = Conversion(foreign, shaping, source_name)
    boundary_parts = build_valid_boundary(conversion)
    original = build_valid_free_space(conversion, boundary_parts)
    cleaned = _remove_hairs(original, conversion)
    selection = select_parts(cleaned.free, conversion)
    parts = drop_specks(selection.parts, conversion)
    outer = _choose_boundary(boundary_parts, parts, selection, conversion)
    conversion.require_at_most(MAX_OBSTACLES, sum(len(part.interiors) for part in parts), "obstacles")
    require_clearance(parts, conversion)
    unsimplified = MultiPolygon(parts)
    simplified = _simplify(unsimplified, original, conversion)
    conversion.require_at_most(MAX_VERTICES, shapely.count_coordinates(simplified.free), "vertices")
    layout = build_layout(simplified, outer, unsimplified, original, conversion)
    if foreign.primitives and shapely.get_num_coordinates(simplified.free) <= _MAX_CHECKED_VERTICES:
        layout = restore_primitives(layout, simplified, unsimplified, conversion)
    _report_deviation(layout.deviation, simplified.free, conversion)
    environment = _build_environment(layout, simplified.free, conversion)
    _report_unreachable(environment, conversion)
    return environment, _build_report(
        environment,
        original=original,
        simplified=simplified,
        layout=layout,
        cleaned=cleaned,
        selection=selection,
        conversion=conversion,
    )


def _build_report(
    environment: Environment,
    *,
    original: MultiPolygon,
    simplified: SimplifiedSpace,
    layout: MapLayout,
    cleaned: Cleaned,
    selection: PartSelection,
    conversion: Conversion,
) -> ImportReport:
    """Build the report on a conversion from the results of its steps."""
    foreign = conversion.foreign
    vertex_count = count_vertices(environment)
    if vertex_count > MANY_VERTICES:
        conversion.notes.append(describe_vertex_count(vertex_count))
    width, height = np.ptp(np.array(environment.boundary), axis=0).tolist()
    return ImportReport(
        source=conversion.source_name,
        format=foreign.format,
        vertices_read=foreign.vertices_read,
        vertices_kept=vertex_count,
        area_read=float(original.area),
        area_kept=environment.free_area,
        size=(round(width, conversion.digits), round(height, conversion.digits)),
        obstacles=len(environment.obstacles),
        tolerance=simplified.tolerance,
        moved_area=layout.deviation.area,
        moved=layout.deviation.distance,
        removed=cleaned.hair_count,
        removed_area=cleaned.hair_area,
        others=selection.offered_positions,
        repaired=tuple(conversion.repaired),
        dropped=tuple(conversion.dropped),
        changed=tuple(conversion.changed),
        notes=tuple(conversion.notes),
    )


def _remove_hairs(free: MultiPolygon, conversion: Conversion) -> Cleaned:
    """Remove hairs, which are thinner than the resolution of coordinates; outlines of cells have none."""
    if conversion.foreign.cell is not None:
        return Cleaned(free)
    width = 2 * conversion.grid
    cleaned = remove_hairs(free, width, max(conversion.tolerance, width))
    if cleaned.hair_count:
        count = f"{format_count(cleaned.hair_count, 'hair')} (slits, spurs)"
        thinner = f"thinner than {2000 * conversion.grid:g} mm"
        conversion.changed.append(f"removed {count} {thinner}, {format_area(cleaned.hair_area, 2)}")
    return cleaned


def _choose_boundary(
    boundary_parts: MultiPolygon | None,
    parts: list[Polygon],
    selection: PartSelection,
    conversion: Conversion,
) -> Polygon | None:
    """Return the boundary around the parts that are kept, or None if their outline is the boundary.

    A boundary is used only if the free space reaches it. If walls separate all of the free space from it, the
    area behind the walls is not part of the map: it would make the known region larger than the area that
    robots can cover, and would attract them to the walls. The boundary is then the inner edge of the walls,
    in all formats. A boundary that the file or the user names is an exception: it is kept, unless the user
    chooses another part of the free space.
    """
    foreign = conversion.foreign
    shaping = conversion.shaping
    if boundary_parts is None:
        return None
    around = [part for part in boundary_parts.geoms if shapely.intersects(part, parts).all()]
    if not around:
        return None
    outer: Polygon = around[0]
    is_chosen = shaping.inside is not None or (foreign.robots != () and shaping.keep == "largest")
    is_kept = foreign.has_named_boundary and not (is_chosen or selection.is_enclosed)
    if len(parts) == 1 and not is_kept and outer.contains_properly(parts[0]):
        conversion.notes.insert(0, "the boundary is the inner edge of the walls around the free space")
        return None
    if foreign.boundary_source:
        conversion.notes.insert(0, f"the boundary is {foreign.boundary_source}")
    return outer


def _simplify(unsimplified: MultiPolygon, original: MultiPolygon, conversion: Conversion) -> SimplifiedSpace:
    """Return the free space with fewer vertices, rounded; walls move by at most the tolerance."""
    foreign = conversion.foreign
    tolerance = conversion.tolerance
    _report_large_cells(conversion)
    sharp = unsimplified
    if foreign.cut_corners:
        sharp = MultiPolygon([sharpen_corners(part, tolerance) for part in unsimplified.geoms])
    # If sharpening and simplification together move walls too far, the next attempt does less.
    attempts = [
        (sharp, tolerance),
        (sharp, tolerance / 2),
        (unsimplified, tolerance / 2),
        (unsimplified, 0.0),
    ]
    for plan, allowed in attempts:
        simple = simplify_free_space(plan, allowed, foreign.cell, conversion.radius)
        free = round_polygons(simple.free, conversion.digits)
        if free.is_empty:
            free_area = format_area(original.area, 3)
            raise MapError(f"{conversion.source_name}: only {free_area} are free: is the scale right?")
        if measure_deviation(unsimplified, free).distance <= tolerance + conversion.grid:
            break
    conversion.changed += simple.changed
    return simple._replace(free=free)


def _report_large_cells(conversion: Conversion) -> None:
    cell = conversion.foreign.cell
    width = 2 * conversion.radius
    if conversion.shaping.simplify is None and cell is not None and cell > width:
        limit = f"walls move by at most {width:g} m instead of one cell (--simplify {cell:g})"
        conversion.notes.append(f"cells are larger than robots: {limit}")


def _report_deviation(deviation: Deviation, free: MultiPolygon, conversion: Conversion) -> None:
    if deviation.distance >= _MIN_REPORTED_MOVE_M:
        share = f"{100 * deviation.area / free.area:.2g}% of the free area"
        walls = f"walls moved by at most {deviation.distance:.2g} m"
        conversion.changed.append(
            f"{walls}; {format_area(deviation.area, 2)} changed between free and solid, {share}"
        )


def _report_unreachable(environment: Environment, conversion: Conversion) -> None:
    """Report the regions that a robot cannot reach from the largest one."""
    if shapely.get_num_coordinates(environment.free) > _MAX_CHECKED_VERTICES:
        return
    areas = sorted(
        (region.area for region in find_center_regions(environment.free, conversion.radius)), reverse=True
    )
    if len(areas) > 1:
        count = f"{format_count(len(areas) - 1, 'part')} of {format_area(sum(areas[1:]), 3)}"
        conversion.notes.append(
            f"{count} cannot be reached by a robot of radius {conversion.radius:g} m from the largest one"
        )


def _build_environment(layout: MapLayout, free: MultiPolygon, conversion: Conversion) -> Environment:
    """Build the environment from its boundary and obstacles; `free` is the free space between them, m."""
    foreign = conversion.foreign
    environment = Environment(
        name=to_one_line(foreign.name)[:_MAX_NAME_CHARACTERS].strip() or "map",
        boundary=normalize_ring(layout.boundary.exterior, conversion.digits),
        obstacles=(*build_polygon_obstacles(layout.solid, conversion), *layout.primitives),
        starts=build_starts(free, conversion),
        density=foreign.density,
        description=foreign.description[:_MAX_DESCRIPTION_CHARACTERS],
    )
    # Convert to a map document and back, which checks the rules of map files, so that the map can be saved.
    return from_json(to_json(environment), conversion.source_name)
