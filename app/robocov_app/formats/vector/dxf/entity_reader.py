"""Conversion of the entities of a DXF drawing, including inserted blocks, to outlines and walls."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from robocov.errors import MapError, RobocovError, to_one_line
from robocov.mapfile.models import MAX_COORDINATE_M
from robocov.optional_imports import import_optional
from robocov.typing import FloatArray
from robocov_app.formats.geometry.curves import CURVE_TOLERANCE_M
from robocov_app.formats.geometry.shapes.collection import Shapes, WallLine
from robocov_app.formats.vector.dxf.curves import flatten_polyline, flatten_spline, to_plane
from robocov_app.formats.vector.dxf.entity_count import MAX_DRAWN_ENTITIES, require_few_entities

_SPLINE_FRAME_FLAG = 16
"""Flag of a vertex of an old polyline that is a control point of its spline, not a point on it."""
_MIN_UPWARD_COMPONENT = 1.0 - 1e-9
"""A circle whose unit normal has a smaller z component is tilted, and is an ellipse seen from above."""
_MAX_RELATIVE_GAP = 1e-9
"""A line is closed if the distance between its ends, relative to its coordinates, is at most this."""
_MAX_KIND_CHARACTERS = 40
_MAX_PLACE_CHARACTERS = 60


class _Polyline(NamedTuple):
    """The data of a polyline of any kind.

    Attributes
    ----------
    rows : (n, 5) array
        For each vertex: x, y, and the bulge, start width and end width of the edge that follows.
    is_closed : bool
    width : float
        Width of edges without a width of their own.
    plane : ezdxf.math.OCS or None
        Coordinate system of the vertices. None stands for that of the drawing.
    height : float
        Position of the vertices along the normal of the plane.
    """

    rows: FloatArray
    is_closed: bool
    width: float
    plane: Any
    height: float


class EntityReader:
    """Adds the entities of a drawing to a collection of shapes.

    Parameters
    ----------
    document : ezdxf.document.Drawing
    shapes : Shapes
    scale : float, m
        Size of a unit.
    """

    def __init__(self, document: Any, shapes: Shapes, scale: float) -> None:
        self._document = document
        self._shapes = shapes
        self._scale = scale
        self._tolerance = CURVE_TOLERANCE_M / scale
        self._drawn_count = 0
        self._has_curves = False
        hidden = (layer for layer in document.layers if layer.is_off() or layer.is_frozen())
        self._hidden_layers = {str(layer.dxf.name).casefold() for layer in hidden}
        self._adders: dict[str, Callable[[Any, tuple[str, ...], str], None]] = {
            "ARC": self._add_curve,
            "CIRCLE": self._add_circle,
            "ELLIPSE": self._add_curve,
            "HATCH": self._add_hatch,
            "LINE": self._add_segment,
            "LWPOLYLINE": self._add_polyline,
            "POINT": self._add_point,
            "POLYLINE": self._add_polyline,
            "SOLID": self._add_quadrilateral,
            "SPLINE": self._add_curve,
            "TRACE": self._add_quadrilateral,
        }

    def add_all(self) -> None:
        """Add all entities of the model space.

        Raises
        ------
        MapError
            If there are too many entities, or if a coordinate is out of range.
        """
        require_few_entities(self._document, self._shapes.source_name)
        self._add_entities(self._document.modelspace(), "0", ())
        if self._has_curves:
            self._shapes.notes.append(f"curves flattened to within {1000 * CURVE_TOLERANCE_M:g} mm")

    def _add_entities(self, entities: Iterable[Any], layer: str, blocks: tuple[str, ...]) -> None:
        """Add entities of the drawing or of a block.

        Parameters
        ----------
        entities : iterable of ezdxf.entities.DXFEntity
        layer : str
            Layer on which the innermost block is inserted. It replaces layer 0 of the entities in the block.
        blocks : tuple of str
            Names of the blocks that contain the entities, the outermost first.
        """
        for entity in entities:
            self._drawn_count += 1
            if self._drawn_count > MAX_DRAWN_ENTITIES:
                source_name = self._shapes.source_name
                raise MapError(f"{source_name}: expected at most {MAX_DRAWN_ENTITIES} entities, got more")
            try:
                entity_layer = str(entity.dxf.get("layer", "0"))
                if entity_layer == "0" and blocks:
                    entity_layer = layer
                self._add_entity(entity, entity_layer, blocks)
            except RobocovError:
                raise
            except Exception as error:  # ezdxf raises exceptions of any type for invalid attributes
                kind = to_one_line(entity.dxftype())[:20]
                self._shapes.count_omission("damaged shape", f"({kind}: {type(error).__name__})")

    def _add_entity(self, entity: Any, layer: str, blocks: tuple[str, ...]) -> None:
        """Add an entity on a layer; if it is hidden or of an unsupported kind, count it as left out."""
        kind = entity.dxftype()
        labels = (layer, *reversed(blocks))
        if layer.casefold() in self._hidden_layers or entity.dxf.get("invisible", 0):
            self._shapes.count_omission("shape", "hidden, or on layers that are off")
        elif kind == "INSERT":
            self._add_block(entity, layer, blocks)
        elif kind == "MLINE":
            self._add_entities(entity.virtual_entities(), layer, blocks)
        elif self._shapes.accept(labels):
            add = self._adders.get(kind)
            if add is None:
                self._shapes.count_omission(to_one_line(kind)[:_MAX_KIND_CHARACTERS])
            else:
                add(entity, labels, _describe_location(entity))

    def _add_block(self, insert: Any, layer: str, blocks: tuple[str, ...]) -> None:
        """Add the entities of a block at each position where it is inserted."""
        block = insert.block()
        if block is None or block.block.is_xref:
            self._shapes.count_omission("block", "missing from the file")
            return
        inserts = [insert]
        if insert.mcount > 1:
            inserts = insert.multi_insert()
        for single in inserts:
            self._add_entities(single.virtual_entities(), layer, (*blocks, str(insert.dxf.name)))

    def _add_point(self, entity: Any, labels: tuple[str, ...], location: str) -> None:
        (point,) = self._to_meters([entity.dxf.location])
        self._shapes.add_point(point, labels, location=location)

    def _add_segment(self, entity: Any, labels: tuple[str, ...], location: str) -> None:
        self._add_line(self._to_meters([entity.dxf.start, entity.dxf.end]), labels, location)

    def _add_quadrilateral(self, entity: Any, labels: tuple[str, ...], location: str) -> None:
        ring = self._to_meters(entity.wcs_vertices())
        self._shapes.add_outline([ring], labels, rule="evenodd", location=location)

    def _add_hatch(self, entity: Any, labels: tuple[str, ...], location: str) -> None:
        """Add a hatch as an area, if the option ``hatches`` is set; otherwise count it as left out."""
        if not self._shapes.options.hatches:
            self._shapes.count_omission("HATCH", "(--hatches imports them as areas)")
            return
        from ezdxf.path import from_hatch

        rings = []
        for path in from_hatch(entity):
            self._require_near(to_plane(path.control_vertices()))
            rings.append(self._to_meters(list(path.flattening(self._tolerance))))
        self._shapes.add_outline(rings, labels, rule="evenodd", location=location)

    def _add_circle(self, entity: Any, labels: tuple[str, ...], location: str) -> None:
        """Add a circle as a disc, or as a curve if it is tilted."""
        is_disc = entity.dxf.radius and abs(entity.ocs().uz.z) > _MIN_UPWARD_COMPONENT
        if not is_disc:
            self._add_curve(entity, labels, location)
            return
        radius = self._get_radius(entity)
        self._has_curves = True
        (center,) = self._to_meters([entity.ocs().to_wcs(entity.dxf.center)])
        self._shapes.add_circle(center, radius * self._scale, labels, location=location)

    def _add_curve(self, entity: Any, labels: tuple[str, ...], location: str) -> None:
        """Add a circle, arc, ellipse or spline as an outline if it is closed, otherwise as a wall."""
        points = self._flatten(entity)
        self._has_curves = True
        self._require_near(points)
        self._add_line(points * self._scale, labels, location)

    def _flatten(self, entity: Any) -> FloatArray:
        """Approximate a circle, arc, ellipse or spline by points, (k, 2) in units of the drawing."""
        kind = entity.dxftype()
        if kind == "ELLIPSE":
            self._require_near(to_plane([entity.dxf.center, entity.dxf.major_axis]))
            return to_plane(list(entity.flattening(self._tolerance)))
        if kind == "SPLINE":
            self._require_near(to_plane([*entity.control_points, *entity.fit_points]))
            return flatten_spline(entity, self._tolerance)
        tolerance = min(self._tolerance, self._get_radius(entity) / 8)
        return to_plane(list(entity.flattening(tolerance)))

    def _add_polyline(self, entity: Any, labels: tuple[str, ...], location: str) -> None:
        """Add a polyline, whose edges may be arcs; it gets the largest width of its edges."""
        polyline = _parse_polyline(entity)
        if polyline is None:
            self._shapes.count_omission("mesh")
            return
        rows = polyline.rows
        if polyline.is_closed:
            rows = np.concatenate([rows, rows[:1]])
        if len(rows) < 2:
            self._shapes.count_omission("line", "without a length")
            return
        self._require_near(rows[:, :2])
        points = flatten_polyline(rows[:, :2], rows[:, 2], self._tolerance)
        if len(points) > len(rows):
            self._has_curves = True
        plane = polyline.plane
        if plane is not None and plane.transform:
            vectors = [(x, y, polyline.height) for x, y in points.tolist()]
            points = to_plane(list(plane.points_to_wcs(vectors)))
        self._require_near(points)
        width = max(polyline.width, float(rows[:, 3:].max()))
        self._add_line(points * self._scale, labels, location, width * self._scale)

    def _add_line(
        self, points: FloatArray, labels: tuple[str, ...], location: str, width: float = 0.0
    ) -> None:
        """Add a line: as an outline if it is closed and has no width, otherwise as a wall.

        Parameters
        ----------
        points : (k, 2) array, m
        labels : tuple of str
        location : str
            Location in the file, for messages.
        width : float, m
            Width in the file; 0 if there is none. The option ``thickness`` takes precedence over it.
        """
        gap = np.abs(points[0] - points[-1])
        ends_meet = bool((gap <= _MAX_RELATIVE_GAP * np.abs(points).max()).all())
        is_closed = len(points) > 3 and ends_meet
        has_width = width > 0.0
        if is_closed and not has_width:
            self._shapes.add_outline([points[:-1]], labels, rule="evenodd", location=location)
            return
        if is_closed:
            points = np.concatenate([points[:-1], points[:1]])
        if not has_width or self._shapes.options.thickness is not None:
            width = self._shapes.thickness
        self._shapes.add_line(WallLine(points, width, labels), location=location)

    def _to_meters(self, vectors: Sequence[Any]) -> FloatArray:
        """Convert ezdxf vectors to points, (k, 2) m; third coordinates are counted as left out."""
        heights = np.array([vector[2] if len(vector) > 2 else 0.0 for vector in vectors])
        self._shapes.omissions.add_heights(heights[heights != 0.0])
        return to_plane(vectors) * self._scale

    def _get_radius(self, entity: Any) -> float:
        """Return the radius of a circle or an arc; raise MapError if it extends too far."""
        radius = abs(float(entity.dxf.radius))
        self._require_near(np.array([*to_plane([entity.dxf.center]), [radius, radius]]))
        return radius

    def _require_near(self, points: FloatArray) -> None:
        """Raise MapError if points of a curve are out of range, because flattening it might never end."""
        if not (np.abs(points) * self._scale <= MAX_COORDINATE_M).all():
            raise MapError(f"{self._shapes.source_name}: a curve beyond {MAX_COORDINATE_M:.0f} m")


def _describe_location(entity: Any) -> str:
    """Return the kind and the handle of an entity, which identify it in messages."""
    kind = entity.dxftype()
    if not entity.dxf.get("handle"):
        return to_one_line(kind)[:_MAX_PLACE_CHARACTERS]
    return to_one_line(f"{kind} {entity.dxf.handle}")[:_MAX_PLACE_CHARACTERS]


def _parse_polyline(entity: Any) -> _Polyline | None:
    """Return the data of a polyline, or None if it is a mesh."""
    if entity.dxftype() == "LWPOLYLINE":
        return _Polyline(
            rows=_to_rows(entity.get_points("xybse")),
            is_closed=bool(entity.closed),
            width=float(entity.dxf.get("const_width", 0.0)),
            plane=entity.ocs(),
            height=float(entity.dxf.get("elevation", 0.0)),
        )
    if not (entity.is_2d_polyline or entity.is_3d_polyline):
        return None
    rows = []
    for vertex in entity.vertices:
        attributes = vertex.dxf
        if not int(attributes.get("flags", 0)) & _SPLINE_FRAME_FLAG:
            edge = [float(attributes.get(key, 0.0)) for key in ("bulge", "start_width", "end_width")]
            rows.append((*attributes.location.vec2, *edge))
    plane = entity.ocs() if entity.is_2d_polyline else None
    height = 0.0
    if plane is not None:
        # The elevation of an old-style polyline is a point. Its z coordinate is the height.
        ezdxf_math = import_optional("ezdxf.math", "dxf")
        height = float(ezdxf_math.Vec3(entity.dxf.get("elevation", (0.0, 0.0, 0.0))).z)
    default_widths = [float(entity.dxf.get(f"default_{end}_width", 0.0)) for end in ("start", "end")]
    return _Polyline(
        rows=_to_rows(rows),
        is_closed=bool(entity.is_closed),
        width=max(default_widths),
        plane=plane,
        height=height,
    )


def _to_rows(rows: Sequence[Any]) -> FloatArray:
    return np.array(rows, dtype=float).reshape(-1, 5)
