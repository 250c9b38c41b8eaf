"""Scenes of recorded runs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from robocov.arrays import IntArray
from robocov.observation import Snapshot
from robocov.observation.neighbors import Neighbors
from robocov.record import Record
from robocov_app.render.distance_map.field import DistanceFields
from robocov_app.render.moving_obstacles import list_moving_obstacles
from robocov_app.render.scene import Scene


def build_record_scene(
    record: Record, row: int, *, cost: str = "", fields: DistanceFields | None = None
) -> Scene:
    """Build the scene of a row of a record; failed robots are marked.

    Parameters
    ----------
    record : Record
    row : int
    cost : str
        The coverage cost as text.
    fields : DistanceFields, optional
        Computes the distances to the nearest robot.

    Returns
    -------
    Scene
    """
    environment = record.environment
    time = float(record.time[row])
    snapshot = record.snapshot(row)
    team = record.team
    starts = record.positions[0]
    trail = record.positions[: row + 1]
    attributes: dict[str, Any] = {"label": record.label, "cost": cost}
    if snapshot.working is not None:
        robots = np.flatnonzero(snapshot.working)
        failed = np.flatnonzero(record.present[row] & ~record.working[row]).tolist()
        attributes["numbers"] = tuple((robots + 1).tolist())
        attributes["failed"] = {robot + 1: tuple(snapshot.positions[robot].tolist()) for robot in failed}
        if not len(robots):
            moving = list_moving_obstacles(environment, time)
            return Scene(environment.at(time), team, moving=moving, **attributes)
        snapshot = select_robots(snapshot, robots)
        team = team[robots]
        first_rows = np.argmax(record.present, axis=0)
        starts = record.positions[first_rows, np.arange(len(first_rows))][robots]
        # A robot has no trail before it joins.
        is_present = record.present[: row + 1, robots, None]
        trail = np.where(is_present, trail[:, robots], starts)
    if fields is not None:
        attributes["field"] = fields.compute_at(snapshot.positions, snapshot.time)
        attributes["field_limit"] = fields.limit
    return Scene.from_snapshot(
        environment,
        team,
        snapshot,
        starts=starts,
        trail=trail,
        trail_time=record.time[: row + 1],
        **attributes,
    )


def select_robots(snapshot: Snapshot, robots: IntArray) -> Snapshot:
    """Return a snapshot with only some of its robots.

    Parameters
    ----------
    snapshot : Snapshot
    robots : (k,) int array

    Returns
    -------
    Snapshot
        Its cells are still those of all robots.
    """
    seen = snapshot.seen
    decision = snapshot.decision
    new_row = np.full(len(seen.positions), -1, dtype=np.intp)
    new_row[robots] = np.arange(len(robots))
    robot, neighbor = seen.neighbors.list_pairs()
    is_kept = (new_row[robot] >= 0) & (new_row[neighbor] >= 0)
    if seen.neighbors.is_complete:
        neighbors = Neighbors(len(robots))
    else:
        ranges = None if seen.neighbors.ranges is None else seen.neighbors.ranges[robots]
        neighbors = Neighbors.from_pairs(
            len(robots), new_row[robot[is_kept]], new_row[neighbor[is_kept]], ranges
        )
    robot_arrays = _select_rows(
        seen, ("positions", "velocities", "obstacle_points", "max_speeds", "steering"), robots
    )
    pair_arrays = _select_rows(seen, ("reported_positions", "report_ages"), is_kept)
    return Snapshot(
        replace(seen, neighbors=neighbors, scans=None, **robot_arrays, **pair_arrays),
        replace(
            decision,
            terms={name: term[robots] for name, term in decision.terms.items()},
            **_select_rows(decision, ("forces", "goals"), robots),
        ),
        None if snapshot.truth is None else snapshot.truth[robots],
    )


def _select_rows(source: object, names: tuple[str, ...], rows: Any) -> dict[str, Any]:
    """Return some rows of those attributes of an object that are not None."""
    values = {name: getattr(source, name) for name in names}
    return {name: value[rows] for name, value in values.items() if value is not None}
