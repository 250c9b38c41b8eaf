"""The best point of a cell against brute force, limits in closed form, and its symmetries."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
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


def sample_triangles(ring: np.ndarray, fine: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points and weights: three in each of the triangles into which a convex ring is cut."""
    middle = ring.mean(axis=0)
    i, j, u, v = (
        each.ravel() for each in np.meshgrid(range(fine), range(fine), *[(1 / 6, 2 / 3)] * 2, indexing="ij")
    )
    within = u + v < 1.0  # the three points of Strang's rule of degree 2
    i, j, u, v = i[within], j[within], u[within], v[within]
    turned = i + j >= fine  # these triangles hang down from the diagonal
    s, t = np.where(turned, [fine - i - u, fine - j - v], [i + u, j + v]) / fine
    fan = list(zip(ring - middle, np.roll(ring, -1, axis=0) - middle, strict=True))
    points = [middle + s[:, None] * a + t[:, None] * b for a, b in fan]
    areas = [0.5 * np.linalg.det([a, b]) for a, b in fan]
    return np.concatenate(points), np.repeat(areas, len(s)) / len(s)


@pytest.mark.slow
@pytest.mark.parametrize("f", [Distance(), Sensing(0.5), Sensing(5.0)], ids=repr)
@pytest.mark.parametrize("name", ["pentagon", "triangle"])
def test_nothing_better_is_found_by_brute_force(f: Performance, name: str) -> None:
    ring = REGIONS[name].vertices
    points, areas = sample_triangles(ring, 30)

    def compute_cost(p: np.ndarray) -> float:
        return float(f.sign * evaluate_performance(f, np.hypot(*(points - p).T)) @ areas)

    start = scatter_points(REGIONS[name], 1, np.random.default_rng(1))[0]
    lowest = minimize(compute_cost, start, method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-9})
    np.testing.assert_allclose(find_best_point(ring, f), lowest.x, atol=2e-4)


@settings(max_examples=150)
@given(seeds, names, families, functions, st.integers(1, 12))
def test_it_lies_in_its_cell_and_the_gradient_vanishes_there(
    seed: int, name: str, family: Family, f: Performance, n: int
) -> None:
    region = REGIONS[name]
    cells = partition(family(region, n, np.random.default_rng(seed)), region)
    points = find_best_points(cells, f)
    offsets = points - cells.generators
    edges, size = cells.edges, region.diameter
    along = edges.end - edges.start
    long = np.hypot(*along.T) > 1e-9 * size
    to = offsets[edges.cell] - edges.start
    beyond = (along[:, 1] * to[:, 0] - along[:, 0] * to[:, 1])[long] / np.hypot(*along[long].T)
    assert beyond.max(initial=-1.0) <= 1e-9 * size
    # what the cell's parts pull by, and what is left of it, in cells that are more than a hair
    width = cells.mass / np.maximum(np.bincount(edges.cell, np.hypot(*along.T), len(points)), 1e-300)
    fair = width > 1e-5 * size
    pull = np.abs(compute_locational_costs(edges, offsets, f)) / np.maximum(width, 1e-300)
    left = np.abs(compute_gradients(edges, offsets, f)).max(axis=1)
    assert (left[fair] <= 1e-9 * pull[fair]).all()


@settings(max_examples=80)
@given(seeds, names, functions, st.integers(1, 6))
def test_no_point_of_the_cell_is_better(seed: int, name: str, f: Performance, n: int) -> None:
    """Quasi-concavity at work: what Newton ends at is the optimum of the whole cell."""
    rng = np.random.default_rng(seed)
    region = REGIONS[name]
    cells = partition(scatter_points(region, n, rng), region)
    least = f.sign * compute_locational_costs(cells.edges, find_best_points(cells, f) - cells.generators, f)
    for _ in range(10):
        tried = np.array(
            [
                rng.dirichlet(np.full(len(ring), 0.4)) @ ring if len(ring) else (0.0, 0.0)
                for ring in cells.polygons
            ]
        )
        assert (
            f.sign * compute_locational_costs(cells.edges, tried - cells.generators, f)
            >= least - 1e-12 * np.abs(least)
        ).all()


@settings(max_examples=40)
@given(seeds, names, families, st.floats(-2.0, 1.0), st.integers(1, 6))
def test_no_place_of_a_grid_over_the_cell_is_better_for_a_sensor(
    seed: int, name: str, family: Family, height: float, n: int
) -> None:
    """Also where the cell is large against h, and most of what counts is near: there is no second optimum."""
    region = REGIONS[name]
    f = Sensing(10.0**height * region.diameter / 10.0)
    cells = partition(family(region, n, np.random.default_rng(seed)), region)
    most = compute_locational_costs(cells.edges, find_best_points(cells, f) - cells.generators, f)
    share = np.linspace(0.02, 0.98, 12)
    for k, ring in enumerate(cells.polygons):
        if len(ring) < 3 or cells.mass[k] < 1e-6 * region.area:
            continue
        low, high = ring.min(axis=0), ring.max(axis=0)
        places = np.stack(np.meshgrid(*(low + share[:, None] * (high - low)).T), axis=-1).reshape(-1, 2)
        edge = np.roll(ring, -1, axis=0) - ring
        to = places[:, None] - ring
        inside = (edge[:, 0] * to[..., 1] - edge[:, 1] * to[..., 0] >= 0.0).all(axis=1)
        own = cells.edges.cell == k
        alone = CellEdges(
            *(each[own] for each in (cells.edges.start, cells.edges.end)),
            np.zeros(own.sum(), dtype=int),
            cells.edges.beyond[own],
        )
        there = [
            compute_locational_costs(alone, (place - cells.generators[k])[None], f)[0]
            for place in places[inside]
        ]
        assert max(there, default=0.0) <= most[k] * (1.0 + 1e-12)


@pytest.mark.parametrize("f", FUNCTIONS, ids=repr)
@pytest.mark.parametrize("scale", [1e-9, 1e-4, 1.0, 1e5, 1e9])
@pytest.mark.parametrize("aspect", [1.0, 1e-3, 1e-6, 1e-9])
def test_symmetric_cells_have_it_in_their_middle(f: Performance, scale: float, aspect: float) -> None:
    """Of any size, as thin as may be, and far from the origin; turned, unless rounding then makes a wedge."""
    box = scale * np.array([[-1.0, -aspect], [1.0, -aspect], [1.0, aspect], [-1.0, aspect]])
    turns = [np.eye(2), np.array([[0.8, 0.6], [-0.6, 0.8]])]
    for turn in turns if aspect >= 1e-3 else turns[:1]:
        for shift in (0.0, 3.0 * scale):
            found = find_best_point(box @ turn + shift, f)
            np.testing.assert_allclose(found, [shift, shift], rtol=0, atol=2e-9 * scale)


@settings(max_examples=80)
@given(seeds, st.floats(-9.0, 9.0), st.floats(0.0, 6.3), st.floats(-2.0, 2.0), st.booleans())
def test_it_turns_and_grows_with_its_cell(
    seed: int, size: float, turn: float, height: float, sensing: bool
) -> None:
    rng = np.random.default_rng(seed)
    ring = Region(rng.normal(size=(7, 2))).vertices
    scale, h = 10.0**size, 10.0**height
    rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    one, other = (Sensing(h), Sensing(h * scale)) if sensing else (Distance(), Distance())
    np.testing.assert_allclose(
        find_best_point(scale * ring @ rotation, other),
        scale * find_best_point(ring, one) @ rotation,
        atol=1e-7 * scale,
    )


@pytest.mark.parametrize("thin", [1e-2, 1e-5, 1e-8])
def test_thin_triangles_have_it_where_a_weighted_line_has_it(thin: float) -> None:
    """As the triangle gets thin, its mass lies on a line, and grows along it: the median is 1/√2."""
    wedge = np.array([[0.0, 0.0], [1.0, -thin], [1.0, thin]])
    assert find_best_point(wedge, Distance())[0] == pytest.approx(np.sqrt(0.5), abs=3.0 * thin)
    h = 0.3

    def compute_negative_sensing(p: float) -> float:  # -∫ x/((x-p)²+h²) dx from 0 to 1
        return -(
            0.5 * np.log(((1 - p) ** 2 + h**2) / (p**2 + h**2))
            + p / h * (np.arctan((1 - p) / h) + np.arctan(p / h))
        )

    expected = minimize_scalar(
        compute_negative_sensing, bounds=(0.4, 1.0), method="bounded", options={"xatol": 1e-10}
    ).x
    assert find_best_point(wedge, Sensing(h))[0] == pytest.approx(expected, abs=3.0 * thin + 1e-7)


@pytest.mark.parametrize("aspect", [1e-3, 1e-6, 1e-8])
def test_a_low_sensor_over_a_thin_cell_stays_in_it(aspect: float) -> None:
    """The cost is then flat, but for a ridge: Newton alone would leave the cell."""
    ring = np.array([[0.0, 0.0], [3.0, 0.0], [1.0, aspect]])
    for h in (1e-9, 1e-5, 1e-2):
        x, y = find_best_point(ring, Sensing(h))
        assert 0.0 <= y <= aspect * min(x, (3.0 - x) / 2.0)
        assert 0.5 < x < 2.0


def test_cells_without_area_and_empty_ones_keep_their_generators() -> None:
    square = REGIONS["square"]
    points = np.array([[1.0, 1.0], [2.0, 2.0], [90.0, 90.0], [91.0, 91.0]])
    cells = partition(points, square)
    assert (cells.mass == 0.0).any()
    for f in FUNCTIONS:
        found = find_best_points(cells, f)
        np.testing.assert_array_equal(found[cells.mass == 0.0], points[cells.mass == 0.0])
    nowhere = partition(np.array([[90.0, 90.0], [-91.0, -91.0], [30.0, 3.0]]), square)
    assert np.isfinite(find_best_points(nowhere, Distance())).all()


@pytest.mark.parametrize("family", FAMILIES, ids=lambda each: each.__name__)
def test_the_worst_cells_end_in_time(family: Family, monkeypatch: pytest.MonkeyPatch) -> None:
    """Convergence is no accident of the number of rounds: half of them change nothing."""
    import robocov.locational_cost.best_points as module

    for seed in range(3):
        rng = np.random.default_rng(seed)
        for region in REGIONS.values():
            cells = partition(family(region, 12, rng), region)
            for f in FUNCTIONS:
                found = find_best_points(cells, f)
                with monkeypatch.context() as patch:
                    patch.setattr(module, "_MAX_ITERATIONS", module._MAX_ITERATIONS // 2)
                    early = find_best_points(cells, f)
                np.testing.assert_allclose(early, found, rtol=0, atol=1e-6 * region.diameter)


def test_a_cell_is_its_own_affair_to_the_last_bit() -> None:
    """Other cells, whatever they look like, do not change a bit, nor how many rounds they take."""
    rng = np.random.default_rng(3)
    region = REGIONS["pentagon"]
    points = np.vstack([scatter_points(region, 9, rng), region.centroid + 1e-7 * rng.normal(size=(4, 2))])
    cells = partition(points, region, Neighbors(len(points)))
    edges = cells.edges
    for f in FUNCTIONS:
        together = find_best_points(cells, f)
        for i in range(len(points)):
            own = edges.cell == i
            alone = CellEdges(
                edges.start[own], edges.end[own], np.zeros(own.sum(), dtype=int), edges.beyond[own]
            )
            row = slice(i, i + 1)
            one = VoronoiPartition(
                cells.generators[row], cells.mass[row], cells.centroid[row], _compute_edges=lambda e=alone: e
            )
            assert find_best_points(one, f)[0].tobytes() == together[i].tobytes()


def test_cells_that_are_not_convex_have_their_median_too() -> None:
    """Of robots of different speeds: a fast one's cell has a hole."""
    region = REGIONS["square"]
    cells = partition_by_travel_time(np.array([[2.0, 3.0], [4.0, 3.0]]), np.array([1.0, 0.3]), region)
    points = find_best_points(cells, Distance())
    edges = cells.edges
    assert np.abs(compute_gradients(edges, points - cells.generators, Distance())).max() < 1e-9
    for shift in np.random.default_rng(0).normal(scale=0.3, size=(20, 2)):
        moved = compute_locational_costs(edges, points + shift - cells.generators, Distance())
        assert (moved > compute_locational_costs(edges, points - cells.generators, Distance())).all()


@settings(max_examples=200)
@given(seeds, st.floats(-3.0, 0.0), st.floats(-2.5, 1.0) | st.none())
def test_it_is_found_from_anywhere_in_the_cell(seed: int, thin: float, height: float | None) -> None:
    """Also from where the Hessian is no bowl, and from where Newton's steps alone would run in circles."""
    rng = np.random.default_rng(seed)
    cells = build_single_cell(rng.normal(size=(rng.integers(3, 7), 2)) * [1.0, 10.0**thin])
    ring, centroid = cells.polygons[0], cells.centroid[0]
    start = rng.dirichlet(np.full(len(ring), 0.1)) @ ring
    f = Distance() if height is None else Sensing(10.0**height)
    usual = find_best_points(cells, f)
    cells.centroid = (start + 1e-4 * (centroid - start))[None]
    found = find_best_points(cells, f)
    np.testing.assert_allclose(found, usual, rtol=0, atol=1e-7 * np.ptp(ring, axis=0).max())


@given(st.lists(st.floats(-5.0, 5.0), min_size=5, max_size=5))
def test_steps_go_down_by_the_sizes_of_the_eigenvalues(numbers: list[float]) -> None:
    slope, (xx, xy, yy) = np.array(numbers[:2]), numbers[2:]
    values, axes = np.linalg.eigh([[xx, xy], [xy, yy]])
    if np.abs(values).min() < 1e-6:
        return
    step = np.array(_compute_descent_step(*slope.tolist(), xx, xy, yy))
    np.testing.assert_allclose(step, -axes @ (axes.T @ slope / np.abs(values)), rtol=1e-6, atol=1e-7)


def test_the_squares_are_best_at_the_centroid() -> None:
    cells = partition(scatter_points(PENTAGON, 8, np.random.default_rng(5)), PENTAGON)
    np.testing.assert_allclose(find_best_points(cells, SquaredDistance()), cells.centroid, atol=1e-12)
