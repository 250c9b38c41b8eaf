"""Visible free space of a scan: how far it reaches, and which corners hide more of it."""

import math
from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel
from robocov.density.base import Density
from robocov.observation import Observations, Scanning

_CHECKS = 4  # parts of a way between which it is looked for walls


class View(NamedTuple):
    """Points that the rays of each robot met in its last scan."""

    distances: Array  # (n, rays) m, no more than the sensing range
    hit: BoolArray  # (n, rays), whether they met anything


class Windows(NamedTuple):
    """Edges of views that begin at a corner, and with which the view turns round it; in the order of robots.

    Seen from a place p, a corner v at the distance ρ hides what is behind it. When p moves by d, the point
    of the edge at the distance s from p moves by -(d · t) (s - ρ)/ρ, where t is the unit vector across the
    edge, away from the obstacle: the view grows by t (s - ρ)/ρ for every metre of the edge and of the way.
    """

    robot: IntArray  # (w,)
    ray: IntArray  # (w,), the first that passes the corner
    across: Array  # (w, 2), t, by which a robot has to move to see more
    corner: Array  # (w,) m, ρ


def compute_view(seen: Observations, before: View | None, scanning: Scanning, reach: Array) -> View:
    """Return what the last scan shows; all in range, (n,) m, is free for a robot that has not scanned yet."""
    if seen.scans is not None:
        return View(np.minimum(seen.scans.distances, reach[:, None]), seen.scans.hit)
    if before is not None:
        return before
    shape = len(reach), scanning.rays
    return View(np.broadcast_to(reach[:, None], shape), np.zeros(shape, dtype=bool))


def find_windows(view: View, directions: Array, reach: Array, jump: float) -> Windows:
    """Return where the view in (rays, 2) directions opens by more than `jump` (m) from one ray to the next.

    A wall seen at a low angle opens the view, too: along it 1/distance is a sinusoid of the angle, so that
    two rays tell where the next one meets it, and only what is beyond that counts.
    """
    distances, hit = view
    inverse = 1.0 / np.maximum(distances, 1e-9)
    step = 2.0 * np.cos(2.0 * np.pi / len(directions))
    parts = []
    for side in (1, -1):
        near, met, before = np.roll(distances, side, 1), np.roll(hit, side, 1), np.roll(hit, 2 * side, 1)
        line = step * np.roll(inverse, side, 1) - np.roll(inverse, 2 * side, 1)
        wall = 1.0 / np.maximum(line, 1.0 / reach[:, None])
        beyond = np.where(before, np.maximum(wall, near), near)
        robot, ray = np.nonzero(met & (distances > beyond + jump))
        across = side * directions[ray][:, ::-1] * [-1.0, 1.0]
        parts.append((robot, ray, across, near[robot, ray]))
    robot, ray, across, corner = (np.concatenate(both) for both in zip(*parts, strict=True))
    order = np.argsort(robot, kind="stable")
    return Windows(robot[order], ray[order], across[order], corner[order])


def evaluate_density(density: Density | None, points: Array) -> Array:
    """Return φ at (..., 2) points (m), as an array of their shape."""
    if density is None:
        return np.ones(points.shape[:-1])
    return density.evaluate(points.reshape(-1, 2)).reshape(points.shape[:-1])


def compute_step_fractions(gradient: Array, before: Array | None, step: Array | None) -> Array:
    """Return the part of full speed, (n,), with which robots follow gradients, (n, 2), that leap.

    Areas in view have ridges, such as doors, from both sides of which the gradient leads back: at each
    turn by more than a right angle the step is halved, and otherwise it grows again.
    """
    if before is None or step is None:
        return np.ones(len(gradient))
    turned = (gradient * before).sum(axis=1) < 0.0
    return np.where(turned, 0.5 * step, np.minimum(1.2 * step, 1.0))


@kernel
def is_behind_wall(x: float, y: float, walls: Array) -> bool:
    """Return whether a place, relative to the robot, is farther away than the wall that it sees there."""
    rays = len(walls)
    ray = math.floor(math.atan2(y, x) * (rays / (2.0 * math.pi)) + 0.5) % rays
    return bool(x * x + y * y > walls[ray] ** 2)


@kernel
def is_path_clear(x: float, y: float, dx: float, dy: float, walls: Array) -> bool:
    """Return whether the way (dx, dy) from a place in view leads past no wall that the robot sees."""
    clear = True
    for k in range(1, _CHECKS):
        clear = clear and not is_behind_wall(x + dx * k / _CHECKS, y + dy * k / _CHECKS, walls)
    return clear
