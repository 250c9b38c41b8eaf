"""Scenes of recorded runs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from robocov.observation import Snapshot
from robocov.observation.neighbors import Neighbors
from robocov.record import Record
from robocov.typing import IntArray
from robocov_app.render.distance_map.pixel_distances import DistanceFields
from robocov_app.render.moving_obstacles import list_moving_obstacles
from robocov_app.render.scene import Scene


def build_record_scene(
    record: Record, row: int, *, cost: str = "", fields: DistanceFields | None = None
) -> Scene:
    """Build the scene at one time of a recorded run.

    Robots that have failed by then are marked; those that have not joined yet are left out.

    Parameters
    ----------
    record : Record
    row : int
        Index of the time in the record.
    cost : str
        The coverage cost as text.
    fields : DistanceFields, optional
        Computes the distances to the nearest robot. If it is None, the scene has none.

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
    # Numbers of robots start at 1, rows at 0.
    if snapshot.is_working is not None:
        robots = np.flatnonzero(snapshot.is_working)
        failed = np.flatnonzero(record.is_present[row] & ~record.is_working[row]).tolist()
        attributes["numbers"] = tuple((robots + 1).tolist())
        attributes["failed"] = {robot + 1: tuple(snapshot.positions[robot].tolist()) for robot in failed}
        if not len(robots):
            moving = list_moving_obstacles(environment, time)
            return Scene(environment.at(time), team, moving=moving, **attributes)
        snapshot = select_robots(snapshot, robots)
        team = team[robots]
        first_rows = np.argmax(record.is_present, axis=0)
        starts = record.positions[first_rows, np.arange(len(first_rows))][robots]
        # Before a robot joins, its trail stays at its start.
        is_present = record.is_present[: row + 1, robots, None]
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
    """Return a snapshot that contains only the selected robots.

    Parameters
    ----------
    snapshot : Snapshot
    robots : (k,) int array

    Returns
    -------
    Snapshot
        Its cells remain those of the whole snapshot. Scans are dropped.
    """
    seen = snapshot.seen
    decision = snapshot.decision
    # The row of each robot among the selected ones; -1 for the others.
    new_row = np.full(len(seen.positions), -1, dtype=np.intp)
    new_row[robots] = np.arange(len(robots))
    first, second = seen.neighbors.list_pairs()
    is_kept = (new_row[first] >= 0) & (new_row[second] >= 0)
    if seen.neighbors.is_complete:
        neighbors = Neighbors(len(robots))
    else:
        ranges = None if seen.neighbors.ranges is None else seen.neighbors.ranges[robots]
        neighbors = Neighbors.from_pairs(
            len(robots), new_row[first[is_kept]], new_row[second[is_kept]], ranges
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
        None if snapshot.true_positions is None else snapshot.true_positions[robots],
    )


def _select_rows(source: object, names: tuple[str, ...], rows: Any) -> dict[str, Any]:
    """Return the given rows of the named attributes of an object, except for attributes that are None."""
    values = {name: getattr(source, name) for name in names}
    return {name: value[rows] for name, value in values.items() if value is not None}
