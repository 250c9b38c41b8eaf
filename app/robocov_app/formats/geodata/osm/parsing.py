"""Reading the data of OpenStreetMap from XML or from the JSON of Overpass.

XML is written by openstreetmap.org, JOSM, osmium and Overpass: https://wiki.openstreetmap.org/wiki/OSM_XML.
JSON is what Overpass returns for ``[out:json]``, and the file ``map.json`` of the API:
https://wiki.openstreetmap.org/wiki/OSM_JSON. In both, Overpass adds the positions of nodes to ways and
relations for ``out geom``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn
from xml.parsers import expat

from robocov.errors import JsonPath, MapError, quote, to_one_line
from robocov_app.formats import files
from robocov_app.formats.files import JsonFile, is_number
from robocov_app.formats.geodata.osm.data import USED_TAGS, LonLat, OsmData, OsmElement

XML_ROOT = re.compile(rb"(?:\xef\xbb\xbf)?\s*(?:<\?xml[^>]*\?>\s*)?(?:<!--.*?-->\s*)*<osm[\s>]", re.DOTALL)
_JSON_ELEMENTS = re.compile(rb'"elements"\s*:\s*\[')
_JSON_SOURCE = re.compile(rb'"osm3s"\s*:|"generator"\s*:\s*"[^"]*(?:Overpass|OpenStreetMap|CGImap)')


def is_osm(head: bytes) -> bool:
    """Return whether a file that starts with `head` contains data of OpenStreetMap."""
    if XML_ROOT.match(head):
        return True
    is_json = files.starts_with(head, b"{") and _JSON_ELEMENTS.search(head) is not None
    return is_json and _JSON_SOURCE.search(head) is not None


def read_osm(path: Path) -> OsmData:
    """Read the data in a file.

    Raises
    ------
    MapError
        If the file is too large, or contains neither XML nor JSON of OpenStreetMap.
    """
    if files.starts_with(files.read_head(path), b"{"):
        return _read_json(path)
    content = files.read_content(path, files.MAX_TEXT_BYTES)
    return _XmlReader(to_one_line(path), content).data


class _XmlReader:
    """Handlers for expat that fill `data`."""

    def __init__(self, source_name: str, content: bytes) -> None:
        """Parse `content`; raise MapError if it is damaged or too large."""
        self.source_name = source_name
        self.data = OsmData(source_name)
        # Counting takes milliseconds, parsing a huge file takes seconds.
        files.require_vertices(content.count(b"<node"), source_name)
        files.require_vertices(content.count(b"<nd"), source_name)
        files.require_vertices(content.count(b"<tag") // 2, source_name)
        self.element: OsmElement | None = None
        self.member_id: int | None = None  # of the current member of a relation, if it is a way
        self.member_line: list[LonLat | None] = []
        self.depth = 0
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start_element
        self.parser.EndElementHandler = self._end_element
        self.parser.StartDoctypeDeclHandler = lambda *_: self._raise_error(
            "document type declarations are not supported"
        )
        try:
            self.parser.Parse(content, True)
        except (expat.ExpatError, ValueError, LookupError) as error:
            line = self.parser.ErrorLineNumber
            raise MapError(f"{source_name}:{line}: not XML: {to_one_line(error)[:80]}") from None

    def _start_element(self, name: str, attributes: dict[str, str]) -> None:
        """Add the content of an XML element; raise MapError if an attribute is missing or invalid."""
        self.depth += 1
        if self.depth == 1 and name != "osm":
            self._raise_error(f"expected <osm>, got <{to_one_line(name)[:40]}>")
        try:
            self._read_start_tag(name, attributes)
        except KeyError as error:
            self._raise_error(f"<{name}>: no {error.args[0]}")
        except ValueError as error:
            self._raise_error(f"<{name}>: {to_one_line(error)[:80]}")

    def _read_start_tag(self, name: str, attributes: dict[str, str]) -> None:
        """Read the attributes of an XML element at any depth.

        Raise KeyError for a missing attribute, and ValueError for an invalid one.
        """
        if self.depth == 2:
            # Deeper bounds are those of single ways and relations, and are not read.
            if name == "bounds":
                self.data.bounds.append(_parse_bounds(attributes))
            elif name in ("node", "way", "relation"):
                self._start_osm_element(name, attributes)
        elif self.element is not None:
            self._read_child(self.element, name, attributes)

    def _read_child(self, element: OsmElement, name: str, attributes: dict[str, str]) -> None:
        """Read a child of a node, way or relation: a tag, a node of a way, or a member or its nodes."""
        if name == "nd" and self.depth == 3:
            # A node of a way, with its position for `out geom`.
            node_id = int(attributes["ref"])
            element.members.append(node_id)
            self.data.add_way_node(node_id, _parse_position(attributes))
        elif name == "nd":
            # A node of a way that is a member of a relation, for `out geom`.
            self.member_line.append(_parse_position(attributes))
        elif name == "member" and attributes["type"] == "way":
            # The nodes of the way follow in the children of the member.
            self.member_id = int(attributes["ref"])
            self.member_line = []
            element.members.append(self.member_id)
        elif name == "tag" and attributes["k"] in USED_TAGS:
            element.tags[attributes["k"]] = attributes["v"]

    def _start_osm_element(self, kind: str, attributes: dict[str, str]) -> None:
        """Start a node, way or relation, unless it was deleted; tags and members follow in its children."""
        number = int(attributes["id"])
        if attributes.get("action") == "delete" or attributes.get("visible") == "false":
            return
        self.element = OsmElement(kind, number)
        if kind == "node":
            longitude = _parse_degrees(attributes, "lon")
            latitude = _parse_degrees(attributes, "lat")
            self.data.add_node(number, longitude, latitude)

    def _end_element(self, name: str) -> None:
        self.depth -= 1
        if name == "member" and self.member_id is not None:
            self.data.add_relation_way(self.member_id, self.member_line)
            self.member_id = None
        if self.depth == 1 and self.element is not None:
            self.data.add_element(self.element)
            self.element = None

    def _raise_error(self, problem: str) -> NoReturn:
        raise MapError(f"{self.source_name}:{self.parser.CurrentLineNumber}: {problem}")


def _read_json(path: Path) -> OsmData:
    """Read the data in a JSON file; a remark of Overpass, such as a timeout, becomes a note."""
    file = JsonFile(path)
    data = OsmData(file.source_name)
    document = file.document
    elements = files.get_member(document, "elements")
    if not isinstance(elements, list):
        raise file.build_error(("elements",), elements, "a list of elements")
    bounds = document.get("bounds")
    if isinstance(bounds, dict):
        try:
            data.bounds.append(_parse_bounds(bounds))
        except (KeyError, ValueError, TypeError):
            expected = "minlat, minlon, maxlat and maxlon in degrees"
            raise file.build_error(("bounds",), bounds, expected) from None
    remark = document.get("remark")
    if isinstance(remark, str):
        data.notes.append(f"Overpass says: {to_one_line(remark)[:200]}")
    for k, element in enumerate(elements):
        _add_json_element(data, file, element, ("elements", k))
    return data


def _add_json_element(data: OsmData, file: JsonFile, value: Any, location: JsonPath) -> None:
    """Add a node, way or relation, unless it was deleted; other kinds of elements are skipped."""
    if not isinstance(value, dict):
        raise file.build_error(location, value, "an element of OpenStreetMap")
    kind = value.get("type")
    if kind not in ("node", "way", "relation"):  # such as the areas and counts of Overpass
        return
    number = value.get("id")
    if type(number) is not int:
        raise file.build_error((*location, "id"), number, "a whole number")
    if value.get("action") == "delete" or value.get("visible") is False:
        return
    element = OsmElement(kind, number, _parse_json_tags(file, value, location))
    if kind == "node":
        longitude, latitude = _parse_json_point(file, value, location)
        data.add_node(number, longitude, latitude)
    elif kind == "way":
        element.members = _parse_json_nodes(data, file, value, location)
    else:
        element.members = _parse_json_ways(data, file, value, location)
    data.add_element(element)


def _parse_json_tags(file: JsonFile, value: dict[str, Any], location: JsonPath) -> dict[str, str]:
    tags = value.get("tags", {})
    if not isinstance(tags, dict):
        raise file.build_error((*location, "tags"), tags, "an object")
    return {key: text for key, text in tags.items() if key in USED_TAGS and isinstance(text, str)}


def _parse_json_point(file: JsonFile, value: Any, location: JsonPath) -> LonLat:
    if not isinstance(value, dict):
        raise file.build_error(location, value, "lat and lon")
    for key, limit in (("lon", 360.0), ("lat", 90.0)):
        degrees = value.get(key)
        if not is_number(degrees) or not abs(degrees) <= limit:  # type: ignore[arg-type]
            raise file.build_error((*location, key), degrees, "degrees")
    return float(value["lon"]), float(value["lat"])


def _parse_json_nodes(data: OsmData, file: JsonFile, value: dict[str, Any], location: JsonPath) -> list[int]:
    """Return the ids of the nodes of a way, and add the positions that the way contains (``out geom``)."""
    numbers = value.get("nodes", [])
    if not isinstance(numbers, list) or not all(type(number) is int for number in numbers):
        raise file.build_error((*location, "nodes"), numbers, "a list of whole numbers")
    if "geometry" not in value:
        return numbers
    line = _parse_json_line(file, value["geometry"], (*location, "geometry"))
    # A way may have positions without ids: its nodes get new ones.
    if len(line) != len(numbers):
        return data.add_line(line)
    for number, point in zip(numbers, line, strict=True):
        data.add_way_node(number, point)
    return numbers


def _parse_json_ways(data: OsmData, file: JsonFile, value: dict[str, Any], location: JsonPath) -> list[int]:
    """Return the ids of the ways of a relation, and add the ways that it contains (``out geom``)."""
    members = value.get("members", [])
    if not isinstance(members, list):
        raise file.build_error((*location, "members"), members, "a list of members")
    numbers = []
    for k, member in enumerate(members):
        member_location = (*location, "members", k)
        if not isinstance(member, dict):
            raise file.build_error(member_location, member, "a member of a relation")
        if member.get("type") != "way":
            continue
        number = member.get("ref")
        if type(number) is not int:
            raise file.build_error((*member_location, "ref"), number, "a whole number")
        numbers.append(number)
        if "geometry" in member:
            line = _parse_json_line(file, member["geometry"], (*member_location, "geometry"))
            data.add_relation_way(number, line)
    return numbers


def _parse_json_line(file: JsonFile, value: Any, location: JsonPath) -> list[LonLat | None]:
    """Return the points of a line, with None for points outside the query's bounding box."""
    if not isinstance(value, list):
        raise file.build_error(location, value, "a list of lat and lon")
    line: list[LonLat | None] = []
    for k, point in enumerate(value):
        line.append(None if point is None else _parse_json_point(file, point, (*location, k)))
    return line


def _parse_position(attributes: Mapping[str, str]) -> LonLat | None:
    """Return the longitude and latitude of a node of a way, or None if it is given without them."""
    if "lat" not in attributes and "lon" not in attributes:
        return None
    return _parse_degrees(attributes, "lon"), _parse_degrees(attributes, "lat")


def _parse_bounds(value: Mapping[str, Any]) -> tuple[float, float, float, float]:
    west = _parse_degrees(value, "minlon")
    south = _parse_degrees(value, "minlat")
    east = _parse_degrees(value, "maxlon")
    north = _parse_degrees(value, "maxlat")
    return west, south, east, north


def _parse_degrees(value: Mapping[str, Any], key: str) -> float:
    """Return a longitude or latitude; raise ValueError if it is invalid, and KeyError if it is missing."""
    degrees = float(value[key])
    limit = 90.0 if key.endswith("lat") else 360.0
    if not abs(degrees) <= limit:
        raise ValueError(f"{key}: expected degrees, got {quote(value[key])}")
    return degrees
