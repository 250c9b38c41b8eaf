"""Indoor Mapping Data Format: https://docs.ogc.org/cs/20-094/index.html.

An archive is a zip, or a folder, of GeoJSON files. The units of one level are free space, unless their
category excludes robots (columns, stairs, openings to the floor below); fixtures and kiosks are solid. Units
have walls along their outlines, which openings cut, except for walkways and the like.
"""

from __future__ import annotations

import io
import zipfile
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

from robocov.errors import MapError, ParameterError, quote, to_one_line
from robocov_app.formats import files
from robocov_app.formats.files import JsonFile, is_number
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geodata.building_floor import (
    FloorElement,
    Role,
    build_floor,
    choose_floor,
    list_floors,
)
from robocov_app.formats.geodata.geojson import GeometryCollector
from robocov_app.formats.geodata.georeference import DEGREES, convert_to_meters
from robocov_app.formats.geometry.shapes.collection import Shapes, SourceGeometry
from robocov_app.formats.options import ReadOptions

MAX_ARCHIVE_FILES = 1000
MAX_OBJECTS = 200_000
"""Maximum total number of JSON objects in the files. A feature has about four."""
_REQUIRED_FILES = ("level", "unit")
_READ_FILES = (*_REQUIRED_FILES, "opening", "fixture", "kiosk", "venue")
_ZIP_MAGIC = b"PK\x03\x04"
_ZIP_ENTRY_MAGIC = b"PK\x01\x02"
"""Signature of a file's entry in the directory of a zip archive."""
_FILE_NAMES = tuple(f"{name}.geojson".encode() for name in ("level", "opening", "unit", "venue"))
_MAX_LABEL_CHARACTERS = 80
# Categories of units, up to the first dot: obstacles, units that robots cannot drive on, units without walls.
_SOLID = {"brick", "column", "concrete", "drywall", "glass", "structure", "vegetation", "wood"}
_NO_FLOOR = {"elevator", "escalator", "movingwalkway", "opentobelow", "stairs", "steps"}
_OPEN = {
    "footbridge", "lobby", "parking", "platform", "ramp", "road", "terrace", "unenclosedarea", "walkway",
}  # fmt: skip


class _Level(NamedTuple):
    """A level of the venue.

    Attributes
    ----------
    ordinal : float
        Number of the floor; 0 is the ground floor.
    names : tuple of str
        The identifier, the short names and the names.
    """

    ordinal: float
    names: tuple[str, ...]


class _Archive:
    """The GeoJSON files of an archive, keyed by their names without suffix."""

    def __init__(self, path: Path) -> None:
        """Read the files of a zip or folder; raise MapError if files are missing or too large."""
        self.path = path
        self.source_name = to_one_line(path)
        texts = _read_folder(path) if path.is_dir() else _read_zip(path)
        for name in _REQUIRED_FILES:
            if name not in texts:
                raise MapError(
                    f"{self.source_name}: expected a file {name}.geojson, which IMDF requires, got none"
                )
        if sum(text.count(b"{") for text in texts.values()) > MAX_OBJECTS:
            raise MapError(
                f"{self.source_name}: expected at most {MAX_OBJECTS} objects in its files, got more"
            )
        self.files = {name: JsonFile(path / f"{name}.geojson", text) for name, text in texts.items()}

    def list_features(self, name: str) -> list[dict[str, Any]]:
        """Return the features of a file; an empty list if there is no such file."""
        file = self.files.get(name)
        if file is None:
            return []
        document = file.document
        features = files.get_member(document, "features")
        if not isinstance(features, list):
            raise file.build_error(("features",), features, "a list of features")
        for k, feature in enumerate(features):
            if not isinstance(feature, dict) or not isinstance(feature.get("properties"), dict):
                raise file.build_error(("features", k), feature, "a feature with properties")
        return features


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return head.startswith(_ZIP_MAGIC) and any(name in head for name in _FILE_NAMES)


def is_archive_folder(path: Path) -> bool:
    """Return whether a path is a folder that contains the files of an IMDF archive."""
    return path.is_dir() and all((path / f"{name}.geojson").is_file() for name in _REQUIRED_FILES)


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read the map of one level of a venue.

    Raises
    ------
    MapError
        If the archive is corrupt, or has no level or no unit.
    ParameterError
        If the option ``level`` names a level that does not exist.
    """
    archive = _Archive(path)
    shapes = Shapes(archive.source_name, options)
    levels = _parse_levels(archive)
    floor = _choose_floor(archive, levels, options.level, shapes)
    level_ids = {level_id for level_id, level in levels.items() if level.ordinal == floor}
    roles: list[Role] = []
    geometries: list[SourceGeometry] = []
    undrivable_count = 0
    for name in ("unit", "fixture", "kiosk", "opening"):
        for k, feature in enumerate(archive.list_features(name)):
            if _get_level_id(feature) not in level_ids:
                continue
            is_solid = False
            for geometry in _collect_geometries(archive.files[name], k, feature, shapes):
                role = _choose_role(name, feature, geometry)
                if role is None:
                    reason = "with a geometry other than a line" if name == "opening" else "without an area"
                    shapes.count_omission(name, reason)
                    continue
                roles.append(role)
                if role == "solid" and shapes.labels.accepts(geometry.labels):
                    is_solid = True
                if role == "opening":
                    # `build_floor` requires openings that are straight lines of two points.
                    geometry = _straighten(geometry)
                geometries.append(geometry)
            if name == "unit" and is_solid and _get_category(feature) in _NO_FLOOR:
                undrivable_count += 1
    if undrivable_count:
        note = "stairs, elevators and openings to the floor below treated as solid"
        shapes.notes.append(f"{note}: {undrivable_count}")
    geometries = convert_to_meters(geometries, shapes, DEGREES)
    elements = [FloorElement(role, geometry) for role, geometry in zip(roles, geometries, strict=True)]
    map_name = _get_venue_name(archive) or files.get_map_name(path)
    return build_floor(shapes, elements, map_name, "A level of a venue, imported from IMDF.")


def _choose_role(name: str, feature: dict[str, Any], geometry: SourceGeometry) -> Role | None:
    """Return the role of a geometry on the floor, or None if the geometry cannot be used.

    Parameters
    ----------
    name : str
        Name of the file that contains the feature.
    feature : dict
    geometry : SourceGeometry
    """
    if name == "opening":
        return "opening" if geometry.kind == "line" else None
    if geometry.kind == "point":
        return None
    if geometry.kind == "line":
        return None if name == "unit" else "wall"
    if name != "unit":
        return "solid"
    category = _get_category(feature)
    if category in _SOLID or category in _NO_FLOOR:
        return "solid"
    if category in _OPEN:
        return "open"
    return "room"


def _read_folder(path: Path) -> dict[str, bytes]:
    """Return the content of the IMDF files in a folder, keyed by their names without suffix."""
    texts = {}
    remaining_bytes = files.MAX_TEXT_BYTES
    for name in _READ_FILES:
        file = path / f"{name}.geojson"
        if file.is_file():
            texts[name] = files.read_content(file, remaining_bytes)
            remaining_bytes -= len(texts[name])
    return texts


def _read_zip(path: Path) -> dict[str, bytes]:
    """Return the content of the IMDF files in a zip archive, keyed by their names without suffix."""
    source_name = to_one_line(path)
    data = files.read_content(path, files.MAX_TEXT_BYTES)
    if data.count(_ZIP_ENTRY_MAGIC) > MAX_ARCHIVE_FILES:
        raise MapError(f"{source_name}: expected an archive of at most {MAX_ARCHIVE_FILES} files, got more")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return _unpack(archive, source_name)
    except MapError:
        raise
    except Exception as error:
        # On broken archives, zipfile and its decompressors raise exceptions of many classes.
        reason = to_one_line(error)[:80]
        raise MapError(
            f"{source_name}: expected a complete zip archive, got a broken one: {reason}"
        ) from None


def _unpack(archive: zipfile.ZipFile, source_name: str) -> dict[str, bytes]:
    """Return the content of the IMDF files in an open archive; raise MapError if they are too large."""
    texts: dict[str, bytes] = {}
    remaining_bytes = files.MAX_TEXT_BYTES
    for entry in archive.infolist():
        entry_path = PurePosixPath(entry.filename)
        name = entry_path.name.removesuffix(".geojson")
        is_read = name in _READ_FILES and entry_path.name == f"{name}.geojson"
        if not is_read or "__MACOSX" in entry_path.parts:
            continue
        if name in texts:
            raise MapError(f"{source_name}: expected one venue, got two files {entry_path.name}")
        # The size stated in the archive is not trusted. One byte more shows that the limit is exceeded.
        with archive.open(entry) as file:
            texts[name] = file.read(remaining_bytes + 1)
        remaining_bytes -= len(texts[name])
        if remaining_bytes < 0:
            limit = f"{files.MAX_TEXT_BYTES / 1e6:g} MB"
            raise MapError(f"{source_name}: expected at most {limit} when unpacked, got more")
    return texts


def _parse_levels(archive: _Archive) -> dict[str, _Level]:
    """Return the levels of a venue, keyed by identifier."""
    levels = {}
    file = archive.files["level"]
    for k, feature in enumerate(archive.list_features("level")):
        identifier = feature.get("id")
        properties = feature["properties"]
        ordinal = properties.get("ordinal")
        if not isinstance(identifier, str):
            raise file.build_error(("features", k, "id"), identifier, "a string")
        if not is_number(ordinal):
            location = ("features", k, "properties", "ordinal")
            raise file.build_error(location, ordinal, "a floor number")
        short_names = _list_names(properties.get("short_name"))
        names = (identifier, *short_names, *_list_names(properties.get("name")))
        levels[identifier] = _Level(float(ordinal), names)
    return levels


def _choose_floor(
    archive: _Archive, levels: dict[str, _Level], requested: str | None, shapes: Shapes
) -> float:
    """Return the ordinal of the floor to be read.

    `requested` is its number or name; a name that is also the number of a floor counts as the number. With
    None, it is the floor nearest to the ground floor. If the venue has several floors, a note lists them.
    """
    used_ids = {_get_level_id(feature) for feature in archive.list_features("unit")}
    # Only floors with units. `choose_floor` does not use their areas, here 1.
    floors = {level.ordinal: 1.0 for level_id, level in levels.items() if level_id in used_ids}
    if not floors:
        raise MapError(f"{archive.source_name}: expected units on its levels, got none")
    used_levels = [level for level in levels.values() if level.ordinal in floors]
    number = requested
    if requested is not None and files.parse_number(requested) not in floors:
        with_name = [level for level in used_levels if _has_name(level, requested)]
        if with_name:
            number = f"{with_name[0].ordinal:g}"
    try:
        floor = choose_floor(floors, number, archive.source_name)
    except ParameterError:
        names = sorted({name for level in used_levels for name in level.names[1:2]})
        known = f"one of {list_floors(floors)}"
        if names:
            known = f"{list_floors(floors)} or a name ({', '.join(names[:10])})"
        problem = f"expected {known}, got {quote(requested)}"
        raise ParameterError(f"{archive.source_name}: level: {problem}") from None
    if len(floors) > 1:
        on_floor = [level for level in levels.values() if level.ordinal == floor]
        labels = sorted({quote(level.names[1]) for level in on_floor if level.names[1:]})
        remark = f" ({', '.join(labels[:3])})" if labels else ""
        shapes.notes.append(f"level {floor:g}{remark} of {list_floors(floors)} (--level)")
    return floor


def _has_name(level: _Level, name: str) -> bool:
    return name.casefold() in {known.casefold() for known in level.names}


def _list_names(labels: Any) -> list[str]:
    """Return the names in all languages of an IMDF label."""
    if not isinstance(labels, dict):
        return []
    texts = [text for text in labels.values() if isinstance(text, str)]
    names = [to_one_line(text).strip()[:_MAX_LABEL_CHARACTERS] for text in texts]
    return [name for name in names if name]


def _get_venue_name(archive: _Archive) -> str:
    for feature in archive.list_features("venue"):
        for name in _list_names(feature["properties"].get("name")):
            return name
    return ""


def _get_level_id(feature: dict[str, Any]) -> str | None:
    level_id = feature["properties"].get("level_id")
    return level_id if isinstance(level_id, str) else None


def _get_category(feature: dict[str, Any]) -> str:
    """Return the category of a feature up to the first dot."""
    category = feature["properties"].get("category")
    if not isinstance(category, str):
        return ""
    first, _, _ = to_one_line(category).partition(".")
    return first


def _collect_geometries(
    file: JsonFile, index: int, feature: dict[str, Any], shapes: Shapes
) -> list[SourceGeometry]:
    """Return the geometries of a feature; its names and its category become their labels."""
    properties = feature["properties"]
    category = properties.get("category")
    labels = [*_list_names(properties.get("name")), *_list_names(properties.get("alt_name"))]
    if isinstance(category, str) and category.strip():
        labels.append(to_one_line(category).strip()[:_MAX_LABEL_CHARACTERS])
    if feature.get("geometry") is None:
        shapes.count_omission("feature", "without a geometry")
        return []
    collector = GeometryCollector(file, shapes)
    location = ("features", index, "geometry")
    collector.add_geometry(feature["geometry"], location, tuple(dict.fromkeys(labels)))
    return collector.geometries


def _straighten(geometry: SourceGeometry) -> SourceGeometry:
    """Return the straight line from the first point of an opening to the last."""
    line = geometry.rings[0]
    return SourceGeometry("line", (line[[0, -1]],), geometry.labels, geometry.location)
