"""Hues of Voronoi cells over a run, for the replay in a page.

JavaScript clips the cells; which cells share an edge, and so must differ, is found here.
"""

from typing import Any

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.record import Record
from robocov.voronoi import partition, partition_by_travel_time
from robocov_app.look.robot_colors import MAX_OWN_HUES, choose_robot_hues

MAX_CELLS = 400
"""Robots up to which replays draw cells. More would take too long in each frame."""


def embed_hues(record: Record, positions: Array, working: BoolArray) -> dict[str, Any]:
    """Build the hues of the cells of a run as JSON content.

    Parameters
    ----------
    record : Record
    positions : (T, n, 2) array, m
        Positions of the robots at the moments that are embedded.
    working : (T, n) bool array
        Which robots work at these moments; only they have cells.

    Returns
    -------
    dict
        ``first``: hue of each robot at the first moment. ``changes``: list of ``[moment, robot, hue]`` in the
        order of time. Between two moments, cells that share an edge at either of them differ.
    """
    robots = positions.shape[1]
    hues = choose_robot_hues(robots)
    if not MAX_OWN_HUES < robots <= MAX_CELLS:
        return {"first": hues.tolist(), "changes": []}
    adjacencies = [_find_adjacency(record, *moment) for moment in zip(positions, working, strict=True)]
    first: list[int] = []
    changes: list[list[int]] = []
    for moment, adjacency in enumerate(adjacencies):
        previous = hues
        # Until the next moment robots move on: its pairs count as well.
        pairs = np.concatenate([adjacency, *adjacencies[moment + 1 : moment + 2]])
        hues = choose_robot_hues(robots, np.unique(pairs, axis=0), previous if moment else None)
        if moment == 0:
            first = hues.tolist()
            continue
        changed = np.flatnonzero(hues != previous).tolist()
        changes += [[moment, robot, int(hues[robot])] for robot in changed]
    return {"first": first, "changes": changes}


def _find_adjacency(record: Record, positions: Array, working: BoolArray) -> IntArray:
    """Return pairs of robots whose cells share an edge, (m, 2), the lower number first."""
    robots = np.flatnonzero(working & np.isfinite(positions).all(axis=1))
    if len(robots) < 2:
        return np.empty((0, 2), dtype=np.intp)
    region = record.environment.region
    if record.has_travel_time_cells:
        speeds = record.team.max_speed[robots]
        adjacency = partition_by_travel_time(positions[robots], speeds, region).adjacency
    else:
        adjacency = partition(positions[robots], region).adjacency
    return np.asarray(np.sort(robots[adjacency], axis=1))
