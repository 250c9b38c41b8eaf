"""Named starts: where a team may begin, and how its positions are drawn.

The draw depends on the start, the number of robots, the radius and the seed only, so that
every controller gets the same positions for the same seed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Integral
from typing import TypeAlias

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov.errors import StartError, is_number
from robocov.robots import DEFAULT_RADIUS

GAP = 0.02
"""Smallest gap, as a part of a robot's radius, left between two robots and to walls at the start."""


@dataclass(frozen=True)
class DiscStart:
    """The robots start somewhere in a disc: a team that was unloaded in one place."""

    center: tuple[float, float]
    radius: float


@dataclass(frozen=True)
class UniformStart:
    """The robots start anywhere in the free space."""


@dataclass(frozen=True)
class PointsStart:
    """The robots start at given positions; at most as many robots as there are positions."""

    positions: tuple[tuple[float, float], ...]


StartSpec: TypeAlias = DiscStart | UniformStart | PointsStart


@dataclass(frozen=True, eq=False)
class Start:
    """A named start of one environment, with its free space, ready to draw positions from."""

    name: str
    spec: StartSpec
    free: BaseGeometry

    def sample(self, n: int, seed: int = 0, radius: float = DEFAULT_RADIUS) -> Array:
        """Draw positions of the centres of `n` discs that touch neither walls nor each other, (n, 2) m.

        Parameters
        ----------
        n : int
        seed : int
            The same seed gives the same positions. It is not used where positions are given.
        radius : float, m
            Radius of a robot.

        Raises
        ------
        StartError
            When the robots do not fit.
        """
        for name, value in (("robots", n), ("seed", seed)):
            if not is_number(value, Integral) or value < (name == "robots"):
                raise self._error(f"{name}: {value!r}, but a whole number was wanted")
        if not 0.0 < radius < math.inf:
            raise self._error(f"radius: {radius!r} m, but a number above 0 was wanted")
        if isinstance(self.spec, PointsStart):
            return self._given(n, radius, self.spec.positions)
        spacing = 2.0 * radius * (1.0 + GAP)
        room = self.room(radius)
        if room.is_empty:
            raise self._error(f"no room for a robot of radius {radius:g} m; a wider start was wanted")
        rng = np.random.default_rng([seed, n])
        # no packing of equal discs is denser than the hexagonal one
        most = 1 + math.floor(room.buffer(spacing / 2).area / (spacing**2 * math.sqrt(3) / 2))
        points = np.empty((0, 2))
        if n <= most:
            points = _darts(rng, room, n, spacing)
            if len(points) < n:
                points = _hexagonal(rng, room, n, spacing)
            most = len(points)
        if len(points) < n:
            raise self._error(
                f"room for about {most} robots of radius {radius:g} m, but {n} were asked for; "
                f"fewer robots or a wider start was wanted"
            )
        return points

    def room(self, radius: float) -> BaseGeometry:
        """Return where the centre of a robot of that radius may be, unless positions are given."""
        room = self.free.buffer(-radius * (1.0 + GAP))
        if isinstance(self.spec, DiscStart):
            # the disc holds the centres; robots may stick out of it by their radius
            room = room.intersection(shapely.Point(self.spec.center).buffer(self.spec.radius, quad_segs=64))
        return room

    def _error(self, what: str) -> StartError:
        return StartError(f"start {self.name!r}: {what}")

    def _given(self, n: int, radius: float, positions: tuple[tuple[float, float], ...]) -> Array:
        if n > len(positions):
            raise self._error(
                f"has {len(positions)} positions, but {n} robots were asked for; "
                f"at most {len(positions)} robots or another start was wanted"
            )
        points = np.array(positions[:n], dtype=float)
        distance = shapely.distance(shapely.points(points), self.free.boundary)
        inside = shapely.contains_properly(self.free, shapely.points(points))
        for k in range(n):
            place = f"positions[{k}] = [{points[k, 0]:g}, {points[k, 1]:g}]"
            if not inside[k]:
                raise self._error(f"{place} is inside an obstacle or outside the boundary")
            if distance[k] < radius:
                away = f"{distance[k]:.3g} m from a wall"
                raise self._error(f"{place} is {away}, but a robot of radius {radius:g} m must fit")
        gaps = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
        gaps[np.arange(n), np.arange(n)] = np.inf
        if n > 1 and gaps.min() < 2 * radius:
            i, j = np.unravel_index(int(gaps.argmin()), gaps.shape)
            raise self._error(
                f"positions[{min(i, j)}] and positions[{max(i, j)}] are {gaps.min():.3g} m apart, "
                f"but at least {2 * radius:g} m, a robot's diameter, was wanted"
            )
        return points


def _darts(rng: np.random.Generator, room: BaseGeometry, n: int, spacing: float) -> Array:
    """Throw darts at `room`, keep those at least `spacing` apart; (up to n, 2).

    It gives up when a round keeps less than one dart in a hundred: the rest would take for ever.
    """
    low_x, low_y, high_x, high_y = room.bounds
    kept = np.empty((0, 2))
    shapely.prepare(room)
    # a thin room misses most darts that are thrown at its bounding box
    share = max(room.area / ((high_x - low_x) * (high_y - low_y)), 1e-3)
    while len(kept) < n:
        count = max(64, int(4 * (n - len(kept)) / share))
        darts = rng.uniform((low_x, low_y), (high_x, high_y), size=(count, 2))
        darts = darts[shapely.contains_xy(room, darts[:, 0], darts[:, 1])]
        if len(kept):
            darts = darts[cKDTree(kept).query(darts)[0] >= spacing]
        fresh = _apart(darts, spacing)
        kept = np.concatenate([kept, fresh])
        if len(fresh) < count * share / 100:
            break
    return kept[:n]


def _apart(points: Array, spacing: float) -> Array:
    """Return the points, in their order, that are at least `spacing` from every one returned before."""
    keep = np.ones(len(points), dtype=bool)
    if len(points):
        pairs = cKDTree(points).query_pairs(spacing, output_type="ndarray")
        for i, k in pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].tolist():
            if keep[i]:
                keep[k] = False
    return points[keep]


def _hexagonal(rng: np.random.Generator, room: BaseGeometry, n: int, spacing: float) -> Array:
    """Return up to n points of the best of some randomly laid hexagonal lattices.

    Darts fill a plane only to about 55 %; the lattice reaches 91 %.
    """
    low_x, low_y, high_x, high_y = room.bounds
    reach = float(np.hypot(high_x - low_x, high_y - low_y)) / 2 + 2 * spacing
    steps = int(np.ceil(reach / (spacing * np.sqrt(3) / 2))) + 1
    if steps > 2000:
        return np.empty((0, 2))
    a, b = np.meshgrid(np.arange(-steps, steps + 1), np.arange(-steps, steps + 1))
    lattice = np.column_stack([(a + 0.5 * (b % 2)).ravel(), (b * np.sqrt(3) / 2).ravel()]) * spacing
    middle = np.array([(low_x + high_x) / 2, (low_y + high_y) / 2])
    best = np.empty((0, 2))
    shapely.prepare(room)
    for _ in range(20):
        angle = rng.uniform(0, np.pi / 3)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        points = lattice @ turn.T + middle + rng.uniform(-spacing, spacing, size=2)
        points = points[shapely.contains_xy(room, points[:, 0], points[:, 1])]
        if len(points) > len(best):
            best = points
        if len(best) >= n:
            return best[np.sort(rng.choice(len(best), size=n, replace=False))]
    return best
