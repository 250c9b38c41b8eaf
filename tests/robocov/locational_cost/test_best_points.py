"""The best point of a cell: brute force, limits in closed form, and symmetries."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from scipy.optimize import minimize, minimize_scalar
from voronoi_cases import (
    FAMILIES,
    PENTAGON,
    REGIONS,
    Family,
    evaluate_performance,
    families,
    names,
    scatter_points,
    seeds,
)

from robocov.density.cell_edges import CellEdges
from robocov.locational_cost import (
    Distance,
    Performance,
    Sensing,
    SquaredDistance,
    compute_gradients,
    compute_locational_costs,
)
from robocov.locational_cost.best_points import _compute_descent_step, find_best_points
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.voronoi import VoronoiPartition, partition, partition_by_travel_time

FUNCTIONS: list[Performance] = [Distance(), Sensing(1e-3), Sensing(0.3), Sensing(2.0), Sensing(1e4)]
functions = st.sampled_from(FUNCTIONS)


def build_single_cell(ring: np.ndarray) -> VoronoiPartition:
    """Return a region as the cell of one robot."""
    region = Region(ring)
    return partition(region.centroid[None], region)


def find_best_point(ring: np.ndarray, f: Performance) -> np.ndarray:
    return find_best_points(build_single_cell(ring), f)[0]


def select_cell_edges(edges: CellEdges, index: int) -> CellEdges:
    """Return the edges of one cell as those of a partition with this cell only."""
    is_of_cell = edges.cells == index
    return CellEdges(
        edges.starts[is_of_cell],
        edges.ends[is_of_cell],
        np.zeros(is_of_cell.sum(), dtype=int),
        edges.other_cells[is_of_cell],
    )


def sample_triangles(ring: np.ndarray, fine: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points and weights: three points in each triangle of a fine triangulation of a convex ring."""
    middle = ring.mean(axis=0)
    coordinates = (1 / 6, 2 / 3)
    grid = np.meshgrid(range(fine), range(fine), coordinates, coordinates, indexing="ij")
    i, j, u, v = np.reshape(grid, (4, -1))
    # These are the three points of Strang's rule of degree 2.
    is_inside = u + v < 1.0
    i, j, u, v = np.compress(is_inside, [i, j, u, v], axis=1)
    # The triangles above the diagonal are turned by 180 degrees.
    is_turned = i + j >= fine
    s, t = np.where(is_turned, [fine - i - u, fine - j - v], [i + u, j + v]) / fine
    fan = list(zip(ring - middle, np.roll(ring, -1, axis=0) - middle, strict=True))
    points = [middle + s[:, None] * a + t[:, None] * b for a, b in fan]
    areas = [0.5 * np.linalg.det([a, b]) for a, b in fan]
    return np.concatenate(points), np.repeat(areas, len(s)) / len(s)


@pytest.mark.slow
@pytest.mark.parametrize("f", [Distance(), Sensing(0.5), Sensing(5.0)], ids=repr)
@pytest.mark.parametrize("name", ["pentagon", "triangle"])
def test_the_best_point_agrees_with_brute_force(f: Performance, name: str) -> None:
    ring = REGIONS[name].vertices
    points, areas = sample_triangles(ring, 30)

    def compute_cost(p: np.ndarray) -> float:
        return float(f.sign * evaluate_performance(f, np.hypot(*(points - p).T)) @ areas)

    start = scatter_points(REGIONS[name], 1, np.random.default_rng(1))[0]
    minimum = minimize(compute_cost, start, method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-9})
    np.testing.assert_allclose(find_best_point(ring, f), minimum.x, atol=2e-4)


@settings(max_examples=count_examples(150))
@given(seeds, names, families, functions, st.integers(1, 12))
def test_best_points_lie_in_their_cells_and_have_no_gradient(
    seed: int, name: str, family: Family, f: Performance, n: int
) -> None:
    region = REGIONS[name]
    cells = partition(family(region, n, np.random.default_rng(seed)), region)
    points = find_best_points(cells, f)
    offsets = points - cells.generators
    edges = cells.edges
    size = region.diameter
    along = edges.ends - edges.starts
    length = np.hypot(*along.T)
    is_long = length > 1e-9 * size
    lever = offsets[edges.cells] - edges.starts
    cross = along[:, 1] * lever[:, 0] - along[:, 0] * lever[:, 1]
    distance_outside = cross[is_long] / length[is_long]
    assert distance_outside.max(initial=-1.0) <= 1e-9 * size
    # In cells that are not extremely thin the gradient is small against the cost per width.
    width = cells.masses / np.maximum(np.bincount(edges.cells, length, len(points)), 1e-300)
    is_wide = width > 1e-5 * size
    scale = np.abs(compute_locational_costs(edges, offsets, f)) / np.maximum(width, 1e-300)
    residual = np.abs(compute_gradients(edges, offsets, f)).max(axis=1)
    assert (residual[is_wide] <= 1e-9 * scale[is_wide]).all()


@settings(max_examples=count_examples(80))
@given(seeds, names, functions, st.integers(1, 6))
def test_no_point_of_the_cell_is_better(seed: int, name: str, f: Performance, n: int) -> None:
    """The cost is quasi-concave, so Newton's method ends at the optimum of the whole cell."""
    rng = np.random.default_rng(seed)
    region = REGIONS[name]
    cells = partition(scatter_points(region, n, rng), region)
    best_offsets = find_best_points(cells, f) - cells.generators
    min_costs = f.sign * compute_locational_costs(cells.edges, best_offsets, f)
    for _ in range(10):
        points = np.zeros((n, 2))
        for point, ring in zip(points, cells.polygons, strict=True):
            if len(ring):
                point[:] = rng.dirichlet(np.full(len(ring), 0.4)) @ ring
        costs = f.sign * compute_locational_costs(cells.edges, points - cells.generators, f)
        assert (costs >= min_costs - 1e-12 * np.abs(min_costs)).all()


@settings(max_examples=count_examples(40))
@given(seeds, names, families, st.floats(-2.0, 1.0), st.integers(1, 6))
def test_no_point_of_a_grid_over_the_cell_is_better_for_a_sensor(
    seed: int, name: str, family: Family, height: float, n: int
) -> None:
    """Also in cells that are large against h, where most of the integral is near, the optimum is unique."""
    region = REGIONS[name]
    f = Sensing(10.0**height * region.diameter / 10.0)
    cells = partition(family(region, n, np.random.default_rng(seed)), region)
    max_values = compute_locational_costs(cells.edges, find_best_points(cells, f) - cells.generators, f)
    fractions = np.linspace(0.02, 0.98, 12)
    for k, ring in enumerate(cells.polygons):
        if len(ring) < 3 or cells.masses[k] < 1e-6 * region.area:
            continue
        low = ring.min(axis=0)
        high = ring.max(axis=0)
        points = np.stack(np.meshgrid(*(low + fractions[:, None] * (high - low)).T), axis=-1).reshape(-1, 2)
        edge = np.roll(ring, -1, axis=0) - ring
        lever = points[:, None] - ring
        is_inside = (edge[:, 0] * lever[..., 1] - edge[:, 1] * lever[..., 0] >= 0.0).all(axis=1)
        single = select_cell_edges(cells.edges, k)
        values = [
            compute_locational_costs(single, (point - cells.generators[k])[None], f)[0]
            for point in points[is_inside]
        ]
        assert max(values, default=0.0) <= max_values[k] * (1.0 + 1e-12)


@pytest.mark.parametrize("f", FUNCTIONS, ids=repr)
@pytest.mark.parametrize("scale", [1e-9, 1e-4, 1.0, 1e5, 1e9])
@pytest.mark.parametrize("aspect", [1.0, 1e-3, 1e-6, 1e-9])
def test_the_best_point_of_a_symmetric_cell_is_its_center(
    f: Performance, scale: float, aspect: float
) -> None:
    """The rectangles have any size and aspect. Very thin ones are not turned: rounding would make wedges."""
    box = scale * np.array([[-1.0, -aspect], [1.0, -aspect], [1.0, aspect], [-1.0, aspect]])
    rotations = [np.eye(2)]
    if aspect >= 1e-3:
        rotations.append(np.array([[0.8, 0.6], [-0.6, 0.8]]))
    for rotation in rotations:
        for shift in (0.0, 3.0 * scale):
            point = find_best_point(box @ rotation + shift, f)
            np.testing.assert_allclose(point, [shift, shift], rtol=0, atol=2e-9 * scale)


@settings(max_examples=count_examples(80))
@given(seeds, st.floats(-9.0, 9.0), st.floats(0.0, 6.3), st.floats(-2.0, 2.0), st.booleans())
def test_the_best_point_rotates_and_scales_with_its_cell(
    seed: int, size: float, turn: float, height: float, sensing: bool
) -> None:
    rng = np.random.default_rng(seed)
    ring = Region(rng.normal(size=(7, 2))).vertices
    scale = 10.0**size
    h = 10.0**height
    rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    f: Performance = Distance()
    scaled_f: Performance = Distance()
    if sensing:
        f = Sensing(h)
        scaled_f = Sensing(h * scale)
    np.testing.assert_allclose(
        find_best_point(scale * ring @ rotation, scaled_f),
        scale * find_best_point(ring, f) @ rotation,
        atol=1e-7 * scale,
    )


@pytest.mark.parametrize("thin", [1e-2, 1e-5, 1e-8])
def test_the_best_point_of_a_thin_triangle_is_that_of_a_weighted_line(thin: float) -> None:
    """The mass of a thin triangle lies on a line and increases along it, so the median is at 1/√2."""
    wedge = np.array([[0.0, 0.0], [1.0, -thin], [1.0, thin]])
    assert find_best_point(wedge, Distance())[0] == pytest.approx(np.sqrt(0.5), abs=3.0 * thin)
    h = 0.3

    def compute_negative_sensing(p: float) -> float:
        """Return -∫ x/((x-p)²+h²) dx from 0 to 1."""
        return -(
            0.5 * np.log(((1 - p) ** 2 + h**2) / (p**2 + h**2))
            + p / h * (np.arctan((1 - p) / h) + np.arctan(p / h))
        )

    expected = minimize_scalar(
        compute_negative_sensing, bounds=(0.4, 1.0), method="bounded", options={"xatol": 1e-10}
    ).x
    assert find_best_point(wedge, Sensing(h))[0] == pytest.approx(expected, abs=3.0 * thin + 1e-7)


@pytest.mark.parametrize("aspect", [1e-3, 1e-6, 1e-8])
def test_the_best_point_of_a_low_sensor_stays_in_a_thin_cell(aspect: float) -> None:
    """The cost is flat except for a ridge, so plain Newton steps would leave the cell."""
    ring = np.array([[0.0, 0.0], [3.0, 0.0], [1.0, aspect]])
    for h in (1e-9, 1e-5, 1e-2):
        x, y = find_best_point(ring, Sensing(h))
        assert 0.0 <= y <= aspect * min(x, (3.0 - x) / 2.0)
        assert 0.5 < x < 2.0


def test_the_best_point_of_a_cell_without_area_is_its_generator() -> None:
    square = REGIONS["square"]
    points = np.array([[1.0, 1.0], [2.0, 2.0], [90.0, 90.0], [91.0, 91.0]])
    cells = partition(points, square)
    assert (cells.masses == 0.0).any()
    for f in FUNCTIONS:
        best_points = find_best_points(cells, f)
        np.testing.assert_array_equal(best_points[cells.masses == 0.0], points[cells.masses == 0.0])
    outside = partition(np.array([[90.0, 90.0], [-91.0, -91.0], [30.0, 3.0]]), square)
    assert np.isfinite(find_best_points(outside, Distance())).all()


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.__name__)
def test_the_worst_cells_need_less_than_half_of_the_allowed_iterations(
    family: Family, monkeypatch: pytest.MonkeyPatch
) -> None:
    import robocov.locational_cost.best_points as module

    for seed in range(3):
        rng = np.random.default_rng(seed)
        for region in REGIONS.values():
            cells = partition(family(region, 12, rng), region)
            for f in FUNCTIONS:
                points = find_best_points(cells, f)
                with monkeypatch.context() as patch:
                    patch.setattr(module, "_MAX_ITERATIONS", module._MAX_ITERATIONS // 2)
                    early_points = find_best_points(cells, f)
                np.testing.assert_allclose(early_points, points, rtol=0, atol=1e-6 * region.diameter)


def test_best_points_do_not_depend_on_other_cells_to_the_last_bit() -> None:
    """The number of iterations for other cells does not matter either."""
    rng = np.random.default_rng(3)
    region = REGIONS["pentagon"]
    points = np.vstack([scatter_points(region, 9, rng), region.centroid + 1e-7 * rng.normal(size=(4, 2))])
    cells = partition(points, region, Neighbors(len(points)))
    edges = cells.edges
    for f in FUNCTIONS:
        best_points = find_best_points(cells, f)
        for i in range(len(points)):
            single_edges = select_cell_edges(edges, i)
            row = slice(i, i + 1)
            single_cell = VoronoiPartition(
                cells.generators[row],
                cells.masses[row],
                cells.centroids[row],
                _compute_edges=lambda edges=single_edges: edges,
            )
            assert find_best_points(single_cell, f)[0].tobytes() == best_points[i].tobytes()


def test_cells_that_are_not_convex_have_a_median() -> None:
    """The cell of a faster robot has a hole."""
    region = REGIONS["square"]
    cells = partition_by_travel_time(np.array([[2.0, 3.0], [4.0, 3.0]]), np.array([1.0, 0.3]), region)
    points = find_best_points(cells, Distance())
    edges = cells.edges
    assert np.abs(compute_gradients(edges, points - cells.generators, Distance())).max() < 1e-9
    min_costs = compute_locational_costs(edges, points - cells.generators, Distance())
    for shift in np.random.default_rng(0).normal(scale=0.3, size=(20, 2)):
        costs = compute_locational_costs(edges, points + shift - cells.generators, Distance())
        assert (costs > min_costs).all()


@settings(max_examples=count_examples(200))
@given(seeds, st.floats(-3.0, 0.0), st.floats(-2.5, 1.0) | st.none())
def test_iterations_converge_from_any_point_of_the_cell(seed: int, thin: float, height: float | None) -> None:
    """Also where the Hessian is not positive definite and where plain Newton steps would cycle."""
    rng = np.random.default_rng(seed)
    cells = build_single_cell(rng.normal(size=(rng.integers(3, 7), 2)) * [1.0, 10.0**thin])
    ring = cells.polygons[0]
    centroid = cells.centroids[0]
    start = rng.dirichlet(np.full(len(ring), 0.1)) @ ring
    f = Distance() if height is None else Sensing(10.0**height)
    expected = find_best_points(cells, f)
    cells.centroids = (start + 1e-4 * (centroid - start))[None]
    points = find_best_points(cells, f)
    np.testing.assert_allclose(points, expected, rtol=0, atol=1e-7 * np.ptp(ring, axis=0).max())


@given(st.lists(st.floats(-5.0, 5.0), min_size=5, max_size=5))
def test_descent_steps_divide_by_the_absolute_eigenvalues(numbers: list[float]) -> None:
    slope = np.array(numbers[:2])
    xx, xy, yy = numbers[2:]
    values, axes = np.linalg.eigh([[xx, xy], [xy, yy]])
    if np.abs(values).min() < 1e-6:
        return
    step = np.array(_compute_descent_step(*slope.tolist(), xx, xy, yy))
    np.testing.assert_allclose(step, -axes @ (axes.T @ slope / np.abs(values)), rtol=1e-6, atol=1e-7)


def test_the_best_point_for_squared_distances_is_the_centroid() -> None:
    cells = partition(scatter_points(PENTAGON, 8, np.random.default_rng(5)), PENTAGON)
    np.testing.assert_allclose(find_best_points(cells, SquaredDistance()), cells.centroids, atol=1e-12)
