"""The scene: all that a picture shows of one moment of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from robocov.arrays import Array, IntArray
from robocov.environment import Environment
from robocov.observation import Snapshot
from robocov.robots import Team
from robocov.voronoi import partition

if TYPE_CHECKING:
    from robocov_app.view.field import Field


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

        The cells that the law used are not taken: where communication is limited they overlap.
        """
        cells = partition(snapshot.positions, environment.region)
        return cls(
            environment,
            team,
            snapshot,
            starts,
            trail,
            trail_time,
            cells.polygons,
            cells.centroid,
            cells.adjacency,
            label,
            cost,
            field,
            field_limit,
        )
