"""SVG drawings as maps: filled shapes are areas, and unfilled strokes are walls.

Filled shapes, according to their fill rule, are solid areas, except for the boundary (see
`Shapes.build_foreign_map`). The names of a shape are its id, its classes and its Inkscape label, and those of
the groups around it. Shapes that are only stroked are walls as wide as the stroke, or as the option
``thickness``; corners sharper than the miter limit are cut off. Hidden elements, text and images are left
out.

The option ``scale`` is the length of a user unit in meters. Without it, the drawing has its own size: 96 px
are an inch, and mm are mm. The y axis is flipped to point up; the lower left corner of the image is [0, 0] m,
or the position in the attribute ``data-origin`` of the root. A drawing smaller than a meter at its own scale
is rejected.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import shapely

from robocov.errors import MapError, to_one_line
from robocov.typing import FloatArray
from robocov_app.formats.files import get_map_name, require_shapes
from robocov_app.formats.files.xml_tree import MAX_ELEMENTS, MAX_NESTING, Element, read_xml_tree
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.curves import CURVE_TOLERANCE_M
from robocov_app.formats.geometry.frames import transform_points
from robocov_app.formats.geometry.shapes.collection import Shapes, note_colors
from robocov_app.formats.options import ReadOptions
from robocov_app.formats.vector.svg.element_state import ElementState, list_labels, parse_view_box
from robocov_app.formats.vector.svg.numbers import METERS_PER_UNIT, parse_length, parse_numbers
from robocov_app.formats.vector.svg.shape_reader import SHAPE_TAGS, ShapeReader
from robocov_app.formats.vector.svg.style import INHERITED, StyleSheet, inherit_style, is_hidden
from robocov_app.formats.vector.svg.transforms import build_affine, compose, fit_view_box

ROOT = re.compile(rb"<(?:[\w-]+:)?svg[\s>]")
_DEFAULT_PAGE_WIDTH_PX = 300.0
_DEFAULT_PAGE_HEIGHT_PX = 150.0
"""Size of a drawing that states none (CSS 2.1, section 10.3.2)."""
_MIN_SIZE_M = 1.0
"""Minimum size of a drawing at its own scale. A smaller one must show something larger than itself."""
_GROUP_TAGS = ("g", "a", "switch", "svg", "use")
_IMAGE_TAGS = ("text", "image", "foreignObject", "video", "iframe", "canvas")
_MAX_TITLE_CHARACTERS = 80
_MAX_DESCRIPTION_CHARACTERS = 1000


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read an SVG drawing; raise MapError if it is damaged, too large or too small, or contains no map."""
    root = read_xml_tree(path, "svg", "SVG", ("style", "title", "desc"))
    shapes = Shapes(root.source_name, options)
    drawing = _DrawingReader(root, shapes)
    try:
        matrix, width, height = _compute_page(root.attributes, options.scale)
    except ValueError as error:
        root.raise_error(str(error))
    left, top, *_ = parse_view_box(root.attributes) or (0.0, 0.0, width, height)
    corners = transform_points(matrix, np.array([[left, top], [left + width, top + height]]))
    shapes.page = shapely.box(*corners.min(axis=0), *corners.max(axis=0))
    drawing.draw(matrix, width, height)
    shapes.drop_thin_outlines(options.compute_stroke_width(drawing.shape_reader.unit))
    _require_size(shapes)
    scale = "at its own scale" if options.scale is None else f"a unit is {options.scale:g} m"
    shapes.notes = [scale, *drawing.describe()]
    note_colors(shapes, drawing.shape_reader.key)
    texts = {
        child.tag: to_one_line(" ".join(child.text.split())) for child in root.children if child.text.strip()
    }
    name = texts.get("title", "")[:_MAX_TITLE_CHARACTERS] or get_map_name(path)
    description = texts.get("desc", "")[:_MAX_DESCRIPTION_CHARACTERS] or "Imported from SVG."
    return shapes.build_foreign_map(name, description, solid=True)


def _require_size(shapes: Shapes) -> None:
    """Raise MapError if all shapes together are too small at the drawing's own scale."""
    geometries = shapes.geometries
    if shapes.options.scale is not None or not geometries:
        return
    x, y, right, top = shapely.total_bounds(geometries)
    if max(right - x, top - y) < _MIN_SIZE_M:
        hint = "--scale METERS gives the size of a unit, as in --scale 0.01"
        got = f"{right - x:.3g} x {top - y:.3g} m at its own scale"
        raise MapError(f"{shapes.source_name}: expected at least {_MIN_SIZE_M:g} m, got {got}: {hint}")


def _compute_page(attributes: dict[str, str], scale: float | None) -> tuple[FloatArray, float, float]:
    """Return the matrix from the root's units to meters, and the width and height of its viewport in units.

    Raises
    ------
    ValueError
        If an attribute is invalid.
    """
    box = parse_view_box(attributes)
    width = _parse_page_length(attributes, "width", box[2] if box else _DEFAULT_PAGE_WIDTH_PX)
    height = _parse_page_length(attributes, "height", box[3] if box else _DEFAULT_PAGE_HEIGHT_PX)
    box = box or (0.0, 0.0, width, height)
    if width <= 0.0 or height <= 0.0:
        raise ValueError(f"expected a size, got {width:g} x {height:g} px")
    if scale is None:
        inside = fit_view_box(box, width, height, attributes.get("preserveAspectRatio", ""))
        fit = compose(build_affine(a=METERS_PER_UNIT, d=METERS_PER_UNIT), inside)
        bottom = METERS_PER_UNIT * height
    else:
        fit = compose(build_affine(a=scale, d=scale), build_affine(e=-box[0], f=-box[1]))
        bottom = scale * box[3]
    origin = parse_numbers(attributes.get("data-origin", "0 0"))
    if len(origin) != 2:
        raise ValueError(f"expected two numbers, got data-origin {attributes['data-origin'][:30]!r}")
    matrix = compose(build_affine(d=-1.0, e=origin[0], f=origin[1] + bottom), fit)
    return matrix, box[2], box[3]


def _parse_page_length(attributes: dict[str, str], name: str, whole: float) -> float:
    text = attributes.get(name, "100%").strip()
    return parse_length("100%" if text == "auto" else text, whole)


class _DrawingReader:
    """Visits the elements, including uses and nested drawings, in the order in which they are drawn."""

    def __init__(self, root: Element, shapes: Shapes) -> None:
        """Collect the style sheets of the drawing, and its elements by id."""
        self.root = root
        self.shapes = shapes
        self.sheet = StyleSheet(root.source_name)
        self.clipped_count = 0
        self._elements_by_id: dict[str, Element] = {}
        for element in root.iterate():
            name = element.attributes.get("id")
            if name:
                self._elements_by_id.setdefault(name, element)
            if element.tag == "style":
                self.sheet.add(element.text)
        self.shape_reader = ShapeReader(shapes, self.sheet, self._elements_by_id)

    def draw(self, matrix: FloatArray, width: float, height: float) -> None:
        """Add all shapes; the matrix and the size are the result of `_compute_page`."""
        self._require_few_elements()
        style = inherit_style(INHERITED, self.sheet.get_properties(self.root))
        state = ElementState(matrix, style, list_labels(self.root), width, height)
        for child in self.root.children:
            self._draw_element(child, state)

    def describe(self) -> list[str]:
        """Return notes about simplified or ignored elements."""
        counts = {
            "dashed strokes treated as continuous lines": self.shape_reader.dashed_count,
            "clip paths and masks not applied": self.clipped_count,
            "style rules of other kinds than tag, .class and #id not applied": self.sheet.unsupported_count,
        }
        notes = []
        if self.shapes.vertices:
            notes.append(f"curves flattened to within {1000 * CURVE_TOLERANCE_M:g} mm")
        notes += [f"{count} {text}" for text, count in counts.items() if count]
        return notes

    def _require_few_elements(self) -> None:
        """Raise MapError if too much would be drawn: a few kB of uses may expand to billions of elements."""
        counts = _ElementCounter(self).count(self.root, 0)
        if counts[0] > MAX_ELEMENTS:
            expected = f"expected at most {MAX_ELEMENTS} elements to draw, including uses"
            raise MapError(f"{self.root.source_name}: {expected}, got {counts[0]:.3g}")
        require_shapes(counts[1], self.root.source_name)

    def find_target(self, element: Element) -> Element | None:
        """Return the element that a ``use`` element refers to, or None if it is not in this file."""
        if element.tag != "use":
            return None
        return self._elements_by_id.get(element.attributes.get("href", "").strip().removeprefix("#"))

    def _draw_element(self, element: Element, outer: ElementState) -> None:
        """Add an element and its children; `outer` is the state around it."""
        if element.tag in _IMAGE_TAGS:
            self.shapes.count_omission(element.tag)
        if element.tag not in _GROUP_TAGS and element.tag not in SHAPE_TAGS:
            return
        if outer.depth > MAX_NESTING:
            element.raise_error(f"nested deeper than {MAX_NESTING}")
        properties = self.sheet.get_properties(element)
        if is_hidden(properties):
            self.shapes.count_omission("hidden element")
            return
        if any(properties.get(name, "none") != "none" for name in ("clip-path", "mask")):
            self.clipped_count += 1
        try:
            state = outer.build_child_state(element, properties)
            if element.tag in SHAPE_TAGS:
                self.shape_reader.add(element, state)
                return
            children = list(self._enter_group(element, state))
        except ValueError as error:
            element.raise_error(str(error))
        for child, child_state in children:
            self._draw_element(child, child_state)

    def _enter_group(self, element: Element, state: ElementState) -> Iterator[tuple[Element, ElementState]]:
        """Yield the elements in a group, a nested drawing or a ``use``, each with the state around it.

        Raises
        ------
        ValueError
            If an attribute is invalid.
        """
        if element.tag in ("use", "svg"):
            state = state.translate(element)
        if element.tag == "use":
            target = self.find_target(element)
            if target is None:
                self.shapes.count_omission("use", "of an element that is not in the file")
                return
            if target.tag not in ("symbol", "svg"):
                yield target, state
                return
            state = state.enter_target(target, self.sheet.get_properties(target))
            size = {name: text for name, text in element.attributes.items() if name in ("width", "height")}
            state = state.enter_viewport(target.attributes | size)
            element = target
        elif element.tag == "svg":
            state = state.enter_viewport(element.attributes)
        for child in element.children:
            yield child, state


class _ElementCounter:
    """Counts the elements that would be drawn, without drawing them. Each target is counted only once."""

    def __init__(self, drawing: _DrawingReader) -> None:
        self._drawing = drawing
        self._counts: dict[Element, tuple[int, int]] = {}
        self._open: set[Element] = set()

    def count(self, element: Element, depth: int) -> tuple[int, int]:
        """Return the number of elements that an element draws, and the number of shapes among them."""
        if element in self._open:
            element.raise_error("uses itself")
        if depth > MAX_NESTING:
            element.raise_error(f"uses are nested deeper than {MAX_NESTING}")
        if element not in self._counts:
            self._open.add(element)
            elements = 1
            shapes = int(element.tag in SHAPE_TAGS)
            target = self._drawing.find_target(element)
            drawn = element.children if target is None else [*element.children, target]
            for child in drawn:
                child_elements, child_shapes = self.count(child, depth + 1)
                elements += child_elements
                shapes += child_shapes
            self._counts[element] = (elements, shapes)
            self._open.discard(element)
        return self._counts[element]
