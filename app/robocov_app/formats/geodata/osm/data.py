"""The data of OpenStreetMap: nodes, ways and relations, before their tags are interpreted."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from robocov.errors import to_one_line
from robocov.typing import FloatArray
from robocov_app.formats import files

LonLat: TypeAlias = tuple[float, float]
"""Longitude and latitude in degrees."""
USED_TAGS = {
    "area", "barrier", "building", "door", "entrance", "highway", "indoor", "layer", "level", "location",
    "name", "natural", "repeat_on", "room", "stairs", "tunnel", "type", "water", "waterway", "width",
}  # fmt: skip
_LABEL_TAGS = ("name", "room", "indoor", "barrier", "building", "natural")
_MAX_READINGS = 4
"""Number of times that all vertices may be read: to measure areas, to find doors, and to draw shapes."""
_FIRST_NEW_ID = 2**64
"""First id given to nodes without one in the file. Ids of OpenStreetMap have at most 64 bits."""
_MISSING_NODE_ID = -_FIRST_NEW_ID
"""Id that no node has; a way with such a node counts as incomplete."""


@dataclass(eq=False, slots=True)
class OsmElement:
    """A node, a way or a relation.

    Attributes
    ----------
    kind : str
        ``node``, ``way`` or ``relation``.
    id : int
    tags : dict of str to str
        Only those in `USED_TAGS`.
    members : list of int
        Ids of the nodes of a way, or of the ways of a relation.
    """

    kind: str
    id: int
    tags: dict[str, str] = field(default_factory=dict)
    members: list[int] = field(default_factory=list)

    @property
    def location(self) -> str:
        """Kind and id, for messages."""
        return f"{self.kind} {self.id}"

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels by which users select the element: its name, and the values and keys of its main tags."""
        values = [self.tags[key] for key in _LABEL_TAGS if key in self.tags]
        keys = [key for key in (*_LABEL_TAGS[1:], "waterway") if key in self.tags]
        labels = [to_one_line(label) for label in (*values, *keys) if label not in ("yes", "no")]
        return tuple(dict.fromkeys(labels))

    @property
    def is_building(self) -> bool:
        """Whether the element is a building that blocks robots; they can pass below a mere roof."""
        return self.tags.get("building", "no") not in ("no", "roof")


class OsmData:
    """The content of a file of OpenStreetMap.

    Parameters
    ----------
    source_name : str
        Name of the file for messages.

    Attributes
    ----------
    nodes, ways, relations : dict
        Elements, keyed by id: only nodes with tags, and only relations that are areas (multipolygons).
    bounds : list of (west, south, east, north), degrees
    notes : list of str
        Lines for the report.
    """

    def __init__(self, source_name: str) -> None:
        self.source_name = source_name
        self.bounds: list[tuple[float, float, float, float]] = []
        self.nodes: dict[int, OsmElement] = {}
        self.ways: dict[int, OsmElement] = {}
        self.relations: dict[int, OsmElement] = {}
        self.notes: list[str] = []
        self._node_rows: dict[int, int] = {}
        self._coordinates = array("d")
        self._points: FloatArray | None = None
        self._vertices_used = 0

    @property
    def elements(self) -> list[OsmElement]:
        """All elements: nodes, ways, relations."""
        return [*self.nodes.values(), *self.ways.values(), *self.relations.values()]

    def add_node(self, node_id: int, longitude: float, latitude: float) -> None:
        """Add the position of a node, in degrees."""
        self._node_rows[node_id] = len(self._coordinates) // 2
        self._coordinates.extend((longitude, latitude))
        self._points = None

    def has_node(self, node_id: int) -> bool:
        """Return whether the position of a node is known."""
        return node_id in self._node_rows

    def add_way_node(self, node_id: int, position: LonLat | None) -> None:
        """Add the position of a node that a way contains (``out geom``), unless it is known.

        Parameters
        ----------
        node_id : int
        position : LonLat or None
            None if the way does not contain the position.
        """
        if position is not None and not self.has_node(node_id):
            longitude, latitude = position
            self.add_node(node_id, longitude, latitude)

    def add_line(self, line: list[LonLat | None]) -> list[int]:
        """Add nodes that have no id in the file, and return new ids for them.

        Parameters
        ----------
        line : list of LonLat or None
            Position of each node. None stands for a node outside the extract.
        """
        ids = []
        for point in line:
            if point is None:
                ids.append(_MISSING_NODE_ID)
                continue
            node_id = _FIRST_NEW_ID + len(self._coordinates) // 2
            longitude, latitude = point
            self.add_node(node_id, longitude, latitude)
            ids.append(node_id)
        return ids

    def add_relation_way(self, way_id: int, line: list[LonLat | None]) -> None:
        """Add a way from the node positions in a relation (``out geom``), unless the way is known.

        Parameters
        ----------
        way_id : int
        line : list of LonLat or None
            Positions of the nodes, as in `add_line`; empty if the relation does not contain them.
        """
        if line and way_id not in self.ways:
            self.add_element(OsmElement("way", way_id, members=self.add_line(line)))

    def add_element(self, element: OsmElement) -> None:
        """Add an element, unless it is a node without tags or position, or a relation that is not an area."""
        if element.kind == "node" and element.tags and self.has_node(element.id):
            self.nodes[element.id] = element
        elif element.kind == "way":
            self.ways[element.id] = element
        elif element.kind == "relation" and element.tags.get("type") == "multipolygon":
            self.relations[element.id] = element

    def get_point(self, node: OsmElement) -> FloatArray:
        """Return the (2,) longitude and latitude of a node."""
        point: FloatArray = self._get_points()[self._node_rows[node.id]]
        return point

    def get_ways(self, element: OsmElement) -> list[OsmElement | None]:
        """Return the ways of a relation, with None for missing ones; for a way, the way itself."""
        if element.kind == "relation":
            return [self.ways.get(way_id) for way_id in element.members]
        return [element]

    def get_lines(self, element: OsmElement) -> list[FloatArray] | None:
        """Return the longitudes and latitudes, (k, 2), of each way of an element; None if a node is missing.

        Raises
        ------
        MapError
            If vertices are read too often: one way may be a part of many relations.
        """
        ways = self.get_ways(element)
        self._vertices_used += sum(len(way.members) for way in ways if way is not None)
        if self._vertices_used > _MAX_READINGS * files.MAX_VERTICES:
            files.require_vertices(self._vertices_used, self.source_name)
        lines = []
        for way in ways:
            members = [] if way is None else way.members
            rows = [self._node_rows.get(node_id, -1) for node_id in members]
            if len(rows) < 2 or min(rows) < 0:
                return None
            lines.append(self._get_points()[rows])
        return lines or None

    def _get_points(self) -> FloatArray:
        """Return the positions of all nodes, (n, 2) degrees."""
        if self._points is None:
            self._points = np.array(self._coordinates).reshape(-1, 2)
        return self._points
