"""Hues of Voronoi cells over a run, for the replay in a page.

The cells are computed in JavaScript. Which cells share an edge, and so need different hues, is computed here.
"""

from typing import Any

import numpy as np

from robocov.record import Record
from robocov.typing import BoolArray, FloatArray, IntArray
from robocov.voronoi import partition, partition_by_travel_time
from robocov_app.look.hues import MAX_OWN_HUES, choose_robot_hues

MAX_CELLS = 400
"""Maximum number of robots for which a replay draws cells. More would take too long in each frame."""


def embed_hues(record: Record, positions: FloatArray, is_working: BoolArray) -> dict[str, Any]:
    """Build the hues of the cells of a run as JSON content.

    Parameters
    ----------
    record : Record
    positions : (T, n, 2) array, m
        Positions of the robots in the embedded frames.
    is_working : (T, n) bool array
        Which robots work in these frames; only working robots have cells.

    Returns
    -------
    dict
        ``first``: hue of each robot in the first frame. ``changes``: list of ``[frame, robot, hue]`` in
        chronological order. From one frame to the next, cells that share an edge in either of the two frames
        have different hues.
    """
    robots = positions.shape[1]
    if not MAX_OWN_HUES < robots <= MAX_CELLS:
        return {"first": choose_robot_hues(robots).tolist(), "changes": []}
    adjacencies = [_find_adjacency(record, *frame) for frame in zip(positions, is_working, strict=True)]
    first_hues: list[int] = []
    changes: list[list[int]] = []
    previous_hues: IntArray | None = None
    for frame in range(len(adjacencies)):
        # The hues stay until the next frame, so they must also suit its pairs of cells.
        pairs = np.concatenate(adjacencies[frame : frame + 2])
        hues = choose_robot_hues(robots, np.unique(pairs, axis=0), previous_hues)
        if previous_hues is None:
            first_hues = hues.tolist()
        else:
            changed_robots = np.flatnonzero(hues != previous_hues).tolist()
            changes += [[frame, robot, int(hues[robot])] for robot in changed_robots]
        previous_hues = hues
    return {"first": first_hues, "changes": changes}


def _find_adjacency(record: Record, positions: FloatArray, is_working: BoolArray) -> IntArray:
    """Return the pairs of robots whose cells share an edge, as an (m, 2) array with the lower index first."""
    robots = np.flatnonzero(is_working & np.isfinite(positions).all(axis=1))
    if len(robots) < 2:
        return np.empty((0, 2), dtype=np.intp)
    region = record.environment.region
    if record.has_travel_time_cells:
        speeds = record.team.max_speed[robots]
        adjacency = partition_by_travel_time(positions[robots], speeds, region).adjacency
    else:
        adjacency = partition(positions[robots], region).adjacency
    return np.asarray(np.sort(robots[adjacency], axis=1))
