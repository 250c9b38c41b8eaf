"""The forces that RPF and RAPF are made of: (25) and (27)."""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array
from robocov.observation import Observations
from robocov.observation.neighbours import NOBODY
from robocov.potential import potential_forces

_NOT_REPORTED = np.empty((0, 2))


def forces_seen(
    seen: Observations,
    goals: Array,
    k_rep: float,
    rho_0: float,
    k_att: float = 0.0,
    limit: float | None = None,
    *,
    from_robots: bool = True,
) -> tuple[Array, Array, Array, Array]:
    """Return the sum of the forces, the attraction to the goals, the repulsion by robots, and by obstacles.

    Each is (n, 2) N, by the parameters of `potential_forces`; no `limit` is None.
    """
    n, links = len(seen.positions), seen.neighbours
    indptr = np.zeros(n + 1, np.intp) if not from_robots else NOBODY if links.indptr is None else links.indptr
    total, attraction, robots, obstacle = potential_forces(
        seen.positions,
        _NOT_REPORTED if seen.reported_positions is None else seen.reported_positions,
        indptr,
        NOBODY if links.indices is None else links.indices,
        n,
        seen.obstacle_points,
        goals,
        k_rep,
        rho_0,
        k_att,
        np.inf if limit is None else limit,
    )
    return total, attraction, robots, obstacle
