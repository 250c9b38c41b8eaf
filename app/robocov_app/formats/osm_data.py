"""The data of OpenStreetMap: nodes, ways and relations, from XML or from the JSON of Overpass.

XML is what openstreetmap.org, JOSM and osmium write: https://wiki.openstreetmap.org/wiki/OSM_XML. JSON is
what Overpass answers to ``[out:json]``, also with ``out geom``, and what the API writes as ``map.json``:
https://wiki.openstreetmap.org/wiki/OSM_JSON. `robocov_app.formats.osm` knows what the data means.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn
from xml.parsers import expat

import numpy as np

from robocov.arrays import Array
from robocov.errors import JsonPath, MapError, quote, to_one_line
from robocov_app.formats import files
from robocov_app.formats.files import JsonFile, is_number

XML_ROOT = re.compile(rb"(?:\xef\xbb\xbf)?\s*(?:<\?xml[^>]*\?>\s*)?(?:<!--.*?-->\s*)*<osm[\s>]", re.DOTALL)
_JSON_ELEMENTS = re.compile(rb'"elements"\s*:\s*\[')
_JSON_SOURCE = re.compile(rb'"osm3s"\s*:|"generator"\s*:\s*"[^"]*(?:Overpass|OpenStreetMap|CGImap)')
_KEYS = {
    "area", "barrier", "building", "door", "entrance", "highway", "indoor", "layer", "level", "location",
    "name", "natural", "repeat_on", "room", "stairs", "tunnel", "type", "water", "waterway", "width",
}  # fmt: skip
_LABEL_KEYS = ("name", "room", "indoor", "barrier", "building", "natural")
_MAX_READINGS = 4  # times that all vertices are looked at: areas are measured, doors found, shapes drawn
_NAMELESS = 2**64  # numbers of nodes that have none begin here: those of the data have at most 64 bits


@dataclass(eq=False, slots=True)
class OsmElement:
    """A node, a way or a relation: the nodes of a way, or the ways of a relation, are its members."""

    kind: str
    number: int
    tags: dict[str, str] = field(default_factory=dict)
    members: list[int] = field(default_factory=list)

    @property
    def place(self) -> str:
        return f"{self.kind} {self.number}"

    @property
    def labels(self) -> tuple[str, ...]:
        """What names the element: its name, the values of its main tags, and their keys."""
        values = [self.tags[key] for key in _LABEL_KEYS if key in self.tags]
        keys = [key for key in (*_LABEL_KEYS[1:], "waterway") if key in self.tags]
        return tuple(
            dict.fromkeys(to_one_line(label) for label in (*values, *keys) if label not in ("yes", "no"))
        )


class OsmData:
    """What a file of OpenStreetMap holds.

    Attributes
    ----------
    nodes, ways, relations : dict
        Elements by number. Of nodes only those with tags, of relations only areas (multipolygons).
    bounds : list of (west, south, east, north), degrees
    notes : list of str
        What the report should say.
    """

    def __init__(self, where: str) -> None:
        self.where = where
        self.bounds: list[tuple[float, float, float, float]] = []
        self.nodes: dict[int, OsmElement] = {}
        self.ways: dict[int, OsmElement] = {}
        self.relations: dict[int, OsmElement] = {}
        self.notes: list[str] = []
        self._node_rows: dict[int, int] = {}
        self._coordinates = array("d")
        self._points: Array | None = None
        self._vertices_used = 0

    @property
    def elements(self) -> list[OsmElement]:
        return [*self.nodes.values(), *self.ways.values(), *self.relations.values()]

    def add_node(self, number: int, longitude: float, latitude: float) -> None:
        self._node_rows[number] = len(self._coordinates) // 2
        self._coordinates.extend((longitude, latitude))
        self._points = None

    def has_node(self, number: int) -> bool:
        return number in self._node_rows

    def add_line(self, line: list[tuple[float, float] | None]) -> list[int]:
        """Add nodes that have no numbers, given as longitude and latitude; return numbers for them.

        Parameters
        ----------
        line : list of (longitude, latitude) or None
            None stands for a node that the file does not have.
        """
        numbers = []
        for point in line:
            number = _NAMELESS + len(self._coordinates) // 2 if point is not None else -_NAMELESS
            if point is not None:
                self.add_node(number, *point)
            numbers.append(number)
        return numbers

    def keep(self, element: OsmElement) -> None:
        """Keep an element, if it can be a part of a map."""
        if element.kind == "node" and element.tags and self.has_node(element.number):
            self.nodes[element.number] = element
        elif element.kind == "way":
            self.ways[element.number] = element
        elif element.kind == "relation" and element.tags.get("type") == "multipolygon":
            self.relations[element.number] = element

    def point(self, node: OsmElement) -> Array:
        """Return the (2,) longitude and latitude of a node."""
        row: Array = self._all_points()[self._node_rows[node.number]]
        return row

    def lines(self, element: OsmElement) -> list[Array] | None:
        """Return the (k, 2) longitudes and latitudes of each way of an element; None if nodes are missing."""
        ways = (
            [self.ways.get(number) for number in element.members] if element.kind == "relation" else [element]
        )
        # a way may be a part of many relations
        self._vertices_used += sum(len(way.members) for way in ways if way is not None)
        if self._vertices_used > _MAX_READINGS * files.MAX_VERTICES:
            files.require_vertices(self._vertices_used, self.where)
        lines = []
        for way in ways:
            rows = [] if way is None else [self._node_rows.get(number, -1) for number in way.members]
            if len(rows) < 2 or min(rows) < 0:
                return None
            lines.append(self._all_points()[rows])
        return lines or None

    def _all_points(self) -> Array:
        if self._points is None:
            self._points = np.array(self._coordinates).reshape(-1, 2)
        return self._points


def is_osm(head: bytes) -> bool:
    """Return whether a file that begins with these bytes holds data of OpenStreetMap."""
    if XML_ROOT.match(head):
        return True
    is_json = files.starts_with(head, b"{") and _JSON_ELEMENTS.search(head) is not None
    return is_json and _JSON_SOURCE.search(head) is not None


def read_osm(path: Path) -> OsmData:
    """Return the data in a file.

    Raises
    ------
    MapError
        When the file is neither XML nor JSON of OpenStreetMap, or too large.
    """
    if files.starts_with(files.read_head(path), b"{"):
        return _read_json(path)
    content = files.read_content(path, files.MAX_TEXT_BYTES)
    return _XmlReader(to_one_line(path), content).data


class _XmlReader:
    """Handlers for expat."""

    def __init__(self, where: str, content: bytes) -> None:
        self.where = where
        self.data = OsmData(where)
        for start in (b"<node", b"<nd", b"<tag"):  # to count takes a moment, to parse seconds
            files.require_vertices(content.count(start) // (2 if start == b"<tag" else 1), where)
        self.element: OsmElement | None = None
        self.depth = 0
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.StartDoctypeDeclHandler = lambda *_: self._refuse("expected no document type")
        try:
            self.parser.Parse(content, True)
        except (expat.ExpatError, ValueError, LookupError) as error:
            line = self.parser.ErrorLineNumber
            raise MapError(f"{where}:{line}: not XML: {to_one_line(error)[:80]}") from None

    def _start(self, name: str, given: dict[str, str]) -> None:
        self.depth += 1
        if self.depth == 1 and name != "osm":
            self._refuse(f"expected <osm>, got <{to_one_line(name)[:40]}>")
        try:
            self._take(name, given)
        except (KeyError, ValueError) as error:
            what = f"no {error.args[0]}" if isinstance(error, KeyError) else to_one_line(error)[:80]
            self._refuse(f"<{name}>: {what}")

    def _take(self, name: str, given: dict[str, str]) -> None:
        if name == "bounds":
            self.data.bounds.append(_bounds(given))
        elif self.depth == 2 and name in ("node", "way", "relation"):
            self._begin(name, given)
        elif self.element is None:
            return
        elif name == "nd" or (name == "member" and given["type"] == "way"):
            self.element.members.append(int(given["ref"]))
        elif name == "tag" and given["k"] in _KEYS:
            self.element.tags[given["k"]] = given["v"]

    def _begin(self, name: str, given: dict[str, str]) -> None:
        number = int(given["id"])
        if given.get("action") == "delete" or given.get("visible") == "false":
            return
        self.element = OsmElement(name, number)
        if name == "node":
            self.data.add_node(number, _degrees(given, "lon"), _degrees(given, "lat"))

    def _end(self, name: str) -> None:
        self.depth -= 1
        if self.depth == 1 and self.element is not None:
            self.data.keep(self.element)
            self.element = None

    def _refuse(self, what: str) -> NoReturn:
        raise MapError(f"{self.where}:{self.parser.CurrentLineNumber}: {what}")


def _read_json(path: Path) -> OsmData:
    file = JsonFile(path)
    data = OsmData(file.where)
    document = file.document
    elements = document.get("elements") if isinstance(document, dict) else None
    if not isinstance(elements, list):
        raise file.build_error(("elements",), elements, "a list of elements")
    if isinstance(bounds := document.get("bounds"), dict):
        try:
            data.bounds.append(_bounds(bounds))
        except (KeyError, ValueError, TypeError):
            raise file.build_error(
                ("bounds",), bounds, "minlat, minlon, maxlat and maxlon in degrees"
            ) from None
    if isinstance(remark := document.get("remark"), str):
        data.notes.append(f"Overpass says: {to_one_line(remark)[:200]}")
    for k, given in enumerate(elements):
        _add_json_element(data, file, given, ("elements", k))
    return data


def _add_json_element(data: OsmData, file: JsonFile, given: Any, at: JsonPath) -> None:
    if not isinstance(given, dict):
        raise file.build_error(at, given, "an element of OpenStreetMap")
    kind = given.get("type")
    if kind not in ("node", "way", "relation"):  # areas and counts of Overpass
        return
    number = given.get("id")
    if type(number) is not int:
        raise file.build_error((*at, "id"), number, "a whole number")
    if given.get("action") == "delete" or given.get("visible") is False:
        return
    element = OsmElement(kind, number, _json_tags(file, given, at))
    if kind == "node":
        data.add_node(number, *_json_point(file, given, at))
    elif kind == "way":
        element.members = _json_nodes(data, file, given, at)
    else:
        element.members = _json_ways(data, file, given, at)
    data.keep(element)


def _json_tags(file: JsonFile, given: dict[str, Any], at: JsonPath) -> dict[str, str]:
    tags = given.get("tags", {})
    if not isinstance(tags, dict):
        raise file.build_error((*at, "tags"), tags, "an object")
    return {key: value for key, value in tags.items() if key in _KEYS and isinstance(value, str)}


def _json_point(file: JsonFile, given: Any, at: JsonPath) -> tuple[float, float]:
    if not isinstance(given, dict):
        raise file.build_error(at, given, "lat and lon")
    for key, limit in (("lon", 360.0), ("lat", 90.0)):
        value = given.get(key)
        if not is_number(value) or not abs(value) <= limit:  # type: ignore[arg-type]
            raise file.build_error((*at, key), value, "degrees")
    return float(given["lon"]), float(given["lat"])


def _json_nodes(data: OsmData, file: JsonFile, given: dict[str, Any], at: JsonPath) -> list[int]:
    """Return the numbers of the nodes of a way, whose places it may hold itself (``out geom``)."""
    numbers = given.get("nodes", [])
    if not isinstance(numbers, list) or not all(type(number) is int for number in numbers):
        raise file.build_error((*at, "nodes"), numbers, "a list of whole numbers")
    if "geometry" not in given:
        return numbers
    line = _json_line(file, given["geometry"], (*at, "geometry"))
    if len(line) != len(numbers):
        return data.add_line(line)
    for number, point in zip(numbers, line, strict=True):
        if point is not None and not data.has_node(number):
            data.add_node(number, *point)
    return numbers


def _json_ways(data: OsmData, file: JsonFile, given: dict[str, Any], at: JsonPath) -> list[int]:
    """Return the numbers of the ways of a relation, and keep those that it holds itself (``out geom``)."""
    members = given.get("members", [])
    if not isinstance(members, list):
        raise file.build_error((*at, "members"), members, "a list of members")
    numbers = []
    for k, member in enumerate(members):
        place = (*at, "members", k)
        if not isinstance(member, dict):
            raise file.build_error(place, member, "a member of a relation")
        if member.get("type") != "way":
            continue
        number = member.get("ref")
        if type(number) is not int:
            raise file.build_error((*place, "ref"), number, "a whole number")
        numbers.append(number)
        if "geometry" in member and number not in data.ways:
            line = _json_line(file, member["geometry"], (*place, "geometry"))
            data.keep(OsmElement("way", number, members=data.add_line(line)))
    return numbers


def _json_line(file: JsonFile, given: Any, at: JsonPath) -> list[tuple[float, float] | None]:
    """Return the points of a line; those beyond the box of a query are null, and so None."""
    if not isinstance(given, list):
        raise file.build_error(at, given, "a list of lat and lon")
    return [None if point is None else _json_point(file, point, (*at, k)) for k, point in enumerate(given)]


def _bounds(given: Mapping[str, Any]) -> tuple[float, float, float, float]:
    west, south = _degrees(given, "minlon"), _degrees(given, "minlat")
    east, north = _degrees(given, "maxlon"), _degrees(given, "maxlat")
    return west, south, east, north


def _degrees(given: Mapping[str, Any], key: str) -> float:
    """Return a longitude or latitude; ValueError for what is none, KeyError where it is missing."""
    value = float(given[key])
    limit = 90.0 if key.endswith("lat") else 360.0
    if not abs(value) <= limit:
        raise ValueError(f"{key}: expected degrees, got {quote(given[key])}")
    return value
