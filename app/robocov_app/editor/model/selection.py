"""What is selected, and what lies under the cursor or in a box."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from robocov.environment import CircleObstacle, DiscStart, PointsStart, PolygonObstacle, WallObstacle
from robocov.errors import MapError, one_line
from robocov_app.editor.model.sketch import BOUNDARY, Item, Owner, Sketch
from robocov_app.viewer.session.map_edits import words_for

if TYPE_CHECKING:
    from robocov.environment import Obstacle, Point, StartSpec


@dataclass(frozen=True, slots=True)
class Vertex:
    """A point of something that can be dragged.

    Attributes
    ----------
    of : key of an obstacle, `BOUNDARY`, or name of a start
    ring : int
        0 for the outline, or a wall's line; 1, 2, ... for the holes of a polygon.
    index : int
        In the ring. Of a circle, and of a start that is a disc: 0 the centre, and 1 to 4 its rim in the
        east, north, west and south.
    """

    of: Owner
    ring: int
    index: int


@dataclass(frozen=True, slots=True)
class Edge:
    """A place on an edge: from vertex `index` of a ring to the next.

    Attributes
    ----------
    of, ring, index
        As of a `Vertex`.
    point : (x, y), m
        The place on the edge.
    """

    of: Owner
    ring: int
    index: int
    point: Point


@dataclass(frozen=True)
class Selection:
    """What is selected: obstacles, single vertices, starts, the boundary."""

    items: frozenset[int] = frozenset()
    vertices: frozenset[Vertex] = frozenset()
    starts: frozenset[str] = frozenset()
    boundary: bool = False

    def __bool__(self) -> bool:
        return bool(self.items or self.vertices or self.starts or self.boundary)

    @classmethod
    def of(cls, *owners: Owner) -> Selection:
        """Return the selection of whole things: keys, `BOUNDARY`, names of starts."""
        return cls(
            items=frozenset(each for each in owners if isinstance(each, int) and each != BOUNDARY),
            starts=frozenset(each for each in owners if isinstance(each, str)),
            boundary=BOUNDARY in owners,
        )

    @classmethod
    def all(cls, sketch: Sketch) -> Selection:
        """Return the selection of every obstacle, every start and the boundary."""
        names = (name for name, _ in sketch.starts)
        return cls(
            frozenset(item.key for item in sketch.obstacles),
            starts=frozenset(names),
            boundary=sketch.boundary is not None,
        )

    @property
    def owners(self) -> frozenset[Owner]:
        """The whole things that are selected."""
        return self.items | self.starts | ({BOUNDARY} if self.boundary else frozenset())

    def plus(self, other: Selection) -> Selection:
        """Return both together."""
        return Selection(
            self.items | other.items,
            self.vertices | other.vertices,
            self.starts | other.starts,
            self.boundary or other.boundary,
        )

    def toggled(self, other: Selection) -> Selection:
        """Return the selection after a click with Shift: what is in both goes, the rest of `other` comes."""
        return Selection(
            self.items ^ other.items,
            self.vertices ^ other.vertices,
            self.starts ^ other.starts,
            self.boundary != other.boundary,
        )

    def within(self, sketch: Sketch) -> Selection:
        """Return what of the selection there is in a sketch, as after undoing."""
        names = {name for name, _ in sketch.starts}
        return Selection(
            self.items & sketch.places.keys(),
            frozenset(vertex for vertex in self.vertices if exists(sketch, vertex)),
            self.starts & names,
            self.boundary and sketch.boundary is not None,
        )

    def without_vertices(self) -> Selection:
        """Return the whole things of the selection, without single vertices."""
        return replace(self, vertices=frozenset())

    def words(self, sketch: Sketch) -> str:
        """Return what people call it: "wall “west”", "3 obstacles", "2 vertices"."""
        counts = {
            "obstacle": len(self.items),
            "start": len(self.starts),
            "boundary": int(self.boundary),
            "vertex": len(self.vertices),
        }
        total = sum(counts.values())
        ((kind, count), *others) = sorted(counts.items(), key=lambda pair: -pair[1])
        if not total:
            return "nothing"
        if others[0][1]:
            return f"{total} things"
        if kind == "vertex":
            return f"{count} vertices" if count > 1 else "vertex"
        if count > 1:
            return f"{count} {kind}s"
        (owner,) = self.owners
        return display_name(sketch, owner)


@dataclass(frozen=True)
class Change:
    """What an edit makes: the sketch after it, what is selected then, and what people call it.

    Attributes
    ----------
    sketch : Sketch
    selection : Selection
    words : str
        In the past, as the status line says it and undo lists it: "3 obstacles moved".
    """

    sketch: Sketch
    selection: Selection
    words: str


def display_name(sketch: Sketch, owner: Owner) -> str:
    """Return what people call something: "polygon “desk”", "start “corner”", "boundary"."""
    if owner == BOUNDARY:
        return "boundary"
    return one_line(f"start “{owner}”" if isinstance(owner, str) else words_for(sketch.item(owner).shape))


def ring_points(sketch: Sketch, owner: Owner) -> tuple[tuple[Point, ...], ...]:
    """Return where the vertices of something are, m, ring by ring; empty where there is no such thing."""
    if owner == BOUNDARY:
        return () if sketch.boundary is None else (sketch.boundary,)
    held: Obstacle | StartSpec | None
    if isinstance(owner, str):
        held = dict(sketch.starts).get(owner)
    else:
        held = sketch.item(owner).shape if owner in sketch.places else None
    if isinstance(held, PolygonObstacle):
        return (held.vertices, *held.holes)
    if isinstance(held, WallObstacle):
        return (held.points,)
    if isinstance(held, PointsStart):
        return (held.positions,)
    if isinstance(held, CircleObstacle | DiscStart):
        (x, y), r = held.center, held.radius
        return (((x, y), (x + r, y), (x, y + r), (x - r, y), (x, y - r)),)
    return ()


def with_rings(sketch: Sketch, owner: Owner, rings: Sequence[Sequence[Point]]) -> Sketch:
    """Return the sketch with other vertices for something that `ring_points` has rings of, not circles."""
    lines = [tuple(ring) for ring in rings]
    if isinstance(owner, str):
        return sketch.with_start(owner, PointsStart(lines[0]))
    if owner == BOUNDARY:
        return replace(sketch, boundary=lines[0])
    shape = sketch.item(owner).shape
    if isinstance(shape, WallObstacle):
        return sketch.with_shapes({owner: replace(shape, points=lines[0])})
    assert isinstance(shape, PolygonObstacle)
    return sketch.with_shapes({owner: replace(shape, vertices=lines[0], holes=tuple(lines[1:]))})


def replace_obstacles(sketch: Sketch, shapes: Mapping[int, Sequence[Obstacle]], words: str) -> Change:
    """Return the change that puts shapes, none or several, in the place of some obstacles."""
    fresh = sketch.fresh_key
    items: list[Item] = []
    keys: list[int] = []
    for item in sketch.obstacles:
        if item.key not in shapes:
            items.append(item)
            continue
        for k, shape in enumerate(shapes[item.key]):
            key = item.key if k == 0 else fresh
            fresh += k > 0
            keys.append(key)
            items.append(Item(key, shape, item.note))
    return Change(replace(sketch, obstacles=tuple(items)), Selection.of(*keys), words)


def points_of(sketch: Sketch, owner: Owner) -> tuple[tuple[Vertex, Point], ...]:
    """Return the vertices of something and where they are, m; the handles that a window shows."""
    return tuple(
        (Vertex(owner, ring, index), point)
        for ring, points in enumerate(ring_points(sketch, owner))
        for index, point in enumerate(points)
    )


def exists(sketch: Sketch, vertex: Vertex) -> bool:
    """Return whether there is such a vertex."""
    rings = ring_points(sketch, vertex.of)
    return 0 <= vertex.ring < len(rings) and 0 <= vertex.index < len(rings[vertex.ring])


def place_of(sketch: Sketch, vertex: Vertex) -> Point:
    """Return where a vertex is, m.

    Raises
    ------
    MapError
        When there is none.
    """
    if not exists(sketch, vertex):
        raise MapError("there is no such vertex any more")
    return ring_points(sketch, vertex.of)[vertex.ring][vertex.index]


def rings_of(sketch: Sketch, owner: Owner) -> tuple[tuple[int, tuple[Point, ...], bool], ...]:
    """Return the rings of something: number, points, and whether it is closed; none of circles and starts."""
    if isinstance(owner, str):
        return ()
    shape = sketch.item(owner).shape if owner in sketch.places else None
    if isinstance(shape, CircleObstacle):
        return ()
    closed = not isinstance(shape, WallObstacle)
    return tuple((k, points, closed) for k, points in enumerate(ring_points(sketch, owner)))
