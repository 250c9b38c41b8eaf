"""Cells from the Delaunay edges against cells by clipping, and when they must not be used."""

from __future__ import annotations

import numpy as np
import pytest
from voronoi_cases import REGIONS, SQUARE, assert_same_ring, clipped, lattice, scattered

from robocov.observation.neighbours import Neighbours
from robocov.voronoi import partition
from robocov.voronoi.clipped_cells import clip_cells, mass_and_centroid
from robocov.voronoi.delaunay_cells import delaunay_cells


def test_robots_on_the_boundary_and_outside_have_whole_polygons() -> None:
    rng = np.random.default_rng(5)
    inner = scattered(SQUARE, 30, rng) * 0.8 + 0.6
    points = np.concatenate([inner, [[3.0, -0.05], [6.0, 2.5], [0.0, 1.0]]])
    assert delaunay_cells(points, SQUARE) is not None
    for a, b in zip(partition(points, SQUARE).polygons, clipped(points, SQUARE).polygons, strict=True):
        assert_same_ring(a, b, 1e-9)


@pytest.mark.parametrize("name", REGIONS)
@pytest.mark.parametrize("n", [4, 6, 20, 50, 200])
def test_both_paths_agree(n: int, name: str) -> None:
    region = REGIONS[name]
    points = scattered(region, n, np.random.default_rng(n))
    fast = delaunay_cells(points, region)
    assert fast is not None
    cells = clip_cells(points, region, Neighbours(n))
    mass, centroid = mass_and_centroid(cells, points)
    assert fast.mass == pytest.approx(mass, rel=1e-9, abs=1e-12 * region.area)
    assert fast.centroid == pytest.approx(centroid, abs=1e-9 * region.diameter)
    assert fast.mass.sum() == pytest.approx(region.area, rel=1e-12)
    assert mass.sum() == pytest.approx(region.area, rel=1e-12)
    quick, slow = partition(points, region), clipped(points, region)
    assert quick.adjacency.tolist() == slow.adjacency.tolist()
    assert quick.polar_moment == pytest.approx(slow.polar_moment, rel=1e-9)
    for a, b in zip(quick.polygons, slow.polygons, strict=True):
        assert_same_ring(a, b, 1e-9 * region.diameter)


@pytest.mark.parametrize("name", REGIONS)
@pytest.mark.parametrize("side", [3, 4, 7, 12])
def test_lattices_do_not_need_the_slow_path(side: int, name: str) -> None:
    """All cocircular by fours, hulls collinear, and in the square and the round rays that end in corners."""
    region = REGIONS[name]
    points = 0.75 * region.centroid + 0.25 * lattice(region, side * side, np.random.default_rng(side))
    assert delaunay_cells(points, region) is not None
    if name != "far away":  # rounding of the coordinates there makes edges between the cocircular
        links = 2 * side * (side - 1)
        assert len(partition(points, region).adjacency) == links
        assert len(clipped(points, region).adjacency) == links
    eighth = region.centroid + (points - region.centroid) @ np.array([[1.0, 1.0], [-1.0, 1.0]])
    cells = delaunay_cells(eighth, region)
    assert cells is not None
    assert cells.mass == pytest.approx(clipped(eighth, region).mass, abs=1e-12 * region.area)
