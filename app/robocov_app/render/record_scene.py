"""The scene of a moment of a record: of the robots that work then, and the obstacles where they are."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from robocov.observation import Snapshot
from robocov.observation.neighbours import Neighbours
from robocov_app.render.scene import Scene

if TYPE_CHECKING:
    from robocov.arrays import IntArray
    from robocov.record import Record
    from robocov_app.render.field import Fields


def record_scene(record: Record, row: int, *, cost: str = "", fields: Fields | None = None) -> Scene:
    """Return the scene of the moment number `row` of a record, with the trail up to there.

    Robots that have failed are marked as such, those that have not joined yet are left out.

    Parameters
    ----------
    record : Record
    row : int
    cost : str
        What is said of the cost.
    fields : Fields or None
        What is known of the distances to the nearest robot, where they are shown.
    """
    environment = record.environment.at(float(record.time[row]))
    snapshot, team = record.snapshot(row), record.team
    starts, trail = record.positions[0], record.positions[: row + 1]
    more: dict[str, Any] = {}
    if snapshot.working is not None:
        rows = np.flatnonzero(snapshot.working)
        failed = np.flatnonzero(record.present[row] & ~record.working[row]).tolist()
        more = {
            "numbers": tuple((rows + 1).tolist()),
            "failed": {robot + 1: tuple(snapshot.positions[robot].tolist()) for robot in failed},
        }
        if not len(rows):
            return Scene(environment, team, label=record.label, cost=cost, **more)
        snapshot, team = snapshot_of(snapshot, rows), team[rows]
        began = np.argmax(record.present, axis=0)
        starts = record.positions[began, np.arange(len(began))][rows]
        # before it joins, a robot has no trail
        trail = np.where(record.present[: row + 1, rows, None], trail[:, rows], starts)
    scene = Scene.of(
        environment,
        team,
        snapshot,
        starts=starts,
        trail=trail,
        trail_time=record.time[: row + 1],
        label=record.label,
        cost=cost,
        field=None if fields is None else fields.at(snapshot.positions, snapshot.time),
        field_limit=1.0 if fields is None else fields.limit,
    )
    return replace(scene, **more) if more else scene


def snapshot_of(snapshot: Snapshot, rows: IntArray) -> Snapshot:
    """Return a moment as if only the robots of some rows were there; the cells are still those of all."""
    seen, decision = snapshot.seen, snapshot.decision
    number = np.full(len(seen.positions), -1, dtype=np.intp)
    number[rows] = np.arange(len(rows))
    robot, neighbour = seen.neighbours.pairs()
    kept = (number[robot] >= 0) & (number[neighbour] >= 0)
    neighbours = Neighbours(len(rows))
    if not seen.neighbours.complete:
        ranges = None if seen.neighbours.ranges is None else seen.neighbours.ranges[rows]
        neighbours = Neighbours.of_pairs(len(rows), number[robot[kept]], number[neighbour[kept]], ranges)
    return Snapshot(
        replace(
            seen,
            positions=seen.positions[rows],
            velocities=seen.velocities[rows],
            neighbours=neighbours,
            obstacle_points=seen.obstacle_points[rows],
            max_speeds=None if seen.max_speeds is None else seen.max_speeds[rows],
            scans=None,
            reported_positions=None if seen.reported_positions is None else seen.reported_positions[kept],
            report_ages=None if seen.report_ages is None else seen.report_ages[kept],
        ),
        replace(
            decision,
            forces=decision.forces[rows],
            goals=None if decision.goals is None else decision.goals[rows],
            terms={name: term[rows] for name, term in decision.terms.items()},
        ),
        None if snapshot.truth is None else snapshot.truth[rows],
    )
