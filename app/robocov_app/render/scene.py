"""The scene: all that a picture shows of one moment of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from dataclasses import field as dataclass_field
from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.environment import Environment
from robocov.observation import Snapshot
from robocov.robots import Team
from robocov.voronoi import VoronoiPartition, partition
from robocov.voronoi.weighted_cells import WeightedCells, weighted_partition

if TYPE_CHECKING:
    from robocov_app.render.field import Field
    from robocov_app.render.sensed import Sensed


@dataclass(frozen=True, eq=False)
class Scene:
    """What is drawn; what is None is left out.

    Attributes
    ----------
    environment : Environment
    team : Team
    snapshot : Snapshot or None
        The state, what was seen in it and what was decided on it; None draws the map alone.
    starts : (n, 2) m or None
    trail : (k, n, 2) m or None
        The positions so far, oldest first.
    trail_time : (k,) s or None
        Their times, for trajectories that fade.
    cells : list of (m, 2) m or None
        The Voronoi cells, one for each robot.
    centroids : (n, 2) m or None
        Their centroids.
    adjacency : (m, 2) or None
        Pairs of cells that share an edge.
    label : str
        The controller as people name it.
    cost : str
        For example ``mean distance 1.23 m``.
    field : Field or None
        The distances to the nearest robot.
    field_limit : float, m
        Where the scale of their colours ends.
    numbers : (n,) int or None
        What people call the robots; by default 1, 2, 3, ...
    failed : dict of number to (x, y) m
        Robots that do not work any more.
    selected : int or None
        Row of the robot that is asked about.
    scans : list of (position (2,), ends (rays, 2)) m
        What range sensors measure all around.
    sensed : Sensed or None
        The obstacle points that were sensed so far.
    path : (w, 2) m or None
        Shortest path from a place to its nearest robot.
    cell_owners : (c,) or None
        Whose each of the `cells` is. Where robots are not equally fast, one may have several outlines, and
        those of fast ones come first: a slow one's are holes in them. None: each robot has one.
    failed_radii : dict of number to m
        Of robots that failed; without, that of the first robot.
    """

    environment: Environment
    team: Team
    snapshot: Snapshot | None = None
    starts: Array | None = None
    trail: Array | None = None
    trail_time: Array | None = None
    cells: Sequence[Array] | None = None
    centroids: Array | None = None
    adjacency: IntArray | None = None
    label: str = ""
    cost: str = ""
    field: Field | None = None
    field_limit: float = 1.0
    numbers: Sequence[int] | None = None
    failed: Mapping[int, tuple[float, float]] = dataclass_field(default_factory=dict)
    selected: int | None = None
    scans: Sequence[tuple[Array, Array]] = ()
    sensed: Sensed | None = None
    path: Array | None = None
    cell_owners: IntArray | None = None
    failed_radii: Mapping[int, float] = dataclass_field(default_factory=dict)

    def failed_radius(self, number: int) -> float:
        """Return the radius of a robot that failed, m."""
        return self.failed_radii.get(number, float(self.team.radius[0]))

    def number(self, robot: int) -> int:
        """Return what people call the robot of a row."""
        return robot + 1 if self.numbers is None else self.numbers[robot]

    @property
    def has_goals(self) -> bool:
        """Whether the controller draws robots to goals, as RAPF does and RPF does not."""
        return self.snapshot is not None and self.snapshot.decision.goals is not None

    @classmethod
    def of(
        cls,
        environment: Environment,
        team: Team,
        snapshot: Snapshot,
        *,
        starts: Array | None = None,
        trail: Array | None = None,
        trail_time: Array | None = None,
        label: str = "",
        cost: str = "",
        field: Field | None = None,
        field_limit: float = 1.0,
    ) -> Scene:
        """Return the scene of `snapshot` with the Voronoi cells of all its robots.

        The cells that the law used are taken where they are these: not where communication is limited, or
        messages are late or get lost, since they overlap there, nor where a user's law says something else.
        """
        cells = snapshot.decision.cells
        if (
            not isinstance(cells, (VoronoiPartition, WeightedCells))
            or not np.isinf(team.communication_range).all()
            or snapshot.seen.reported_positions is not None
            or not np.array_equal(cells.generators, snapshot.positions)
        ):
            where, density = snapshot.positions, environment.density
            if isinstance(cells, WeightedCells):
                cells = weighted_partition(where, team.max_speed, environment.region, density=density)
            else:
                cells = partition(where, environment.region, density=density)
        outlines, owners = cells.outlines
        return cls(
            environment,
            team,
            snapshot,
            starts,
            trail,
            trail_time,
            outlines,
            cells.centroid,
            cells.adjacency,
            label,
            cost,
            field,
            field_limit,
            cell_owners=owners,
        )
