"""The scene: everything that a picture shows of one moment of a run, from a simulation or a record."""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from dataclasses import field as dataclass_field
from typing import Any, NamedTuple

import numpy as np
import shapely
import shapely.affinity

from robocov.arrays import Array, IntArray
from robocov.environment import Environment
from robocov.observation import Snapshot
from robocov.observation.neighbors import Neighbors
from robocov.record import Record
from robocov.team import Team
from robocov.voronoi import VoronoiPartition, WeightedCells, partition, partition_by_travel_time
from robocov_app.render.distance_field import Field, Fields

SAME = 0.05  # meters within which a goal is the centroid: a record's are those of a moment before its end
CENTROID, GOAL = "cell centroid", "goal"


def are_centroids(goals: Array, centroids: Array) -> bool:
    """Whether all goals that there are, (n, 2) m with nan for none, are the centroids, (n, 2) m."""
    known = np.isfinite(goals).all(axis=1)
    return bool((np.hypot(*(goals - centroids)[known].T) <= SAME).all())


CELL = 0.05  # points that a robot senses within the same square of so many meters count once
MOST = 20_000  # more are not remembered


class Sensed:
    """A growing set of points, each with its robot and the time when it was sensed first."""

    def __init__(self) -> None:
        self._times, self._robots = np.empty(0), np.empty(0, dtype=np.intp)
        self._points = np.empty((0, 2))
        self._known: set[tuple[int, float, float]] = set()

    def __len__(self) -> int:
        return len(self._times)

    def add(self, time: float, numbers: Sequence[int], points: Array) -> None:
        """Add what robots of these numbers sense now, (n, 2) m, nan for nothing."""
        if len(self) + len(numbers) > MOST:
            return
        keys = list(zip(numbers, *np.floor(points / CELL).T.tolist(), strict=True))
        # nan is not equal to itself
        fresh = [row for row, key in enumerate(keys) if key[1] == key[1] and key not in self._known]
        if fresh:
            self._known.update(keys[row] for row in fresh)
            self._times = np.append(self._times, np.full(len(fresh), time))
            self._robots = np.append(self._robots, np.asarray(numbers, dtype=np.intp)[fresh])
            self._points = np.concatenate([self._points, points[fresh]])

    def until(self, time: float) -> tuple[Array, IntArray]:
        """Return the points that were known at a time, (k, 2) m in order, and the numbers of the robots."""
        count = int(np.searchsorted(self._times, time + 1e-6, side="right"))
        return self._points[:count], self._robots[:count]

    def copy(self) -> "Sensed":
        twin = copy(self)  # arrays are replaced, never changed
        twin._known = set(self._known)
        return twin

    def cut(self, time: float) -> None:
        self._points, self._robots = self.until(time)
        self._times = self._times[: len(self._points)]
        x, y = np.floor(self._points / CELL).T.tolist()
        self._known = set(zip(self._robots.tolist(), x, y, strict=True))


class MovingObstacle(NamedTuple):
    """An obstacle at one moment: its shape, the path of its middle, (k, 2) m, and its heading, (2,)."""

    polygon: shapely.Polygon
    middle: Array
    path: Array
    heading: Array


def moving_obstacles(environment: Environment, time: float) -> list[MovingObstacle]:
    found = []
    for obstacle in environment.obstacles:
        if (path := obstacle.path) is None:
            continue
        shift = path.compute_displacement(time)
        ahead = path.compute_displacement(time + 1e-3 * min(path.period, 1.0)) - shift
        ahead /= max(float(np.hypot(*ahead)), 1e-12)
        middle = np.array(obstacle.polygon.envelope.centroid.coords[0])
        polygon = shapely.affinity.translate(obstacle.polygon, *shift.tolist())
        points = [*path.points, *(path.points[:1] if path.repeat == "loop" else ())]
        found.append(MovingObstacle(polygon, middle + shift, np.array(points) - points[0] + middle, ahead))
    return found


@dataclass(frozen=True, eq=False)
class Scene:
    """Content of a picture at one moment; what is None is left out."""

    environment: Environment
    team: Team
    snapshot: Snapshot | None = None  # None draws the map alone
    starts: Array | None = None  # (n, 2) m
    trail: Array | None = None  # (k, n, 2) m, the positions so far, oldest first
    trail_time: Array | None = None  # (k,) s, for trajectories that fade
    trail_fade: float | None = None  # s, so much of the trail is shown, fading into the past
    cells: Sequence[Array] | None = None  # (m, 2) m each, the outlines of Voronoi cells
    centroids: Array | None = None  # (n, 2) m
    adjacency: IntArray | None = None  # (m, 2), pairs of cells that share an edge
    label: str = ""  # the controller as people name it
    cost: str = ""  # "mean distance 1.23 m"
    field: Field | None = None  # the distances to the nearest robot
    field_limit: float = 1.0  # m, where the scale of their colors ends
    numbers: Sequence[int] | None = None  # what people call the robots; by default 1, 2, 3, ...
    failed: Mapping[int, tuple[float, float]] = dataclass_field(default_factory=dict)  # m, by number
    selected: int | None = None  # row of the robot that is asked about
    scans: Sequence[tuple[Array, Array]] = ()  # position (2,) and ends of rays (r, 2) of range sensors, m
    sensed: Sensed | None = None  # the obstacle points that were sensed so far
    path: Array | None = None  # (w, 2) m, the shortest path from a place to its nearest robot
    # (c,), whose each of the cells is; None: each robot has one. Where robots are not equally fast, one may
    # have several outlines, and those of fast ones come first: a slow one's are holes in them
    cell_owners: IntArray | None = None
    moving: Sequence[MovingObstacle] = ()
    failed_radii: Mapping[int, float] = dataclass_field(default_factory=dict)  # m, by number

    def failed_radius(self, number: int) -> float:
        return self.failed_radii.get(number, float(self.team.radius[0]))

    def number(self, robot: int) -> int:
        return robot + 1 if self.numbers is None else self.numbers[robot]

    @property
    def now(self) -> Snapshot:
        assert self.snapshot is not None
        return self.snapshot

    @classmethod
    def of(cls, environment: Environment, team: Team, snapshot: Snapshot, **more: Any) -> "Scene":
        """Return the scene of a snapshot, obstacles where they are then, with all robots' Voronoi cells.

        Those of the law are taken where they are these: limited, late or lost messages make them overlap.
        """
        moving = moving_obstacles(environment, snapshot.time)
        environment = environment.at(snapshot.time)
        cells = snapshot.decision.cells
        if (
            not isinstance(cells, (VoronoiPartition, WeightedCells))
            or not np.isinf(team.communication_range).all()
            or snapshot.seen.reported_positions is not None
            or not np.array_equal(cells.generators, snapshot.positions)
        ):
            where, density = snapshot.positions, environment.density
            if isinstance(cells, WeightedCells):
                cells = partition_by_travel_time(where, team.max_speed, environment.region, density=density)
            else:
                cells = partition(where, environment.region, density=density)
        more["cells"], more["cell_owners"] = cells.outlines
        more |= {"centroids": cells.centroid, "adjacency": cells.adjacency, "moving": moving}
        return cls(environment, team, snapshot, **more)


def record_scene(record: Record, row: int, *, cost: str = "", fields: Fields | None = None) -> Scene:
    """Return the scene of a row of a record, with distances if `fields` are given, failed robots marked."""
    environment, time = record.environment, float(record.time[row])
    snapshot, team = record.snapshot(row), record.team
    starts, trail = record.positions[0], record.positions[: row + 1]
    more: dict[str, Any] = {"label": record.label, "cost": cost}
    if snapshot.working is not None:
        rows = np.flatnonzero(snapshot.working)
        failed = np.flatnonzero(record.present[row] & ~record.working[row]).tolist()
        more["numbers"] = tuple((rows + 1).tolist())
        more["failed"] = {robot + 1: tuple(snapshot.positions[robot].tolist()) for robot in failed}
        if not len(rows):
            return Scene(environment.at(time), team, moving=moving_obstacles(environment, time), **more)
        snapshot, team = snapshot_of(snapshot, rows), team[rows]
        began = np.argmax(record.present, axis=0)
        starts = record.positions[began, np.arange(len(began))][rows]
        # before it joins, a robot has no trail
        trail = np.where(record.present[: row + 1, rows, None], trail[:, rows], starts)
    if fields is not None:
        more |= {"field": fields.at(snapshot.positions, snapshot.time), "field_limit": fields.limit}
    more |= {"starts": starts, "trail": trail, "trail_time": record.time[: row + 1]}
    return Scene.of(environment, team, snapshot, **more)


def snapshot_of(snapshot: Snapshot, rows: IntArray) -> Snapshot:
    """Return a moment as if only the robots of some rows were there; the cells are still those of all."""
    seen, decision = snapshot.seen, snapshot.decision
    number = np.full(len(seen.positions), -1, dtype=np.intp)
    number[rows] = np.arange(len(rows))
    robot, neighbor = seen.neighbors.list_pairs()
    kept = (number[robot] >= 0) & (number[neighbor] >= 0)
    neighbors = Neighbors(len(rows))
    if not seen.neighbors.is_complete:
        ranges = None if seen.neighbors.ranges is None else seen.neighbors.ranges[rows]
        neighbors = Neighbors.from_pairs(len(rows), number[robot[kept]], number[neighbor[kept]], ranges)

    def chosen(of: Any, which: Any, *names: str) -> dict[str, Any]:
        return {name: value[which] for name in names if (value := getattr(of, name)) is not None}

    own = chosen(seen, rows, "positions", "velocities", "obstacle_points", "max_speeds", "steering")
    told = chosen(seen, kept, "reported_positions", "report_ages")
    terms = {name: term[rows] for name, term in decision.terms.items()}
    return Snapshot(
        replace(seen, neighbors=neighbors, scans=None, **own, **told),
        replace(decision, terms=terms, **chosen(decision, rows, "forces", "goals")),
        None if snapshot.truth is None else snapshot.truth[rows],
    )
