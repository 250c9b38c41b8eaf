"""Indoor Mapping Data Format: https://docs.ogc.org/cs/20-094/index.html.

An archive is a zip, or a folder, of GeoJSON files. The units of one level are free space, unless their
category says that nobody drives there (columns, stairs, openings to the floor below); fixtures and kiosks are
solid. Units have walls along their outlines, which openings cut, except for walkways and the like.
"""

from __future__ import annotations

import io
import zipfile
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

from robocov.errors import MapError, ParameterError, quote, to_one_line
from robocov_app.formats import files
from robocov_app.formats.building_floor import IndoorFigure, Role, build_floor, choose_floor, list_floors
from robocov_app.formats.files import JsonFile, is_number
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geojson import FigureCollector
from robocov_app.formats.geometry.shapes import Shapes, SourceGeometry
from robocov_app.formats.georeference import DEGREES, in_metres
from robocov_app.formats.options import ReadOptions

MAX_ENTRIES = 1000  # files in an archive
MAX_OBJECTS = 200_000  # of JSON in the files together; a feature is about four
_REQUIRED = ("level", "unit")
_READ = (*_REQUIRED, "opening", "fixture", "kiosk", "venue")
_ZIP = b"PK\x03\x04"
_ZIP_ENTRY = b"PK\x01\x02"  # begins the entry of a file in the directory of a zip
_FILE_NAMES = tuple(f"{name}.geojson".encode() for name in ("level", "opening", "unit", "venue"))
# categories of units, up to the first dot
_SOLID = {"brick", "column", "concrete", "drywall", "glass", "structure", "vegetation", "wood"}
_NO_FLOOR = {"elevator", "escalator", "movingwalkway", "opentobelow", "stairs", "steps"}
_OPEN = {
    "footbridge", "lobby", "parking", "platform", "ramp", "road", "terrace", "unenclosedarea", "walkway",
}  # fmt: skip


class _Level(NamedTuple):
    """A level of the venue: the number of its floor, and what it is called."""

    ordinal: float
    names: tuple[str, ...]


class _Archive:
    """The GeoJSON files of an archive, by the names that IMDF gives them, without suffix."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.where = to_one_line(path)
        texts = _read_folder(path) if path.is_dir() else _read_zip(path)
        for name in _REQUIRED:
            if name not in texts:
                raise MapError(f"{self.where}: expected {name}.geojson in it, as IMDF has, got none")
        if sum(text.count(b"{") for text in texts.values()) > MAX_OBJECTS:
            raise MapError(f"{self.where}: expected at most {MAX_OBJECTS} objects in its files, got more")
        self.files = {name: JsonFile(path / f"{name}.geojson", text) for name, text in texts.items()}

    def features(self, name: str) -> list[dict[str, Any]]:
        """Return the features of one of the files, none if there is no such file."""
        file = self.files.get(name)
        if file is None:
            return []
        document = file.document
        found = document.get("features") if isinstance(document, dict) else None
        if not isinstance(found, list):
            raise file.build_error(("features",), found, "a list of features")
        for k, feature in enumerate(found):
            if not isinstance(feature, dict) or not isinstance(feature.get("properties"), dict):
                raise file.build_error(("features", k), feature, "a feature with properties")
        return found


def sniff(path: Path, head: bytes) -> bool:
    return head.startswith(_ZIP) and any(name in head for name in _FILE_NAMES)


def is_archive_folder(path: Path) -> bool:
    """Return whether a path is a folder with the files of an archive in it."""
    return path.is_dir() and all((path / f"{name}.geojson").is_file() for name in _REQUIRED)


def read(path: Path, options: ReadOptions) -> ForeignMap:
    archive = _Archive(path)
    shapes = Shapes(archive.where, options)
    levels = _read_levels(archive)
    floor = _choose_floor(archive, levels, options.level, shapes)
    on_floor = {number for number, level in levels.items() if level.ordinal == floor}
    roles: list[Role] = []
    figures: list[SourceGeometry] = []
    without_floor = 0
    for name in ("unit", "fixture", "kiosk", "opening"):
        for k, feature in enumerate(archive.features(name)):
            if _level_id(feature) not in on_floor:
                continue
            category = _category(feature)
            role: Role = _unit_role(category) if name == "unit" else "solid"
            without_floor += name == "unit" and category in _NO_FLOOR
            for figure in _collect(archive.files[name], k, feature, shapes):
                is_line = figure.kind == "line"
                if figure.kind == "point" or (is_line and name == "unit"):
                    shapes.leave_out(name, "that is no area")
                elif name == "opening" and is_line:
                    roles.append("opening")
                    figures.append(_straighten(figure))
                else:
                    roles.append("wall" if is_line else role)
                    figures.append(figure)
    if without_floor:
        shapes.notes.append(f"stairs, lifts and openings to below taken as solid: {without_floor}")
    placed = in_metres(figures, shapes, DEGREES)
    parts = [IndoorFigure(role, figure) for role, figure in zip(roles, placed, strict=True)]
    name = _venue_name(archive) or files.get_map_name(path)
    return build_floor(shapes, parts, name, "A level of a venue, imported from IMDF.")


def _read_folder(path: Path) -> dict[str, bytes]:
    texts = {}
    left = files.MAX_TEXT_BYTES
    for name in _READ:
        file = path / f"{name}.geojson"
        if file.is_file():
            texts[name] = files.read_content(file, left)
            left -= len(texts[name])
    return texts


def _read_zip(path: Path) -> dict[str, bytes]:
    where = to_one_line(path)
    data = files.read_content(path, files.MAX_TEXT_BYTES)
    if data.count(_ZIP_ENTRY) > MAX_ENTRIES:
        raise MapError(f"{where}: expected an archive of at most {MAX_ENTRIES} files, got more")
    texts: dict[str, bytes] = {}
    left = files.MAX_TEXT_BYTES
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            for entry in archive.infolist():
                place = PurePosixPath(entry.filename)
                name = place.name.removesuffix(".geojson")
                if name not in _READ or f"{name}.geojson" != place.name or "__MACOSX" in place.parts:
                    continue
                if name in texts:
                    raise MapError(f"{where}: expected one venue, got two files {place.name}")
                # however large it says to be
                with archive.open(entry) as file:
                    texts[name] = file.read(left + 1)
                left -= len(texts[name])
                if left < 0:
                    limit = f"{files.MAX_TEXT_BYTES / 1e6:g} MB"
                    raise MapError(f"{where}: expected at most {limit} when unpacked, got more")
    except MapError:
        raise
    except Exception as error:  # of zipfile and its decompressors, which raise many kinds
        raise MapError(
            f"{where}: expected a whole zip archive, got a broken one: {to_one_line(error)[:80]}"
        ) from None
    return texts


def _read_levels(archive: _Archive) -> dict[str, _Level]:
    """Return the levels by their identifiers."""
    levels = {}
    for k, feature in enumerate(archive.features("level")):
        number = feature.get("id")
        properties = feature["properties"]
        ordinal = properties.get("ordinal")
        file = archive.files["level"]
        if not isinstance(number, str):
            raise file.build_error(("features", k, "id"), number, "a string")
        if not is_number(ordinal):
            raise file.build_error(("features", k, "properties", "ordinal"), ordinal, "the number of a floor")
        names = (number, *_names(properties.get("short_name")), *_names(properties.get("name")))
        levels[number] = _Level(float(ordinal), names)
    return levels


def _choose_floor(archive: _Archive, levels: dict[str, _Level], asked: str | None, shapes: Shapes) -> float:
    """Return the ordinal of the floor to read: that which the user named or numbered, or the ground floor."""
    used = {_level_id(feature) for feature in archive.features("unit")}
    floors = {level.ordinal: 1.0 for number, level in levels.items() if number in used}
    if not floors:
        raise MapError(f"{archive.where}: expected units on its levels, got none")
    named = [level for level in levels.values() if asked is not None and asked.casefold() in _folded(level)]
    if named:
        asked = f"{named[0].ordinal:g}"
    try:
        floor = choose_floor(floors, asked, archive.where)
    except ParameterError:
        names = sorted({name for level in levels.values() for name in level.names[1:2]})
        if not names:
            raise
        known = f"{list_floors(floors)} or a name ({', '.join(names[:10])})"
        raise ParameterError(f"{archive.where}: level: expected {known}, got {quote(asked)}") from None
    if len(floors) > 1:
        called = sorted(
            {quote(level.names[1]) for level in levels.values() if level.ordinal == floor and level.names[1:]}
        )
        words = f" ({', '.join(called[:3])})" if called else ""
        shapes.notes.append(f"level {floor:g}{words} of {list_floors(floors)} (--level)")
    return floor


def _folded(level: _Level) -> set[str]:
    return {name.casefold() for name in level.names}


def _names(labels: Any) -> list[str]:
    """Return the names in all languages that a member holds."""
    if not isinstance(labels, dict):
        return []
    names = [to_one_line(name).strip()[:80] for name in labels.values() if isinstance(name, str)]
    return [name for name in names if name]


def _venue_name(archive: _Archive) -> str:
    for feature in archive.features("venue"):
        for name in _names(feature["properties"].get("name")):
            return name
    return ""


def _level_id(feature: dict[str, Any]) -> str | None:
    number = feature["properties"].get("level_id")
    return number if isinstance(number, str) else None


def _category(feature: dict[str, Any]) -> str:
    category = feature["properties"].get("category")
    return to_one_line(category).partition(".")[0] if isinstance(category, str) else ""


def _unit_role(category: str) -> Role:
    if category in _SOLID or category in _NO_FLOOR:
        return "solid"
    return "open" if category in _OPEN else "walled"


def _collect(file: JsonFile, k: int, feature: dict[str, Any], shapes: Shapes) -> list[SourceGeometry]:
    """Return the geometries of a feature, with its names and its category as labels."""
    properties = feature["properties"]
    category = properties.get("category")
    labels = [*_names(properties.get("name")), *_names(properties.get("alt_name"))]
    if isinstance(category, str) and category.strip():
        labels.append(to_one_line(category).strip()[:80])
    if feature.get("geometry") is None:
        shapes.leave_out("feature", "without a geometry")
        return []
    collector = FigureCollector(file, shapes)
    at = ("features", k, "geometry")
    collector.add_geometry(feature["geometry"], at, tuple(dict.fromkeys(labels)))
    return collector.figures


def _straighten(figure: SourceGeometry) -> SourceGeometry:
    """Return the line from the first point of an opening to its last one."""
    line = figure.rings[0]
    return SourceGeometry("line", (line[[0, -1]],), figure.labels, figure.at)
