"""GeoJSON (RFC 7946), in degrees or meters.

Polygons and lines are interpreted as in `Shapes.build_foreign_map`; the properties ``name``, ``kind`` and
``id`` of a feature name its shapes. Coordinates are longitude and latitude (RFC 7946, section 4) and are
projected to meters if that makes a map of at most 10 km; otherwise they are taken as meters. The member
``crs`` of the older standard is respected, and so is the member ``units`` (``meters`` or ``degrees``), which
`robocov export` writes; the option ``units`` takes precedence over both.

A file may also be a sequence of GeoJSON texts (GeoJSONSeq, RFC 8142), each preceded by a record separator.
Many programs write each text on its own line instead.
"""

import json
import re
from codecs import BOM_UTF8
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely import MultiPolygon
from shapely.geometry import mapping
from shapely.geometry.base import BaseGeometry

from robocov.environment import Environment
from robocov.errors import (
    JsonPath,
    ParameterError,
    RobocovError,
    format_count,
    format_path,
    quote,
    to_one_line,
)
from robocov.files.writing import replace_file
from robocov.optional_imports import import_optional
from robocov.typing import FloatArray
from robocov_app.formats import files
from robocov_app.formats.files import JsonFile, is_number
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geodata.georeference import LocalPlane, convert_to_meters
from robocov_app.formats.geometry.cells.rasterize import describe_unsupported
from robocov_app.formats.geometry.polygons import DEFAULT_DIGITS, compute_free_area, snap_to_grid
from robocov_app.formats.geometry.shapes.collection import BOUNDARY, Shapes, SourceGeometry
from robocov_app.formats.options import ReadOptions, WriteOptions
from robocov_app.formats.reports import ExportReport

_PLURAL = {"MultiPoint": "Point", "MultiLineString": "LineString", "MultiPolygon": "Polygon"}
_GEOMETRIES = ("Point", "LineString", "Polygon", *_PLURAL, "GeometryCollection")
_TYPE = re.compile(rb'"type"\s*:\s*"(?:FeatureCollection|Feature|%s)"' % "|".join(_GEOMETRIES).encode())
_NAME_PROPERTIES = ("name", "kind", "id")
"""Properties of a feature that name its shapes, in addition to the feature's own id."""
_RECORD_SEPARATOR = b"\x1e"
_SEQUENCE_SUFFIXES = (".geojsonl", ".geojsons", ".geojsonseq", ".jsonl", ".ldjson", ".ndjson")
_SECOND_RECORD = re.compile(rb"\}[ \t]*\r?\n\s*\{")
_EXTRA_DIGITS_OF_DEGREES = 6
"""Additional decimals of coordinates in degrees: a degree is about 100 km."""
_MAX_NAME_CHARACTERS = 80
_MAX_DESCRIPTION_CHARACTERS = 1000


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    start = head.removeprefix(BOM_UTF8).lstrip(b" \t\r\n" + _RECORD_SEPARATOR)
    return start.startswith(b"{") and _TYPE.search(head) is not None


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read the features of a GeoJSON file, or of a sequence of GeoJSON texts.

    Raises
    ------
    MapError
        If the file is not GeoJSON, or its coordinates cannot be converted to meters.
    """
    content = files.read_content(path, files.MAX_TEXT_BYTES)
    sequence = _convert_sequence_to_list(content, path.suffix.lower())
    if sequence is not None:
        content = sequence
    file = JsonFile(path, content)
    shapes = Shapes(file.source_name, options)
    collector = GeometryCollector(file, shapes)
    collector.collect(is_sequence=sequence is not None)
    document = file.document if isinstance(file.document, dict) else {}
    units = document.get("units")
    if units == "metres":  # as written by earlier versions
        units = "meters"
    if units not in (None, "meters", "degrees") and options.units is None:
        raise file.build_error(("units",), units, "meters or degrees")
    origin = _parse_origin(file, document)
    shapes.options = replace(options, units=options.units or units)
    geometries = convert_to_meters(
        collector.geometries, shapes, collector.crs, may_be_degrees=True, origin=origin
    )
    shapes.add_all(geometries)
    name = document.get("name")
    if not isinstance(name, str) or not name.strip():
        name = path.stem
    name = to_one_line(name)[:_MAX_NAME_CHARACTERS]
    description = document.get("description")
    if not isinstance(description, str):
        description = "Imported from GeoJSON."
    description = to_one_line(description)[:_MAX_DESCRIPTION_CHARACTERS]
    return shapes.build_foreign_map(name or "map", description, solid=False)


def _parse_origin(file: JsonFile, document: dict[str, Any]) -> tuple[float, float] | None:
    """Return the member ``origin``: the longitude and latitude of the map's point [0, 0], or None."""
    origin = document.get("origin")
    if origin is None:
        return None
    if isinstance(origin, list) and len(origin) == 2 and all(map(is_number, origin)):
        longitude, latitude = origin
        if abs(longitude) <= 360.0 and abs(latitude) <= 90.0:
            return float(longitude), float(latitude)
    raise file.build_error(("origin",), origin, "longitude and latitude in degrees")


def _convert_sequence_to_list(content: bytes, suffix: str) -> bytes | None:
    """Convert a sequence of GeoJSON texts to one JSON list; return None if the content is not a sequence.

    Each text stays on its line, so that error messages name the right one.
    """
    text = content.removeprefix(BOM_UTF8)
    if text.lstrip().startswith(_RECORD_SEPARATOR):
        return _convert_records_to_list(text)
    lines = text.split(b"\n")
    used = [k for k, line in enumerate(lines) if line.strip()]
    is_sequence = suffix in _SEQUENCE_SUFFIXES or _SECOND_RECORD.search(text) is not None
    if len(used) < 2 or not is_sequence or not _is_json(lines[used[0]]):
        return None
    for k in used[:-1]:
        lines[k] += b","
    return b"[" + b"\n".join(lines) + b"]"


def _convert_records_to_list(text: bytes) -> bytes:
    """Convert a sequence with record separators to a JSON list; empty records are skipped."""
    # Nothing but white space precedes the first separator.
    _, first, *others = text.split(_RECORD_SEPARATOR)
    has_record = bool(first.strip())
    pieces = [b"[", first]
    for record in others:
        is_empty = not record.strip()
        if has_record and not is_empty:
            pieces.append(b",")
        else:
            pieces.append(b" ")
        pieces.append(record)
        has_record |= not is_empty
    return b"".join(pieces) + b"]"


def _is_json(line: bytes) -> bool:
    try:
        json.loads(line)
    except (ValueError, RecursionError):
        return False
    return True


class GeometryCollector:
    """Collects the geometries in a GeoJSON file, labeled with the names of their features.

    Attributes
    ----------
    geometries : list of SourceGeometry
        The geometries, in the coordinates of the file.
    crs : str or None
        Reference system that the file names.
    """

    def __init__(self, file: JsonFile, shapes: Shapes) -> None:
        self.file = file
        self.shapes = shapes
        self.geometries: list[SourceGeometry] = []
        self.crs: str | None = None

    def collect(self, *, is_sequence: bool = False) -> None:
        """Add the geometries of the file, which is one GeoJSON text or, for a sequence, a list of them."""
        if not is_sequence:
            self._add_text(self.file.document, ())
            return
        for k, text in enumerate(self.file.document):
            self._add_text(text, (k,))

    def _add_text(self, text: Any, location: JsonPath) -> None:
        """Add a GeoJSON text: a geometry, a feature or a collection of features."""
        kind = files.get_member(text, "type")
        if kind == "FeatureCollection":
            features = text.get("features")
            if not isinstance(features, list):
                raise self.file.build_error((*location, "features"), features, "a list of features")
            self._store_reference_system(text, location)
            for k, feature in enumerate(features):
                self._add_feature(feature, (*location, "features", k))
        elif kind == "Feature":
            self._add_feature(text, location)
        elif kind == "Topology":
            raise self.file.build_error((*location, "type"), kind, "GeoJSON, not TopoJSON")
        else:
            self.add_geometry(text, location, ())

    def _add_feature(self, feature: Any, location: JsonPath) -> None:
        """Add the geometry of a feature; a feature without one is counted as left out."""
        if not isinstance(feature, dict) or feature.get("type") != "Feature":
            raise self.file.build_error(location, feature, "a Feature")
        self._store_reference_system(feature, location)
        properties = feature.get("properties") or {}
        if not isinstance(properties, dict):
            raise self.file.build_error((*location, "properties"), properties, "an object")
        if feature.get("geometry") is None:
            self.shapes.count_omission("feature", "without a geometry")
            return
        labels = _list_labels(properties, feature.get("id"))
        self.add_geometry(feature["geometry"], (*location, "geometry"), labels)

    def add_geometry(self, geometry: Any, location: JsonPath, labels: tuple[str, ...]) -> None:
        """Add a geometry, or each geometry of a collection.

        Parameters
        ----------
        geometry : object
            A geometry as parsed from JSON.
        location : JsonPath
            Keys and indices that lead to the geometry.
        labels : tuple of str
            Names of the shapes that it becomes.

        Raises
        ------
        MapError
            If the value is not a valid geometry.
        """
        kind = files.get_member(geometry, "type")
        expected = f"one of {', '.join(_GEOMETRIES)}"
        if kind is None:
            raise self.file.build_error(location, geometry, expected)
        if kind not in _GEOMETRIES:
            raise self.file.build_error((*location, "type"), kind, expected)
        self._store_reference_system(geometry, location)
        if kind != "GeometryCollection":
            self._add_coordinates(kind, geometry.get("coordinates"), (*location, "coordinates"), labels)
            return
        members = geometry.get("geometries")
        if not isinstance(members, list):
            raise self.file.build_error((*location, "geometries"), members, "a list of geometries")
        for k, member in enumerate(members):
            self.add_geometry(member, (*location, "geometries", k), labels)

    def _add_coordinates(
        self, kind: str, value: Any, location: JsonPath, labels: tuple[str, ...], parent_location: str = ""
    ) -> None:
        """Add the coordinates of a geometry.

        For a part of a multipolygon, `parent_location` is the location of the multipolygon in the file.
        """
        if kind in _PLURAL:
            if not isinstance(value, list):
                raise self.file.build_error(location, value, "a list")
            for k, member in enumerate(value):
                self._add_coordinates(
                    _PLURAL[kind], member, (*location, k), labels, parent_location=format_path(location)
                )
        elif value == []:
            self.shapes.count_omission("geometry", "without coordinates")
        elif kind == "Point":
            point = self._parse_points([value], location, 1)
            self.geometries.append(SourceGeometry("point", (point,), labels, format_path(location)))
        elif kind == "LineString":
            line = self._parse_points(value, location, 2)
            self.geometries.append(SourceGeometry("line", (line,), labels, format_path(location)))
        elif not isinstance(value, list):
            raise self.file.build_error(location, value, "a list of rings")
        else:
            rings = [self._parse_points(ring, (*location, k), 1) for k, ring in enumerate(value)]
            self.geometries.append(
                self.shapes.build_polygon(rings, labels, format_path(location), parent_location)
            )

    def _parse_points(self, value: Any, location: JsonPath, min_count: int) -> FloatArray:
        points = self.file.parse_points(
            value, location, min_count=min_count, min_dimensions=2, max_dimensions=4
        )
        return self.shapes.drop_heights(points)

    def _store_reference_system(self, member: dict[str, Any], location: JsonPath) -> None:
        """Store the coordinate reference system that an object names (GeoJSON before RFC 7946).

        Raise MapError if it differs from the one of an earlier object.
        """
        value = member.get("crs")
        if value is None:
            return
        name = files.get_member(files.get_member(value, "properties"), "name")
        if not isinstance(name, str):
            raise self.file.build_error((*location, "crs"), value, "the name of a reference system")
        if self.crs not in (None, name):
            raise self.file.build_error((*location, "crs"), value, f"the same system as before, {self.crs}")
        self.crs = name


def _list_labels(properties: dict[str, Any], identifier: Any) -> tuple[str, ...]:
    """Return the distinct names of a feature."""
    values = [*(properties.get(name) for name in _NAME_PROPERTIES), identifier]
    labels = [to_one_line(value).strip() for value in values if type(value) in (str, int)]
    kind = properties.get("kind")
    if isinstance(kind, str) and kind.casefold() != BOUNDARY:
        # A feature of another kind is not the boundary, even if its name is "boundary".
        labels = [label for label in labels if label.casefold() != BOUNDARY]
    return tuple(dict.fromkeys(filter(None, labels)))


@dataclass
class _WrittenShapes:
    """The shapes of a map as written to a file, rounded to its number of decimals.

    Attributes
    ----------
    features : list of str
        JSON of each feature.
    areas : list of geometry, m
        The boundary, followed by the obstacles, as a reader of the file would get them.
    lost : int
        Number of shapes that rounding reduced to nothing.
    crosses_antimeridian : bool
    """

    features: list[str] = field(default_factory=list)
    areas: list[BaseGeometry] = field(default_factory=list)
    lost: int = 0
    crosses_antimeridian: bool = False


def write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    """Write the boundary and the obstacles of an environment as features.

    Raises
    ------
    ParameterError
        If the option ``origin`` is too near a pole, or pyproj is missing.
    OutputError
        If the file cannot be written.
    """
    origin = options.origin
    digits = options.digits
    if digits is None:
        digits = DEFAULT_DIGITS
        if origin is not None:
            digits += _EXTRA_DIGITS_OF_DEGREES
    header: dict[str, Any] = {"type": "FeatureCollection", "name": environment.name}
    if environment.description:
        header["description"] = environment.description
    plane = None
    if origin is None:
        header["units"] = "meters"
        remark = "other programs expect degrees in GeoJSON (--origin writes them)"
        notes = [f"in meters, {digits} decimals; {remark}"]
    else:
        plane = _build_plane(environment, origin)
        longitude, latitude = origin
        header["units"] = "degrees"
        header["origin"] = [longitude, latitude]
        notes = [f"in degrees about longitude {longitude:.10g}, latitude {latitude:.10g}"]
    written = _format_shapes(environment, plane, digits)
    if written.crosses_antimeridian:
        notes.append("longitudes continue beyond 180 degrees: shapes are not cut at the antimeridian")
    if written.lost:
        verb = "vanishes" if written.lost == 1 else "vanish"
        notes.append(f"{format_count(written.lost, 'shape')} {verb} with {digits} decimals")
    members = json.dumps(header, ensure_ascii=False, indent=1).removesuffix("\n}")
    lines = ",\n".join(written.features)
    with replace_file(path) as temporary:
        temporary.write_text(f'{members},\n "features": [\n{lines}\n]}}\n', encoding="utf-8")
    boundary, *obstacles = written.areas
    area_written = compute_free_area(boundary, obstacles)
    dropped = describe_unsupported(environment, names=False)
    return ExportReport(
        format="geojson",
        files=(path,),
        area=environment.free_area,
        area_written=area_written,
        dropped=dropped,
        notes=tuple(notes),
    )


def _format_shapes(environment: Environment, plane: LocalPlane | None, digits: int) -> _WrittenShapes:
    """Format the boundary and the obstacles as features, in degrees if `plane` is given, else in meters."""
    written = _WrittenShapes()
    _format_shape(written, environment.boundary_polygon, {"kind": "boundary"}, plane, digits)
    for obstacle in environment.obstacles:
        properties = {"kind": "obstacle"}
        if obstacle.name is not None:
            properties["name"] = obstacle.name
        _format_shape(written, obstacle.polygon, properties, plane, digits)
    return written


def _format_shape(
    written: _WrittenShapes,
    shape: BaseGeometry,
    properties: dict[str, str],
    plane: LocalPlane | None,
    digits: int,
) -> None:
    """Round a shape, in m, format it as a feature and add it to `written`."""
    if plane is None:
        polygons = snap_to_grid(shape, digits)
        written.areas.append(MultiPolygon(polygons))
    else:
        # Meters are rounded first, so that shapes which touch after reading touch here as well.
        rounded = MultiPolygon(snap_to_grid(shape, DEFAULT_DIGITS))
        polygons = snap_to_grid(shapely.transform(rounded, plane.to_degrees), digits)
        written.areas.append(shapely.transform(MultiPolygon(polygons), plane.to_meters))
        for polygon in polygons:
            west, _, east, _ = polygon.bounds
            written.crosses_antimeridian |= max(abs(west), abs(east)) > 180.0
    if not polygons:
        written.lost += 1
        return
    geometry = MultiPolygon(polygons)
    if len(polygons) == 1:
        geometry = polygons[0]
    feature = {"type": "Feature", "properties": properties, "geometry": mapping(geometry)}
    written.features.append(json.dumps(feature, ensure_ascii=False))


def _build_plane(environment: Environment, origin: tuple[float, float]) -> LocalPlane:
    """Build the plane around an origin; raise ParameterError if the map spans too many longitudes."""
    longitude, latitude = origin
    try:
        plane = LocalPlane(import_optional("pyproj", "geo"), longitude, latitude)
    except RobocovError as error:
        raise ParameterError(f"origin: degrees need more: {error}") from None
    corners = plane.to_degrees(np.array(environment.boundary, dtype=float))
    if np.ptp(corners[:, 0]) >= 180.0:
        problem = "the map would span half of all longitudes: expected a position farther from the pole"
        raise ParameterError(f"origin: {quote(origin)}: {problem}")
    return plane
