"""GeoJSON (RFC 7946), in degrees or metres.

Polygons and lines are interpreted as in `Shapes.build_foreign_map`; the properties ``name``, ``kind`` and
``id`` of a feature name its shapes. Coordinates are longitude and latitude (RFC 7946, section 4) and are
projected to metres, if that makes a map of at most 10 km; else they are metres. The member ``crs`` of the
older standard is obeyed, as is a member ``units`` (``metres`` or ``degrees``), which `robocov export` writes;
the option overrules both.

A file may also be a sequence of such texts (GeoJSONSeq, RFC 8142): each after a record separator, or, as many
programs write it, each on a line of its own.
"""

import json
import re
from codecs import BOM_UTF8
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely import MultiPolygon
from shapely.geometry import mapping

from robocov.arrays import Array
from robocov.environment import Environment
from robocov.errors import JsonPath as Steps
from robocov.errors import ParameterError, RobocovError, format_path, quote, to_one_line
from robocov.files.writing import replace_file
from robocov.optional_imports import import_optional
from robocov_app.formats import files
from robocov_app.formats.files import JsonFile, is_number
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.polygons import DEFAULT_DIGITS, compute_free_area, snap_to_grid
from robocov_app.formats.geometry.rasterize import describe_unsupported
from robocov_app.formats.geometry.shapes import BOUNDARY, Shapes, SourceGeometry
from robocov_app.formats.georeference import LocalPlane, in_metres
from robocov_app.formats.options import ReadOptions, WriteOptions
from robocov_app.formats.reports import ExportReport

_PLURAL = {"MultiPoint": "Point", "MultiLineString": "LineString", "MultiPolygon": "Polygon"}
_GEOMETRIES = ("Point", "LineString", "Polygon", *_PLURAL, "GeometryCollection")
_TYPE = re.compile(rb'"type"\s*:\s*"(?:FeatureCollection|Feature|%s)"' % "|".join(_GEOMETRIES).encode())
_NAMES = ("name", "kind", "id")  # properties of a feature that name its shapes; its own id does too
_RECORD_SEPARATOR = b"\x1e"
_LINES_SUFFIXES = (".geojsonl", ".geojsons", ".geojsonseq", ".jsonl", ".ldjson", ".ndjson")
_SECOND_RECORD = re.compile(rb"\}[ \t]*\r?\n\s*\{")
_FINER = 6  # so many more decimals have degrees: one is about a hundred kilometres


def sniff(path: Path, head: bytes) -> bool:
    begin = head.removeprefix(BOM_UTF8).lstrip(b" \t\r\n" + _RECORD_SEPARATOR)
    return begin.startswith(b"{") and _TYPE.search(head) is not None


def read(path: Path, options: ReadOptions) -> ForeignMap:
    content = files.read_content(path, files.MAX_TEXT_BYTES)
    sequence = _as_list(content, path.suffix.lower())
    file = JsonFile(path, content if sequence is None else sequence)
    shapes = Shapes(file.where, options)
    found = FigureCollector(file, shapes)
    found.collect(is_sequence=sequence is not None)
    document = file.document if isinstance(file.document, dict) else {}
    units, origin = document.get("units"), document.get("origin")
    if units not in (None, "metres", "degrees") and options.units is None:
        raise file.build_error(("units",), units, "metres or degrees")
    if origin is not None:
        good = isinstance(origin, list) and len(origin) == 2 and all(map(is_number, origin))
        if not good or not (abs(origin[0]) <= 360.0 and abs(origin[1]) <= 90.0):
            raise file.build_error(("origin",), origin, "longitude and latitude in degrees")
        origin = float(origin[0]), float(origin[1])
    shapes.options = replace(options, units=options.units or units)
    shapes.add_all(in_metres(found.figures, shapes, found.crs, globe=True, origin=origin))
    named, text = document.get("name"), document.get("description")
    name = to_one_line(named if isinstance(named, str) and named.strip() else path.stem)[:80]
    text = to_one_line(text)[:1000] if isinstance(text, str) else "Imported from GeoJSON."
    return shapes.build_foreign_map(name or "map", text, solid=False)


def _as_list(content: bytes, suffix: str) -> bytes | None:
    """Return a sequence of GeoJSON texts as a JSON list with the same lines; None where it is no sequence."""
    text = content.removeprefix(BOM_UTF8)
    if text.lstrip().startswith(_RECORD_SEPARATOR):
        # each separator becomes a comma, but the first, and those that nothing stands between
        _, first, *others = text.split(_RECORD_SEPARATOR)
        has_record = bool(first.strip())
        pieces = [b"[", first]
        for record in others:
            is_next = has_record and bool(record.strip())
            pieces.append(b"," + record if is_next else b" " + record)
            has_record |= bool(record.strip())
        return b"".join(pieces) + b"]"
    lines = text.split(b"\n")
    used = [k for k, line in enumerate(lines) if line.strip()]
    is_sequence = suffix in _LINES_SUFFIXES or _SECOND_RECORD.search(text) is not None
    if len(used) < 2 or not is_sequence or not _is_json(lines[used[0]]):
        return None
    for k in used[:-1]:
        lines[k] += b","
    return b"[" + b"\n".join(lines) + b"]"


def _is_json(line: bytes) -> bool:
    try:
        json.loads(line)
    except (ValueError, RecursionError):
        return False
    return True


class FigureCollector:
    """Goes through GeoJSON and collects its geometries, with the names of the features that hold them.

    Attributes
    ----------
    figures : list of Figure
        In the coordinates of the file.
    crs : str or None
        Reference system that the file names.
    """

    def __init__(self, file: JsonFile, shapes: Shapes) -> None:
        self.file = file
        self.shapes = shapes
        self.figures: list[SourceGeometry] = []
        self.crs: str | None = None

    def collect(self, *, is_sequence: bool = False) -> None:
        """Add what the file holds: one GeoJSON text, or a list of them that stands for a sequence."""
        if not is_sequence:
            self._add_text(self.file.document, ())
            return
        for k, text in enumerate(self.file.document):
            self._add_text(text, (k,))

    def _add_text(self, text: Any, at: Steps) -> None:
        """Add a GeoJSON text: a geometry, a feature or a collection of features."""
        kind = text.get("type") if isinstance(text, dict) else None
        if kind == "FeatureCollection":
            features = text.get("features")
            if not isinstance(features, list):
                raise self.file.build_error((*at, "features"), features, "a list of features")
            self._see_system(text, at)
            for k, feature in enumerate(features):
                self._feature(feature, (*at, "features", k))
        elif kind == "Feature":
            self._feature(text, at)
        elif kind == "Topology":
            raise self.file.build_error((*at, "type"), kind, "GeoJSON, not TopoJSON")
        else:
            self.add_geometry(text, at, ())

    def _feature(self, feature: Any, at: Steps) -> None:
        if not isinstance(feature, dict) or feature.get("type") != "Feature":
            raise self.file.build_error(at, feature, "a Feature")
        self._see_system(feature, at)
        properties = feature.get("properties") or {}
        if not isinstance(properties, dict):
            raise self.file.build_error((*at, "properties"), properties, "an object")
        given = [*(properties.get(name) for name in _NAMES), feature.get("id")]
        labels = [to_one_line(label).strip() for label in given if type(label) in (str, int)]
        kind = properties.get("kind")
        if isinstance(kind, str) and kind.casefold() != BOUNDARY:  # whatever it is called
            labels = [label for label in labels if label.casefold() != BOUNDARY]
        if feature.get("geometry") is None:
            self.shapes.leave_out("feature", "without a geometry")
        else:
            self.add_geometry(
                feature["geometry"], (*at, "geometry"), tuple(dict.fromkeys(filter(None, labels)))
            )

    def add_geometry(self, geometry: Any, at: Steps, labels: tuple[str, ...]) -> None:
        kind = geometry.get("type") if isinstance(geometry, dict) else None
        if kind not in _GEOMETRIES:
            value, where = (geometry, at) if kind is None else (kind, (*at, "type"))
            raise self.file.build_error(where, value, f"one of {', '.join(_GEOMETRIES)}")
        self._see_system(geometry, at)
        if kind != "GeometryCollection":
            self._coordinates(kind, geometry.get("coordinates"), (*at, "coordinates"), labels)
            return
        parts = geometry.get("geometries")
        if not isinstance(parts, list):
            raise self.file.build_error((*at, "geometries"), parts, "a list of geometries")
        for k, part in enumerate(parts):
            self.add_geometry(part, (*at, "geometries", k), labels)

    def _coordinates(
        self, kind: str, value: Any, at: Steps, labels: tuple[str, ...], whole: str = ""
    ) -> None:
        if kind in _PLURAL:
            if not isinstance(value, list):
                raise self.file.build_error(at, value, "a list")
            for k, part in enumerate(value):
                self._coordinates(_PLURAL[kind], part, (*at, k), labels, whole=format_path(at))
        elif value == []:
            self.shapes.leave_out("geometry", "without coordinates")
        elif kind == "Point":
            self.figures.append(
                SourceGeometry("point", (self._points([value], at, 1),), labels, format_path(at))
            )
        elif kind == "LineString":
            self.figures.append(
                SourceGeometry("line", (self._points(value, at, 2),), labels, format_path(at))
            )
        elif not isinstance(value, list):
            raise self.file.build_error(at, value, "a list of rings")
        else:
            rings = [self._points(ring, (*at, k), 1) for k, ring in enumerate(value)]
            self.figures.append(self.shapes.build_polygon(rings, labels, format_path(at), whole))

    def _points(self, value: Any, at: Steps, least: int) -> Array:
        return self.shapes.drop_heights(
            self.file.parse_points(value, at, min_count=least, min_dimensions=2, max_dimensions=4)
        )

    def _see_system(self, holder: dict[str, Any], at: Steps) -> None:
        """Keep the reference system that an object names, as GeoJSON did before RFC 7946."""
        given = holder.get("crs")
        if given is None:
            return
        properties = given.get("properties") if isinstance(given, dict) else None
        name = properties.get("name") if isinstance(properties, dict) else None
        if not isinstance(name, str):
            raise self.file.build_error((*at, "crs"), given, "the name of a reference system")
        if self.crs not in (None, name):
            raise self.file.build_error((*at, "crs"), given, f"the same system as before, {self.crs}")
        self.crs = name


def write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    origin, boundary = options.origin, environment.boundary_polygon
    digits = DEFAULT_DIGITS + (_FINER if origin else 0) if options.digits is None else options.digits
    head: dict[str, Any] = {"type": "FeatureCollection", "name": environment.name}
    if environment.description:
        head["description"] = environment.description
    head["units"] = "metres"
    notes = [f"in metres, {digits} decimals; other programs take GeoJSON for degrees (--origin makes them)"]
    plane = None
    if origin is not None:
        plane = _plane(environment, origin)
        head |= {"units": "degrees", "origin": list(origin)}
        notes = [f"in degrees about longitude {origin[0]:.10g}, latitude {origin[1]:.10g}"]
    features, areas, lost, across = [], [], 0, False
    shapes = [("obstacle", obstacle.name, obstacle.polygon) for obstacle in environment.obstacles]
    for kind, name, shape in [("boundary", None, boundary), *shapes]:
        # rounded in metres first, as a reader finds it: what touches there still touches
        exact = (
            shape
            if plane is None
            else shapely.transform(MultiPolygon(snap_to_grid(shape, DEFAULT_DIGITS)), plane.degrees)
        )
        parts = snap_to_grid(exact, digits)
        area = MultiPolygon(parts)
        areas.append(area if plane is None else shapely.transform(area, plane.metres))
        across |= plane is not None and any(max(map(abs, part.bounds[::2])) > 180.0 for part in parts)
        lost += not parts
        if parts:
            properties = {"kind": kind} if name is None else {"kind": kind, "name": name}
            geometry = mapping(parts[0] if len(parts) == 1 else area)
            feature = {"type": "Feature", "properties": properties, "geometry": geometry}
            features.append(json.dumps(feature, ensure_ascii=False))
    if across:
        notes.append("longitudes go on beyond 180 degrees: shapes are not cut at the antimeridian")
    if lost:
        notes.append(f"{lost} shapes are nothing with {digits} decimals")
    members, lines = json.dumps(head, ensure_ascii=False, indent=1).removesuffix("\n}"), ",\n".join(features)
    with replace_file(path) as part:
        part.write_text(f'{members},\n "features": [\n{lines}\n]}}\n', encoding="utf-8")
    kept = compute_free_area(areas[0], areas[1:])
    dropped = describe_unsupported(environment, names=False)
    return ExportReport("geojson", (path,), environment.free_area, kept, dropped, tuple(notes))


def _plane(environment: Environment, origin: tuple[float, float]) -> LocalPlane:
    """Return the plane about a place, if longitudes do not run all around in the map."""
    try:
        plane = LocalPlane(import_optional("pyproj", "geo"), *origin)
    except RobocovError as error:
        raise ParameterError(f"origin: degrees need more: {error}") from None
    if np.ptp(plane.degrees(np.array(environment.boundary, dtype=float))[:, 0]) >= 180.0:
        wanted = "expected a place farther from the pole"
        raise ParameterError(f"origin: {quote(origin)}: longitudes run all around on the map, {wanted}")
    return plane
