"""A map that is being edited, valid or not. Sketches are immutable; edits share unchanged objects."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Final, NamedTuple, Self, TypeAlias

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
_COPIED_FIELDS = ("name", "description", "schema", "density")
"""Fields with the same values in a sketch and in its environment. The other fields must be converted."""
BOUNDARY: Final = -1  # key of the boundary, which no obstacle has
Owner: TypeAlias = int | str
"""Identifies an object with vertices: the key of an obstacle, `BOUNDARY`, or the name of a start."""


class VertexRing(NamedTuple):
    """A ring or line of vertices of an object.

    Attributes
    ----------
    number : int
        0 for the outline or a wall's line; 1, 2, ... for the holes of a polygon.
    points : Ring
        The vertices, m.
    is_closed : bool
        Whether there is an edge from the last vertex to the first.
    """

    number: int
    points: Ring
    is_closed: bool

    @property
    def edge_count(self) -> int:
        """Number of edges between the vertices."""
        if self.is_closed:
            return len(self.points)
        return max(len(self.points) - 1, 0)


@dataclass(frozen=True)
class Item:
    """An obstacle of a sketch.

    Attributes
    ----------
    key : int
        Identifies the obstacle throughout all edits. Not stored in the file.
    shape : Obstacle
        Shape of the obstacle. It may break the rules of maps, such as a polygon with two corners.
    note : str
        Note that the user has written.
    group : str
        Name of the group; empty if there is none.
    locked : bool
        Whether the obstacle cannot be selected with the mouse.
    hidden : bool
        Whether the editor does not show the obstacle. It is still part of the map.
    """

    key: int
    shape: Obstacle
    note: str = ""
    group: str = ""
    locked: bool = False
    hidden: bool = False

    @cached_property
    def geometry(self) -> shapely.Geometry:
        """Covered area as a valid geometry, m; a line, a point or empty if the shape is invalid."""
        return build_geometry(self.shape)

    @property
    def is_selectable(self) -> bool:
        """Whether the obstacle can be selected with the mouse."""
        return not (self.locked or self.hidden)

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for pickling, without cached geometries."""
        # The copy of the shape does not contain its cached polygon.
        return {name: getattr(self, name) for name in ("key", *MARKS)} | {"shape": replace(self.shape)}


@dataclass(frozen=True)
class Sketch:
    """A map that is being edited. Immutable. Sketches are equal if content and obstacle keys are equal.

    Attributes
    ----------
    name, description : str
        Name and description of the map.
    boundary : Ring or None
        The boundary, m; None if it has not been drawn yet.
    obstacles : tuple of Item
        Obstacles from bottom to top.
    starts : tuple of (str, StartSpec)
        Names and starts; the first one is the default.
    background : Background or None
        The background image.
    extra : mapping
        Free keys of the file, except for those of the editor.
    schema : str or None
        Value of the key ``$schema`` in the file.
    density : Density or None
        The density.
    """

    name: str = "Untitled"
    description: str = ""
    boundary: Ring | None = None
    obstacles: tuple[Item, ...] = ()
    starts: tuple[tuple[str, StartSpec], ...] = ()
    background: Background | None = None
    extra: Mapping[str, Any] = field(default_factory=dict)
    schema: str | None = None
    density: Density | None = None

    def __hash__(self) -> int:
        return hash((self.name, self.boundary, self.obstacles))

    @classmethod
    def from_environment(cls, environment: env.Environment) -> Self:
        """Build a sketch of a map; the keys of its obstacles are 0, 1, ..."""
        shapes = environment.obstacles
        marks, background, extra = read_marks(dict(environment.extra), [shape.name for shape in shapes])
        copied_values = {name: getattr(environment, name) for name in _COPIED_FIELDS}
        return cls(
            boundary=environment.boundary,
            obstacles=tuple(Item(k, shape, **marks.get(k, {})) for k, shape in enumerate(shapes)),
            starts=tuple(environment.starts.items()),
            background=background,
            extra=extra,
            **copied_values,
        )

    def build_environment(self, source_name: str = "map") -> env.Environment:
        """Build the map for simulation; raise a MapError that names `source_name` if it breaks a rule."""
        return from_json(to_document(self), source_name)

    def build_unchecked_environment(self) -> env.Environment:
        """Build the map without checking the rules; using a map that breaks them may raise any error."""
        shapes = [item.shape for item in self.obstacles]
        marks: dict[int, dict[str, Any]] = {}
        for k, item in enumerate(self.obstacles):
            values = {name: getattr(item, name) for name in MARKS}
            marks[k] = {name: value for name, value in values.items() if value}
        copied_values = {name: getattr(self, name) for name in _COPIED_FIELDS}
        return env.Environment(
            boundary=self.boundary or (),
            obstacles=tuple(shapes),
            starts=dict(self.starts),
            extra=write_marks(self.extra, marks, [shape.name for shape in shapes], self.background),
            **copied_values,
        )

    def get_item(self, key: int) -> Item:
        """Return an obstacle by its key."""
        return self.obstacles[self.index_by_key[key]]

    def get_start(self, name: str) -> StartSpec:
        """Return a start by its name."""
        return dict(self.starts)[name]

    def get_shape(self, owner: Owner) -> Obstacle | StartSpec | None:
        """Return the shape of an obstacle, or a start; None for the boundary and missing objects."""
        if isinstance(owner, str):
            return dict(self.starts).get(owner)
        if owner not in self.index_by_key:
            return None
        return self.get_item(owner).shape

    @property
    def owners(self) -> tuple[Owner, ...]:
        """All objects: `BOUNDARY` (even if there is none), obstacle keys from bottom to top, start names."""
        return BOUNDARY, *self.index_by_key, *dict(self.starts)

    def display_name(self, owner: Owner) -> str:
        """Return the name of an object for the user, such as "polygon “desk”", "start “corner”" or "wall"."""
        if isinstance(owner, str):
            return to_one_line(f"start “{owner}”")
        if owner == BOUNDARY:
            return "boundary"
        shape = self.get_item(owner).shape
        kind = KINDS[type(shape)]
        if shape.name:
            return to_one_line(f"{kind} “{shape.name}”")
        return kind

    def list_vertex_rings(self, owner: Owner) -> tuple[Ring, ...]:
        """Return the vertices of an object ring by ring, m; empty if there is no such object."""
        if owner == BOUNDARY:
            if self.boundary is None:
                return ()
            return (self.boundary,)
        shape = self.get_shape(owner)
        if isinstance(shape, env.PolygonObstacle):
            return (shape.vertices, *shape.holes)
        if isinstance(shape, env.WallObstacle):
            return (shape.points,)
        if isinstance(shape, env.PointsStart):
            return (shape.positions,)
        if isinstance(shape, env.CircleObstacle | env.DiscStart):
            x, y = shape.center
            radius = shape.radius
            # East, north, west, south.
            rim = ((x + radius, y), (x, y + radius), (x - radius, y), (x, y - radius))
            return (((x, y), *rim),)
        return ()

    def list_rings(self, owner: Owner) -> tuple[VertexRing, ...]:
        """Return the rings of an object with edges between its vertices; circles and starts have none."""
        shape = self.get_shape(owner)
        if isinstance(owner, str) or isinstance(shape, env.CircleObstacle):
            return ()
        is_closed = not isinstance(shape, env.WallObstacle)
        rings = enumerate(self.list_vertex_rings(owner))
        return tuple(VertexRing(number, points, is_closed) for number, points in rings)

    def with_rings(self, owner: Owner, rings: Iterable[Sequence[Point]]) -> Self:
        """Return the map with new vertices, m, for an object that is not a circle or disc."""
        line, *holes = map(tuple, rings)
        if owner == BOUNDARY:
            return replace(self, boundary=line)
        shape = self.get_shape(owner)
        if isinstance(shape, env.PolygonObstacle):
            return self.with_objects({owner: replace(shape, vertices=line, holes=tuple(holes))})
        if isinstance(shape, env.WallObstacle):
            return self.with_objects({owner: replace(shape, points=line)})
        assert isinstance(shape, env.PointsStart)
        return self.with_objects({owner: replace(shape, positions=line)})

    @cached_property
    def index_by_key(self) -> Mapping[int, int]:
        """Index of each obstacle by its key."""
        return {item.key: index for index, item in enumerate(self.obstacles)}

    @cached_property
    def geometries(self) -> Any:
        """Geometries of the obstacles, an (n,) array of shapely geometries, m."""
        return np.array([item.geometry for item in self.obstacles], dtype=object)

    @cached_property
    def tree(self) -> shapely.STRtree:
        """Search tree of the geometries."""
        return shapely.STRtree(self.geometries)

    @property
    def next_key(self) -> int:
        """Smallest key that is greater than those of all obstacles."""
        return max(self.index_by_key, default=-1) + 1

    def with_obstacles(self, shapes: Iterable[Obstacle]) -> tuple[Self, tuple[int, ...]]:
        """Return the map with new obstacles on top, and their keys."""
        return self.with_annotated_obstacles((shape, "") for shape in shapes)

    def with_annotated_obstacles(self, pairs: Iterable[tuple[Obstacle, str]]) -> tuple[Self, tuple[int, ...]]:
        """Return the map with new obstacles on top, given as pairs of shape and note, and their keys."""
        items = [Item(key, shape, note) for key, (shape, note) in enumerate(pairs, self.next_key)]
        return replace(self, obstacles=(*self.obstacles, *items)), tuple(item.key for item in items)

    def with_items(self, items: Iterable[Item]) -> Self:
        """Return the map in which the given items replace those with the same keys."""
        by_key = {item.key: item for item in items}
        return replace(self, obstacles=tuple(by_key.get(item.key, item) for item in self.obstacles))

    def with_objects(self, objects: Mapping[Any, Any]) -> Self:
        """Return the map with new shapes of obstacles, by key, and with replaced or added starts, by name."""
        items: list[Item] = []
        starts = dict(self.starts)
        for owner, shape in objects.items():
            if isinstance(owner, str):
                starts[owner] = shape
            elif shape != self.get_item(owner).shape:
                items.append(replace(self.get_item(owner), shape=shape))
        return replace(self.with_items(items), starts=tuple(starts.items()))

    def without(self, owners: Iterable[Owner]) -> Self:
        """Return the map without the given obstacles and starts."""
        removed = frozenset(owners)
        obstacles = tuple(item for item in self.obstacles if item.key not in removed)
        starts = tuple((name, start) for name, start in self.starts if name not in removed)
        return replace(self, obstacles=obstacles, starts=starts)

    def with_default_name(self, name: str) -> Self:
        """Return the map with a name if it still has the default name."""
        name = "".join(char for char in " ".join(name.split()) if char.isprintable())[:100]
        if self.name != Sketch.name or not name:
            return self
        return replace(self, name=name)

    @property
    def bounds(self) -> Box | None:
        """Bounding box of all objects and of the background image, if shown, m; None for an empty map."""
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
        low_x, low_y = corners.min(axis=0).tolist()
        high_x, high_y = corners.max(axis=0).tolist()
        return low_x, low_y, high_x, high_y


def to_document(sketch: Sketch) -> dict[str, Any]:
    """Return the map document of a sketch, valid or not; `parser.build_sketch` reads it, with new keys."""
    document = to_json(sketch.build_unchecked_environment())
    if sketch.boundary is None:
        del document["boundary"]
    return document


def dump_sketch(sketch: Sketch) -> str:
    """Return the content of the map file of a sketch."""
    return dump_document(to_document(sketch))


def build_geometry(shape: Obstacle) -> shapely.Geometry:
    """Build the area that an obstacle covers as a valid geometry, m; empty if it is too far away."""
    if isinstance(shape, env.CircleObstacle):
        return _build_circle(shape)
    if isinstance(shape, env.WallObstacle):
        return _build_wall(shape)
    return _build_polygon(shape)


def _build_circle(circle: env.CircleObstacle) -> shapely.Geometry:
    """Build the area of a circle; its center if the radius is invalid."""
    if not _is_within_coordinate_limit([circle.center]):
        return shapely.GeometryCollection()
    if not 0.0 < circle.radius <= MAX_SIZE_M:
        return shapely.Point(circle.center)
    return circle.polygon


def _build_wall(wall: env.WallObstacle) -> shapely.Geometry:
    """Build the area of a wall; its line if the width or length is invalid."""
    if not wall.points or not _is_within_coordinate_limit(wall.points):
        return shapely.GeometryCollection()
    line = _build_line(wall.points)
    is_valid = line.length > 0.0 and 0.0 < wall.width <= MAX_SIZE_M
    if not is_valid:
        return line
    return wall.polygon


def _build_polygon(shape: env.PolygonObstacle) -> shapely.Geometry:
    """Build the area of a polygon, without holes that are invalid; a line if it has too few vertices."""
    if not shape.vertices or not _is_within_coordinate_limit(shape.vertices):
        return shapely.GeometryCollection()
    if len(shape.vertices) < 3:
        return _build_line(shape.vertices)
    holes = [hole for hole in shape.holes if len(hole) >= 3 and _is_within_coordinate_limit(hole)]
    if len(holes) == len(shape.holes):
        polygon = shape.polygon
    else:
        polygon = shapely.Polygon(shape.vertices, holes)
    if not polygon.is_valid:
        return shapely.make_valid(polygon)
    return polygon


def _build_line(points: Sequence[Point]) -> shapely.Geometry:
    """Build a line, or a point if all points are the same."""
    if len(set(points)) == 1:
        return shapely.Point(points[0])
    return shapely.LineString(points)


def _is_within_coordinate_limit(points: Iterable[Point]) -> bool:
    return all(abs(x) <= MAX_COORDINATE_M and abs(y) <= MAX_COORDINATE_M for x, y in points)
