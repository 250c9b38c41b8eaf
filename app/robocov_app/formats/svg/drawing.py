"""What an SVG file draws: its shapes in metres, groups, uses and nested pictures carried out."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from robocov.arrays import Array
from robocov.errors import MapError
from robocov_app.formats.files import MAX_VERTICES, require_shapes
from robocov_app.formats.geometry.curves import TOLERANCE, arc
from robocov_app.formats.geometry.polygons import Rule
from robocov_app.formats.geometry.shapes import Line, Shapes
from robocov_app.formats.svg.path import (
    MOST_DRAWS,
    affine,
    composed,
    fitted,
    length,
    moved,
    numbers,
    stretch,
    subpaths,
    transform,
)
from robocov_app.formats.svg.style import INHERITED, Style, StyleSheet, inherited, is_hidden, is_painted
from robocov_app.formats.xml_tree import DEEPEST, MOST_ELEMENTS, Element

GROUPS = ("g", "a", "switch", "svg")
SHAPES = ("path", "rect", "circle", "ellipse", "line", "polyline", "polygon")
_PICTURES = ("text", "image", "foreignObject", "video", "iframe", "canvas")
_CAPS: dict[str, Literal["flat", "square", "round"]] = {"butt": "flat", "square": "square", "round": "round"}
_JOINS: dict[str, Literal["mitre", "bevel", "round"]] = {"miter": "mitre", "bevel": "bevel", "round": "round"}
_EVEN = 1.0 + 1e-6
"""Where lengths grow by more different factors in different directions, a stroke has no one width."""


@dataclass(frozen=True, eq=False)
class _Place:
    """Where an element stands, and what it has from the groups around it.

    `matrix`, (3, 3): from its units to metres. `labels`: of the groups, the innermost first. `width`,
    `height`: of the innermost viewport, in its units.
    """

    matrix: Array
    style: Style
    labels: tuple[str, ...]
    width: float
    height: float
    depth: int = 0

    @property
    def diagonal(self) -> float:
        """What a percentage of a length in no direction is of (SVG 2, section 8.9)."""
        return math.hypot(self.width, self.height) / math.sqrt(2.0)


class SvgDrawing:
    """Goes through the elements as they are drawn and adds them to the shapes.

    `where`: what messages call the file.
    """

    def __init__(self, root: Element, where: str, shapes: Shapes) -> None:
        self.root = root
        self.where = where
        self.shapes = shapes
        self.sheet = StyleSheet(where)
        self.named: dict[str, Element] = {}
        self.draws = MOST_DRAWS
        self.dashed = self.clipped = 0
        for element in root.everything():
            name = element.attributes.get("id")
            if name:
                self.named.setdefault(name, element)
            if element.tag == "style":
                self.sheet.add(element.text)

    def draw(self, matrix: Array, width: float, height: float) -> None:
        """Add all that is drawn.

        `matrix`, (3, 3): from the units of the root's content to metres. `width`, `height`: of the viewport,
        in these units. Raises MapError when an element cannot be understood, or too much is drawn.
        """
        self._require_few()
        style = inherited(INHERITED, self.sheet.of(self.root))
        place = _Place(matrix, style, self._labels(self.root), width, height)
        for child in self.root.children:
            self._draw(child, place)

    def notes(self) -> list[str]:
        """Return what is worth knowing of how things were taken."""
        told = [f"curves flattened to within {1000 * TOLERANCE:g} mm"] if self.shapes.vertices else []
        for count, words in (
            (self.dashed, "dashed strokes taken as whole"),
            (self.clipped, "clip paths and masks not applied"),
            (self.sheet.strange, "style rules of other kinds than tag, .class and #id not applied"),
        ):
            if count:
                told.append(f"{count} {words}")
        return told

    def _require_few(self) -> None:
        """Count what will be drawn, uses and all, without drawing it: a few kB may stand for billions."""
        counted: dict[Element, tuple[int, int]] = {}
        inside: set[Element] = set()

        def count(element: Element, depth: int) -> tuple[int, int]:
            if element in inside:
                element.refuse(self.where, "is used within itself, but an end was wanted")
            if depth > DEEPEST:
                element.refuse(self.where, f"uses nested deeper than {DEEPEST}, but less was wanted")
            if element not in counted:
                inside.add(element)
                inner = [*element.children]
                target = self._target(element)
                if target is not None:
                    inner.append(target)
                elements, shapes = 1, int(element.tag in SHAPES)
                for each in inner:
                    more = count(each, depth + 1)
                    elements, shapes = elements + more[0], shapes + more[1]
                counted[element] = elements, shapes
                inside.discard(element)
            return counted[element]

        elements, shapes = count(self.root, 0)
        if elements > MOST_ELEMENTS:
            raise MapError(
                f"{self.where}: {elements:.3g} elements to be drawn, uses and all, but at most "
                f"{MOST_ELEMENTS} were wanted"
            )
        require_shapes(shapes, self.where)

    def _target(self, element: Element) -> Element | None:
        """Return what a ``use`` uses, if it is in this file."""
        if element.tag != "use":
            return None
        return self.named.get(element.attributes.get("href", "").strip().removeprefix("#"))

    def _labels(self, element: Element) -> tuple[str, ...]:
        given = element.attributes
        names = (given.get("id", ""), given.get("label", ""), *given.get("class", "").split())
        return tuple(dict.fromkeys(name.strip() for name in names if name.strip()))

    def _draw(self, element: Element, outer: _Place) -> None:
        """Add an element, with all in it."""
        drawn = element.tag in GROUPS or element.tag in SHAPES or element.tag == "use"
        if element.tag in _PICTURES:
            self.shapes.leave_out(element.tag)
        if not drawn:
            return
        if outer.depth > DEEPEST:
            element.refuse(self.where, f"nested deeper than {DEEPEST}, but less was wanted")
        own = self.sheet.of(element)
        if is_hidden(own):
            self.shapes.leave_out("hidden element")
            return
        self.clipped += any(own.get(name, "none") != "none" for name in ("clip-path", "mask"))
        try:
            matrix = composed(outer.matrix, transform(own.get("transform", "")))
            place = replace(
                outer,
                matrix=matrix,
                style=inherited(outer.style, own),
                labels=tuple(dict.fromkeys([*self._labels(element), *outer.labels])),
                depth=outer.depth + 1,
            )
            if element.tag in SHAPES:
                self._shape(element, place)
                return
            inner = self._inside(element, place)
        except ValueError as error:
            element.refuse(self.where, str(error))
        if inner is not None:
            for child in inner[0]:
                self._draw(child, inner[1])

    def _inside(self, element: Element, place: _Place) -> tuple[list[Element], _Place] | None:
        """Return what is drawn in a group, a use or a nested picture, and where."""
        if element.tag == "use":
            target = self._target(element)
            if target is None:
                self.shapes.leave_out("use", "of what is not in the file")
                return None
            x, y = self._lengths(element, place, ("x", "y"))
            place = replace(place, matrix=composed(place.matrix, affine(e=x, f=y)))
            if target.tag not in ("symbol", "svg"):
                return [target], place
            style = inherited(place.style, self.sheet.of(target))
            labels = tuple(dict.fromkeys([*place.labels, *self._labels(target)]))
            place = replace(place, style=style, labels=labels)
            given = {**target.attributes}
            given |= {name: text for name, text in element.attributes.items() if name in ("width", "height")}
            return target.children, self._viewport(target, place, given)
        if element.tag == "svg":
            x, y = self._lengths(element, place, ("x", "y"))
            place = replace(place, matrix=composed(place.matrix, affine(e=x, f=y)))
            return element.children, self._viewport(element, place, element.attributes)
        return element.children, place

    def _viewport(self, element: Element, place: _Place, given: dict[str, str]) -> _Place:
        """Return the place inside of a nested picture or a symbol, its ``viewBox`` fitted."""
        width = length(given.get("width", "100%").replace("auto", "100%"), place.width)
        height = length(given.get("height", "100%").replace("auto", "100%"), place.height)
        box = view_box(given)
        if box is None:
            return replace(place, width=width, height=height)
        fit = fitted(box, width, height, given.get("preserveAspectRatio", ""))
        return replace(place, matrix=composed(place.matrix, fit), width=box[2], height=box[3])

    def _shape(self, element: Element, place: _Place) -> None:
        """Add a shape: as an area where it is filled, else as walls where it is stroked."""
        style = place.style
        if style["visibility"].lower() in ("hidden", "collapse"):
            self.shapes.leave_out("hidden element")
            return
        if not self.shapes.wants(place.labels):
            return
        filled = is_painted(style, "fill") and element.tag != "line"
        stroked = is_painted(style, "stroke")
        if not filled and not stroked:
            self.shapes.leave_out("hidden element")
            return
        at = f"line {element.line}"
        if filled and element.tag == "circle" and self._disc(element, place, at):
            return
        parts = self._points(element, place)
        rings = [moved(place.matrix, points) for points, _ in parts]
        rule: Rule = "evenodd" if style["fill-rule"].lower() == "evenodd" else "nonzero"
        if filled and rings and self.shapes.add_outline(rings, place.labels, rule=rule, at=at):
            return
        if stroked:
            self._strokes(parts, place, at)
        else:
            self.shapes.leave_out("shape", "without an area")

    def _strokes(self, parts: list[tuple[Array, bool]], place: _Place, at: str) -> None:
        """Add subpaths in the units of `place` as walls."""
        style, given = place.style, self.shapes.options.thickness
        least, most = stretch(place.matrix)
        own = length(style["stroke-width"], place.diagonal)
        width = own * math.sqrt(least * most) if given is None else given
        if not width > 0.0:
            self.shapes.leave_out("stroke", "without a width")
            return
        self.dashed += style["stroke-dasharray"].lower() != "none"
        limit = numbers(style["stroke-miterlimit"])
        for points, closed in parts:
            path = np.concatenate([points, points[:1]]) if closed else points
            line = Line(
                moved(place.matrix, path),
                width,
                place.labels,
                cap=_CAPS.get(style["stroke-linecap"].lower(), "flat"),
                join=_JOINS.get(style["stroke-linejoin"].lower(), "mitre"),
                mitre_limit=limit[0] if limit and limit[0] >= 1.0 else 4.0,
                stretched=(path, own, place.matrix) if given is None and most > _EVEN * least else None,
            )
            self.shapes.add_line(line, at=at)

    def _disc(self, element: Element, place: _Place, at: str) -> bool:
        """Add a filled circle that is one in metres as well; return whether it is."""
        least, most = stretch(place.matrix)
        x, y, radius = self._circle(element, place)
        if most - least > 1e-9 * most or not radius * most > 0.0:
            return False
        self.shapes.add_circle(moved(place.matrix, np.array([[x, y]]))[0], radius * most, place.labels, at=at)
        return True

    def _points(self, element: Element, place: _Place) -> list[tuple[Array, bool]]:
        """Return the subpaths of a shape, in its own units, and whether they are closed."""
        most = stretch(place.matrix)[1]
        tolerance = TOLERANCE / most if most > 0.0 else np.inf
        if element.tag == "path":
            data = element.attributes.get("d", "")
            if data.strip() == "none":
                return []
            parts, draws = subpaths(data, tolerance, MAX_VERTICES, self.draws)
            self.draws -= draws
            return parts
        if element.tag in ("polyline", "polygon"):
            values = numbers(element.attributes.get("points", ""))
            points = np.array(values[: len(values) // 2 * 2]).reshape(-1, 2)
            return [(points, element.tag == "polygon")] if len(points) > 1 else []
        if element.tag == "line":
            ends = self._lengths(element, place, ("x1", "y1", "x2", "y2"))
            return [(np.array(ends).reshape(2, 2), False)]
        if element.tag == "rect":
            return self._rectangle(element, place, tolerance)
        if element.tag == "circle":
            x, y, radius = self._circle(element, place)
            radii = [radius, radius]
        else:
            x, y, *radii = self._lengths(element, place, ("cx", "cy", "rx", "ry"))
            given = element.attributes
            radii = [radii["rx" not in given], radii["ry" in given]]
        if min(radii) <= 0.0:
            return []
        u, v = np.array([radii[0], 0.0]), np.array([0.0, radii[1]])
        return [(arc(np.array([x, y]), u, v, 0.0, 2 * np.pi, tolerance), True)]

    def _rectangle(self, element: Element, place: _Place, tolerance: float) -> list[tuple[Array, bool]]:
        x, y, width, height, *radii = self._lengths(element, place, ("x", "y", "width", "height", "rx", "ry"))
        if width <= 0.0 or height <= 0.0:
            return []
        given = [element.attributes.get(name, "auto").strip() != "auto" for name in ("rx", "ry")]
        rx = min(radii[0] if given[0] else radii[1], width / 2)
        ry = min(radii[1] if given[1] else radii[0], height / 2)
        corners = np.array([[x, y], [x + width, y], [x + width, y + height], [x, y + height]])
        if rx <= 0.0 or ry <= 0.0:
            return [(corners, True)]
        inward = np.array([[rx, ry], [-rx, ry], [-rx, -ry], [rx, -ry]])
        u, v = np.array([rx, 0.0]), np.array([0.0, ry])
        parts = []
        for k, centre in enumerate(corners + inward):
            begin = np.pi + k * np.pi / 2
            first = centre + u * np.cos(begin) + v * np.sin(begin)
            parts += [first[None], arc(centre, u, v, begin, np.pi / 2, tolerance)]
        return [(np.concatenate(parts), True)]

    def _circle(self, element: Element, place: _Place) -> tuple[float, float, float]:
        x, y = self._lengths(element, place, ("cx", "cy"))
        return x, y, length(element.attributes.get("r", "0"), place.diagonal)

    def _lengths(self, element: Element, place: _Place, names: tuple[str, ...]) -> list[float]:
        """Return lengths along x and y in turn; what is missing is 0."""
        found = []
        for name in names:
            text = element.attributes.get(name, "0").strip()
            whole = place.width if name[0] in "xw" or name in ("cx", "rx") else place.height
            found.append(0.0 if text == "auto" else length(text, whole))
        return found


def view_box(given: dict[str, str]) -> tuple[float, float, float, float] | None:
    """Return the ``viewBox`` among attributes, None where there is none of positive size.

    Raises ValueError when it is no four numbers.
    """
    if "viewBox" not in given:
        return None
    values = numbers(given["viewBox"])
    if len(values) != 4:
        raise ValueError(f"viewBox {given['viewBox'][:30]!r}, but four numbers were wanted")
    x, y, width, height = values
    return (x, y, width, height) if width > 0.0 and height > 0.0 else None
