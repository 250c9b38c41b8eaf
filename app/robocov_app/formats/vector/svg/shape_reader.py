"""Conversion of the shapes of a drawing, from paths to rectangles, to outlines and walls."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Literal

import numpy as np

from robocov.mapfile.models import MAX_SIZE_M, MIN_SIZE_M
from robocov.typing import FloatArray
from robocov_app.formats.colors import Paint, parse_css_color_on_white
from robocov_app.formats.files import MAX_VERTICES
from robocov_app.formats.files.xml_tree import Element
from robocov_app.formats.geometry.curves import CURVE_TOLERANCE_M, flatten_arc
from robocov_app.formats.geometry.frames import transform_points
from robocov_app.formats.geometry.shapes.collection import Shapes, WallLine
from robocov_app.formats.geometry.shapes.drawn_shapes import PenStroke
from robocov_app.formats.geometry.shapes.enclosed_area import Rule
from robocov_app.formats.options import get_or_default
from robocov_app.formats.vector.svg.element_state import ElementState
from robocov_app.formats.vector.svg.numbers import METERS_PER_UNIT, parse_length, parse_numbers
from robocov_app.formats.vector.svg.path_data import MAX_COMMANDS, Subpath, parse_path
from robocov_app.formats.vector.svg.style import StyleSheet, compute_visible_color, is_painted
from robocov_app.formats.vector.svg.transforms import compute_stretch

SHAPE_TAGS = ("path", "rect", "circle", "ellipse", "line", "polyline", "polygon")
_CAPS: dict[str, Literal["square", "round"]] = {"square": "square", "round": "round"}
_JOINS: dict[str, Literal["bevel", "round"]] = {"bevel": "bevel", "round": "round"}
_MAX_REFERENCES = 5
"""Maximum number of references that are followed from one gradient to the next."""
_MAX_EVEN_STRETCH = 1.0 + 1e-6
"""Maximum ratio of the stretch in two directions for which a stroke has the same width in all directions."""
_DEFAULT_MITRE_LIMIT = 4.0


class ShapeReader:
    """Adds the shapes of a drawing to a collection.

    Parameters
    ----------
    shapes : Shapes
    sheet : StyleSheet
    elements_by_id : dict of str to Element
        Elements to which paints refer, such as gradients.

    Attributes
    ----------
    unit : float, m
        Length of a unit of the root.
    key : ColorKey
        Colors with a declared role.
    dashed_count : int
        Number of dashed strokes.
    """

    def __init__(self, shapes: Shapes, sheet: StyleSheet, elements_by_id: dict[str, Element]) -> None:
        self.shapes = shapes
        self.unit = get_or_default(shapes.options.scale, METERS_PER_UNIT)
        self.key = shapes.options.build_color_key()
        self.dashed_count = 0
        self._sheet = sheet
        self._elements_by_id = elements_by_id
        self._remaining_commands = MAX_COMMANDS

    def add(self, element: Element, state: ElementState) -> None:
        """Add a shape; raise ValueError if an attribute is invalid."""
        style = state.style
        is_visible = style["visibility"].lower() not in ("hidden", "collapse")
        if is_visible and not self.shapes.accept(state.labels):
            return
        has_fill = is_painted(style, "fill") and element.tag != "line"
        has_stroke = is_painted(style, "stroke")
        if not (is_visible and (has_fill or has_stroke)):
            self.shapes.count_omission("hidden element")
            return
        fill = self._find_paint(state, "fill")
        stroke = self._find_paint(state, "stroke")
        has_fill = has_fill and not self._is_ignored(fill, "fill")
        has_stroke = has_stroke and not self._is_ignored(stroke, "stroke")
        if has_fill:
            self._add_fill(element, state, fill, stroke if has_stroke else None)
        elif has_stroke:
            self._add_walls(self._compute_subpaths(element, state), state, stroke, element)

    def _add_fill(self, element: Element, state: ElementState, fill: Paint, stroke: Paint | None) -> None:
        """Add a filled shape and its stroke, if any. If the shape has no area, its stroke becomes walls."""
        if self._add_disc(element, state, fill):
            if stroke is not None:
                with suppress(ValueError):  # a huge disc has too many points for edges, but needs none itself
                    self._add_edges(self._compute_subpaths(element, state), state, stroke)
            return
        subpaths = self._compute_subpaths(element, state)
        has_area = self._add_area(subpaths, state, fill, element)
        if stroke is not None and has_area:
            self._add_edges(subpaths, state, stroke)
        elif stroke is not None:
            self._add_walls(subpaths, state, stroke, element)
        elif not has_area:
            self.shapes.count_omission("shape", "without an area")

    def _is_ignored(self, paint: Paint, kind: str) -> bool:
        """Return whether the user ignores a color; if so, count the fill or stroke as left out."""
        if paint.role != "ignore":
            return False
        self.shapes.count_omission(kind, "in an ignored color (--ignore-color)")
        return True

    def _find_paint(self, state: ElementState, kind: Literal["fill", "stroke"]) -> Paint:
        """Return the color of a fill or a stroke, and its role; a gradient has its first color."""
        visible = compute_visible_color(state.style, kind, state.opacity, self._get_gradient_color)
        written = parse_css_color_on_white(state.style[kind])
        return Paint(visible, self.key.find_role(written) or self.key.find_role(visible))

    def _get_gradient_color(self, name: str) -> str | None:
        """Return the first color of a gradient, or of one to which it refers; None if it has no colors."""
        for _ in range(_MAX_REFERENCES):
            gradient = self._elements_by_id.get(name)
            if gradient is None:
                return None
            stop = next((child for child in gradient.children if child.tag == "stop"), None)
            if stop is not None:
                properties = self._sheet.get_properties(stop)
                return properties.get("stop-color") or stop.attributes.get("stop-color", "black")
            name = gradient.attributes.get("href", "").strip().removeprefix("#")
        return None

    def _add_disc(self, element: Element, state: ElementState, paint: Paint) -> bool:
        """Add a circle as a disc, unless the transform distorts it; return whether it was added."""
        smallest, largest = compute_stretch(state.matrix)
        if element.tag != "circle" or largest - smallest > 1e-9 * largest:
            return False
        center = np.array([state.parse_lengths(element, "cx", "cy")])
        radius = state.parse_radius(element) * largest
        if radius <= 0.0:
            return False
        (center,) = transform_points(state.matrix, center)
        self.shapes.add_circle(center, radius, state.labels, location=_format_line(element), paint=paint)
        return True

    def _add_area(
        self, subpaths: Sequence[Subpath], state: ElementState, paint: Paint, element: Element
    ) -> bool:
        """Add the area of a filled shape; return whether it has one."""
        if not subpaths:
            return False
        rings = [transform_points(state.matrix, subpath.points) for subpath in subpaths]
        rule: Rule = "nonzero"
        if state.style["fill-rule"].lower() == "evenodd":
            rule = "evenodd"
        return self.shapes.add_outline(
            rings, state.labels, rule=rule, location=_format_line(element), kind="", paint=paint
        )

    def _add_edges(self, subpaths: Sequence[Subpath], state: ElementState, paint: Paint) -> None:
        """Add the stroke of a filled shape, which is a wall only if the fill turns out to be a floor."""
        try:
            lines = self._build_lines(subpaths, state, paint)
        except ValueError:  # an invalid width is not an error, because the stroke may never be used
            return
        min_width = self.shapes.options.compute_stroke_width(self.unit)
        wide = [line for line in lines if min_width <= line.measure_widths()[1] <= MAX_SIZE_M]
        self.shapes.add_edges([replace(line, width=max(line.width, MIN_SIZE_M)) for line in wide])

    def _add_walls(
        self, subpaths: Sequence[Subpath], state: ElementState, paint: Paint, element: Element
    ) -> None:
        """Add a stroke as walls."""
        lines = self._build_lines(subpaths, state, paint)
        if not lines:
            self.shapes.count_omission("stroke", "without a width")
            return
        min_width = self.shapes.options.compute_stroke_width(self.unit)
        if max(line.measure_widths()[1] for line in lines) < min_width:
            self.shapes.count_omission("stroke", f"thinner than {min_width:.3g} m (--min-stroke)")
            return
        if state.style["stroke-dasharray"].lower() != "none":
            self.dashed_count += 1
        for line in lines:
            self.shapes.add_line(line, location=_format_line(element))

    def _build_lines(self, subpaths: Sequence[Subpath], state: ElementState, paint: Paint) -> list[WallLine]:
        """Build the walls of a stroke, one for each subpath; none if it has no width."""
        style = state.style
        thickness = self.shapes.options.thickness
        smallest, largest = compute_stretch(state.matrix)
        pen_width = parse_length(style["stroke-width"], state.diagonal)
        width = get_or_default(thickness, pen_width * math.sqrt(smallest * largest))
        if not width > 0.0:
            return []
        mitre_limit = _DEFAULT_MITRE_LIMIT
        limits = parse_numbers(style["stroke-miterlimit"])
        if limits and limits[0] >= 1.0:
            mitre_limit = limits[0]
        is_stretched = thickness is None and largest > _MAX_EVEN_STRETCH * smallest
        lines = []
        for points, is_closed in subpaths:
            path = points
            if is_closed:
                path = np.concatenate([points, points[:1]])
            line = WallLine(
                transform_points(state.matrix, path),
                width,
                state.labels,
                cap=_CAPS.get(style["stroke-linecap"].lower(), "flat"),
                join=_JOINS.get(style["stroke-linejoin"].lower(), "mitre"),
                mitre_limit=mitre_limit,
                stretched=PenStroke(path, pen_width, state.matrix) if is_stretched else None,
                color=paint.color,
                role=paint.role,
            )
            lines.append(line)
        return lines

    def _compute_subpaths(self, element: Element, state: ElementState) -> list[Subpath]:
        """Return the subpaths of a shape, in the units of the element."""
        _, stretch = compute_stretch(state.matrix)
        tolerance = CURVE_TOLERANCE_M / stretch if stretch > 0.0 else np.inf
        attributes = element.attributes
        match element.tag:
            case "path":
                return self._parse_path(attributes.get("d", ""), tolerance)
            case "polyline" | "polygon":
                values = parse_numbers(attributes.get("points", ""))
                points = np.array(values[: len(values) // 2 * 2]).reshape(-1, 2)
                if len(points) < 2:
                    return []
                return [Subpath(points, element.tag == "polygon")]
            case "line":
                ends = state.parse_lengths(element, "x1", "y1", "x2", "y2")
                return [Subpath(np.array(ends).reshape(2, 2), False)]
            case "rect":
                return _compute_rectangle(element, state, tolerance)
            case _:
                return _compute_ellipse(element, state, tolerance)

    def _parse_path(self, data: str, tolerance: float) -> list[Subpath]:
        if data.strip() == "none":
            return []
        subpaths, commands = parse_path(data, tolerance, MAX_VERTICES, self._remaining_commands)
        self._remaining_commands -= commands
        return subpaths


def _format_line(element: Element) -> str:
    return f"line {element.line}"


def _parse_radii(element: Element, state: ElementState) -> tuple[float, float]:
    """Return the radii of an ellipse or a round corner; one that is missing or "auto" equals the other."""
    rx, ry = state.parse_lengths(element, "rx", "ry")
    if element.attributes.get("rx", "auto").strip() == "auto":
        return ry, ry
    if element.attributes.get("ry", "auto").strip() == "auto":
        return rx, rx
    return rx, ry


def _compute_ellipse(element: Element, state: ElementState, tolerance: float) -> list[Subpath]:
    """Return the points of a circle or an ellipse; nothing if a radius is not positive."""
    if element.tag == "circle":
        rx = ry = state.parse_radius(element)
    else:
        rx, ry = _parse_radii(element, state)
    if min(rx, ry) <= 0.0:
        return []
    center = np.array(state.parse_lengths(element, "cx", "cy"))
    u, v = np.diag([rx, ry])
    points = flatten_arc(center, u, v, start=0.0, sweep=2 * np.pi, tolerance=tolerance)
    return [Subpath(points, True)]


def _compute_rectangle(element: Element, state: ElementState, tolerance: float) -> list[Subpath]:
    """Return the points of a rectangle, whose corners may be round; nothing if it has no area."""
    x, y, width, height = state.parse_lengths(element, "x", "y", "width", "height")
    if width <= 0.0 or height <= 0.0:
        return []
    rx, ry = _parse_radii(element, state)
    rx = min(rx, width / 2)
    ry = min(ry, height / 2)
    corners = np.array([[x, y], [x + width, y], [x + width, y + height], [x, y + height]])
    if rx <= 0.0 or ry <= 0.0:
        return [Subpath(corners, True)]
    u, v = np.diag([rx, ry])
    inward = np.array([[rx, ry], [-rx, ry], [-rx, -ry], [rx, -ry]])
    parts: list[FloatArray] = []
    for k, center in enumerate(corners + inward):
        start = np.pi + k * np.pi / 2
        first = center + u * np.cos(start) + v * np.sin(start)
        parts.append(first[None])
        parts.append(flatten_arc(center, u, v, start=start, sweep=np.pi / 2, tolerance=tolerance))
    return [Subpath(np.concatenate(parts), True)]
