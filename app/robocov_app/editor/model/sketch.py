"""A map in the making, valid or not: a value; every edit makes another, which shares what did not change."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Final, Self, TypeAlias

import numpy as np
import shapely

from robocov import environment as env
from robocov.density import Density
from robocov.environment import Obstacle, Point, Ring, StartSpec
from robocov.errors import to_one_line
from robocov.mapfile import dump_document, from_json, to_json
from robocov.mapfile.models import MAX_COORDINATE_M, MAX_SIZE_M
from robocov_app.editor.model.background import MARKS, Background, read_marks, write_marks
from robocov_app.editor.model.geometry import Box, to_array

KINDS = {env.PolygonObstacle: "polygon", env.CircleObstacle: "circle", env.WallObstacle: "wall"}
_LINES = {env.WallObstacle: "points", env.PointsStart: "positions"}
_SHARED = ("name", "description", "schema", "density")  # fields that sketches have as environments do
BOUNDARY: Final = -1  # stands for the boundary where obstacles have their keys
Owner: TypeAlias = int | str  # of vertices: the key of an obstacle, `BOUNDARY`, or the name of a start


@dataclass(frozen=True)
class Item:
    """An obstacle of a sketch."""

    key: int  # who it is, whatever it looks like: stays the same through every edit; not in the file
    shape: Obstacle  # in a draft it may break rules, such as a polygon with two corners
    note: str = ""  # what people wrote about it
    group: str = ""  # the name of the group that it is in; empty for none
    locked: bool = False  # not to be taken by the mouse
    hidden: bool = False  # not shown in the editor either; robots meet it all the same

    @cached_property
    def geometry(self) -> shapely.Geometry:
        """Covered area as a valid shapely geometry, m: a line or a point where it covers nothing."""
        return build_geometry(self.shape)

    @property
    def is_selectable(self) -> bool:
        return not (self.locked or self.hidden)

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what can be derived again."""
        return {name: getattr(self, name) for name in ("key", *MARKS)} | {"shape": replace(self.shape)}


@dataclass(frozen=True)
class Sketch:
    """A map in the making. Immutable; equal when the content is equal, the keys of obstacles included."""

    name: str = "Untitled"
    description: str = ""
    boundary: Ring | None = None  # m
    obstacles: tuple[Item, ...] = ()  # from the bottom to the top
    starts: tuple[tuple[str, StartSpec], ...] = ()  # the first is the default
    background: Background | None = None
    extra: Mapping[str, Any] = field(default_factory=dict)  # the file's free keys, without the editor's
    schema: str | None = None  # the file's ``$schema``
    density: Density | None = None  # how much each place counts; pictures are read when the map is

    def __hash__(self) -> int:
        return hash((self.name, self.boundary, self.obstacles))

    @classmethod
    def from_environment(cls, environment: env.Environment) -> Self:
        """Return the sketch of a map, with keys 0, 1, ... in the order of its obstacles."""
        shapes, free_keys = environment.obstacles, dict(environment.extra)
        marks, background, extra = read_marks(free_keys, [shape.name for shape in shapes])
        return cls(
            boundary=environment.boundary,
            obstacles=tuple(Item(k, shape, **marks.get(k, {})) for k, shape in enumerate(shapes)),
            starts=tuple(environment.starts.items()),
            background=background,
            extra=extra,
            **{name: getattr(environment, name) for name in _SHARED},
        )

    def build_environment(self, where: str = "map") -> env.Environment:
        """Return the map that can be simulated; MapError when it breaks a rule, as of the saved file."""
        return from_json(to_document(self), where)

    def build_unchecked_environment(self) -> env.Environment:
        """Return the map without a look at its rules: if it breaks one, it may fail at anything."""
        shapes, marks = [item.shape for item in self.obstacles], dict[int, dict[str, Any]]()
        for k, item in enumerate(self.obstacles):
            marks[k] = {name: value for name in MARKS if (value := getattr(item, name))}
        return env.Environment(
            boundary=self.boundary or (),
            obstacles=tuple(shapes),
            starts=dict(self.starts),
            extra=write_marks(self.extra, marks, [shape.name for shape in shapes], self.background),
            **{name: getattr(self, name) for name in _SHARED},
        )

    def get_item(self, key: int) -> Item:
        return self.obstacles[self.index_by_key[key]]

    def get_start(self, name: str) -> StartSpec:
        return dict(self.starts)[name]

    def find_object(self, owner: Owner) -> Obstacle | StartSpec | None:
        """Return an obstacle or a start; None of the boundary, and where there is no such thing."""
        if isinstance(owner, str):
            return dict(self.starts).get(owner)
        return self.get_item(owner).shape if owner in self.index_by_key else None

    @property
    def owners(self) -> tuple[Owner, ...]:
        return BOUNDARY, *self.index_by_key, *dict(self.starts)

    def display_name(self, owner: Owner) -> str:
        """Return what people call something: "polygon “desk”", "start “corner”", "boundary"."""
        if isinstance(owner, str):
            return to_one_line(f"start “{owner}”")
        shape = None if owner == BOUNDARY else self.get_item(owner).shape
        kind = "boundary" if shape is None else KINDS[type(shape)]
        return to_one_line(f"{kind} “{shape.name}”") if shape and shape.name else kind

    def list_vertex_rings(self, owner: Owner) -> tuple[Ring, ...]:
        """Return where the vertices of something are, m, ring by ring; empty where there is no such thing."""
        if owner == BOUNDARY:
            return () if self.boundary is None else (self.boundary,)
        thing: Any = self.find_object(owner)
        if isinstance(thing, env.PolygonObstacle):
            return (thing.vertices, *thing.holes)
        if isinstance(thing, env.CircleObstacle | env.DiscStart):
            (x, y), r = thing.center, thing.radius
            return (((x, y), (x + r, y), (x, y + r), (x - r, y), (x, y - r)),)
        return (getattr(thing, _LINES[type(thing)]),) if type(thing) in _LINES else ()

    def list_rings(self, owner: Owner) -> tuple[tuple[int, Ring, bool], ...]:
        """Return the rings of something: number, points, whether it is closed; none of circles and starts."""
        thing = self.find_object(owner)
        if isinstance(owner, str) or isinstance(thing, env.CircleObstacle):
            return ()
        closed = not isinstance(thing, env.WallObstacle)
        return tuple((k, points, closed) for k, points in enumerate(self.list_vertex_rings(owner)))

    def with_rings(self, owner: Owner, rings: Iterable[Sequence[Point]]) -> Self:
        """Return the sketch with other vertices for something that `ring_points` has, but circles."""
        line, *holes = map(tuple, rings)
        if owner == BOUNDARY:
            return replace(self, boundary=line)
        thing: Any = self.find_object(owner)
        if isinstance(thing, env.PolygonObstacle):
            return self.with_objects({owner: replace(thing, vertices=line, holes=tuple(holes))})
        return self.with_objects({owner: replace(thing, **{_LINES[type(thing)]: line})})

    @cached_property
    def index_by_key(self) -> Mapping[int, int]:
        return {item.key: place for place, item in enumerate(self.obstacles)}

    @cached_property
    def geometries(self) -> Any:  # an array of shapely geometries
        return np.array([item.geometry for item in self.obstacles], dtype=object)

    @cached_property
    def tree(self) -> shapely.STRtree:
        return shapely.STRtree(self.geometries)

    @property
    def next_key(self) -> int:
        return max(self.index_by_key, default=-1) + 1

    def with_obstacles(
        self, shapes: Iterable[Obstacle | tuple[Obstacle, str]]
    ) -> tuple[Self, tuple[int, ...]]:
        """Return the sketch with more obstacles on top, each a shape or one with a note; and their keys."""
        pairs = [each if isinstance(each, tuple) else (each, "") for each in shapes]
        items = [Item(k, *pair) for k, pair in enumerate(pairs, self.next_key)]
        return replace(self, obstacles=(*self.obstacles, *items)), tuple(item.key for item in items)

    def with_objects(self, things: Mapping[Any, Any]) -> Self:
        """Return the sketch with other obstacles by their keys, and other or more starts by their names."""
        changed = {
            k: new for k, new in things.items() if isinstance(k, int) and new != self.get_item(k).shape
        }
        items = [replace(i, shape=changed[i.key]) if i.key in changed else i for i in self.obstacles]
        starts = dict(self.starts) | {name: spec for name, spec in things.items() if isinstance(name, str)}
        return replace(self, obstacles=tuple(items), starts=tuple(starts.items()))

    def without(self, owners: Iterable[Owner]) -> Self:
        gone = frozenset(owners)
        obstacles = tuple(item for item in self.obstacles if item.key not in gone)
        return replace(self, obstacles=obstacles, starts=tuple(s for s in self.starts if s[0] not in gone))

    def with_default_name(self, name: str) -> Self:
        """Return the sketch with a name if nobody has given it one."""
        name = "".join(char for char in " ".join(name.split()) if char.isprintable())[:100]
        return replace(self, name=name) if self.name == Sketch.name and name else self

    @property
    def bounds(self) -> Box | None:
        """Bounding box of all that there is, with a shown picture; None of nothing."""
        points = list(self.boundary or ())
        if self.background is not None and self.background.shown:
            points += self.background.corners
        points += [
            point for name, _ in self.starts for ring in self.list_vertex_rings(name) for point in ring
        ]
        corners = np.concatenate([to_array(points), shapely.bounds(self.geometries).reshape(-1, 2)])
        corners = corners[np.isfinite(corners).all(axis=1)]
        if not len(corners):
            return None
        (low_x, low_y), (high_x, high_y) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        return low_x, low_y, high_x, high_y


def to_document(sketch: Sketch) -> dict[str, Any]:
    """Return the map document of a sketch, valid or not; `parser.sketch_of` reads it back, keys aside."""
    document = to_json(sketch.build_unchecked_environment())
    if sketch.boundary is None:
        del document["boundary"]
    return document


def dump_sketch(sketch: Sketch) -> str:
    return dump_document(to_document(sketch))


def build_geometry(shape: Obstacle) -> shapely.Geometry:
    """Return what any obstacle covers as a valid geometry: nothing where it is too large or too far away."""
    if isinstance(shape, env.CircleObstacle):
        if not _is_near([shape.center]):
            return shapely.GeometryCollection()
        return shape.polygon if 0.0 < shape.radius <= MAX_SIZE_M else shapely.Point(shape.center)
    points = shape.points if isinstance(shape, env.WallObstacle) else shape.vertices
    if not _is_near(points) or not points:
        return shapely.GeometryCollection()
    line = shapely.LineString(points) if len(set(points)) > 1 else shapely.Point(points[0])
    if isinstance(shape, env.WallObstacle):
        return shape.polygon if line.length > 0.0 and 0.0 < shape.width <= MAX_SIZE_M else line
    if len(points) < 3:
        return line
    holes = [hole for hole in shape.holes if len(hole) >= 3 and _is_near(hole)]
    polygon = shape.polygon if len(holes) == len(shape.holes) else shapely.Polygon(points, holes)
    return polygon if polygon.is_valid else shapely.make_valid(polygon)


def _is_near(points: Iterable[Point]) -> bool:
    return all(abs(x) <= MAX_COORDINATE_M and abs(y) <= MAX_COORDINATE_M for x, y in points)
