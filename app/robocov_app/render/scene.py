"""The scene: the content of a picture at one time of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from dataclasses import field as dataclass_field
from typing import Any

import numpy as np

from robocov.environment import Environment
from robocov.observation import Snapshot
from robocov.team import Team
from robocov.typing import FloatArray, IntArray
from robocov.voronoi import VoronoiPartition, WeightedCells, partition, partition_by_travel_time
from robocov_app.render.distance_map.pixel_distances import DistanceField
from robocov_app.render.moving_obstacles import MovingObstacle, list_moving_obstacles
from robocov_app.render.sensed_points import SensedPoints

CENTROID_TOLERANCE_M = 0.05
"""Distance within which a goal counts as the centroid: in records, goals are a step older than cells."""


def are_centroids(goals: FloatArray, centroids: FloatArray) -> bool:
    """Return whether all goals are at the centroids of the robots' cells, within a tolerance.

    Parameters
    ----------
    goals : (n, 2) array, m
        nan for robots without a goal.
    centroids : (n, 2) array, m

    Returns
    -------
    bool
    """
    has_goal = np.isfinite(goals).all(axis=1)
    distances = np.hypot(*(goals - centroids)[has_goal].T)
    return bool((distances <= CENTROID_TOLERANCE_M).all())


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts of robots at one time.

    Attributes
    ----------
    rows : (c,) int array
        Rows of the robots that touch a wall, an obstacle or a failed robot.
    points : (c, 2) array, m
        Points at which they touch it.
    points_between_robots : (p, 2) array, m
        Points at which two working robots touch each other.
    """

    rows: IntArray
    points: FloatArray
    points_between_robots: FloatArray

    def __len__(self) -> int:
        return len(self.points) + len(self.points_between_robots)


@dataclass(frozen=True, eq=False)
class Scene:
    """The content of a picture at one time; values that are None or empty are not drawn.

    Attributes
    ----------
    environment : Environment
        The map, with moving obstacles at their positions.
    team : Team
    snapshot : Snapshot or None
        State and knowledge of the robots. If it is None, only the map is drawn.
    starts : (n, 2) array or None, m
    trail : (k, n + f, 2) array or None, m
        Positions so far, the oldest first. The n robots of the scene come before f robots that have failed
        and whose trajectories are known. Positions are nan at times when a robot is not working.
    trail_time : (k,) array or None, s
        Times of the trail, for trajectories that fade.
    trail_fade : float or None, s
        Time after which a trail has faded away; by default the whole trail is drawn.
    cells : sequence of (m, 2) arrays or None, m
        Outlines of the Voronoi cells.
    centroids : (n, 2) array or None, m
    adjacency : (m, 2) int array or None
        Pairs of cells that share an edge.
    label : str
        Display name of the controller.
    cost : str
        The coverage cost as text.
    field : DistanceField or None
        Distances to the nearest robot.
    field_limit : float, m
        End of the color scale of these distances.
    numbers : sequence of int or None
        Numbers of the robots as shown to users; by default 1, 2, 3, ...
    failed : mapping of int to (float, float), m
        Positions of failed robots, by their numbers.
    selected : int or None
        Row of the selected robot.
    scans : sequence of (array, array), m
        Position (2,) and ends of the rays (r, 2) of range sensors.
    sensed : SensedPoints or None
        Points of obstacles that have been sensed so far.
    path : (w, 2) array or None, m
        The shortest path from a position to its nearest robot.
    cell_owners : (c,) int array or None
        Row of the robot that owns each cell; by default cell i belongs to robot i. If robots differ in
        speed, a robot may own several outlines. Those of fast robots come first, so that the cells of slower
        robots inside them are drawn on top.
    moving : sequence of MovingObstacle
    failed_radii : mapping of int to float, m
        Radii of failed robots, by their numbers.
    memory_rows : (n,) int array or None
        Rows of the robots in the memory of the controller, which may contain further robots; by default
        0 to n - 1.
    contacts : Contacts or None
    spacing : float or None, m
        Distance between neighbors that decides on the size of all discs, so that several scenes next to each
        other have discs of the same size; by default that of the robots of this scene.
    """

    environment: Environment
    team: Team
    snapshot: Snapshot | None = None
    starts: FloatArray | None = None
    trail: FloatArray | None = None
    trail_time: FloatArray | None = None
    trail_fade: float | None = None
    cells: Sequence[FloatArray] | None = None
    centroids: FloatArray | None = None
    adjacency: IntArray | None = None
    label: str = ""
    cost: str = ""
    field: DistanceField | None = None
    field_limit: float = 1.0
    numbers: Sequence[int] | None = None
    failed: Mapping[int, tuple[float, float]] = dataclass_field(default_factory=dict)
    selected: int | None = None
    scans: Sequence[tuple[FloatArray, FloatArray]] = ()
    sensed: SensedPoints | None = None
    path: FloatArray | None = None
    cell_owners: IntArray | None = None
    moving: Sequence[MovingObstacle] = ()
    failed_radii: Mapping[int, float] = dataclass_field(default_factory=dict)
    memory_rows: IntArray | None = None
    contacts: Contacts | None = None
    spacing: float | None = None

    def get_failed_radius(self, number: int) -> float:
        """Return the radius of a failed robot, m; if it is unknown, that of the first working robot."""
        return self.failed_radii.get(number, float(self.team.radius[0]))

    def get_number(self, row: int) -> int:
        """Return the number that users see for the robot in a row."""
        if self.numbers is None:
            return row + 1
        return self.numbers[row]

    def has_content(self, name: str) -> bool:
        """Return whether the named attribute is neither None nor an empty collection."""
        value = getattr(self, name)
        if isinstance(value, Sequence | Mapping):
            return len(value) > 0
        return value is not None

    @property
    def now(self) -> Snapshot:
        """The snapshot, in scenes that have one."""
        assert self.snapshot is not None
        return self.snapshot

    @classmethod
    def from_snapshot(
        cls, environment: Environment, team: Team, snapshot: Snapshot, **attributes: Any
    ) -> Scene:
        """Build the scene of a snapshot, with the Voronoi cells of all robots.

        Parameters
        ----------
        environment : Environment
            The map; its moving obstacles are placed where they are at the time of the snapshot.
        team : Team
        snapshot : Snapshot
        **attributes
            Further attributes of the scene.

        Returns
        -------
        Scene
        """
        cells = _find_cells(environment, team, snapshot)
        outlines, owners = cells.outlines
        return cls(
            environment.at(snapshot.time),
            team,
            snapshot,
            cells=outlines,
            cell_owners=owners,
            centroids=cells.centroids,
            adjacency=cells.adjacency,
            moving=list_moving_obstacles(environment, snapshot.time),
            **attributes,
        )


def _find_cells(environment: Environment, team: Team, snapshot: Snapshot) -> VoronoiPartition | WeightedCells:
    """Return the cells of the controller if they partition the map, or compute cells that do.

    If communication is limited, or messages are late or lost, the cells of the controller may overlap. Then
    the cells of all robots at their true positions are computed.
    """
    cells = snapshot.decision.cells
    positions = snapshot.positions
    has_true_cells = (
        isinstance(cells, VoronoiPartition | WeightedCells)
        and bool(np.isinf(team.communication_range).all())
        and snapshot.seen.reported_positions is None
        and np.array_equal(cells.generators, positions)
    )
    if has_true_cells:
        assert isinstance(cells, VoronoiPartition | WeightedCells)
        return cells
    static = environment.at(snapshot.time)
    if isinstance(cells, WeightedCells):
        return partition_by_travel_time(positions, team.max_speed, static.region, density=static.density)
    return partition(positions, static.region, density=static.density)
