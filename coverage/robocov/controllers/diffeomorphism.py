"""Lloyd's algorithm behind a diffeomorphism that shrinks the obstacles of the known map to points."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import shapely
from scipy.sparse import csr_array, diags_array
from scipy.spatial import Delaunay

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel
from robocov.controllers.base import BaseController
from robocov.controllers.driving import (
    Margins,
    avoid_collisions,
    compute_approach_velocities,
    compute_drive_forces,
)
from robocov.controllers.gains import gain, response_time_gain
from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.optimum import find_nearest_inside
from robocov.team import Team
from robocov.voronoi.sampled_cells import compute_sample_centroids, find_own_samples

_ROUNDS = 12  # times that pieces of walls are halved which are no edges of the mesh yet
_GRID = 1e-6  # metres to which vertices of the mesh are rounded


@dataclass(frozen=True, slots=True, eq=False)
class DiffeomorphismMemory:
    """Memory of the last planning."""

    team: Team
    centroids: Array | None = None  # (n, 2) m, of the cells in the chart
    goals: Array | None = None  # (n, 2) m, in the map
    planned: float = -np.inf  # s


@dataclass(frozen=True)
class Diffeomorphism(BaseController):
    """Coverage of a non-convex region by way of a convex one (Caicedo-Núñez and Žefran 2008).

    A diffeomorphism F takes the free space to the convex region without some points, or slits: the
    obstacles. There Lloyd's algorithm goes straight to the centroids of Voronoi cells, with the density
    that F carries over, so that every place has the mass it has in the map; back in the map that is

        u_i = k DF(p_i)⁻¹ (C_i - F(p_i)),    C_i the centroid of the cell of F(p_i)

    and goes round the obstacles. What is minimised is the cost of the images: distances are those of the
    chart, not of ways in the map. A room behind a long corridor is a speck there, and hardly worth going to.

    Any F will do. This one is a discrete harmonic map: a triangulation of the whole region, obstacles
    included, whose vertices on the boundary stay and of which every other is the weighted mean of its
    neighbours, with Floater's mean value weights (2003), multiplied by `shrink` inside of obstacles. With
    positive weights and a convex boundary it is one to one (Tutte 1963, Floater 1997), for every `shrink`:
    an obstacle becomes as small as one likes, one that touches the boundary withdraws to where it does, and
    a wall between two rooms becomes a slit. Without obstacles, and with `shrink` 1, F is the identity, and
    the law is Lloyd's.

    It knows the whole map from the beginning. Walls are widened by radius and `clearance`; whoever is
    pushed in there goes by the nearest place outside. The closest obstacle point and other robots are kept
    off by slowing down, which is decided here. Cells are sampled by the triangles of the mesh, and planned
    anew every `period`; a robot that does not hear everybody cuts its cell by those it hears. Rooms that
    cannot be reached are not left out; obstacles that move are not in the map that it is told.

    Taken from what is generally known of the two papers ("A coverage algorithm for a class of non-convex
    regions", CDC 2008; "Performing coverage on nonconvex domains", CCA 2008), not from their texts. Departs
    from them in F, which is piecewise linear, and in that obstacles become small, but not points.
    """

    name = "diffeomorphism"
    label = "LA, diffeomorphism"
    summary = "Lloyd's algorithm in a convex chart of the known map (Caicedo-Núñez and Žefran 2008)"
    information = "whole map"

    shrink: float = gain(1e4, "1", "how much stiffer obstacles are than the free space", low=1.0, high=1e6)
    lattice: float = gain(64.0, "cells", "of the mesh along a side", low=4.0, high=512.0, whole=True)
    clearance: float = gain(0.03, "m", "distance that ways keep from walls, beyond the radius", high=10.0)
    period: float = gain(0.2, "s", "time from one planning to the next", high=60.0)
    k_prop: float = gain(2.0, "1/s", "wanted speed per metre to the centroid, back in the map", high=100.0)
    response_time: float = response_time_gain()
    environment: Environment | None = field(default=None, repr=False, compare=False)

    def inform(self, environment: Environment) -> Diffeomorphism:
        """Return the same law with the map."""
        return replace(self, environment=environment)

    def begin(self, region: Region, team: Team) -> DiffeomorphismMemory:
        """Return what the robots know of themselves; a ParameterError when no robot fits into the map."""
        self._chart(team)
        return DiffeomorphismMemory(team)

    def decide(self, seen: Observations, memory: DiffeomorphismMemory) -> Decision:
        team, chart = memory.team, self._chart(memory.team)
        images, slopes = chart.at(seen.positions)
        if memory.centroids is None or not memory.planned <= seen.time < memory.planned + self.period - 1e-9:
            robot, other, offset, _ = seen.find_near_neighbours(np.inf)
            told = seen.reported_positions is not None
            heard = chart.at(seen.positions[robot] - offset)[0] if told else images[other]
            mine = find_own_samples(chart.samples, images, robot, heard)
            middle = compute_sample_centroids(mine, chart.samples, chart.mass, images)
            memory = DiffeomorphismMemory(team, middle, chart.back(middle), seen.time)
        assert memory.centroids is not None
        (x, y), (a, b, c, d) = (memory.centroids - images).T, slopes.reshape(-1, 4).T
        # one to one means a positive determinant
        back = np.column_stack([d * x - b * y, a * y - c * x]) / np.maximum(a * d - b * c, 1e-300)[:, None]
        wanted = compute_approach_velocities(back, self.k_prop, team.max_speed)
        keep, points = team.radius + 0.5 * self.clearance, seen.obstacle_points[:, None]
        wanted = avoid_collisions(
            wanted, seen, team, points, Margins(keep, keep + float(team.radius.max()), 4.0, 0.5)
        )
        forces = compute_drive_forces(wanted, seen, team, self.response_time)
        return Decision(forces, memory.goals, {"attraction": forces}, memory=memory)

    def _chart(self, team: Team) -> Chart:
        if self.environment is None:
            told = "it has not been told the map; inform(environment) was wanted"
            raise ParameterError(f"controller {self.name!r}: {told}")
        keep = float(team.radius.max()) + self.clearance
        return _cached(self.environment, keep, int(self.lattice), self.shrink)


class Chart:
    """F, from the region (m) to itself, for robots whose centres keep a clearance (m) from walls; immutable.

    It has the `room` where centres may be, and the free space as `samples`, (k, 2) m in the chart, with
    their `mass`, (k,) m².
    """

    def __init__(self, environment: Environment, clearance: float, lattice: int, shrink: float) -> None:
        self.room = environment.free.buffer(-clearance, quad_segs=2).simplify(0.005)
        if self.room.is_empty:
            told = f"no room for robots that keep {clearance:g} m from its walls"
            raise ParameterError(f"map {environment.name!r} has {told}")
        shapely.prepare(self.room)
        self.points, triangles, fixed = _triangulated(environment.region, self.room, lattice)
        middles = self.points[triangles].mean(axis=1)
        solid = ~shapely.contains_xy(self.room, middles)
        self.image = _harmonic(self.points, triangles, np.where(solid, shrink, 1.0), fixed)
        self.triangles = triangles
        before, after = self.points[triangles], self.image[triangles]
        self._there, self._back = _Pieces.between(before, after), _Pieces.between(after, before)
        (x, y), (u, v) = (before[:, 1] - before[:, 0]).T, (before[:, 2] - before[:, 0]).T
        # what the walls were widened by is free, too
        mass = 0.5 * (x * v - y * u)
        mass[solid] = shapely.area(
            shapely.intersection(environment.free, shapely.polygons(self.points[triangles[solid]]))
        )
        some = mass > 0.0
        self.samples, self.mass = after[some].mean(axis=1), mass[some]
        if environment.density is not None:
            self.mass *= environment.density.evaluate(middles[some])

    def at(self, positions: Array) -> tuple[Array, Array]:
        """Return F at the nearest places in the room, (n, 2) m, and its Jacobian there, (n, 2, 2)."""
        return self._there.at(find_nearest_inside(self.room, positions))

    def back(self, images: Array) -> Array:
        """Return the places of which these are the images, (n, 2) m."""
        return self._back.at(images)[0]


class _Pieces(NamedTuple):
    """A map that is affine on each of t triangles."""

    origins: Array  # (t, 2), their third corners
    inverse: Array  # (t, 2, 2), from the offset to barycentric coordinates
    images: Array  # (t, 3, 2), of the corners
    slopes: Array  # (t, 2, 2), Jacobians

    @classmethod
    def between(cls, corners: Array, images: Array) -> _Pieces:
        """Return the map from triangles, (t, 3, 2), to their images."""
        first, second = corners[:, 0] - corners[:, 2], corners[:, 1] - corners[:, 2]
        doubled = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
        inverse = np.stack([second[:, ::-1] * [1.0, -1.0], first[:, ::-1] * [-1.0, 1.0]], axis=1)
        inverse /= doubled[:, None, None]
        sides = images[:, :2] - images[:, 2:]
        return cls(corners[:, 2], inverse, images, (sides[..., None] * inverse[:, :, None]).sum(axis=1))

    def at(self, places: Array) -> tuple[Array, Array]:
        """Return the images of (n, 2) places, (n, 2), and the Jacobians there, (n, 2, 2)."""
        k = _located(places, self.inverse, self.origins)
        first = (self.inverse[k] * (places - self.origins[k])[:, None]).sum(axis=2)
        weights = np.column_stack([first, 1.0 - first.sum(axis=1)])
        return (weights[..., None] * self.images[k]).sum(axis=1), self.slopes[k]


def _triangulated(region: Region, room: shapely.Geometry, lattice: int) -> tuple[Array, IntArray, BoolArray]:
    """Return a mesh of the region with the walls of the room as edges.

    That is its vertices, (v, 2) m, its triangles, (t, 3), counter-clockwise, and which vertices are on the
    boundary of the region, (v,).
    """
    low_x, low_y, high_x, high_y = region.bounds
    side = max(high_x - low_x, high_y - low_y) / lattice
    walls = shapely.segmentize(shapely.union(room.boundary, region.polygon.boundary), side)
    lines, line = shapely.get_coordinates(shapely.get_parts(walls), return_index=True)
    along = line[1:] == line[:-1]
    begin, end = lines[:-1][along], lines[1:][along]
    x, y = np.meshgrid(np.arange(low_x, high_x, side), np.arange(low_y, high_y, side))
    inner = np.column_stack([x.ravel(), y.ravel()])
    inner = inner[region.contains(inner)]
    inner = inner[shapely.distance(walls, shapely.points(inner)) > 0.5 * side]
    for _ in range(_ROUNDS):
        points = np.unique(np.round(np.concatenate([begin, end, inner]) / _GRID) * _GRID, axis=0)
        mesh = Delaunay(points)
        first, last = (_indices(points, ends) for ends in (begin, end))
        edges = np.sort(mesh.simplices[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        there = np.isin(
            np.minimum(first, last) * len(points) + np.maximum(first, last), edges @ [len(points), 1]
        )
        if there.all():
            break
        middle = 0.5 * (begin + end)[~there]
        begin = np.concatenate([begin[there], begin[~there], middle])
        end = np.concatenate([end[there], middle, end[~there]])
    fixed = ~region.contains(points, -2.0 * _GRID)
    triangles = mesh.simplices.astype(np.intp)
    # those are flat, or as good as nothing, and move with the boundary
    return points, triangles[~fixed[triangles].all(axis=1)], fixed


def _indices(points: Array, places: Array) -> IntArray:
    """Return which of the (k, 2) m sorted points each place is, (m,)."""
    both = np.unique(np.concatenate([points, np.round(places / _GRID) * _GRID]), axis=0, return_inverse=True)[
        1
    ]
    return np.asarray(both.ravel()[len(points) :])


def _harmonic(points: Array, triangles: IntArray, stiffness: Array, fixed: BoolArray) -> Array:
    """Return vertices, (v, 2) m, each the weighted mean of its neighbours, but for the fixed ones.

    The weights are Floater's mean value coordinates, tan(α/2) + tan(β/2) over the length, of the two angles
    beside the edge, each times the stiffness, (t,), of its triangle.
    """
    rows, columns, weights = [], [], []
    for k in range(3):
        here, left, right = (triangles[:, (k + turn) % 3] for turn in range(3))
        u, v = points[left] - points[here], points[right] - points[here]
        long, other = np.hypot(*u.T), np.hypot(*v.T)
        # tan(α/2) = |u × v| / (|u| |v| + u · v)
        half = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / (long * other + (u * v).sum(axis=1))
        rows += [here, here]
        columns += [left, right]
        weights += [stiffness * half / long, stiffness * half / other]
    row, column = np.concatenate(rows), np.concatenate(columns)
    means = csr_array((np.concatenate(weights), (row, column)), shape=(len(points), len(points)))
    inner = np.flatnonzero(~fixed)
    system = diags_array(means.sum(axis=1)) - means
    image = points.copy()
    known = means[inner][:, np.flatnonzero(fixed)] @ points[fixed]
    system = system.tocsr()[inner][:, inner].tocoo()
    # vertices are sorted: neighbours have near numbers
    reach = int(np.abs(system.row - system.col).max(initial=0))
    band = np.zeros((len(inner), 2 * reach + 1))
    band[system.row, system.col - system.row + reach] = system.data
    image[inner] = _solved(band, known)
    return image


@kernel
def _solved(band: Array, right: Array) -> Array:
    """Solve a diagonally dominant system of (v, 2 b + 1) diagonals for (v, 2)."""
    size, reach = len(band), band.shape[1] // 2
    for k in range(size):
        last = min(size, k + reach + 1)
        for r in range(k + 1, last):
            part = band[r, k - r + reach] / band[k, reach]
            if part != 0.0:
                right[r] -= part * right[k]
                for c in range(k, last):
                    band[r, c - r + reach] -= part * band[k, c - k + reach]
    for k in range(size - 1, -1, -1):
        for c in range(k + 1, min(size, k + reach + 1)):
            right[k] -= band[k, c - k + reach] * right[c]
        right[k] /= band[k, reach]
    return right


@kernel
def _located(places: Array, inverse: Array, origins: Array) -> IntArray:
    """Return in which triangle each of (n, 2) places is, (n,), or in which it is the least outside."""
    result = np.zeros(len(places), dtype=np.intp)
    for i in range(len(places)):
        best = -np.inf
        for t in range(len(origins)):
            x, y = places[i, 0] - origins[t, 0], places[i, 1] - origins[t, 1]
            first = inverse[t, 0, 0] * x + inverse[t, 0, 1] * y
            second = inverse[t, 1, 0] * x + inverse[t, 1, 1] * y
            least = min(first, second, 1.0 - first - second)
            if least > best:
                result[i], best = t, least
            if best >= 0.0:
                break
    return result


# a chart takes long, and memories of robots must not hold it
_cached = lru_cache(maxsize=8)(Chart)
