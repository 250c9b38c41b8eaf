"""Regions, families of points, and exact cells, for the tests of the Voronoi partition."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import pytest
from hypothesis import strategies as st

from robocov.locational_cost import Performance, Sensing, SquaredDistance
from robocov.observation import Cells
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.voronoi import VoronoiPartition, partition

if TYPE_CHECKING:
    from robocov.typing import FloatArray

Family: TypeAlias = Callable[..., "FloatArray"]
"""Builds a number of points for a region."""

SQUARE = Region(np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 6.0], [0.0, 6.0]]))
PENTAGON = Region(np.array([[0.0, 0.0], [4.0, 0.0], [5.0, 2.0], [2.0, 4.0], [-1.0, 1.5]]))
REGIONS = {
    "square": SQUARE,
    "pentagon": PENTAGON,
    "triangle": Region(np.array([[0.0, 0.0], [9.0, 1.0], [2.0, 5.0]])),
    "far away": Region(PENTAGON.vertices + np.array([8000.0, -6000.0])),
    "corridor": Region(np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 1.0], [0.0, 1.0]])),
    "round": Region(5.0 * np.column_stack([f(np.linspace(0, 2 * np.pi, 65)[:-1]) for f in (np.cos, np.sin)])),
}
ROUNDING = 3e-11
"""Allowed error, relative to the area of the region, or for first moments to area times diameter."""

seeds = st.integers(0, 2**32 - 1)
names = st.sampled_from(sorted(REGIONS))


def evaluate_performance(f: Performance, r: FloatArray) -> FloatArray:
    """Return f(r) of the locational cost (4)."""
    if isinstance(f, Sensing):
        return 1.0 / (r**2 + f.height**2)
    if isinstance(f, SquaredDistance):
        return r**2
    return r


def scatter_points(region: Region, n: int, rng: np.random.Generator) -> FloatArray:
    """Return n points within the region, by convex combinations of its corners."""
    return rng.dirichlet(np.full(len(region.vertices), 0.6), n) @ region.vertices


def build_lattice(region: Region, n: int, rng: np.random.Generator) -> FloatArray:
    """Return points of a square lattice about the region's centroid. All are cocircular by fours."""
    side = max(2, int(np.sqrt(n)))
    step = 2.0 ** rng.integers(-6, -2)
    x, y = np.meshgrid(np.arange(side), np.arange(side))
    return region.centroid + step * (np.column_stack([x.ravel(), y.ravel()]) - (side - 1) / 2)


def place_on_circle(region: Region, n: int, rng: np.random.Generator) -> FloatArray:
    angle = rng.uniform(0, 1) + np.arange(n) * 2 * np.pi / n
    return region.centroid + 0.3 * np.column_stack([np.cos(angle), np.sin(angle)])


def place_on_line(region: Region, n: int, rng: np.random.Generator) -> FloatArray:
    a, b = scatter_points(region, 2, rng)
    return a + rng.uniform(0, 1, (n, 1)) * (b - a)


def cluster_points(region: Region, n: int, rng: np.random.Generator) -> FloatArray:
    return region.centroid + 10.0 ** rng.uniform(-9, -2) * rng.uniform(-1, 1, (n, 2))


def cluster_in_groups(region: Region, n: int, rng: np.random.Generator) -> FloatArray:
    """Return single points and groups with a diameter of about a micrometer."""
    centers = scatter_points(region, max(2, n // 3), rng)
    return centers[rng.integers(0, len(centers), n)] + 1e-6 * rng.uniform(-1, 1, (n, 2))


def pair_points(region: Region, n: int, rng: np.random.Generator) -> FloatArray:
    """Return points in pairs that nearly coincide."""
    points = scatter_points(region, n, rng)
    distance = 10.0 ** rng.uniform(-12, -3, (n // 2, 1))
    points[1::2] = points[: n - 1 : 2] + distance * rng.normal(size=(n // 2, 2))
    return points


def place_on_boundary(region: Region, n: int, rng: np.random.Generator) -> FloatArray:
    edge = rng.integers(0, len(region.edges), n)
    return region.vertices[edge] + rng.choice([0.0, 0.25, 0.5, 0.71], (n, 1)) * region.edges[edge]


def place_half_outside(region: Region, n: int, rng: np.random.Generator) -> FloatArray:
    """Return points in an enlarged copy of the region, some of them outside the region."""
    return region.centroid + 1.3 * (scatter_points(region, n, rng) - region.centroid)


FAMILIES = [
    scatter_points,
    build_lattice,
    place_on_circle,
    place_on_line,
    cluster_points,
    cluster_in_groups,
    pair_points,
    place_on_boundary,
    place_half_outside,
]
families = st.sampled_from(FAMILIES)


def compute_exact_cell(
    robot: int, generators: FloatArray, region: Region
) -> tuple[Fraction, Fraction, Fraction, Fraction]:
    """Return area, first moments and polar moment (all about the generator) in rational arithmetic."""
    px, py = map(Fraction, generators[robot].tolist())
    ring = [(Fraction(x) - px, Fraction(y) - py) for x, y in region.vertices.tolist()]
    for other in generators.tolist():
        dx = Fraction(other[0]) - px
        dy = Fraction(other[1]) - py
        side = [x * dx + y * dy - (dx * dx + dy * dy) / 2 for x, y in ring]
        clipped = []
        for k, (x, y) in enumerate(ring):
            u, v = ring[(k + 1) % len(ring)]
            a = side[k]
            b = side[(k + 1) % len(ring)]
            if a <= 0:
                clipped.append((x, y))
            if a * b < 0:
                clipped.append((x + a / (a - b) * (u - x), y + a / (a - b) * (v - y)))
        ring = clipped
    area = mx = my = polar = Fraction(0)
    for (x, y), (u, v) in zip(ring, ring[1:] + ring[:1], strict=True):
        cross = x * v - u * y
        area += cross / 2
        mx += cross * (x + u) / 6
        my += cross * (y + v) / 6
        polar += cross * (x * x + x * u + u * u + y * y + y * v + v * v) / 12
    return area, mx, my, polar


def assert_cells_are_exact(cells: VoronoiPartition, region: Region) -> None:
    size = estimate_size(cells, region)
    for robot, p in enumerate(cells.generators):
        area, mx, my, polar = map(float, compute_exact_cell(robot, cells.generators, region))
        assert cells.masses[robot] == pytest.approx(area, rel=1e-8, abs=ROUNDING * region.area)
        moment = cells.masses[robot] * (cells.centroids[robot] - p)
        assert moment == pytest.approx([mx, my], abs=ROUNDING * region.area * size)
        assert cells.polar_moments[robot] == pytest.approx(polar, abs=ROUNDING * region.area * size**2)


def compute_moment_about_centroid(cells: Cells) -> FloatArray:
    """Return J_{V,C}, (n,) m⁴, by the parallel axis theorem, equation (3)."""
    lever = cells.generators - cells.centroids
    return cells.polar_moments - cells.masses * (lever[:, 0] ** 2 + lever[:, 1] ** 2)


def estimate_size(cells: VoronoiPartition, region: Region) -> float:
    """Return a length that no difference of a generator and a point of the region exceeds by much."""
    outside = float(np.abs(cells.generators - region.centroid).max()) if len(cells.generators) else 0.0
    # Coordinates far from the origin have larger rounding errors.
    return region.diameter + outside + 1e-4 * float(np.abs(region.vertices).max())


def partition_by_clipping(points: FloatArray, region: Region) -> VoronoiPartition:
    """Return the partition by clipping alone, as with limited communication; all robots are in range."""
    n = len(points)
    all_neighbors = Neighbors(
        n,
        np.full(n, 1e9),
        np.arange(n + 1) * (n - 1),
        np.array([j for i in range(n) for j in range(n) if j != i], dtype=np.intp),
    )
    return partition(points, region, all_neighbors)


def assert_same_ring(a: FloatArray, b: FloatArray, tolerance: float) -> None:
    assert len(a) == len(b)
    first = int(np.argmin(np.hypot(*(b - a[0]).T)))
    assert np.roll(b, -first, axis=0) == pytest.approx(a, abs=tolerance)
