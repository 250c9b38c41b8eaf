"""Well-known text.

The grammar is that of OGC 06-103r4, section 7, with the prefix ``SRID=...;`` of PostGIS.

Polygons are free space, all of them together, whether they overlap or lie in each other, and their holes are
obstacles, also where another polygon overlaps them: JuPedSim unites accessible areas, and then takes out what
is excluded (``build_geometry`` in the manual, https://www.jupedsim.org). Only a polygon that lies wholly in a
hole is free there, as in a MULTIPOLYGON. Where there are only lines they are walls. The option ``outlines``
says it otherwise; see `Shapes.build_foreign_map`. Coordinates are meters, unless a prefix ``SRID=...;`` names
another system.
"""

import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import NoReturn

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from robocov.arrays import Array
from robocov.environment import Environment
from robocov.errors import MapError, format_count, quote
from robocov.files.json_positions import find_line_and_column
from robocov.files.writing import replace_file
from robocov_app.formats.files import MAX_DEPTH, get_map_name, read_text
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.crossings import CrossingCounter
from robocov_app.formats.geometry.polygons import (
    DEFAULT_DIGITS,
    format_decimal,
    list_rings,
    snap_to_grid,
    to_multipolygon,
    unite,
)
from robocov_app.formats.geometry.rasterize import describe_unsupported
from robocov_app.formats.geometry.shapes import Shapes, SourceGeometry
from robocov_app.formats.georeference import convert_to_meters
from robocov_app.formats.options import ReadOptions, WriteOptions
from robocov_app.formats.reports import ExportReport

KINDS = (  # the geometries that are read
    "POINT", "LINESTRING", "LINEARRING", "POLYGON", "TRIANGLE", "MULTIPOINT", "MULTILINESTRING",
    "MULTIPOLYGON", "POLYHEDRALSURFACE", "TIN", "GEOMETRYCOLLECTION",
)  # fmt: skip
# those that are known and not read
CURVED = ("CIRCULARSTRING", "COMPOUNDCURVE", "CURVEPOLYGON", "MULTICURVE", "MULTISURFACE", "CURVE", "SURFACE")
_SPACE = re.compile(r"\s*")
_WORD = re.compile(r"[A-Za-z_]+")
_KIND = re.compile(rf"((?ai:{'|'.join(KINDS)}))\s*((?ai:ZM|Z|M))?(?![A-Za-z_])")
_POINTS = re.compile(r"\(([-+.\deE\s,]*)\)", re.ASCII)
_NO_POINT = re.compile(r"[^-+.\deE\s,]", re.ASCII)
_BEYOND = 1e100
MAX_OVERLAPS = 50_000  # of a hole and a polygon
_HOLES_TOGETHER = 20  # so many holes are looked at together, which bounds the memory
_SRID = re.compile(r"SRID\s*=\s*(\d{1,9})\s*;", re.IGNORECASE)
_COMMENT = re.compile(r"^[ \t]*(?:#|--).*$", re.MULTILINE)
BEGIN = re.compile(
    rb"(?:\xef\xbb\xbf)?(?:\s|(?:#|--)[^\n]*\n)*(?:SRID\s*=\s*\d+\s*;\s*)?(?:%s)(?:ZM|Z|M)?\s*(?:ZM|Z|M)?\s*(?:\(|EMPTY)"
    % b"|".join(kind.encode() for kind in (*KINDS, *CURVED)),
    re.IGNORECASE,
)


class WktText:
    """Reads geometries that stand one after the other, with a comma, a semicolon or nothing between them.

    Lines that begin with # or -- are comments. `srid`: the reference system that the geometries name.
    """

    def __init__(self, text: str, where: str, shapes: Shapes) -> None:
        # as many spaces instead, so that places stay what they are
        self.text = _COMMENT.sub(lambda comment: " " * len(comment[0]), text)
        self.where, self.shapes = where, shapes
        self.at = 0
        self.srid: int | None = None
        self._figures: list[SourceGeometry] = []

    def parse(self) -> list[SourceGeometry]:
        """Return all geometries; raise MapError at the first mistake."""
        number = 0
        while self._skip_space() < len(self.text):
            if srid := _SRID.match(self.text, self.at):
                if self.srid not in (None, int(srid[1])):
                    self._refuse(f"expected one SRID for all geometries, got {srid[1]} after {self.srid}")
                self.srid = int(srid[1])
                self.at = srid.end()
                self._skip_space()
            number += 1
            self._geometry(0, f"geometry {number}")
            if self._skip_space() < len(self.text) and self.text[self.at] in ",;":
                self.at += 1
        return self._figures

    def _geometry(self, depth: int, place: str) -> None:
        if depth > MAX_DEPTH:
            self._refuse(f"nested too deeply, expected at most {MAX_DEPTH} levels")
        begin, add = self.at, self._figures.append
        kind, measured = self._kind()
        if self._empty():
            self.shapes.leave_out("geometry", "without coordinates")
        elif kind == "GEOMETRYCOLLECTION":
            for number in self._items(empty=False):
                self._geometry(depth + 1, f"{place}.{number}")
        elif kind in ("POLYGON", "TRIANGLE"):
            self._polygon(measured, place)
        elif kind in ("MULTIPOLYGON", "POLYHEDRALSURFACE", "TIN"):
            for number in self._items():
                self._polygon(measured, f"{place}.{number}", whole=place)
        elif kind == "MULTILINESTRING":
            for _ in self._items():
                add(SourceGeometry("line", (self._points(measured, 2),), at=place))
        elif kind in ("LINESTRING", "LINEARRING"):
            add(SourceGeometry("line", (self._points(measured, 2),), at=place))
        else:
            several = kind == "MULTIPOINT" and not _POINTS.match(self.text, self.at)
            parts = [self._points(measured, 1) for _ in (self._items() if several else [0])]
            if kind == "POINT" and len(parts[0]) != 1:
                self._refuse(f"expected one point, got {len(parts[0])}", begin)
            self._figures += [
                SourceGeometry("point", (point[None],), at=place) for part in parts for point in part
            ]

    def _kind(self) -> tuple[str, bool]:
        """Read the word that begins a geometry; return it, and whether its last coordinate is a measure."""
        match = _KIND.match(self.text, self.at)
        if match is None:
            word = _WORD.match(self.text, self.at)
            found = word[0].upper() if word else ""
            if found.rstrip("ZM") in CURVED:
                self._refuse(f"expected a geometry of straight edges, got {found}")
            self._refuse(f"expected one of {', '.join(KINDS)}, got {self._found()}")
        self.at = match.end()
        self._skip_space()
        return match[1].upper(), (match[2] or "").upper() == "M"

    def _empty(self) -> bool:
        word = _WORD.match(self.text, self._skip_space())
        if word is None or word[0].upper() != "EMPTY":
            return False
        self.at = word.end()
        return True

    def _items(self, *, empty: bool = True) -> Iterator[int]:
        """Read brackets and commas around items that the caller reads: all but those that may be EMPTY."""
        self._expect("(")
        for number in count(1):
            self._skip_space()
            if not (empty and self._empty()):
                yield number
            self._skip_space()
            if self.text[self.at : self.at + 1] != ",":
                break
            self.at += 1
        self._expect(")")

    def _polygon(self, measured: bool, place: str, whole: str = "") -> None:
        if rings := [self._points(measured, 1) for _ in self._items()]:
            self._figures.append(self.shapes.build_polygon(rings, (), place, whole))

    def _points(self, measured: bool, least: int) -> Array:
        """Read points in brackets; return them as (k, 2)."""
        self._skip_space()
        match = _POINTS.match(self.text, self.at)
        if match is None:
            self._expect("(")
            strange = _NO_POINT.search(self.text, self.at)
            end = strange.start() if strange else len(self.text)
            if self.text[end : end + 1] in ("", "("):
                self.at = end
                self._refuse(f"expected a point or ), got {self._found()}")
            self.at = self.text.rfind(",", self.at, end) + 1 or self.at
            self._refuse_point()
        self.at = match.start(1)
        points: list[list[float]] = []
        for point in match[1].split(","):
            try:
                points.append([float(number) for number in point.split()])
            except ValueError:
                self._refuse_point()
            if not 2 <= len(points[-1]) <= 4 or len(points[-1]) != len(points[0]):
                self._refuse_point()
            self.at += len(point) + 1
        if len(points) < least:
            self._refuse(f"expected at least {least} points, got 1", match.start())
        self.at = match.end()
        array = np.array(points)
        if not (np.abs(array) < _BEYOND).all():
            self._refuse("expected finite numbers", match.start())
        if array.shape[1] > 2 and not (measured and array.shape[1] == 3):
            self.shapes.tally.add_heights(array[:, 2])
        return array[:, :2]

    def _skip_space(self) -> int:
        match = _SPACE.match(self.text, self.at)
        assert match is not None
        self.at = match.end()
        return self.at

    def _expect(self, bracket: str) -> None:
        self._skip_space()
        if self.text[self.at : self.at + 1] != bracket:
            self._refuse(f"expected {bracket}, got {self._found()}")
        self.at += 1

    def _found(self) -> str:
        rest = self.text[self._skip_space() : self.at + 24].splitlines()
        return quote(rest[0]) if rest else "the end"

    def _refuse_point(self) -> NoReturn:
        point = self.text[self.at : self.at + 80].split(",")[0].split(")")[0]
        self._skip_space()
        what = quote(" ".join(point.split())) if point.strip() else "nothing"
        self._refuse(f"expected a point as 1.5 2, with as many numbers as the first, got {what}")

    def _refuse(self, what: str, at: int | None = None) -> NoReturn:
        line, column = find_line_and_column(self.text, self.at if at is None else at)
        raise MapError(f"{self.where}:{line}:{column}: {what}")


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return BEGIN.match(head) is not None


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read the geometries of a file.

    Raises
    ------
    MapError
        If the file is damaged, too large, or contains no map.
    """
    text, where = read_text(path, b",")
    shapes = Shapes(where, options)
    parsed = WktText(text, where, shapes)
    figures = convert_to_meters(parsed.parse(), shapes, f"EPSG:{parsed.srid}" if parsed.srid else None)
    if options.outlines is None and any(figure.kind == "polygon" for figure in figures):
        shapes.options = replace(options, outlines="free")
        figures = _exclude_holes(figures, shapes)
    shapes.add_all(figures)
    return shapes.build_foreign_map(get_map_name(path), "Imported from WKT.", solid=False, overlap=True)


def _exclude_holes(figures: list[SourceGeometry], shapes: Shapes) -> list[SourceGeometry]:
    """Return figures whose polygons do not fill the holes of others, unless they lie wholly in one."""
    valid: dict[int, Polygon] = {}
    for k, figure in enumerate(figures):
        if figure.kind == "polygon" and all(len(ring) >= 4 for ring in figure.rings):
            polygon = Polygon(figure.rings[0], figure.rings[1:])
            if polygon.is_valid:  # others are repaired later, each by itself
                valid[k] = polygon
    polygons = [*valid.values()]
    holes = [Polygon(ring) for polygon in polygons for ring in polygon.interiors]
    if len(polygons) < 2 or not holes:
        return figures
    CrossingCounter(shapes.where).add([ring for polygon in polygons for ring in shapely.get_rings(polygon)])
    taken: dict[int, list[Polygon]] = {}
    for hole, k in _find_overlaps(holes, polygons, shapes.where):
        taken.setdefault(k, []).append(hole)
    if not taken:
        return figures
    found = {k: to_multipolygon(shapely.difference(polygons[k], unite(some))) for k, some in taken.items()}
    changed = {number: found[k] for k, number in enumerate(valid) if k in found}
    shapes.notes.append(
        "holes excluded from polygons that overlap them, as in JuPedSim: "
        + format_count(len(changed), "polygon")
    )
    result: list[SourceGeometry] = []
    for number, figure in enumerate(figures):
        if number not in changed:
            result.append(figure)
            continue
        for part in changed[number].geoms:
            rings_left = tuple(np.array(ring.coords) for ring in shapely.get_rings(part))
            result += [replace(figure, rings=rings_left)]
    return result


def _find_overlaps(
    holes: list[Polygon], polygons: list[Polygon], where: str
) -> Iterator[tuple[Polygon, int]]:
    """Yield holes with the index of each polygon that overlaps them, other than those that lie in them."""
    tree = shapely.STRtree(polygons)
    number = 0
    for begin in range(0, len(holes), _HOLES_TOGETHER):
        some = np.array(holes[begin : begin + _HOLES_TOGETHER], dtype=object)
        one, other = tree.query(some, predicate="intersects")
        number += len(one)
        if number > MAX_OVERLAPS:
            limit = f"at most {MAX_OVERLAPS} overlaps of holes and polygons"
            raise MapError(f"{where}: expected {limit}, got more")
        areas = tree.geometries[other]
        have_common_area = shapely.relate_pattern(some[one], areas, "T********")
        overlaps = have_common_area & ~shapely.covered_by(areas, some[one])
        yield from zip(some[one[overlaps]], other[overlaps].tolist(), strict=True)


def write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    """Write the free space of an environment as polygons with holes.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    digits = DEFAULT_DIGITS if options.digits is None else options.digits
    free = snap_to_grid(environment.free, digits)
    parts = [_text(part, digits) for part in free]
    text = f"POLYGON {parts[0]}" if len(parts) == 1 else f"MULTIPOLYGON ({', '.join(parts)})"
    with replace_file(path) as part:
        part.write_text(text + "\n", encoding="ascii")
    notes = [f"in meters, {digits} decimals"]
    if len(parts) > 1:
        notes.append(f"the free space has {len(parts)} parts: some programs take one polygon only")
    dropped = (
        *describe_unsupported(environment),
        "the boundary and the obstacles as such: only what is free is there",
    )
    area = float(MultiPolygon(free).area)
    return ExportReport("wkt", (path,), environment.free_area, area, dropped, tuple(notes))


def _text(polygon: Polygon, digits: int) -> str:
    points = [
        [f"{format_decimal(x, digits)} {format_decimal(y, digits)}" for x, y in ring]
        for ring in list_rings(polygon)
    ]
    parts = [f"({', '.join(ring)})" for ring in points]
    return f"({', '.join(parts)})"
