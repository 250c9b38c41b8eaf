"""Grammar of well-known text: OGC 06-103r4, section 7, with the prefix ``SRID=...;`` of PostGIS."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np

from robocov.errors import quote
from robocov.typing import FloatArray
from robocov_app.formats.files import MAX_DEPTH
from robocov_app.formats.geometry.shapes.collection import Shapes, SourceGeometry
from robocov_app.formats.vector.wkt.scanner import Scanner

KINDS = (
    "POINT", "LINESTRING", "LINEARRING", "POLYGON", "TRIANGLE", "MULTIPOINT", "MULTILINESTRING",
    "MULTIPOLYGON", "POLYHEDRALSURFACE", "TIN", "GEOMETRYCOLLECTION",
)  # fmt: skip
"""Kinds of geometries that are read."""
CURVED_KINDS = (
    "CIRCULARSTRING", "COMPOUNDCURVE", "CURVEPOLYGON", "MULTICURVE", "MULTISURFACE", "CURVE", "SURFACE",
)  # fmt: skip
"""Kinds that are recognized, but not supported."""
START = re.compile(
    rb"(?:\xef\xbb\xbf)?(?:\s|(?:#|--)[^\n]*\n)*(?:SRID\s*=\s*\d+\s*;\s*)?(?:%s)(?:ZM|Z|M)?\s*(?:ZM|Z|M)?\s*(?:\(|EMPTY)"
    % b"|".join(kind.encode() for kind in (*KINDS, *CURVED_KINDS)),
    re.IGNORECASE,
)
"""Start of a file: comments, a reference system, and a geometry."""
_COMMENT = re.compile(r"^[ \t]*(?:#|--).*$", re.MULTILINE)
_SRID = re.compile(r"SRID\s*=\s*(\d{1,9})\s*;", re.IGNORECASE)
_WORD = re.compile(r"[A-Za-z_]+")
_KIND = re.compile(rf"((?ai:{'|'.join(KINDS)}))\s*((?ai:ZM|Z|M))?(?![A-Za-z_])")
_POINTS = re.compile(r"\(([-+.\deE\s,]*)\)", re.ASCII)
_BARE_POINT = re.compile(r"[-+.\deE\s]*", re.ASCII)
_NOT_IN_POINT = re.compile(r"[^-+.\deE\s,]", re.ASCII)
_MAX_NUMBER = 1e100
"""Larger numbers might overflow before the limits of a map are checked."""
_MAX_POINT_CHARACTERS = 80


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return START.match(head) is not None


class _Geometry(NamedTuple):
    """The beginning of a geometry that is being parsed.

    Attributes
    ----------
    kind : str
    is_measured : bool
        Whether the last coordinate of its points is a measure, not a height.
    start : int
        Index of its first character in the text.
    location : str
        Number of the geometry, for messages, such as "geometry 2.1".
    depth : int
        Number of collections around it.
    """

    kind: str
    is_measured: bool
    start: int
    location: str
    depth: int


class WktParser:
    """Parser of a sequence of geometries.

    Geometries may be separated by commas or semicolons. Lines that begin with # or -- are comments.

    Parameters
    ----------
    text : str
    source_name : str
        The file, for messages.
    shapes : Shapes
        Counts geometries that are left out or repaired.

    Attributes
    ----------
    srid : int or None
        Number of the reference system that the geometries name.
    """

    def __init__(self, text: str, source_name: str, shapes: Shapes) -> None:
        # Comments become spaces of the same length, so that positions in messages are right.
        text = _COMMENT.sub(lambda comment: " " * len(comment[0]), text)
        self.srid: int | None = None
        self._scanner = Scanner(text, source_name)
        self._shapes = shapes
        self._geometries: list[SourceGeometry] = []
        self._parsers: dict[str, Callable[[_Geometry], None]] = {
            "GEOMETRYCOLLECTION": self._parse_collection,
            "LINEARRING": self._parse_line,
            "LINESTRING": self._parse_line,
            "MULTILINESTRING": self._parse_lines,
            "MULTIPOINT": self._parse_multipoint,
            "MULTIPOLYGON": self._parse_polygons,
            "POINT": self._parse_point,
            "POLYGON": self._parse_polygon,
            "POLYHEDRALSURFACE": self._parse_polygons,
            "TIN": self._parse_polygons,
            "TRIANGLE": self._parse_polygon,
        }

    def parse(self) -> list[SourceGeometry]:
        """Return all geometries; raise MapError at the first syntax error."""
        scanner = self._scanner
        number = 0
        while not scanner.is_at_end():
            self._parse_srid()
            number += 1
            self._parse_geometry(f"geometry {number}", depth=0)
            scanner.accept(",;")
        return self._geometries

    def _parse_srid(self) -> None:
        """Parse the reference system in front of a geometry, if there is one."""
        match = self._scanner.match(_SRID)
        if match is None:
            return
        srid = int(match[1])
        if self.srid not in (None, srid):
            self._scanner.raise_error(f"expected one SRID for all geometries, got {srid} after {self.srid}")
        self.srid = srid
        self._scanner.position = match.end()
        self._scanner.skip_space()

    def _parse_geometry(self, location: str, *, depth: int) -> None:
        """Parse a geometry, whose number for messages is `location`, inside `depth` collections."""
        if depth > MAX_DEPTH:
            self._scanner.raise_error(f"nested too deeply, expected at most {MAX_DEPTH} levels")
        start = self._scanner.position
        kind, is_measured = self._parse_kind()
        if self._accept_empty():
            self._shapes.count_omission("geometry", "without coordinates")
            return
        parse = self._parsers[kind]
        parse(_Geometry(kind, is_measured, start, location, depth))

    def _parse_kind(self) -> tuple[str, bool]:
        """Return the kind of a geometry, and whether its last coordinate is a measure."""
        scanner = self._scanner
        match = scanner.match(_KIND)
        if match is None:
            word = scanner.match(_WORD)
            name = word[0].upper() if word else ""
            if name.rstrip("ZM") in CURVED_KINDS:
                scanner.raise_error(f"expected a geometry with straight edges, got {name}")
            scanner.raise_error(f"expected one of {', '.join(KINDS)}, got {scanner.quote_next()}")
        scanner.position = match.end()
        scanner.skip_space()
        dimensions = match[2] or ""
        return match[1].upper(), dimensions.upper() == "M"

    def _accept_empty(self) -> bool:
        """Move past the word EMPTY if it follows, and return whether it does."""
        self._scanner.skip_space()
        word = self._scanner.match(_WORD)
        if word is None or word[0].upper() != "EMPTY":
            return False
        self._scanner.position = word.end()
        return True

    def _iterate_items(self, *, may_be_empty: bool = True) -> Iterator[int]:
        """Parse the brackets and commas of a list; yield the number of each item, which the caller parses.

        Items that are EMPTY are skipped if `may_be_empty`.
        """
        self._scanner.expect("(")
        for number in count(1):
            self._scanner.skip_space()
            if not (may_be_empty and self._accept_empty()):
                yield number
            if not self._scanner.accept(","):
                break
        self._scanner.expect(")")

    def _parse_collection(self, geometry: _Geometry) -> None:
        for number in self._iterate_items(may_be_empty=False):
            self._parse_geometry(f"{geometry.location}.{number}", depth=geometry.depth + 1)

    def _parse_polygon(self, geometry: _Geometry) -> None:
        self._add_polygon(geometry, geometry.location)

    def _parse_polygons(self, geometry: _Geometry) -> None:
        for number in self._iterate_items():
            self._add_polygon(geometry, f"{geometry.location}.{number}", parent_location=geometry.location)

    def _add_polygon(self, geometry: _Geometry, location: str, parent_location: str = "") -> None:
        """Parse the rings of a polygon; `parent_location` numbers a geometry of several polygons."""
        rings = [self._parse_points(geometry, minimum=1) for _ in self._iterate_items()]
        if rings:
            self._geometries.append(self._shapes.build_polygon(rings, (), location, parent_location))

    def _parse_line(self, geometry: _Geometry) -> None:
        points = self._parse_points(geometry, minimum=2)
        self._geometries.append(SourceGeometry("line", (points,), location=geometry.location))

    def _parse_lines(self, geometry: _Geometry) -> None:
        for _ in self._iterate_items():
            self._parse_line(geometry)

    def _parse_point(self, geometry: _Geometry) -> None:
        points = self._parse_points(geometry, minimum=1)
        if len(points) != 1:
            self._scanner.raise_error(f"expected one point, got {len(points)}", geometry.start)
        self._add_points(points, geometry)

    def _parse_multipoint(self, geometry: _Geometry) -> None:
        """Parse points in a common pair of brackets, or in a pair of brackets each; some may be EMPTY."""
        scanner = self._scanner
        if scanner.match(_POINTS):
            self._add_points(self._parse_points(geometry, minimum=1), geometry)
            return
        for _ in self._iterate_items():
            if scanner.is_at("("):
                points = self._parse_points(geometry, minimum=1)
            else:
                points = self._parse_bare_point(geometry)
            self._add_points(points, geometry)

    def _add_points(self, points: FloatArray, geometry: _Geometry) -> None:
        self._geometries += [
            SourceGeometry("point", (point[None],), location=geometry.location) for point in points
        ]

    def _parse_points(self, geometry: _Geometry, *, minimum: int) -> FloatArray:
        """Parse at least `minimum` points in brackets; return their first two coordinates, (k, 2)."""
        scanner = self._scanner
        scanner.skip_space()
        match = scanner.match(_POINTS)
        if match is None:
            self._raise_points_error()
        points = self._convert_points(match[1], match.start(1), geometry)
        if len(points) < minimum:
            scanner.raise_error(f"expected at least {minimum} points, got 1", match.start())
        scanner.position = match.end()
        return points

    def _parse_bare_point(self, geometry: _Geometry) -> FloatArray:
        """Parse a point without brackets; return its first two coordinates, (1, 2)."""
        match = self._scanner.match(_BARE_POINT)
        assert match is not None  # the pattern also matches empty text
        points = self._convert_points(match[0], match.start(), geometry)
        self._scanner.position = match.end()
        return points

    def _convert_points(self, list_text: str, start: int, geometry: _Geometry) -> FloatArray:
        """Convert a list of points that begins at index `start`.

        Return their first two coordinates, (k, 2).
        """
        position = start
        rows: list[list[float]] = []
        for text in list_text.split(","):
            try:
                rows.append([float(number) for number in text.split()])
            except ValueError:
                self._raise_point_error(position)
            if not 2 <= len(rows[-1]) <= 4 or len(rows[-1]) != len(rows[0]):
                self._raise_point_error(position)
            position += len(text) + 1
        points = np.array(rows)
        if not (np.abs(points) < _MAX_NUMBER).all():
            self._scanner.raise_error("expected finite numbers", start)
        dimensions = points.shape[1]
        has_heights = dimensions > 2 and not (geometry.is_measured and dimensions == 3)
        if has_heights:
            self._shapes.omissions.add_heights(points[:, 2])
        return points[:, :2]

    def _raise_points_error(self) -> NoReturn:
        """Raise MapError for the first error in the list of points that follows."""
        scanner = self._scanner
        scanner.expect("(")
        end = len(scanner.text)
        match = _NOT_IN_POINT.search(scanner.text, scanner.position)
        if match is not None:
            end = match.start()
        if scanner.text[end : end + 1] in ("", "("):
            scanner.position = end
            scanner.raise_error(f"expected a point or ), got {scanner.quote_next()}")
        comma = scanner.text.rfind(",", scanner.position, end)
        self._raise_point_error(comma + 1 if comma >= 0 else scanner.position)

    def _raise_point_error(self, position: int) -> NoReturn:
        """Raise MapError for the point that begins at index `position`."""
        scanner = self._scanner
        scanner.position = position
        ahead = scanner.text[position : position + _MAX_POINT_CHARACTERS]
        point = ahead.split(",")[0].split(")")[0]
        scanner.skip_space()
        actual = quote(" ".join(point.split())) if point.strip() else "nothing"
        expected = "expected a point such as 1.5 2, with as many numbers as the first point"
        scanner.raise_error(f"{expected}, got {actual}")
