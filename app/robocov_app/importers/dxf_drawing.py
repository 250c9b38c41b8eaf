"""What the model space of a DXF drawing draws: its shapes in metres, blocks carried out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from robocov.errors import MapError, RobocovError, one_line, shown
from robocov.mapfile.models import FARTHEST
from robocov_app.importers.curves import TOLERANCE
from robocov_app.importers.dxf_curves import flat, polyline, spline
from robocov_app.importers.limits import MAX_DEPTH
from robocov_app.importers.shapes import Line, Shapes

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from robocov.arrays import Array

MOST_ENTITIES = 200_000
"""That are drawn, blocks and all."""

_FRAME = 16
"""Flag of a vertex that only shapes the spline of an old polyline."""

_LEVEL = 1.0 - 1e-9
"""Upward part of the direction, of length 1, that a circle is seen from as one."""

_CLOSED = 1e-9
"""Curves whose ends are nearer, in parts of their coordinates, are closed."""


class DxfDrawing:
    """Goes through the entities and adds them to the shapes.

    Parameters
    ----------
    document : ezdxf drawing
    where : str
        What messages call the file.
    shapes : Shapes
    scale : float, m
        Of a unit.
    """

    def __init__(self, document: Any, where: str, shapes: Shapes, scale: float) -> None:
        self.document = document
        self.where = where
        self.shapes = shapes
        self.scale = scale
        self.drawn = 0
        self.curved = False
        self._hidden = {
            str(layer.dxf.name).casefold() for layer in document.layers if layer.is_off() or layer.is_frozen()
        }

    def draw(self) -> None:
        """Add all that is drawn.

        Raises
        ------
        MapError
            When a block is inserted within itself, or too much is drawn.
        """
        space = self.document.modelspace()
        self._require_few(space)
        self._draw(space, "0", ())

    def notes(self) -> list[str]:
        """Return what is worth knowing of how things were taken."""
        return [f"curves flattened to within {1000 * TOLERANCE:g} mm"] if self.curved else []

    def _require_few(self, space: Iterable[Any]) -> None:
        """Count what will be drawn, blocks and all, without drawing it: a few kB may stand for billions."""
        counted: dict[str, int] = {}
        inside: list[str] = []

        def count(entities: Iterable[Any]) -> int:
            return sum(count_insert(entity) if entity.dxftype() == "INSERT" else 1 for entity in entities)

        def count_insert(insert: Any) -> int:
            name = str(insert.dxf.get("name", "")).casefold()
            if name in inside:
                what = f"block {shown(name)} is inserted within itself, but an end was wanted"
                raise MapError(f"{self.where}: {what}")
            if len(inside) >= MAX_DEPTH:
                raise MapError(f"{self.where}: blocks nested deeper than {MAX_DEPTH}, but less was wanted")
            if name not in counted:
                block = self.document.blocks.get(name)
                inside.append(name)
                counted[name] = 0 if block is None else count(block)
                inside.pop()
            rows, columns = (int(insert.dxf.get(key, 1)) for key in ("row_count", "column_count"))
            return max(rows, 1) * max(columns, 1) * (1 + counted[name])

        total = count(space)
        if total > MOST_ENTITIES:
            # of blocks in blocks it may be too many for a float
            what = f"{min(total, 10**300):.3g} entities to be drawn, blocks and all"
            raise MapError(f"{self.where}: {what}, but at most {MOST_ENTITIES} were wanted")

    def _draw(self, entities: Iterable[Any], layer: str, blocks: tuple[str, ...]) -> None:
        """Add entities; those on layer 0 of a block are on the layer that it is inserted on."""
        for entity in entities:
            self.drawn += 1
            if self.drawn > MOST_ENTITIES:
                raise MapError(f"{self.where}: more than {MOST_ENTITIES} entities, but fewer were wanted")
            try:
                self._one(entity, layer, blocks)
            except RobocovError:
                raise
            except Exception as error:  # of ezdxf, which raises what it likes on nonsense
                self.shapes.leave_out(
                    "damaged shape", f"({one_line(entity.dxftype())[:20]}: {type(error).__name__})"
                )

    def _one(self, entity: Any, layer: str, blocks: tuple[str, ...]) -> None:
        """Add an entity, or what a block holds; see `_draw`."""
        own = str(entity.dxf.get("layer", "0"))
        own = layer if own == "0" and blocks else own
        kind = entity.dxftype()
        if own.casefold() in self._hidden or entity.dxf.get("invisible", 0):
            self.shapes.leave_out("shape", "hidden, or on layers that are off")
        elif kind == "INSERT":
            self._insert(entity, own, blocks)
        elif kind == "MLINE":
            self._draw(entity.virtual_entities(), own, blocks)
        elif self.shapes.wants(labels := (own, *reversed(blocks))):
            self._add(kind, entity, labels)

    def _insert(self, insert: Any, layer: str, blocks: tuple[str, ...]) -> None:
        """Add what a block holds, wherever it is inserted."""
        block = insert.block()
        if block is None or block.block.is_xref:
            self.shapes.leave_out("block", "missing from the file")
            return
        for single in insert.multi_insert() if insert.mcount > 1 else (insert,):
            self._draw(single.virtual_entities(), layer, (*blocks, str(insert.dxf.name)))

    def _add(self, kind: str, entity: Any, labels: tuple[str, ...]) -> None:
        """Add one entity that is no block."""
        at = one_line(f"{kind} {entity.dxf.handle}" if entity.dxf.get("handle") else kind)[:60]
        if kind == "LINE":
            ends = self._metres([entity.dxf.start, entity.dxf.end])
            self.shapes.add_line(Line(ends, self.shapes.thickness, labels), at=at)
        elif kind == "POINT":
            self.shapes.add_point(self._metres([entity.dxf.location])[0], at=at)
        elif kind in ("CIRCLE", "ARC"):
            self._arc(kind, entity, labels, at)
        elif kind == "ELLIPSE":
            self._require_near(flat([entity.dxf.center, entity.dxf.major_axis]))
            self._curve(flat(list(entity.flattening(self._tolerance))), labels, at)
        elif kind == "SPLINE":
            self._spline(entity, labels, at)
        elif kind in ("LWPOLYLINE", "POLYLINE"):
            self._polyline(kind, entity, labels, at)
        elif kind in ("SOLID", "TRACE"):
            self._outline([self._metres(entity.wcs_vertices())], labels, at)
        elif kind == "HATCH" and self.shapes.options.hatches:
            self._hatch(entity, labels, at)
        elif kind == "HATCH":
            self.shapes.leave_out("HATCH", "(--hatches takes them as areas)")
        else:
            self.shapes.leave_out(one_line(kind)[:40])

    @property
    def _tolerance(self) -> float:
        return TOLERANCE / self.scale

    def _metres(self, points: Sequence[Any]) -> Array:
        """Return points of the drawing as (k, 2) m; third coordinates are told of."""
        heights = np.array([point[2] if len(point) > 2 else 0.0 for point in points])
        self.shapes.leave_heights(heights[heights != 0.0])
        return flat(points) * self.scale

    def _require_near(self, points: Array) -> None:
        """Make sure that a curve ends, by its (k, 2) control points."""
        if not (np.abs(points) * self.scale <= FARTHEST).all():
            raise MapError(f"{self.where}: a curve beyond {FARTHEST:.0f} m, but a nearer one was wanted")

    def _outline(self, rings: list[Array], labels: tuple[str, ...], at: str) -> None:
        if not self.shapes.add_outline(rings, labels, rule="evenodd", at=at):
            self.shapes.leave_out("outline", "without an area")

    def _curve(self, points: Array, labels: tuple[str, ...], at: str) -> None:
        self.curved = True
        self._require_near(points)
        self._line(points * self.scale, labels, at)

    def _line(self, points: Array, labels: tuple[str, ...], at: str, width: float = 0.0) -> None:
        """Add (k, 2) m: an outline where they close and have no width, else a wall."""
        near = bool((np.abs(points[0] - points[-1]) <= _CLOSED * np.abs(points).max()).all())
        closed = len(points) > 3 and near
        if closed and not width > 0.0:
            self._outline([points[:-1]], labels, at)
            return
        if closed:
            points = np.concatenate([points[:-1], points[:1]])
        given = self.shapes.options.thickness
        drawn = width * self.scale if width > 0.0 and given is None else self.shapes.thickness
        self.shapes.add_line(Line(points, drawn, labels), at=at)

    def _arc(self, kind: str, entity: Any, labels: tuple[str, ...], at: str) -> None:
        centre, radius = entity.dxf.center, abs(float(entity.dxf.radius))
        self._require_near(np.array([[centre[0], centre[1]], [radius, radius]]))
        if kind == "CIRCLE" and radius > 0.0 and abs(entity.ocs().uz.z) > _LEVEL:
            self.curved = True
            (middle,) = self._metres([entity.ocs().to_wcs(centre)])
            self.shapes.add_circle(middle, radius * self.scale, labels, at=at)
            return
        self._curve(flat(list(entity.flattening(min(self._tolerance, radius / 8)))), labels, at)

    def _spline(self, entity: Any, labels: tuple[str, ...], at: str) -> None:
        self._require_near(flat([*entity.control_points, *entity.fit_points]))
        self._curve(spline(entity, self._tolerance), labels, at)

    def _polyline(self, kind: str, entity: Any, labels: tuple[str, ...], at: str) -> None:
        """Add a polyline with its bulges: columns are x, y, bulge and the widths at both ends of an edge."""
        plane, height = entity.ocs(), 0.0
        if kind == "LWPOLYLINE":
            rows = np.array(entity.get_points("xybse"), dtype=float).reshape(-1, 5)
            closed, width = bool(entity.closed), float(entity.dxf.get("const_width", 0.0))
            height = float(entity.dxf.get("elevation", 0.0))
        elif entity.is_2d_polyline or entity.is_3d_polyline:
            rows = _rows(entity)
            closed, width = bool(entity.is_closed), float(entity.dxf.get("default_start_width", 0.0))
            plane = plane if entity.is_2d_polyline else None
        else:
            self.shapes.leave_out("mesh")
            return
        if closed:
            rows = np.concatenate([rows, rows[:1]])
        if len(rows) < 2:
            self.shapes.leave_out("line", "without a length")
            return
        self._require_near(rows[:, :2])
        points = polyline(rows[:, :2], rows[:, 2], self._tolerance)
        self.curved |= len(points) > len(rows)
        if plane is not None and plane.transform:
            points = flat(list(plane.points_to_wcs([(x, y, height) for x, y in points.tolist()])))
        self._require_near(points)
        width = max(width, float(rows[:, 3:].max()))
        self._line(points * self.scale, labels, at, width)

    def _hatch(self, entity: Any, labels: tuple[str, ...], at: str) -> None:
        """Add the area within the boundary paths of a hatch, as ezdxf approximates them."""
        from ezdxf.path import from_hatch

        rings = []
        for path in from_hatch(entity):
            self._require_near(flat(path.control_vertices()))
            rings.append(self._metres(list(path.flattening(self._tolerance))))
        self._outline(rings, labels, at)


def _rows(entity: Any) -> Array:
    """Return the vertices of an old polyline as rows of x, y, bulge, and widths; not its spline's frame."""
    found = []
    for vertex in entity.vertices:
        place = vertex.dxf.location
        if not int(vertex.dxf.get("flags", 0)) & _FRAME:
            others = (float(vertex.dxf.get(key, 0.0)) for key in ("bulge", "start_width", "end_width"))
            found.append((place.x, place.y, *others))
    return np.array(found, dtype=float).reshape(-1, 5)
