"""Floors: outlines of a drawing that are free although others are solid, by their color or nesting."""

from collections.abc import Sequence
from dataclasses import dataclass

import shapely
from shapely import LineString, MultiPolygon, Polygon

from robocov.errors import format_area
from robocov_app.formats.colors import WHITE, describe_color_counts
from robocov_app.formats.geometry.polygons import to_multipolygon, unite
from robocov_app.formats.geometry.shapes.drawings import Boundary, Drawing, InterpretationReport, get_outlines
from robocov_app.formats.geometry.shapes.drawn_shapes import ClosedOutline
from robocov_app.formats.geometry.shapes.painting import (
    PaintLayer,
    find_evident_floors,
    is_dark,
    is_pale,
    split_alternating,
)

_LOWEST_ORDER = -1
"""Drawing order below that of all paint in a file."""
_MIN_BACKGROUND_SHARE = 0.98
"""Minimum fraction of the page that a background covers."""


@dataclass(frozen=True, eq=False)
class Floors:
    """Outlines that are free although others are solid.

    Attributes
    ----------
    outlines : frozenset of ClosedOutline
    layers : sequence of PaintLayer
        Paint of the floors, which makes the area below it free.
    is_slab : bool
        Whether the boundary itself is solid, except for the floors on it.
    """

    outlines: frozenset[ClosedOutline]
    layers: Sequence[PaintLayer]
    is_slab: bool = False


@dataclass(frozen=True, eq=False)
class NestedAreas:
    """A boundary in which nested outlines are alternately free and solid, and the solid area in it."""

    boundary: Boundary
    solid: PaintLayer


def find_floors(
    drawing: Drawing, boundary: Boundary | None, report: InterpretationReport, *, are_solid: bool
) -> Floors:
    """Find the floors of a drawing: fills of a color that the user declared free, and pale fills.

    Parameters
    ----------
    drawing : Drawing
    boundary : Boundary or None
    report : InterpretationReport
    are_solid : bool
        Whether closed outlines are solid, except for the boundary.

    Returns
    -------
    Floors
    """
    used = get_outlines(boundary)
    others = [outline for outline in drawing.outlines if outline not in used]
    chosen = {outline for outline in others if outline.role == "free"}
    is_slab = are_solid and boundary is not None and _is_slab(drawing, boundary)
    if are_solid and drawing.options.outlines is None:
        undecided = [outline for outline in others if outline.role is None and outline.color is not None]
        if is_slab:
            pale = [outline for outline in undecided if is_pale(outline.color)]
            pale_floors = _PaleFloors(pale, "they are on a dark background")
        else:
            pale_floors = _find_pale_floors(drawing, boundary, others, undecided)
        _report_pale(drawing, undecided, pale_floors, report)
        chosen |= set(pale_floors.outlines)
    layers = [outline.paint_layer for outline in others if outline in chosen]
    layers += [line.paint_layer for line in drawing.lines if line.role == "free"]
    return Floors(frozenset(chosen), layers, is_slab)


def find_nested_areas(
    drawing: Drawing, boundary: Boundary | None, report: InterpretationReport
) -> NestedAreas | None:
    """Find the free and the solid area of nested outlines, which are alternately free and solid.

    Without a boundary, the larger of both areas is free. None is returned if there are no outlines.
    """
    used = get_outlines(boundary)
    others = [outline for outline in drawing.outlines if outline not in used]
    areas = [outline.area for outline in others if outline.role is None]
    if not areas:
        return None
    odd, even = split_alternating(areas)
    if boundary is not None:
        report.notes.append("areas in an odd number of outlines within the boundary are solid")
        return NestedAreas(boundary, PaintLayer(odd, _LOWEST_ORDER))
    if odd.area >= even.area:
        number = "an odd number"
        free = odd
        solid = even
    else:
        number = "an even number"
        free = even
        solid = odd
    whole = to_multipolygon(unite([Polygon(part.exterior) for part in (*odd.geoms, *even.geoms)]))
    size = format_area(free.area, 3)
    report.notes.append(f"areas in {number} of outlines are free, {size}, as the larger area")
    return NestedAreas(Boundary(whole, "the outermost outlines"), PaintLayer(solid, _LOWEST_ORDER))


def build_solid_layer(boundary: Boundary | None, region: MultiPolygon, floors: Floors) -> PaintLayer | None:
    """Return the region as a solid layer if only floors are free; otherwise None."""
    if boundary is None:
        return None
    has_declared = any(outline.role == "free" for outline in floors.outlines)
    if floors.is_slab or (boundary.is_guess and has_declared):
        order = min((outline.order for outline in boundary.outlines), default=-1)
        return PaintLayer(region, order)
    return None


def is_background(drawing: Drawing, boundary: Boundary | None) -> bool:
    """Return whether the boundary is only the background of the page: a fill of its size without a stroke."""
    if drawing.page is None or boundary is None or boundary.is_named or len(boundary.outlines) != 1:
        return False
    (outline,) = boundary.outlines
    is_plain = not outline.edges and outline.role is None and not is_dark(outline.color)
    covered = shapely.intersection(outline.area, drawing.page).area
    return is_plain and covered > _MIN_BACKGROUND_SHARE * drawing.page.area


def _is_slab(drawing: Drawing, boundary: Boundary) -> bool:
    """Return whether a boundary is solid: declared so, or a dark area with pale floors painted on it."""
    if boundary.is_named or len(boundary.outlines) != 1:
        return False
    (outline,) = boundary.outlines
    if outline.role is not None:
        return outline.role == "solid"
    later = [other for other in drawing.outlines if other.order > outline.order and other.role != "solid"]
    return is_dark(outline.color) and any(is_pale(other.color) for other in later)


@dataclass(frozen=True, eq=False)
class _PaleFloors:
    """Outlines that are floors because of their color, and the reason for the import report."""

    outlines: list[ClosedOutline]
    reason: str


def _find_pale_floors(
    drawing: Drawing,
    boundary: Boundary | None,
    outlines: Sequence[ClosedOutline],
    undecided: Sequence[ClosedOutline],
) -> _PaleFloors:
    """Return the undecided outlines that are floors by their color.

    They have something darker painted on them, resemble outlines that do, or are invisible on the background.
    """
    marks = [outline.paint_layer for outline in outlines]
    lines = [*drawing.lines, *(edge for outline in outlines for edge in outline.edges)]
    marks += [PaintLayer(LineString(line.points), line.order, line.color) for line in lines]
    is_evident = find_evident_floors([outline.paint_layer for outline in undecided], marks)
    chosen = [outline for outline, evident in zip(undecided, is_evident, strict=True) if evident]
    rest = [outline for outline in undecided if outline not in chosen]
    chosen += [outline for outline in rest if _is_invisible(outline, boundary)]
    reason = "they have the color of the background"
    if any(is_evident):
        reason = "darker paint lies on them or on similar ones"
    return _PaleFloors(chosen, reason)


def _is_invisible(outline: ClosedOutline, boundary: Boundary | None) -> bool:
    """Return whether an outline is invisible on the background: it has the same pale color and no stroke."""
    background_colors = [background.color for background in get_outlines(boundary)] or [WHITE]
    return is_pale(outline.color) and not outline.edges and outline.color in background_colors


def _report_pale(
    drawing: Drawing,
    undecided: Sequence[ClosedOutline],
    floors: _PaleFloors,
    report: InterpretationReport,
) -> None:
    """Report which pale fills are treated as floors, and which pale paint is treated as solid."""
    rest = [outline for outline in undecided if outline not in floors.outlines]
    pale = [outline.color for outline in rest if is_pale(outline.color)]
    pale += [line.color for line in drawing.lines if line.role is None and is_pale(line.color)]
    if floors.outlines:
        counts = describe_color_counts(outline.color for outline in floors.outlines)
        hint = "(--solid-color: as obstacles)"
        report.notes.append(f"pale fills treated as floor: {counts}, because {floors.reason} {hint}")
    if pale:
        counts = describe_color_counts(pale)
        report.notes.append(f"pale paint treated as solid: {counts} (--free-color: as free space)")
