"""DXF drawings.

Closed outlines (polylines, circles, ellipses, closed splines, filled quadrilaterals) are solid, but for the
boundary; lines, arcs and open polylines are walls as wide as they are drawn, or as the option ``thickness``.
Names are those of layers and blocks: see `Shapes.build_foreign_map`. Blocks are carried out wherever they are
inserted. Layers that are off or frozen, texts, dimensions and what has a third dimension are left out; so are
hatches without the option ``hatches``. Curves become lines that stay within a millimeter. The option
``scale`` overrules the unit of the header; one of them is needed.
"""

import logging
import math
import re
from collections.abc import Iterable, Sequence
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import BSpline

from robocov.arrays import Array
from robocov.errors import MapError, RobocovError, quote, to_one_line
from robocov.mapfile.models import MAX_COORDINATE_M
from robocov.optional_imports import import_optional
from robocov_app.formats import files
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.curves import CURVE_TOLERANCE_M, MAX_POINTS, sample_curve
from robocov_app.formats.geometry.shapes import Shapes, WallLine
from robocov_app.formats.options import ReadOptions

MAX_LINES = 8_000_000
"""Largest number of lines of text: a line of the drawing takes about 24, a vertex 4."""
MAX_ENTITIES = 50_000
"""Largest number of entities on all layers: ezdxf takes an eighth of a millisecond and 5 kB for each."""
MAX_DRAWN_ENTITIES = 200_000
"""Largest number of entities drawn, including those of inserted blocks."""
UNITS = {  # of the header's $INSUNITS, with their meters
    1: ("inches", 0.0254), 2: ("feet", 0.3048), 3: ("miles", 1609.344), 4: ("millimeters", 0.001),
    5: ("centimeters", 0.01), 6: ("meters", 1.0), 7: ("kilometers", 1000.0), 9: ("mils", 2.54e-5),
    10: ("yards", 0.9144), 13: ("micrometers", 1e-6), 14: ("decimeters", 0.1), 15: ("decameters", 10.0),
    16: ("hectometers", 100.0), 21: ("US survey feet", 1200 / 3937),
}  # fmt: skip
BINARY = b"AutoCAD Binary DXF"
TEXT = re.compile(rb"(?:\xef\xbb\xbf)?\s*(?:999[ \t]*\r?\n[^\n]*\n\s*)*0[ \t]*\r?\n[ \t]*SECTION\b")
_ENTITY = re.compile(rb"\n[ \t]*0[ \t]*\r?\n[ \t]*[A-Z]")
_POINT = re.compile(rb"\n[ \t]*10[ \t]*\r?\n")
_BULGE = 1e-9  # edges of polylines that are bent less are straight
_FRAME = 16  # flag of a vertex that only shapes the spline of an old polyline
_LEVEL = 1.0 - 1e-9  # upward part of the direction, of length 1, that a circle is seen from as one
_CLOSED = 1e-9  # curves whose ends are nearer, in parts of their coordinates, are closed


def polyline(points: Array, bulges: Array, tolerance: float) -> Array:
    """Return points of a polyline, (k, 2); the bulge of an edge after one is tan(angle / 4), to the left."""
    arcs = import_optional("ezdxf.math", "dxf")
    drawn = [points[:1]]
    left = float(MAX_POINTS)
    for (a, b), bulge in zip(pairwise(points), bulges[:-1].tolist(), strict=True):
        if abs(bulge) > _BULGE and (a != b).any():
            center, begin, end, radius = arcs.bulge_to_arc(a, b, bulge)
            left -= 4 * math.atan(abs(bulge)) * math.sqrt(radius / tolerance / 8)
            if not left > 0.0:
                raise ValueError(f"expected at most {MAX_POINTS} points, got more")
            arc = arcs.ConstructionArc(center, radius, *np.degrees([begin, end]))
            curve = flat(list(arc.flattening(min(tolerance, radius / 8))))
            drawn.append((curve if bulge > 0.0 else curve[::-1])[1:-1])
        drawn.append(b[None])
    return np.concatenate(drawn)


def spline(entity: Any, tolerance: float) -> Array:
    """Return points of an ezdxf spline: a rational B-spline, between the knots where it is defined.

    Its own `flattening` goes on to where it is not, which spoils closed ones (ezdxf 1.4). L. Piegl, W.
    Tiller, The NURBS Book, 2nd edition, Springer 1997, section 4.2.
    """
    tool = entity.construction_tool()
    control, knots, degree = flat(tool.control_points), np.array(tool.knots(), dtype=float), tool.degree
    weights = np.array(tool.weights() or np.ones(len(control)), dtype=float)
    if not np.isfinite(knots).all() or not (np.isfinite(weights).all() and (weights > 0.0).all()):
        raise ValueError("expected finite knots and weights of a spline")
    rational = BSpline(knots, np.column_stack([control, np.ones(len(control))]) * weights[:, None], degree)

    def curve(t: Array) -> Array:
        found = rational(t)
        return np.asarray(found[:, :2] / found[:, 2:])

    return sample_curve(curve, np.unique(knots[degree : len(control) + 1]), tolerance)


def flat(points: Sequence[Any]) -> Array:
    """Return ezdxf vectors as (k, 2)."""
    return np.array([(point[0], point[1]) for point in points], dtype=float).reshape(-1, 2)


class DxfDrawing:
    """Adds the entities of a drawing to the shapes; `scale` is the size of a unit in meters."""

    def __init__(self, document: Any, shapes: Shapes, scale: float) -> None:
        self.document, self.where, self.shapes, self.scale = document, shapes.where, shapes, scale
        self.tolerance = CURVE_TOLERANCE_M / scale
        self.drawn = 0
        self.curved = False
        hidden = (layer for layer in document.layers if layer.is_off() or layer.is_frozen())
        self._hidden = {str(layer.dxf.name).casefold() for layer in hidden}

    def draw(self) -> None:
        """Add all entities of the model space to the shapes."""
        space = self.document.modelspace()
        self._require_few(space)
        self._draw(space, "0", ())
        if self.curved:
            self.shapes.notes.append(f"curves flattened to within {1000 * CURVE_TOLERANCE_M:g} mm")

    def _require_few(self, space: Iterable[Any]) -> None:
        """Count what will be drawn, blocks and all, without drawing it: a few kB may stand for billions."""
        where, deepest = self.where, files.MAX_DEPTH
        counted: dict[str, int] = {}
        inside: list[str] = []

        def count(entities: Iterable[Any]) -> int:
            return sum(count_insert(entity) if entity.dxftype() == "INSERT" else 1 for entity in entities)

        def count_insert(insert: Any) -> int:
            name = str(insert.dxf.get("name", "")).casefold()
            if name in inside:
                what = "is inserted into itself"
                raise MapError(f"{where}: block {quote(name)} {what}")
            if len(inside) >= deepest:
                raise MapError(f"{where}: blocks are nested deeper than {deepest}")
            if name not in counted:
                block = self.document.blocks.get(name)
                inside.append(name)
                counted[name] = 0 if block is None else count(block)
                inside.pop()
            rows, columns = (int(insert.dxf.get(key, 1)) for key in ("row_count", "column_count"))
            return max(rows, 1) * max(columns, 1) * (1 + counted[name])

        total = count(space)
        if total > MAX_DRAWN_ENTITIES:
            # of blocks in blocks it may be too many for a float
            found = f"{min(total, 10**300):.3g} entities to be drawn, blocks and all"
            raise MapError(f"{where}: expected at most {MAX_DRAWN_ENTITIES}, got {found}")

    def _draw(self, entities: Iterable[Any], layer: str, blocks: tuple[str, ...]) -> None:
        """Add entities; those on layer 0 of a block are on the layer that it is inserted on."""
        for entity in entities:
            self.drawn += 1
            if self.drawn > MAX_DRAWN_ENTITIES:
                raise MapError(f"{self.where}: expected at most {MAX_DRAWN_ENTITIES} entities, got more")
            try:
                own = str(entity.dxf.get("layer", "0"))
                self._one(entity, layer if own == "0" and blocks else own, blocks)
            except RobocovError:
                raise
            except Exception as error:  # of ezdxf, which raises what it likes on nonsense
                kind = to_one_line(entity.dxftype())[:20]
                self.shapes.leave_out("damaged shape", f"({kind}: {type(error).__name__})")

    def _one(self, entity: Any, layer: str, blocks: tuple[str, ...]) -> None:
        shapes, kind, labels = self.shapes, entity.dxftype(), (layer, *reversed(blocks))
        at = to_one_line(f"{kind} {entity.dxf.handle}" if entity.dxf.get("handle") else kind)[:60]
        if layer.casefold() in self._hidden or entity.dxf.get("invisible", 0):
            shapes.leave_out("shape", "hidden, or on layers that are off")
        elif kind == "INSERT":
            block = entity.block()
            if block is None or block.block.is_xref:
                shapes.leave_out("block", "missing from the file")
                return
            for single in entity.multi_insert() if entity.mcount > 1 else (entity,):
                self._draw(single.virtual_entities(), layer, (*blocks, str(entity.dxf.name)))
        elif kind == "MLINE":
            self._draw(entity.virtual_entities(), layer, blocks)
        elif not shapes.accept(labels):
            return
        elif kind == "POINT":
            shapes.add_point(self._meters([entity.dxf.location])[0], at=at)
        elif kind in ("SOLID", "TRACE"):
            shapes.add_outline([self._meters(entity.wcs_vertices())], labels, rule="evenodd", at=at)
        elif kind == "HATCH" and shapes.options.hatches:
            shapes.add_outline(self._hatch(entity), labels, rule="evenodd", at=at)
        elif kind == "HATCH":
            shapes.leave_out("HATCH", "(--hatches takes them as areas)")
        elif kind == "CIRCLE" and entity.dxf.radius and abs(entity.ocs().uz.z) > _LEVEL:
            radius = self._radius(entity)
            self.curved = True
            (middle,) = self._meters([entity.ocs().to_wcs(entity.dxf.center)])
            shapes.add_circle(middle, radius * self.scale, labels, at=at)
        elif kind in ("LWPOLYLINE", "POLYLINE"):
            self._polyline(entity, labels, at)
        elif kind == "LINE":
            self._line(self._meters([entity.dxf.start, entity.dxf.end]), labels, at)
        elif (curve := self._curve(kind, entity)) is not None:
            self.curved = True
            self._require_near(curve)
            self._line(curve * self.scale, labels, at)
        else:
            shapes.leave_out(to_one_line(kind)[:40])

    def _meters(self, points: Sequence[Any]) -> Array:
        """Return points of the drawing as (k, 2) m; third coordinates are counted."""
        heights = np.array([point[2] if len(point) > 2 else 0.0 for point in points])
        self.shapes.tally.add_heights(heights[heights != 0.0])
        return flat(points) * self.scale

    def _require_near(self, points: Array) -> None:
        """Make sure that a curve ends, by its (k, 2) control points."""
        if not (np.abs(points) * self.scale <= MAX_COORDINATE_M).all():
            raise MapError(f"{self.where}: a curve beyond {MAX_COORDINATE_M:.0f} m")

    def _radius(self, entity: Any) -> float:
        radius = abs(float(entity.dxf.radius))
        self._require_near(np.array([*flat([entity.dxf.center]), [radius, radius]]))
        return radius

    def _curve(self, kind: str, entity: Any) -> Array | None:
        """Return points of a curve, (k, 2); None of what is none."""
        if kind in ("CIRCLE", "ARC"):
            return flat(list(entity.flattening(min(self.tolerance, self._radius(entity) / 8))))
        if kind == "ELLIPSE":
            self._require_near(flat([entity.dxf.center, entity.dxf.major_axis]))
            return flat(list(entity.flattening(self.tolerance)))
        if kind == "SPLINE":
            self._require_near(flat([*entity.control_points, *entity.fit_points]))
            return spline(entity, self.tolerance)
        return None

    def _line(self, points: Array, labels: tuple[str, ...], at: str, width: float = 0.0) -> None:
        """Add (k, 2) m: an outline where they close and have no width, else a wall."""
        near = bool((np.abs(points[0] - points[-1]) <= _CLOSED * np.abs(points).max()).all())
        closed = len(points) > 3 and near
        if closed and not width > 0.0:
            self.shapes.add_outline([points[:-1]], labels, rule="evenodd", at=at)
            return
        if closed:
            points = np.concatenate([points[:-1], points[:1]])
        given = self.shapes.options.thickness
        drawn = width * self.scale if width > 0.0 and given is None else self.shapes.thickness
        self.shapes.add_line(WallLine(points, drawn, labels), at=at)

    def _polyline(self, entity: Any, labels: tuple[str, ...], at: str) -> None:
        """Add a polyline with its bulges: columns are x, y, bulge and the widths at both ends of an edge."""
        plane, height, dxf = entity.ocs(), 0.0, entity.dxf
        if entity.dxftype() == "LWPOLYLINE":
            rows = entity.get_points("xybse")
            closed, width = bool(entity.closed), float(dxf.get("const_width", 0.0))
            height = float(dxf.get("elevation", 0.0))
        elif entity.is_2d_polyline or entity.is_3d_polyline:
            parts = [each.dxf for each in entity.vertices if not int(each.dxf.get("flags", 0)) & _FRAME]
            more = ("bulge", "start_width", "end_width")
            rows = [(*part.location.vec2, *(float(part.get(key, 0.0)) for key in more)) for part in parts]
            closed, width = bool(entity.is_closed), float(dxf.get("default_start_width", 0.0))
            plane = plane if entity.is_2d_polyline else None
        else:
            self.shapes.leave_out("mesh")
            return
        rows = np.array(rows, dtype=float).reshape(-1, 5)
        if closed:
            rows = np.concatenate([rows, rows[:1]])
        if len(rows) < 2:
            self.shapes.leave_out("line", "without a length")
            return
        self._require_near(rows[:, :2])
        points = polyline(rows[:, :2], rows[:, 2], self.tolerance)
        self.curved |= len(points) > len(rows)
        if plane is not None and plane.transform:
            points = flat(list(plane.points_to_wcs([(x, y, height) for x, y in points.tolist()])))
        self._require_near(points)
        width = max(width, float(rows[:, 3:].max()))
        self._line(points * self.scale, labels, at, width)

    def _hatch(self, entity: Any) -> list[Array]:
        from ezdxf.path import from_hatch

        rings = []
        for path in from_hatch(entity):
            self._require_near(flat(path.control_vertices()))
            rings.append(self._meters(list(path.flattening(self.tolerance))))
        return rings


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return head.startswith(BINARY) or TEXT.match(head) is not None


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read a drawing.

    Raises
    ------
    MapError
        If the file is damaged, too large, or contains no map.
    """
    where = to_one_line(path)
    document = _document(path, where)
    code = document.header.get("$INSUNITS", 0)
    if options.scale is not None:
        unit, scale = f"a unit is {options.scale:g} m", options.scale
    elif code in UNITS:
        unit, scale = f"in {UNITS[code][0]}", UNITS[code][1]
    else:
        hint = "--scale METERS says what it is, as in --scale 0.001 for millimeters"
        raise MapError(f"{where}: $INSUNITS: expected a unit, got {code}: {hint}")
    shapes = Shapes(where, options)
    shapes.notes.append(unit)
    DxfDrawing(document, shapes, scale).draw()
    shapes.join_lines()
    files.require_shapes(len(shapes.lines) + len(shapes.outlines), where)
    return shapes.build_foreign_map(files.get_map_name(path), "Imported from DXF.", solid=True)


def _document(path: Path, where: str) -> Any:
    """Return the drawing as ezdxf has it, recovered where it has faults; what takes long is refused."""
    content = files.read_content(path, files.MAX_TEXT_BYTES)
    if not content.startswith(BINARY):
        if not TEXT.match(content):
            raise MapError(
                f"{where}: expected a DXF with sections, got a file that begins with {content[:20]!r}"
            )
        if sum(1 for _ in islice(_ENTITY.finditer(content), MAX_ENTITIES + 1)) > MAX_ENTITIES:
            raise MapError(f"{where}: expected at most {MAX_ENTITIES} entities, got more")
        points = islice(_POINT.finditer(content), files.MAX_VERTICES + 1)
        files.require_vertices(sum(1 for _ in points), where)
    if (lines := content.count(b"\n")) > MAX_LINES:
        raise MapError(f"{where}: expected at most {MAX_LINES}, got {lines} lines")
    try:
        ezdxf, recover = import_optional("ezdxf", "dxf"), import_optional("ezdxf.recover", "dxf")
    except RobocovError as error:
        raise MapError(f"{where}: {error}") from None
    logging.getLogger("ezdxf").addHandler(logging.NullHandler())  # what it notes is no answer of ours
    for read in (ezdxf.readfile, lambda file: recover.readfile(file)[0]):
        try:
            return read(path)
        except OSError as error:
            raise MapError(f"{where}: cannot be read: {error.strerror or error}") from None
        except Exception as error:  # it raises what it likes on nonsense
            reason = to_one_line(error) or type(error).__name__
    raise MapError(f"{where}: no DXF that can be read: {reason[:200]}")
