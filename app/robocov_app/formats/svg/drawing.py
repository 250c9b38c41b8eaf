"""SVG drawings, read (filled shapes are areas, unfilled strokes are walls) and written (at true scale).

Filled shapes are areas, by their fill rule: solid, except for the boundary (see `Shapes`; names are
ids, classes and the labels of Inkscape's layers, of the shape and the groups around it). Shapes that are only
stroked are walls as wide as the stroke, or as the option ``thickness``, cut where they turn more sharply than
their mitre limit. Colours mean nothing. What is hidden, text and pictures are left out.

Without the option ``scale``, metres a user unit of the root, the drawing has its own size: 96 px are an inch,
mm are mm. The y axis is turned up; the lower left corner of the picture is [0, 0] m, or what an attribute
``data-origin`` of the root says. Raises MapError when it is smaller than a metre at its own scale.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal
from xml.sax.saxutils import escape

import numpy as np
import shapely
from shapely import Polygon

from robocov.arrays import Array
from robocov.environment import CircleObstacle, Environment, Obstacle, Ring, WallObstacle
from robocov.errors import MapError, to_one_line
from robocov.files.writing import replace_file
from robocov.mapfile.models import MAX_SIZE_M, MIN_SIZE_M
from robocov_app.formats.colours import Paint, parse_css_colour_on_white
from robocov_app.formats.files import MAX_VERTICES, get_map_name, require_shapes
from robocov_app.formats.files.xml_tree import MAX_ELEMENTS, MAX_NESTING, Element, read_xml_tree
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.curves import CURVE_TOLERANCE_M, flatten_arc
from robocov_app.formats.geometry.enclosed_area import Rule
from robocov_app.formats.geometry.frames import transform_points
from robocov_app.formats.geometry.polygons import compute_free_area, format_decimal
from robocov_app.formats.geometry.primitives import transform_numbers
from robocov_app.formats.geometry.rasterize import describe_unsupported
from robocov_app.formats.geometry.shape_types import PenStroke
from robocov_app.formats.geometry.shapes import Shapes, WallLine, note_colours
from robocov_app.formats.options import ReadOptions, WriteOptions
from robocov_app.formats.reports import ExportReport
from robocov_app.formats.svg import path as paths
from robocov_app.formats.svg.path import build_affine, compose, compute_stretch, parse_length, parse_numbers
from robocov_app.render.theme import DARK, LIGHT, Theme

DIGITS = 3  # decimals of millimetres by default: as fine as the free space is known at true scale
_MARGIN = 0.03  # of the longer side, around a map that is written
ROOT = re.compile(rb"<(?:[\w-]+:)?svg[\s>]")
_SMALLEST = 1.0  # a drawing smaller than this, in metres, at its own scale is a picture of something larger
_GROUPS = ("g", "a", "switch", "svg", "use")
_SHAPES = ("path", "rect", "circle", "ellipse", "line", "polyline", "polygon")
_PICTURES = ("text", "image", "foreignObject", "video", "iframe", "canvas")
_CAPS: dict[str, Literal["square", "round"]] = {"square": "square", "round": "round"}
_JOINS: dict[str, Literal["bevel", "round"]] = {"bevel": "bevel", "round": "round"}
_MAX_REFERENCES = 5  # from one gradient to the next
_EVEN = 1.0 + 1e-6  # ratio of the growth of lengths in two directions up to which a stroke has one width


def read(path: Path, options: ReadOptions) -> ForeignMap:
    root = read_xml_tree(path, "svg", "SVG", ("style", "title", "desc"))
    shapes = Shapes(root.where, options)
    drawing = _Drawing(root, shapes)
    try:
        matrix, width, height = _page(root.attributes, options.scale)
    except ValueError as error:
        root.refuse(str(error))
    left, top, *_ = _view_box(root.attributes) or (0.0, 0.0, width, height)
    corners = np.array([[left, top], [left + width, top + height]])
    (x0, y0), (x1, y1) = transform_points(matrix, corners).tolist()
    shapes.page = shapely.box(min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1))
    drawing.pixel = paths.PIXEL if options.scale is None else options.scale
    drawing.draw(matrix, width, height)
    shapes.drop_thin_outlines(options.compute_stroke_width(drawing.pixel))
    everything = shapes.geometries
    if options.scale is None and everything:
        x, y, right, top = shapely.total_bounds(everything)
        if max(right - x, top - y) < _SMALLEST:
            hint = "--scale METRES says what a unit is, as in --scale 0.01"
            found = f"{right - x:.3g} x {top - y:.3g} m at its own scale"
            raise MapError(f"{shapes.where}: expected at least {_SMALLEST:g} m, got {found}: {hint}")
    own = "at its own scale" if options.scale is None else f"a unit is {options.scale:g} m"
    shapes.notes = [own, *drawing.notes()]
    note_colours(shapes, drawing.key)
    texts = {
        each.tag: to_one_line(" ".join(each.text.split())) for each in root.children if each.text.strip()
    }
    name = texts.get("title", "")[:80] or get_map_name(path)
    return shapes.build_foreign_map(name, texts.get("desc", "")[:1000] or "Imported from SVG.", solid=True)


def _page(given: dict[str, str], scale: float | None) -> tuple[Array, float, float]:
    """Return the matrix from the root's units to metres, and the size of its viewport in these units."""
    box = _view_box(given)
    whole = {"width": box[2] if box else 300.0, "height": box[3] if box else 150.0}
    sizes = {name: given.get(name, "100%").strip() for name in whole}
    width, height = (parse_length("100%" if sizes[k] == "auto" else sizes[k], whole[k]) for k in whole)
    box = box or (0.0, 0.0, width, height)
    if width <= 0.0 or height <= 0.0:
        raise ValueError(f"expected a size, got {width:g} x {height:g} px")
    if scale is None:
        inside = paths.fit_view_box(box, width, height, given.get("preserveAspectRatio", ""))
        fit, bottom = compose(build_affine(paths.PIXEL, d=paths.PIXEL), inside), paths.PIXEL * height
    else:
        fit, bottom = (
            compose(build_affine(scale, d=scale), build_affine(e=-box[0], f=-box[1])),
            scale * box[3],
        )
    origin = parse_numbers(given.get("data-origin", "0 0"))
    if len(origin) != 2:
        raise ValueError(f"expected two numbers, got data-origin {given['data-origin'][:30]!r}")
    return compose(build_affine(d=-1.0, e=origin[0], f=origin[1] + bottom), fit), box[2], box[3]


def _view_box(given: dict[str, str]) -> tuple[float, float, float, float] | None:
    """Return the ``viewBox`` among attributes, None where there is none of positive size."""
    if "viewBox" not in given:
        return None
    values = parse_numbers(given["viewBox"])
    if len(values) != 4:
        raise ValueError(f"expected four numbers, got viewBox {given['viewBox'][:30]!r}")
    x, y, width, height = values
    return (x, y, width, height) if width > 0.0 and height > 0.0 else None


def _labels(element: Element, *, outer: tuple[str, ...] = (), inner: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Return the labels of an element among others, the innermost first, each once."""
    given = element.attributes
    names = (given.get("id", ""), given.get("label", ""), *given.get("class", "").split())
    return tuple(dict.fromkeys([*inner, *filter(None, map(str.strip, names)), *outer]))


@dataclass(frozen=True, eq=False)
class _Place:
    """Matrix from an element's units to metres, (3, 3); style; labels, the innermost first; viewport.

    `opacity`: of the groups around an element and of its own.
    """

    matrix: Array
    style: paths.Style
    labels: tuple[str, ...]
    width: float
    height: float
    depth: int = 0
    opacity: float = 1.0

    @property
    def diagonal(self) -> float:
        """Reference length of a percentage in no direction (SVG 2, section 8.9)."""
        return math.hypot(self.width, self.height) / math.sqrt(2.0)

    def radius(self, element: Element) -> float:
        return parse_length(element.attributes.get("r", "0"), self.diagonal)

    def lengths(self, element: Element, *names: str) -> list[float]:
        """Return lengths along x or y; what is missing is 0."""
        found = []
        for name in names:
            text = element.attributes.get(name, "0").strip()
            whole = self.width if name[0] in "xw" or name in ("cx", "rx") else self.height
            found.append(0.0 if text == "auto" else parse_length(text, whole))
        return found


class _Drawing:
    """Goes through the elements as they are drawn, uses and nested pictures too, and adds the shapes."""

    def __init__(self, root: Element, shapes: Shapes) -> None:
        self.root, self.shapes = root, shapes
        self.sheet = paths.StyleSheet(root.where)
        self.named: dict[str, Element] = {}
        self.draws = paths.MAX_DRAWS
        self.pixel = paths.PIXEL  # metres a unit of the root
        self.key = shapes.options.build_colour_key()
        self.dashed = self.clipped = 0
        self._last: tuple[Element, _Place, list[tuple[Array, bool]]] | None = None
        for element in root.iterate():
            if name := element.attributes.get("id"):
                self.named.setdefault(name, element)
            if element.tag == "style":
                self.sheet.add(element.text)

    def draw(self, matrix: Array, width: float, height: float) -> None:
        self._require_few()
        style = paths.inherit_style(paths.INHERITED, self.sheet.of(self.root))
        for child in self.root.children:
            self._draw(child, _Place(matrix, style, _labels(self.root), width, height))

    def notes(self) -> list[str]:
        counts = {
            "dashed strokes taken as whole": self.dashed,
            "clip paths and masks not applied": self.clipped,
            "style rules of other kinds than tag, .class and #id not applied": self.sheet.strange,
        }
        curves = (
            [f"curves flattened to within {1000 * CURVE_TOLERANCE_M:g} mm"] if self.shapes.vertices else []
        )
        return curves + [f"{count} {words}" for words, count in counts.items() if count]

    def _require_few(self) -> None:
        """Count what will be drawn, uses and all, without drawing it: a few kB may stand for billions."""
        counted: dict[Element, tuple[int, int]] = {}
        inside: set[Element] = set()

        def count(element: Element, depth: int) -> tuple[int, int]:
            if element in inside:
                element.refuse("is used within itself")
            if depth > MAX_NESTING:
                element.refuse(f"uses are nested deeper than {MAX_NESTING}")
            if element not in counted:
                inside.add(element)
                target = self._target(element)
                drawn = [*element.children, *([] if target is None else [target])]
                parts = [(1, int(element.tag in _SHAPES)), *(count(each, depth + 1) for each in drawn)]
                counted[element] = sum(part[0] for part in parts), sum(part[1] for part in parts)
                inside.discard(element)
            return counted[element]

        elements, shapes = count(self.root, 0)
        if elements > MAX_ELEMENTS:
            few = f"expected at most {MAX_ELEMENTS}"
            raise MapError(f"{self.root.where}: {few}, got {elements:.3g} elements to be drawn, uses and all")
        require_shapes(shapes, self.root.where)

    def _target(self, element: Element) -> Element | None:
        """Return what a ``use`` uses, if it is in this file."""
        if element.tag != "use":
            return None
        return self.named.get(element.attributes.get("href", "").strip().removeprefix("#"))

    def _draw(self, element: Element, outer: _Place) -> None:
        if element.tag in _PICTURES:
            self.shapes.leave_out(element.tag)
        if element.tag not in _GROUPS and element.tag not in _SHAPES:
            return
        if outer.depth > MAX_NESTING:
            element.refuse(f"nested deeper than {MAX_NESTING}")
        own = self.sheet.of(element)
        if paths.is_hidden(own):
            self.shapes.leave_out("hidden element")
            return
        self.clipped += any(own.get(name, "none") != "none" for name in ("clip-path", "mask"))
        try:
            place = replace(
                outer,
                matrix=compose(outer.matrix, paths.parse_transform(own.get("transform", ""))),
                style=paths.inherit_style(outer.style, own),
                labels=_labels(element, outer=outer.labels),
                depth=outer.depth + 1,
                opacity=outer.opacity * paths.parse_opacity(own.get("opacity", "1")),
            )
            if element.tag in _SHAPES:
                self._shape(element, place)
                return
            children, place = self._inside(element, place)
        except ValueError as error:
            element.refuse(str(error))
        for child in children:
            self._draw(child, place)

    def _inside(self, element: Element, place: _Place) -> tuple[list[Element], _Place]:
        given, target = element.attributes, self._target(element)
        if element.tag in ("use", "svg"):
            x, y = place.lengths(element, "x", "y")
            place = replace(place, matrix=compose(place.matrix, build_affine(e=x, f=y)))
        if element.tag == "use":
            if target is None:
                self.shapes.leave_out("use", "of what is not in the file")
                return [], place
            if target.tag not in ("symbol", "svg"):
                return [target], place
            style = paths.inherit_style(place.style, self.sheet.of(target))
            place = replace(place, style=style, labels=_labels(target, inner=place.labels))
            size = {name: text for name, text in given.items() if name in ("width", "height")}
            element, given = target, target.attributes | size
        elif element.tag != "svg":
            return element.children, place
        width = parse_length(given.get("width", "100%").replace("auto", "100%"), place.width)
        height = parse_length(given.get("height", "100%").replace("auto", "100%"), place.height)
        matrix, box = place.matrix, _view_box(given)
        if box is not None:
            matrix = compose(
                matrix, paths.fit_view_box(box, width, height, given.get("preserveAspectRatio", ""))
            )
            _, _, width, height = box
        return element.children, replace(place, matrix=matrix, width=width, height=height)

    def _shape(self, element: Element, place: _Place) -> None:
        style, at = place.style, f"line {element.line}"
        visible = style["visibility"].lower() not in ("hidden", "collapse")
        if visible and not self.shapes.accept(place.labels):
            return
        filled = paths.is_painted(style, "fill") and element.tag != "line"
        stroked = paths.is_painted(style, "stroke")
        if not (visible and (filled or stroked)):
            self.shapes.leave_out("hidden element")
            return
        fill, stroke = self._paint(place, "fill"), self._paint(place, "stroke")
        if filled and fill.role == "ignore":
            self.shapes.leave_out("fill", "of a colour that is left out (--ignore-colour)")
            filled = False
        if stroked and stroke.role == "ignore":
            self.shapes.leave_out("stroke", "of a colour that is left out (--ignore-colour)")
            stroked = False
        if not (filled or stroked):
            return
        if filled and self._fill(element, place, fill, at):
            if stroked:
                self._add_edges(element, place, stroke)
            return
        if stroked:
            self._strokes(self._points(element, place), place, stroke, at)
        else:
            self.shapes.leave_out("shape", "without an area")

    def _paint(self, place: _Place, what: str) -> Paint:
        """Return the colour of a fill or a stroke; the first of a gradient's colours for all of it."""
        seen = paths.compute_visible_colour(place.style, what, place.opacity, self._gradient_colour)
        written = parse_css_colour_on_white(place.style[what])
        return Paint(seen, self.key.find_role(written) or self.key.find_role(seen))

    def _gradient_colour(self, name: str) -> str | None:
        """Return the first colour of the gradient of that name, or of the one that it refers to."""
        for _ in range(_MAX_REFERENCES):
            gradient = self.named.get(name)
            if gradient is None:
                return None
            for stop in gradient.children:
                if stop.tag == "stop":
                    own = self.sheet.of(stop)
                    return own.get("stop-color") or stop.attributes.get("stop-color", "black")
            name = gradient.attributes.get("href", "").strip().removeprefix("#")
        return None

    def _fill(self, element: Element, place: _Place, paint: Paint, at: str) -> bool:
        """Add the area of a filled shape; return whether it has one that counts."""
        least, most = compute_stretch(place.matrix)
        if element.tag == "circle" and most - least <= 1e-9 * most:
            (centre,) = transform_points(place.matrix, np.array([place.lengths(element, "cx", "cy")]))
            radius = place.radius(element) * most
            if radius > 0.0:
                self.shapes.add_circle(centre, radius, place.labels, at=at, paint=paint)
                return True
        rings = [transform_points(place.matrix, points) for points, _ in self._points(element, place)]
        rule: Rule = "evenodd" if place.style["fill-rule"].lower() == "evenodd" else "nonzero"
        if not rings:
            return False
        return self.shapes.add_outline(rings, place.labels, rule=rule, at=at, thing="", paint=paint)

    def _add_edges(self, element: Element, place: _Place, paint: Paint) -> None:
        """Keep the stroke of a filled shape, which only counts where its fill turns out to be floor."""
        try:
            lines = self._lines(self._points(element, place), place, paint)
        except ValueError:  # of a width that no program writes, of a stroke that may never matter
            return
        thinnest = self.shapes.options.compute_stroke_width(self.pixel)
        wide = (line for line in lines if thinnest <= line.measure_widths()[1] <= MAX_SIZE_M)
        self.shapes.add_edges([replace(line, width=max(line.width, MIN_SIZE_M)) for line in wide])

    def _strokes(self, parts: list[tuple[Array, bool]], place: _Place, paint: Paint, at: str) -> None:
        lines = self._lines(parts, place, paint)
        if not lines:
            self.shapes.leave_out("stroke", "without a width")
            return
        thinnest = self.shapes.options.compute_stroke_width(self.pixel)
        if max(line.measure_widths()[1] for line in lines) < thinnest:
            self.shapes.leave_out("stroke", f"thinner than {thinnest:.3g} m (--min-stroke)")
            return
        self.dashed += place.style["stroke-dasharray"].lower() != "none"
        for line in lines:
            self.shapes.add_line(line, at=at)

    def _lines(self, parts: list[tuple[Array, bool]], place: _Place, paint: Paint) -> list[WallLine]:
        """Return the lines of a stroke, none where it has no width."""
        style, given = place.style, self.shapes.options.thickness
        least, most = compute_stretch(place.matrix)
        own = parse_length(style["stroke-width"], place.diagonal)
        width = own * math.sqrt(least * most) if given is None else given
        if not width > 0.0:
            return []
        limit = parse_numbers(style["stroke-miterlimit"])
        is_stretched = given is None and most > _EVEN * least
        lines = []
        for points, closed in parts:
            path = np.concatenate([points, points[:1]]) if closed else points
            line = WallLine(
                transform_points(place.matrix, path),
                width,
                place.labels,
                cap=_CAPS.get(style["stroke-linecap"].lower(), "flat"),
                join=_JOINS.get(style["stroke-linejoin"].lower(), "mitre"),
                mitre_limit=limit[0] if limit and limit[0] >= 1.0 else 4.0,
                stretched=PenStroke(path, own, place.matrix) if is_stretched else None,
                colour=paint.colour,
                role=paint.role,
            )
            lines.append(line)
        return lines

    def _points(self, element: Element, place: _Place) -> list[tuple[Array, bool]]:
        """Return the points of the subpaths of a shape, (k, 2), and whether they are closed."""
        last = self._last
        if last is None or last[0] is not element or last[1] is not place:
            last = element, place, self._compute_points(element, place)
            self._last = last
        return last[2]

    def _compute_points(self, element: Element, place: _Place) -> list[tuple[Array, bool]]:
        most = compute_stretch(place.matrix)[1]
        tolerance = CURVE_TOLERANCE_M / most if most > 0.0 else np.inf
        given = element.attributes
        match element.tag:
            case "path":
                data = given.get("d", "")
                if data.strip() == "none":
                    return []
                parts, draws = paths.parse_path(data, tolerance, MAX_VERTICES, self.draws)
                self.draws -= draws
                return parts
            case "polyline" | "polygon":
                values = parse_numbers(given.get("points", ""))
                points = np.array(values[: len(values) // 2 * 2]).reshape(-1, 2)
                return [(points, element.tag == "polygon")] if len(points) > 1 else []
            case "line":
                return [(np.array(place.lengths(element, "x1", "y1", "x2", "y2")).reshape(2, 2), False)]
            case "rect":
                return [(ring, True) for ring in _rectangle(element, place, tolerance)]
            case "circle":
                radii = [place.radius(element)] * 2
            case _:
                radii = place.lengths(element, "rx", "ry")
                radii = [radii["rx" not in given], radii["ry" in given]]
        if min(radii) <= 0.0:
            return []
        centre, (u, v) = np.array(place.lengths(element, "cx", "cy")), np.diag(radii)
        return [(flatten_arc(centre, u, v, start=0.0, sweep=2 * np.pi, tolerance=tolerance), True)]


def _rectangle(element: Element, place: _Place, tolerance: float) -> list[Array]:
    """Return the ring of a rectangle, whose corners may be round, if it has a size."""
    x, y, width, height, *radii = place.lengths(element, "x", "y", "width", "height", "rx", "ry")
    if width <= 0.0 or height <= 0.0:
        return []
    given = [element.attributes.get(name, "auto").strip() != "auto" for name in ("rx", "ry")]
    rx, ry = min(radii[not given[0]], width / 2), min(radii[given[1]], height / 2)
    corners = np.array([[x, y], [x + width, y], [x + width, y + height], [x, y + height]])
    if rx <= 0.0 or ry <= 0.0:
        return [corners]
    u, v = np.diag([rx, ry])
    inward = np.array([[rx, ry], [-rx, ry], [-rx, -ry], [rx, -ry]])
    parts = []
    for k, centre in enumerate(corners + inward):
        begin = np.pi + k * np.pi / 2
        first = centre + u * np.cos(begin) + v * np.sin(begin)
        parts += [first[None], flatten_arc(centre, u, v, start=begin, sweep=np.pi / 2, tolerance=tolerance)]
    return [np.concatenate(parts)]


@dataclass(frozen=True)
class _Pen:
    """Writes shapes in millimetres of the drawing, y down."""

    scale: float
    digits: int

    def length(self, metres: float) -> str:
        return format_decimal(metres / self.scale, self.digits)

    def rounded(self, metres: float) -> float:
        return round(metres / self.scale, self.digits) * self.scale

    def ring(self, ring: Ring, end: str = "Z") -> str:
        places = (f"{self.length(x)} {self.length(-y)}" for x, y in ring)
        return f"M{' L'.join(places)}{end}"

    def shape(self, obstacle: Obstacle) -> str:
        if isinstance(obstacle, CircleObstacle):
            x, y = obstacle.center
            kind = f'circle cx="{self.length(x)}" cy="{self.length(-y)}" r="{self.length(obstacle.radius)}"'
        elif isinstance(obstacle, WallObstacle):
            line = self.ring(obstacle.points, "")
            kind = f'path class="wall" fill="none" stroke-width="{self.length(obstacle.width)}" d="{line}"'
        else:
            rings = " ".join(self.ring(ring) for ring in (obstacle.vertices, *obstacle.holes))
            kind = f'path fill-rule="evenodd" d="{rings}"'
        title = _plain(obstacle.name or "")
        return f"<{kind}><title>{title}</title></{kind.split(' ', 1)[0]}>" if title else f"<{kind}/>"


def write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    scale = 0.001 if options.scale is None else options.scale
    pen = _Pen(scale, DIGITS if options.digits is None else options.digits)
    boundary = np.asarray(environment.boundary, dtype=float)
    margin = _MARGIN * float(np.ptp(boundary, axis=0).max())
    low, high = boundary.min(axis=0) - margin, boundary.max(axis=0) + margin
    x, y = pen.length(low[0]), pen.length(-high[1])
    width, height = pen.length(high[0] - low[0]), pen.length(high[1] - low[1])
    # where the corner is that the box gives with its decimals
    left, bottom = float(x) * scale, -(float(y) + float(height)) * scale
    page = _PAGE.format(
        size=f'width="{width}mm" height="{height}mm"',
        box=f'viewBox="{x} {y} {width} {height}" data-origin="{left!r} {bottom!r}"',
        title=_plain(environment.name),
        text=_plain(environment.description),
        light=_colours(LIGHT),
        dark=_colours(DARK),
        boundary=pen.ring(environment.boundary),
        obstacles="".join(f"{pen.shape(each)}\n" for each in environment.obstacles),
    )
    with replace_file(path) as part:
        part.write_text(page, encoding="utf-8")
    obstacles = [transform_numbers(obstacle, pen.rounded).polygon for obstacle in environment.obstacles]
    area = compute_free_area(
        Polygon([(pen.rounded(x), pen.rounded(y)) for x, y in environment.boundary]), obstacles
    )
    notes = [f"1 mm is {scale:g} m: {(high - low)[0] / scale:.6g} x {(high - low)[1] / scale:.6g} mm"]
    notes += [] if options.scale is None else [f"to import it again: --scale {scale:g}"]
    dropped = describe_unsupported(environment, names=False)
    return ExportReport("svg", (path,), environment.free_area, area, dropped, tuple(notes))


# a window shows all of it, however large it is
_PAGE = """\
<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" {size}
     {box}>
<title>{title}</title>
<desc>{text}</desc>
<style>
svg {{ max-width: 100vw; max-height: 100vh }}
#boundary {{ stroke-width: 1.5px; stroke-linejoin: miter; vector-effect: non-scaling-stroke }}
.wall {{ stroke-linecap: butt; stroke-linejoin: miter; stroke-miterlimit: 4 }}
{light}
@media (prefers-color-scheme: dark) {{
{dark}
}}
</style>
<path id="boundary" d="{boundary}"/>
<g id="obstacles">
{obstacles}</g>
</svg>
"""


def _colours(theme: Theme) -> str:
    ground, page, edge, solid = (
        "#{:02x}{:02x}{:02x}".format(*colour)
        for colour in (theme.panel, theme.background, theme.boundary, theme.obstacle)
    )
    return (
        f"svg {{ background: {ground} }}\n#boundary {{ fill: {page}; stroke: {edge} }}\n"
        f"#obstacles {{ fill: {solid} }}\n.wall {{ fill: none; stroke: {solid} }}"
    )


def _plain(text: str) -> str:
    return escape("".join(char if char.isprintable() else " " for char in text))
