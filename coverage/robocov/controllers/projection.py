"""The point of a disc, cut by half planes, that is nearest to a given one: a quadratic programme in 2 D."""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array, BoolArray


def nearest_allowed(wanted: Array, normals: Array, offsets: Array, radius: Array) -> tuple[Array, BoolArray]:
    """Solve one small quadratic programme for each of n robots, exactly and all at once.

    Minimise |u - wanted|² subject to normals[k] @ u <= offsets[k] for all k and |u| <= radius.

    Constraints are added one by one. Where the optimum so far meets the next one, it stays; where it
    does not, the new optimum lies on that constraint's line, as the objective is strictly convex: there
    the constraints before leave an interval, and the nearest point of it is the new optimum (de Berg et
    al., *Computational Geometry*, section 4.3, incremental linear programming, with this objective).

    Parameters
    ----------
    wanted : (n, 2)
    normals : (n, m, 2)
        Unit vectors; where one is nan there is no constraint.
    offsets : (n, m)
        Infinite for no constraint.
    radius : (n,)

    Returns
    -------
    best : (n, 2)
        Where nothing is allowed, the best point for the constraints before the first that cannot be met.
    feasible : (n,)
    """
    n, m = offsets.shape
    size = np.hypot(wanted[:, 0], wanted[:, 1])
    best = wanted * np.minimum(1.0, radius / np.maximum(size, 1e-300))[:, None]
    feasible = np.ones(n, dtype=bool)
    # what the disc meets anyhow is no constraint
    bound = ~np.isnan(normals[..., 0]) & (offsets < radius[:, None])
    normals = np.where(bound[..., None], normals, 0.0)
    offsets = np.where(bound, offsets, np.inf)
    # the tightest first: few of the others are left to violate
    order = np.argsort(offsets, axis=1, kind="stable")
    normals, offsets = np.take_along_axis(normals, order[..., None], 1), np.take_along_axis(offsets, order, 1)
    slack = 1e-12 * np.maximum(radius, 1.0)
    for k in range(m if n else 0):
        if not bound.any() or k >= int(bound.sum(axis=1).max()):
            break
        beyond = (normals[:, k] * best).sum(axis=1) - offsets[:, k]
        rows = np.flatnonzero(feasible & (beyond > slack))
        if not len(rows):
            continue
        best[rows], feasible[rows] = _on_line(
            wanted[rows], normals[rows, : k + 1], offsets[rows, : k + 1], radius[rows], best[rows]
        )
    return best, feasible


def _on_line(
    wanted: Array, normals: Array, offsets: Array, radius: Array, before: Array
) -> tuple[Array, BoolArray]:
    """Return the optima on the lines of the last constraints, and whether there are any."""
    normal, level = normals[:, -1], offsets[:, -1]
    foot = normal * level[:, None]
    along = np.column_stack([-normal[:, 1], normal[:, 0]])
    half = np.sqrt(np.maximum(radius**2 - level**2, 0.0))
    low, high = -half, half
    # t normals[k] @ along <= offsets[k] - normals[k] @ foot
    rate = (normals[:, :-1] * along[:, None]).sum(axis=2)
    room = offsets[:, :-1] - (normals[:, :-1] * foot[:, None]).sum(axis=2)
    parallel = np.abs(rate) < 1e-12
    limit = room / np.where(parallel, 1.0, rate)
    high = np.minimum(high, np.where(~parallel & (rate > 0.0), limit, np.inf).min(axis=1, initial=np.inf))
    low = np.maximum(low, np.where(~parallel & (rate < 0.0), limit, -np.inf).max(axis=1, initial=-np.inf))
    slack = 1e-12 * np.maximum(radius, 1.0)
    possible = (level >= -radius) & (low <= high + slack) & ~(parallel & (room < -slack[:, None])).any(axis=1)
    place = np.clip(((wanted - foot) * along).sum(axis=1), np.minimum(low, high), high)
    return np.where(possible[:, None], foot + place[:, None] * along, before), possible
