"""Maps, synthetic runs and scenes for tests of drawings."""

import numpy as np

from robocov.environment import (
    CircleObstacle,
    DiscStart,
    Environment,
    PolygonObstacle,
    UniformStart,
    WallObstacle,
)
from robocov.observation import Decision, Observations, Snapshot
from robocov.observation.neighbors import Neighbors
from robocov.record import Record
from robocov.team import Team
from robocov.voronoi import partition
from robocov_app.render.scene import Scene

ROOMS = Environment(
    "rooms",
    ((0, 0), (16, 0), (16, 10), (0, 10)),
    (
        PolygonObstacle(((4, 2.4), (7.2, 2.4), (7.2, 3.2), (4.8, 3.2), (4.8, 6.4), (4, 6.4))),
        CircleObstacle((11, 2.8), 0.95),
        PolygonObstacle(
            ((1, 7), (4, 7), (4, 9.4), (1, 9.4)), (((1.6, 7.6), (3.4, 7.6), (3.4, 8.8), (1.6, 8.8)),)
        ),
        WallObstacle(((8, 0), (8, 2), (9, 2)), 0.2),
    ),
    {"spread": UniformStart(), "corner": DiscStart((2, 2), 1.4)},
)
HALL = Environment(
    "hall", ((0, 0), (14, 0), (14, 4), (6, 4), (6, 11), (0, 11)), (), {"spread": UniformStart()}
)
SQUARE = Environment("square", ((0, 0), (8, 0), (8, 8), (0, 8)), (), {"spread": UniformStart()})
CORRIDOR = Environment("corridor", ((0, 0), (40, 0), (40, 4), (0, 4)), (), {"spread": UniformStart()})
SHAFT = Environment("shaft", ((0, 0), (4, 0), (4, 40), (0, 40)), (), {"spread": UniformStart()})


def record_walk(
    environment: Environment, n: int, steps: int = 40, seed: int = 0, controller: str = "rapf"
) -> Record:
    """Return a record in which each robot moves from its start to another free position.

    Goals are the centroids of the cells, except for RPF, which has no goals.
    """
    start = environment.start("spread").sample(n, seed)
    end = environment.start("spread").sample(n, seed + 1000)
    fraction = np.linspace(0.0, 1.0, steps)[:, None, None]
    bend = np.random.default_rng(seed).normal(size=(1, n, 2)) * 0.3
    positions = start + (end - start) * fraction + bend * np.sin(np.pi * fraction)
    low = environment.region.vertices.min(axis=0)
    high = environment.region.vertices.max(axis=0)
    positions = np.clip(positions, low + 0.1, high - 0.1)
    time = np.arange(steps) * 0.1
    unknown = np.full_like(positions, np.nan)
    goals = unknown
    if controller != "rpf":
        goals = np.array([partition(points, environment.region).centroids for points in positions])
    return Record(
        environment=environment,
        team=Team.homogeneous(n),
        controller=controller,
        label=controller.upper(),
        gains={},
        start="spread",
        seed=seed,
        dt=0.1,
        time=time,
        positions=positions,
        velocities=np.gradient(positions, time, axis=0),
        forces=np.ones_like(positions),
        goals=goals,
        obstacle_points=unknown,
    )


def build_row_scene(record: Record, row: int = -1, cost: str = "mean distance 1.234 m") -> Scene:
    """Return the scene of one row of a record."""
    row %= len(record)
    return Scene.from_snapshot(
        record.environment,
        record.team,
        record.snapshot(row),
        starts=record.positions[0],
        trail=record.positions[: row + 1],
        trail_time=record.time[: row + 1],
        label=record.label,
        cost=cost,
    )


def build_scene(
    positions: np.ndarray,
    *,
    forces: np.ndarray | None = None,
    velocities: np.ndarray | None = None,
    goals: np.ndarray | None = None,
    obstacle_points: np.ndarray | None = None,
    sensing_range: float = 3.0,
    communication_range: float = np.inf,
) -> Scene:
    """Return a scene in the square with all observations and terms of a decision."""
    n = len(positions)
    zero = np.zeros_like(positions)
    forces = zero if forces is None else forces
    team = Team.homogeneous(n, sensing_range=sensing_range, communication_range=communication_range)
    observations = Observations(
        positions,
        zero if velocities is None else velocities,
        Neighbors.from_ranges(positions, team.communication_range),
        np.full_like(positions, np.nan) if obstacle_points is None else obstacle_points,
        SQUARE.region,
        1.5,
    )
    terms = {"attraction": forces, "repulsion_robots": forces, "repulsion_obstacle": forces}
    return Scene.from_snapshot(
        SQUARE, team, Snapshot(observations, Decision(forces, goals, terms)), label="RAPF"
    )
