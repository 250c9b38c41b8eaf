"""From what a robot wants and its scans show to a safe velocity, and to the force that brings it about."""

import math

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel
from robocov.observation import Observations
from robocov.team import Team


def approach(offset: Array, k_prop: float, speed: Array) -> Array:
    """Return velocities (n, 2) m/s: k_prop (1/s) times the (n, 2) m offsets of goals, (n,) m/s at most."""
    distance = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2)
    return np.asarray(offset * np.minimum(k_prop, speed / np.maximum(distance, 1e-300))[:, None])


def drive(wanted: Array, seen: Observations, team: Team, response_time: float) -> Array:
    """Return the forces (n, 2) N that track wanted velocities (n, 2) m/s with a time constant (s)."""
    change = (wanted - seen.velocities) * (team.mass / response_time)[:, None]
    return np.asarray(change + seen.velocities * team.viscosity[:, None])


def last_returns(seen: Observations, before: Array | None) -> Array | None:
    """Return the points that the last scans met, (n, rays, 2) m, nan for none; between scans `before`."""
    scans = seen.scans
    if scans is None:
        return before
    reach = np.where(scans.hit, scans.distances, np.nan)
    return np.asarray(seen.positions[:, None] + reach[:, :, None] * scans.headings)


def with_nearest(seen: Observations, returns: Array | None) -> Array:
    """Return the closest obstacle point and those that the last scan met, (n, k, 2) m, nan where none."""
    nearest = seen.obstacle_points[:, None]
    return nearest if returns is None else np.concatenate([nearest, returns], axis=1)


def avoid(
    wanted: Array, seen: Observations, team: Team, points: Array,
    clearance: Array, apart: Array, rate: float, braking: float,
) -> Array:  # fmt: skip
    """Return the velocities nearest to the wanted ones, (n, 2) m/s, that are slow towards points and robots.

    Obstacle points, (n, k, 2) m, are kept a clearance, (n,) m, off, other robots `apart`, (n,) m, centre to
    centre; `braking` is the part of the acceleration that is counted on. See `limit_approach_speed`.
    """
    # of two robots each brakes for its half of the way
    slow, half = braking * team.max_acceleration, 0.5 * braking * team.max_acceleration
    # whom a robot at full speed need not brake for is far
    stopping = np.maximum(team.max_speed / max(rate, 1e-9), team.max_speed**2 / (2.0 * half))
    others = neighbour_offsets(seen, float((apart + stopping).max()))
    walls = seen.positions[:, None] - points
    robots = np.arange(others.shape[1] + walls.shape[1]) < others.shape[1]
    keep = np.where(robots, apart[:, None], clearance[:, None])
    close = np.concatenate([others, walls], axis=1)
    each = np.where(robots, half[:, None], slow[:, None])
    return limit_approach_speed(wanted, close, keep, rate, each, team.max_speed)


def limit_approach_speed(
    wanted: Array, away: Array, clearance: Array, rate: float, braking: Array, speed: Array
) -> Array:
    """Return the velocities nearest to the wanted ones, (n, 2) m/s, that are slow towards what is close.

    The distance to each thing (`away` from it is the robot, (n, k, 2) m, nan for none) falls to its clearance
    (m) exponentially at most, with a rate (1/s), and no faster than a robot can brake (m/s²); inside it, the
    velocity leads out. Where not all of that is possible, nothing is approached.
    """
    distance = np.sqrt(away[..., 0] ** 2 + away[..., 1] ** 2)
    normal = away / np.where(distance > 0.0, distance, np.nan)[..., None]
    gap = np.nan_to_num(distance - clearance)
    level = np.minimum(rate * gap, np.sqrt(2.0 * braking * np.maximum(gap, 0.0)))
    # leading out is worth less than full speed, which would leave no room for anything else
    level = np.maximum(level, -0.5 * speed[:, None])
    slowed, feasible = nearest_allowed(wanted, -normal, level, speed)
    if feasible.all():
        return slowed
    stopped, _ = nearest_allowed(wanted, -normal, np.maximum(level, 0.0), speed)
    return np.where(feasible[:, None], slowed, stopped)


@kernel
def nearest_allowed(wanted: Array, normals: Array, offsets: Array, radius: Array) -> tuple[Array, BoolArray]:
    """Return for each robot the point of a disc, cut by half planes, that is nearest to the wanted one.

    Minimise |u - wanted|² subject to normals[k] · u <= offsets[k] for all k and |u| <= radius. Constraints
    are added one by one: where the optimum so far violates the next one, the new optimum lies on its line,
    in the interval that those before leave (de Berg et al., *Computational Geometry*, section 4.3,
    incremental linear programming, with this objective).

    Normals, (n, m, 2), are of length 1, or nan for no constraint; offsets are (n, m), radii (n,). Return the
    best points, (n, 2), and whether there is any, (n,).
    """
    best = np.empty(wanted.shape)
    feasible = np.ones(len(wanted), dtype=np.bool_)
    for i in range(len(wanted)):
        r = radius[i]
        slack = 1e-12 * max(r, 1.0)
        x, y = wanted[i, 0], wanted[i, 1]
        size = math.sqrt(x * x + y * y)
        if size > r:
            x, y = x * (r / size), y * (r / size)
        for k in range(offsets.shape[1]):
            nx, ny, level = normals[i, k, 0], normals[i, k, 1], offsets[i, k]
            # what the disc meets anyhow, and nan, is no constraint
            if not (level < r and nx * x + ny * y - level > slack):
                continue
            high = math.sqrt(max(r * r - level * level, 0.0))
            low = -high
            if level < -r:
                low = math.inf
            for j in range(k):
                # points of the line are level n + t (-ny, nx)
                rate = normals[i, j, 1] * nx - normals[i, j, 0] * ny
                room = offsets[i, j] - level * (normals[i, j, 0] * nx + normals[i, j, 1] * ny)
                if rate >= 1e-12:
                    high = min(high, room / rate)
                elif rate <= -1e-12:
                    low = max(low, room / rate)
                elif room < -slack:
                    low = math.inf
            if low > high + slack:
                feasible[i] = False
                break
            t = min(max(wanted[i, 1] * nx - wanted[i, 0] * ny, min(low, high)), high)
            x, y = level * nx - t * ny, level * ny + t * nx
        best[i, 0], best[i, 1] = x, y
    return best, feasible


def neighbour_offsets(seen: Observations, reach: float) -> Array:
    """Return the offsets from each robot's neighbours within reach to itself, (n, k, 2) m; nan for none."""
    robot, _, offset, _ = seen.find_near_neighbours(reach)
    return in_rows(robot, len(seen.positions), offset, np.nan)


def in_rows(robot: IntArray, n: int, values: Array, fill: float) -> Array:
    """Return (m, ...) values that belong to n robots, sorted by robot, as (n, k, ...), filled up."""
    count = np.bincount(robot, minlength=n)
    column = np.arange(len(robot)) - np.repeat(np.cumsum(count) - count, count)
    rows = np.full((n, int(count.max(initial=0)), *values.shape[1:]), fill)
    rows[robot, column] = values
    return rows


def summed(robot: IntArray, vectors: Array, n: int) -> Array:
    """Return the sums of (m, 2) vectors that belong to each of n robots, (n, 2)."""
    sums = [np.bincount(robot, part, minlength=n) for part in vectors.T]
    return np.column_stack(sums).astype(np.float64, copy=False)  # of nothing counts are whole
