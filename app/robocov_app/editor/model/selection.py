"""Selections, vertices, and the changes that edits make."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from robocov.environment import Obstacle, Point
from robocov.errors import format_count
from robocov_app.editor.model import require
from robocov_app.editor.model.sketch import BOUNDARY, Item, Owner, Sketch


@dataclass(frozen=True, slots=True)
class Vertex:
    """A point of an object that can be dragged.

    Attributes
    ----------
    owner : int or str
        Key of an obstacle, `BOUNDARY`, or name of a start.
    ring : int
        0 for the outline or a wall's line; 1, 2, ... for the holes of a polygon.
    index : int
        Index in the ring. A circle has five vertices: 0 is its center; 1 to 4 are its easternmost,
        northernmost, westernmost and southernmost points.
    """

    owner: Owner
    ring: int
    index: int


@dataclass(frozen=True, slots=True)
class Edge(Vertex):
    """A point, m, on the edge from a vertex of a ring to the next one."""

    point: Point


@dataclass(frozen=True)
class Selection:
    """Selected objects and vertices.

    Attributes
    ----------
    items : frozenset of int
        Keys of obstacles.
    vertices : frozenset of Vertex
        Vertices that are selected individually.
    starts : frozenset of str
        Names of starts.
    boundary : bool
        Whether the boundary is selected.
    """

    items: frozenset[int] = frozenset()
    vertices: frozenset[Vertex] = frozenset()
    starts: frozenset[str] = frozenset()
    boundary: bool = False

    def __bool__(self) -> bool:
        return bool(self.items or self.vertices or self.starts or self.boundary)

    @classmethod
    def of(cls, *owners: Owner) -> Selection:
        """Build the selection of the given objects."""
        items = frozenset(owner for owner in owners if isinstance(owner, int) and owner != BOUNDARY)
        starts = frozenset(owner for owner in owners if isinstance(owner, str))
        return cls(items, starts=starts, boundary=BOUNDARY in owners)

    @classmethod
    def select_all(cls, sketch: Sketch) -> Selection:
        """Build the selection of all objects except for locked and hidden obstacles."""
        excluded = frozenset(item.key for item in sketch.obstacles if not item.is_selectable)
        owners = [owner for owner in sketch.owners if owner not in excluded]
        return cls.of(*owners).restrict_to(sketch)

    @property
    def owners(self) -> frozenset[Owner]:
        """Selected obstacles, starts and the boundary."""
        owners: frozenset[Owner] = self.items | self.starts
        if self.boundary:
            return owners | {BOUNDARY}
        return owners

    def list_items(self, sketch: Sketch) -> list[Item]:
        """Return the selected obstacles, the lowest first."""
        return [item for item in sketch.obstacles if item.key in self.items]

    def union(self, other: Selection) -> Selection:
        """Return the union of two selections."""
        return Selection(
            items=self.items | other.items,
            vertices=self.vertices | other.vertices,
            starts=self.starts | other.starts,
            boundary=self.boundary or other.boundary,
        )

    def toggle(self, other: Selection) -> Selection:
        """Return the symmetric difference of two selections, as after a click with Shift."""
        return Selection(
            items=self.items ^ other.items,
            vertices=self.vertices ^ other.vertices,
            starts=self.starts ^ other.starts,
            boundary=self.boundary != other.boundary,
        )

    def restrict_to(self, sketch: Sketch) -> Selection:
        """Return the part of the selection that exists in a map, for instance after undo."""
        return Selection(
            items=self.items & sketch.index_by_key.keys(),
            vertices=frozenset(vertex for vertex in self.vertices if has_vertex(sketch, vertex)),
            starts=self.starts & dict(sketch.starts).keys(),
            boundary=self.boundary and sketch.boundary is not None,
        )

    def without_vertices(self) -> Selection:
        """Return the selection without its vertices."""
        return replace(self, vertices=frozenset())

    def with_groups(self, sketch: Sketch) -> Selection:
        """Return the selection extended to whole groups, except for locked and hidden obstacles."""
        groups = {sketch.get_item(key).group for key in self.items} - {""}
        members = {item.key for item in sketch.obstacles if item.group in groups and item.is_selectable}
        return replace(self, items=self.items | members)

    def describe(self, sketch: Sketch) -> str:
        """Describe the selection, for example "wall “west”", "3 obstacles" or "2 vertices"."""
        owners = self.owners
        vertex_count = len(self.vertices)
        kinds = [self.items, self.starts, self.boundary, self.vertices]
        if sum(map(bool, kinds)) > 1:
            return f"{len(owners) + vertex_count} objects"
        if vertex_count > 1:
            return f"{vertex_count} vertices"
        if vertex_count == 1:
            return "vertex"
        if len(self.items) > 1:
            return format_count(len(self.items), "obstacle")
        if len(self.starts) > 1:
            return format_count(len(self.starts), "start")
        if not owners:
            return "nothing"
        return sketch.display_name(next(iter(owners)))


@dataclass(frozen=True)
class Change:
    """The result of an edit.

    Attributes
    ----------
    sketch : Sketch
        The map after the edit.
    selection : Selection
        The selection after the edit.
    description : str
        Description for the history, for example "3 obstacles moved".
    """

    sketch: Sketch
    selection: Selection
    description: str


def format_numbered_name(sketch: Sketch, owner: Owner) -> str:
    """Return the name of an object; for obstacles without a name, kind and number, such as "wall 17"."""
    name = sketch.display_name(owner)
    if isinstance(owner, str) or owner == BOUNDARY or sketch.get_item(owner).shape.name:
        return name
    return f"{name} {sketch.index_by_key[owner] + 1}"


def replace_obstacles(sketch: Sketch, shapes: Mapping[Any, Sequence[Obstacle]], description: str) -> Change:
    """Return the change that replaces each of the given obstacles by any number of shapes.

    The first shape keeps the key of the obstacle. All of them keep its note, group, lock and visibility. An
    obstacle without shapes is removed. The new obstacles are selected.
    """
    next_key = sketch.next_key
    items: list[Item] = []
    keys: list[int] = []
    for item in sketch.obstacles:
        if item.key not in shapes:
            items.append(item)
            continue
        for k, shape in enumerate(shapes[item.key]):
            key = item.key
            if k > 0:
                key = next_key
                next_key += 1
            keys.append(key)
            items.append(replace(item, key=key, shape=shape))
    return Change(replace(sketch, obstacles=tuple(items)), Selection.of(*keys), description)


def list_vertices(sketch: Sketch, owner: Owner) -> tuple[tuple[Vertex, Point], ...]:
    """Return the vertices of an object with their positions, m."""
    rings = enumerate(sketch.list_vertex_rings(owner))
    return tuple((Vertex(owner, ring, k), at) for ring, points in rings for k, at in enumerate(points))


def has_vertex(sketch: Sketch, vertex: Vertex) -> bool:
    """Return whether a vertex exists in a map."""
    rings = sketch.list_vertex_rings(vertex.owner)
    return 0 <= vertex.ring < len(rings) and 0 <= vertex.index < len(rings[vertex.ring])


def find_position(sketch: Sketch, vertex: Vertex) -> Point:
    """Return the position of a vertex, m; raise MapError if it no longer exists."""
    require(has_vertex(sketch, vertex), "this vertex no longer exists")
    return sketch.list_vertex_rings(vertex.owner)[vertex.ring][vertex.index]
