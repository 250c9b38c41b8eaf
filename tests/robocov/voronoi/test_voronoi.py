"""The bounded Voronoi partition against exact arithmetic, itself, and its symmetries."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from voronoi_cases import (
    FAMILIES,
    PENTAGON,
    REGIONS,
    SQUARE,
    Family,
    assert_cells_are_exact,
    assert_same_ring,
    compute_exact_cell,
    compute_moment_about_centroid,
    families,
    names,
    partition_by_clipping,
    scatter_points,
    seeds,
)

from robocov.density.cell_edges import REGION
from robocov.errors import InputError
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.voronoi import partition, partition_by_travel_time


@pytest.mark.parametrize("name", REGIONS)
@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 6, 7, 12])
def test_small_teams_are_exact(n: int, name: str) -> None:
    rng = np.random.default_rng(n)
    cells = partition(scatter_points(REGIONS[name], n, rng), REGIONS[name])
    assert_cells_are_exact(cells, REGIONS[name])
    assert cells.masses.sum() == pytest.approx(REGIONS[name].area, rel=1e-12)


@pytest.mark.slow
@settings(deadline=None, max_examples=count_examples(300))
@given(seeds, names, families, st.integers(1, 14))
def test_every_family_is_exact(seed: int, name: str, family: Family, n: int) -> None:
    region = REGIONS[name]
    points = family(region, n, np.random.default_rng(seed))
    assert_cells_are_exact(partition(points, region), region)
    assert_cells_are_exact(partition_by_clipping(points, region), region)


def test_one_robot_gets_the_whole_region() -> None:
    cells = partition(np.array([[1.0, 1.0]]), PENTAGON)
    assert cells.masses == pytest.approx([PENTAGON.area])
    assert cells.centroids == pytest.approx(PENTAGON.centroid[None])
    assert cells.polygons[0] == pytest.approx(PENTAGON.vertices)
    assert cells.adjacency.shape == (0, 2)


def test_an_empty_team_has_no_cells() -> None:
    cells = partition(np.empty((0, 2)), SQUARE)
    assert cells.masses.shape == (0,)
    assert cells.centroids.shape == (0, 2)
    assert cells.polygons == []
    assert cells.adjacency.shape == (0, 2)


def test_nine_robots_on_a_lattice_get_a_ninth_of_the_square_each() -> None:
    x, y = np.meshgrid([1.0, 3.0, 5.0], [1.0, 3.0, 5.0])
    points = np.column_stack([x.ravel(), y.ravel()])
    across = [(0, 1), (0, 3), (1, 2), (1, 4), (2, 5), (3, 4), (3, 6), (4, 5), (4, 7), (5, 8), (6, 7), (7, 8)]
    for cells in (partition(points, SQUARE), partition_by_clipping(points, SQUARE)):
        assert cells.masses == pytest.approx(np.full(9, 4.0), rel=1e-13)
        assert cells.centroids == pytest.approx(points, rel=1e-13)
        assert cells.polar_moments == pytest.approx(np.full(9, 16.0 / 6.0), rel=1e-13)
        assert cells.adjacency.tolist() == [list(pair) for pair in across]
        assert [len(polygon) for polygon in cells.polygons] == [4] * 9


def test_three_cells_may_meet_on_the_boundary() -> None:
    cells = partition(np.array([[1.0, 0.0], [3.0, 2.0], [5.0, 0.0]]), SQUARE)
    assert cells.masses == pytest.approx([4.5, 27.0, 4.5], rel=1e-13)
    assert cells.adjacency.tolist() == [[0, 1], [1, 2]]
    assert sorted(cells.edges.other_cells[cells.edges.cells == 1].tolist()) == [REGION, REGION, REGION, 0, 2]
    assert_same_ring(cells.polygons[1], np.array([[6.0, 3], [6, 6], [0, 6], [0, 3], [3, 0]]), 1e-12)


@settings(deadline=None, max_examples=count_examples(200))
@given(seeds, names, st.sampled_from(FAMILIES[:-1]), st.integers(1, 60))
def test_cells_tile_the_region(seed: int, name: str, family: Family, n: int) -> None:
    region = REGIONS[name]
    rng = np.random.default_rng(seed)
    points = family(region, n, rng)
    cells = partition(points, region)
    distinct = np.unique(points, axis=0, return_index=True)[1]
    assert cells.masses[distinct].sum() == pytest.approx(region.area, rel=5e-12)
    shapes = [shapely.Polygon(ring) if len(ring) > 2 else shapely.Point() for ring in cells.polygons]
    assert [shape.area for shape in shapes] == pytest.approx(cells.masses, abs=1e-11 * region.diameter**2)
    samples = rng.dirichlet(np.ones(len(region.vertices)), 200) @ region.vertices
    distance = np.hypot(*(samples[:, None] - points).transpose(2, 0, 1))
    is_inside = np.column_stack([shapely.contains_xy(shape, *samples.T) for shape in shapes])
    nearest = distance.min(axis=1, keepdims=True)
    blur = 1e-9 * region.diameter
    # Near a bisector rounding may decide: both cells or neither may contain the sample.
    generator_distance = np.hypot(*(points[:, None] - points).transpose(2, 0, 1))[distance.argmin(axis=1)]
    is_doubtful = (distance**2 - nearest**2 <= 2 * blur * generator_distance) & (distance > nearest)
    is_off_boundary = (np.abs(samples @ region.normals.T - region.offsets) > blur).all(axis=1)
    is_clear = ~is_doubtful.any(axis=1) & is_off_boundary
    assert (is_inside == (distance == nearest))[is_clear].all()


@settings(deadline=None, max_examples=count_examples(200))
@given(seeds, names, families, st.integers(1, 40))
def test_polygons_are_convex_rings_about_their_mass(seed: int, name: str, family: Family, n: int) -> None:
    region = REGIONS[name]
    cells = partition(family(region, n, np.random.default_rng(seed)), region)
    for ring, mass, centroid in zip(cells.polygons, cells.masses, cells.centroids, strict=True):
        if mass < 1e-9 * region.area:
            continue
        local = ring - centroid
        x, y = local.T
        u, v = np.roll(local, -1, axis=0).T
        cross = x * v - u * y
        assert (cross > -1e-9 * region.diameter**2).all()
        assert cross.sum() / 2 == pytest.approx(mass, rel=1e-6)
        assert region.contains(ring, 1e-9 * region.diameter).all()


@settings(deadline=None, max_examples=count_examples(120))
@given(seeds, st.integers(1, 30))
def test_moments_obey_the_parallel_axis_theorem(seed: int, n: int) -> None:
    """Check equation (3) with moments from triangles that have the centroid as a corner."""
    points = scatter_points(PENTAGON, n, np.random.default_rng(seed))
    for cells in (partition(points, PENTAGON), partition_by_clipping(points, PENTAGON)):
        moments_about_centroids = []
        for ring, centroid in zip(cells.polygons, cells.centroids, strict=True):
            x, y = (ring - centroid).T
            u, v = (np.roll(ring, -1, axis=0) - centroid).T
            # Moment of the triangle (0, a, b) about 0: (a × b) (a·a + a·b + b·b) / 12.
            triangle_moments = (x * v - u * y) * (x * x + x * u + u * u + y * y + y * v + v * v) / 12
            moments_about_centroids.append(triangle_moments.sum())
        expected = np.array(moments_about_centroids)
        assert compute_moment_about_centroid(cells) == pytest.approx(expected, abs=1e-11)
        offset = points - cells.centroids
        shifted = expected + cells.masses * (offset**2).sum(axis=1)
        assert cells.polar_moments == pytest.approx(shifted, abs=1e-11)


@settings(deadline=None, max_examples=count_examples(120))
@given(seeds, st.integers(1, 40), st.floats(0.0, 6.3), st.booleans())
def test_cells_rotate_and_mirror_with_the_robots(seed: int, n: int, angle: float, mirror: bool) -> None:
    points = scatter_points(PENTAGON, n, np.random.default_rng(seed))
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    if mirror:
        turn = np.diag([-1.0, 1.0]) @ turn
    plain = partition(points, PENTAGON)
    turned = partition(points @ turn, Region(PENTAGON.vertices @ turn))
    assert turned.masses == pytest.approx(plain.masses, abs=1e-11)
    offset = plain.centroids @ turn - turned.centroids
    assert plain.masses[:, None] * offset == pytest.approx(np.zeros((n, 2)), abs=1e-10)


@settings(deadline=None, max_examples=count_examples(60))
@given(seeds, st.integers(2, 40))
def test_order_of_the_robots_does_not_matter(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    points = scatter_points(SQUARE, n, rng)
    order = rng.permutation(n)
    cells = partition(points, SQUARE)
    permuted = partition(points[order], SQUARE)
    assert permuted.masses == pytest.approx(cells.masses[order], abs=1e-11)


def test_coincident_robots_get_the_same_cell() -> None:
    for n in (2, 8, 30):
        points = scatter_points(PENTAGON, n, np.random.default_rng(n))
        twice = partition(np.concatenate([points, points[:2]]), PENTAGON)
        once = partition(points, PENTAGON)
        assert twice.masses[:n] == pytest.approx(once.masses, rel=1e-12)
        assert twice.masses[n:].tolist() == twice.masses[:2].tolist()
        assert twice.centroids[n:].tolist() == twice.centroids[:2].tolist()
        assert twice.polygons[n].tolist() == twice.polygons[0].tolist()


def test_robots_at_one_position_get_the_region_each() -> None:
    cells = partition(np.full((7, 2), 1.5), PENTAGON)
    assert cells.masses == pytest.approx(np.full(7, PENTAGON.area))
    assert cells.adjacency.shape == (0, 2)


def test_the_centroid_of_an_empty_cell_is_its_generator() -> None:
    cells = partition(np.array([[1.0, 1.0], [-9.0, 1.0], [5.0, 5.0]]), SQUARE)
    assert cells.masses[1] == 0.0
    assert cells.centroids[1].tolist() == [-9.0, 1.0]
    assert cells.polygons[1].shape == (0, 2)
    assert cells.polar_moments[1] == 0.0
    assert cells.masses.sum() == pytest.approx(SQUARE.area)


@settings(deadline=None, max_examples=count_examples(200))
@given(seeds, st.integers(2, 90), st.floats(0.1, 5.0))
def test_a_cell_depends_only_on_the_neighbors_to_the_last_bit(seed: int, n: int, range_: float) -> None:
    rng = np.random.default_rng(seed)
    points = scatter_points(SQUARE, n, rng)
    robot = int(rng.integers(n))
    neighbors = Neighbors.from_ranges(points, np.full(n, range_))
    heard = np.union1d(neighbors.list_neighbors(robot), [robot])
    before = partition(points, SQUARE, neighbors)

    # The other robots move but stay out of range, and some leave the team or join it.
    moved = points.copy()
    for other in np.setdiff1d(np.arange(n), heard):
        position = scatter_points(SQUARE, 1, rng)[0]
        if np.hypot(*(position - points[robot])) > range_:
            moved[other] = position
    remaining = np.union1d(heard, np.flatnonzero(rng.random(n) < 0.6))
    newcomers = scatter_points(SQUARE, 5, rng)
    newcomers = newcomers[np.hypot(*(newcomers - points[robot]).T) > range_]
    moved = np.concatenate([moved[remaining], newcomers])
    index = int(np.searchsorted(remaining, robot))
    after = partition(moved, SQUARE, Neighbors.from_ranges(moved, np.full(len(moved), range_)))

    assert after.masses[index] == before.masses[robot]
    assert after.centroids[index].tolist() == before.centroids[robot].tolist()
    assert after.polygons[index].tolist() == before.polygons[robot].tolist()
    assert after.polar_moments[index] == before.polar_moments[robot]


@settings(deadline=None, max_examples=count_examples(120))
@given(seeds, st.integers(1, 12), st.floats(0.1, 6.0))
def test_limited_cells_equal_those_of_the_neighbors_alone(seed: int, n: int, range_: float) -> None:
    points = scatter_points(PENTAGON, n, np.random.default_rng(seed))
    neighbors = Neighbors.from_ranges(points, np.full(n, range_))
    cells = partition(points, PENTAGON, neighbors)
    for robot in range(n):
        heard = np.concatenate([points[robot : robot + 1], points[neighbors.list_neighbors(robot)]])
        area, mx, my, _ = map(float, compute_exact_cell(0, heard, PENTAGON))
        assert cells.masses[robot] == pytest.approx(area, abs=1e-11)
        lever = cells.centroids[robot] - points[robot]
        assert cells.masses[robot] * lever == pytest.approx([mx, my], abs=1e-10)


def test_adjacent_cells_share_a_piece_of_boundary() -> None:
    points = scatter_points(PENTAGON, 40, np.random.default_rng(3))
    cells = partition(points, PENTAGON)
    shapes = [shapely.Polygon(ring) for ring in cells.polygons]
    pairs = {
        (i, j)
        for i in range(40)
        for j in range(i + 1, 40)
        if shapes[i].buffer(1e-7).intersection(shapes[j].buffer(1e-7)).area > 1e-10
    }
    assert {tuple(pair) for pair in cells.adjacency.tolist()} == pairs


@pytest.mark.parametrize("n", [2, 6, 50])
def test_equal_input_gives_equal_bits_and_read_only_cells(n: int) -> None:
    points = scatter_points(PENTAGON, n, np.random.default_rng(n))
    first = partition(points, PENTAGON)
    second = partition(points, Region(PENTAGON.vertices))
    assert first.masses.tobytes() == second.masses.tobytes()
    assert first.centroids.tobytes() == second.centroids.tobytes()
    rings = [ring.tobytes() for ring in second.polygons]
    # The partition does not share the array of the caller.
    points[:] = 0.0
    assert [ring.tobytes() for ring in first.polygons] == rings
    with pytest.raises(ValueError, match="read-only"):
        first.masses[0] = 1.0
    copy = pickle.loads(pickle.dumps(first))
    assert [ring.tobytes() for ring in copy.polygons] == rings


@pytest.mark.parametrize("n", [1, 9])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_generators_that_are_not_finite_are_named(n: int, bad: float) -> None:
    points = scatter_points(SQUARE, n, np.random.default_rng(0))
    points[n // 2, 1] = bad
    with pytest.raises(InputError, match=rf"^generators\[{n // 2}\]: .*finite"):
        partition(points, SQUARE)


@pytest.mark.parametrize("values", [[["1", "2"]], [[10**400, 1]], np.ones((1, 2), complex), [[1, 2], [3]]])
def test_generators_that_are_not_real_numbers_are_rejected(values: object) -> None:
    with pytest.raises(InputError, match=r"^generators: expected numbers of shape \(n, 2\), got "):
        partition(values, SQUARE)  # type: ignore[arg-type]


def test_generators_of_the_wrong_shape_are_rejected() -> None:
    with pytest.raises(InputError, match=r"shape \(n, 2\), got shape \(3,\)"):
        partition(np.zeros(3), SQUARE)


def test_neighbors_that_do_not_fit_the_generators_are_rejected() -> None:
    """Kernels do not check bounds: they would read memory beyond the arrays."""
    points = np.array([[1.0, 1.0], [2.0, 1.0], [3.0, 1.0]])
    neighbors = Neighbors.from_ranges(points, np.full(3, 1.5))
    with pytest.raises(InputError, match="neighbors: expected a graph of 2 robots, got 3"):
        partition(points[:2], SQUARE, neighbors)
    with pytest.raises(InputError, match=r"reported_positions: expected shape \(4, 2\), got \(3, 2\)"):
        partition(points, SQUARE, neighbors, reported_positions=points)
    with pytest.raises(InputError, match=r"reported_positions: expected shape \(4, 2\), got \(3, 2\)"):
        partition_by_travel_time(points, [1.0, 2.0, 3.0], SQUARE, neighbors, reported_positions=points)
    with pytest.raises(InputError, match="neighbors: expected a graph of 2 robots, got 3"):
        partition_by_travel_time(points[:2], [1.0, 2.0], SQUARE, neighbors)
