"""The locational cost (4) against quadrature, dilogarithms, the paper's own formulas, and its properties."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import dblquad, quad
from scipy.special import spence
from voronoi_cases import (
    PENTAGON,
    REGIONS,
    compute_moment_about_centroid,
    evaluate_performance,
    names,
    scatter_points,
    seeds,
)

from robocov.density.cell_edges import CellEdges
from robocov.errors import ParameterError
from robocov.locational_cost import (
    Distance,
    Performance,
    Sensing,
    SquaredDistance,
    compute_derivatives,
    compute_gradients,
    compute_locational_costs,
)
from robocov.observation.region import Region
from robocov.voronoi import partition

FUNCTIONS: list[Performance] = [SquaredDistance(), Distance(), Sensing(0.02), Sensing(1.0), Sensing(60.0)]
functions = st.sampled_from(FUNCTIONS)


def compute_hessians(edges: CellEdges, points: np.ndarray, f: Performance) -> np.ndarray:
    derivatives = compute_derivatives(edges, points, f)
    rows = np.column_stack([derivatives.xx, derivatives.xy, derivatives.xy, derivatives.yy])
    return rows.reshape(-1, 2, 2)


def build_cell_edges(ring: np.ndarray) -> CellEdges:
    """Return a ring of vertices as the one cell of a generator at the origin."""
    count = len(ring)
    return CellEdges(ring, np.roll(ring, -1, axis=0), np.zeros(count, dtype=int), np.full(count, -1))


def integrate_by_quadrature(
    ring: np.ndarray, p: np.ndarray, f: Performance, tolerance: float = 1e-10
) -> float:
    """Return ∫ f(|q-p|) dq over a convex ring by scipy's adaptive quadrature, cut where it has corners."""
    edges = list(pairwise([*ring.tolist(), ring[0].tolist()]))

    def find_heights(x: float) -> tuple[float, float]:
        heights = [
            y + (v - y) * (x - u) / (w - u)
            for (u, y), (w, v) in edges
            if u != w and min(u, w) <= x <= max(u, w)
        ]
        return min(heights), max(heights)

    cuts = sorted({*ring[:, 0].tolist(), *([p[0]] if ring[:, 0].min() < p[0] < ring[:, 0].max() else [])})
    total = 0.0
    for low, high in pairwise(cuts):
        total += dblquad(
            lambda y, x: float(evaluate_performance(f, np.hypot(x - p[0], y - p[1]))),
            low,
            high,
            lambda x: find_heights(x)[0],
            lambda x: find_heights(x)[1],
            epsabs=tolerance,
            epsrel=tolerance,
        )[0]
    return total


@pytest.mark.parametrize("f", FUNCTIONS[:2] + FUNCTIONS[3:], ids=repr)
@pytest.mark.parametrize("p", [(2.1, 1.7), (-1.0, 1.5), (6.0, -2.0)], ids=["inside", "corner", "outside"])
def test_values_agree_with_quadrature(f: Performance, p: tuple[float, float]) -> None:
    found = compute_locational_costs(build_cell_edges(PENTAGON.vertices), np.array([p]), f)[0]
    assert found == pytest.approx(integrate_by_quadrature(PENTAGON.vertices, np.array(p), f, 1e-8), rel=3e-8)


def integrate_by_dilogarithms(ring: np.ndarray, p: np.ndarray, h: float) -> float:
    """Return ∫ dq / (|q-p|² + h²) over a ring in closed form, by the imaginary parts of dilogarithms."""

    def evaluate_clausen(z: complex) -> float:
        return float(np.imag(spence(1.0 + z)))  # Im Li₂(-z)

    total = 0.0
    for a, b in pairwise([*(ring - p), ring[0] - p]):
        along = (b - a) / np.hypot(*(b - a))
        d = a[0] * along[1] - a[1] * along[0]
        root = (h / (abs(d) + np.hypot(d, h))) ** 2
        ends = []
        for s in (a @ along, b @ along):
            angle = np.arctan2(s, abs(d))
            ends.append(
                -angle * np.log(root)
                - evaluate_clausen(root * np.exp(2j * angle))
                + evaluate_clausen(np.exp(2j * angle))
            )
        total += np.sign(d) * 0.5 * (ends[1] - ends[0])
    return total


@settings(max_examples=200)
@given(seeds, names, st.floats(-2.5, 1.0))
def test_sensing_is_a_sum_of_dilogarithms(seed: int, name: str, size: float) -> None:
    rng = np.random.default_rng(seed)
    ring = REGIONS[name].vertices - REGIONS[name].centroid
    p, h = rng.normal(scale=3.0, size=2), 10.0**size
    assert compute_locational_costs(build_cell_edges(ring), p[None], Sensing(h))[0] == pytest.approx(
        integrate_by_dilogarithms(ring, p, h), rel=1e-10
    )


@pytest.mark.parametrize("h", [1e-9, 1e-4, 1.0, 1e4, 1e9])
@pytest.mark.parametrize("width", [1e-12, 1e-6, 1.0, 1e6])
def test_sensing_keeps_its_digits_at_every_height_and_in_every_width(h: float, width: float) -> None:
    """Of a slab about a generator, by one integral that no part of the implementation uses."""
    ring = np.array([[-width, -1.0], [width, -1.0], [width, 1.0], [-width, 1.0]]) / 2.0

    def evaluate_strip(t: float) -> float:  # with y = e^t, which spreads what happens near the generator
        y = np.exp(t)
        root = np.hypot(y, h)
        return float(y * 4.0 * np.arctan(0.5 * width / root) / root)

    low = np.log(0.5 * min(1.0, h, width)) - 40.0
    points = [np.log(each) for each in (h, width) if np.log(each) > low and each < 0.5]
    expected, _ = quad(
        evaluate_strip, low, np.log(0.5), points=points or None, limit=500, epsabs=0.0, epsrel=1e-12
    )
    assert compute_locational_costs(build_cell_edges(ring), np.zeros((1, 2)), Sensing(h))[0] == pytest.approx(
        expected, rel=1e-11
    )


@settings(max_examples=120)
@given(seeds, names, functions)
def test_gradient_and_hessian_are_finite_differences(seed: int, name: str, f: Performance) -> None:
    rng = np.random.default_rng(seed)
    region = REGIONS[name]
    ring = region.vertices - region.centroid
    # a sensor low over the edge of a cell sees a step there, which no finite difference resolves
    p = scatter_points(region, 1, rng) - region.centroid
    p = 0.8 * p if isinstance(f, Sensing) and f.height < 1.0 else p + rng.normal(scale=2.0, size=2)
    step = 1e-4 * min(1.0, np.sqrt(region.area))
    if isinstance(f, Sensing) and f.height < 1.0:
        step = 1e-3 * f.height
    edges, ends = build_cell_edges(ring), step * np.array([[1.0, 0.0], [0.0, 1.0]])
    slope = [
        (compute_locational_costs(edges, p + e, f) - compute_locational_costs(edges, p - e, f))[0]
        / (2.0 * step)
        for e in ends
    ]
    bend = [
        (compute_gradients(edges, p + e, f) - compute_gradients(edges, p - e, f))[0] / (2.0 * step)
        for e in ends
    ]
    found = compute_locational_costs(edges, p, f)[0]
    size = min(region.diameter, getattr(f, "height", np.inf))
    noise = 1e-13 * found / step
    steepest, sharpest = (
        np.abs(compute_gradients(edges, p, f)).max(),
        np.abs(compute_hessians(edges, p, f)).max(),
    )
    np.testing.assert_allclose(compute_gradients(edges, p, f)[0], slope, rtol=0, atol=2e-5 * steepest + noise)
    np.testing.assert_allclose(
        compute_hessians(edges, p, f)[0], bend, rtol=0, atol=2e-5 * sharpest + noise / size
    )


@settings(max_examples=60)
@given(seeds, names, st.integers(1, 9))
def test_squares_give_mass_centroid_and_the_parallel_axis(seed: int, name: str, n: int) -> None:
    """(2), (3) and (13), by integrals that know nothing of mass and centroid."""
    rng = np.random.default_rng(seed)
    region = REGIONS[name]
    cells = partition(scatter_points(region, n, rng), region)
    points = rng.normal(scale=2.0, size=(n, 2))
    lever = points + cells.generators - cells.centroid
    size = region.diameter
    expected = compute_moment_about_centroid(cells) + cells.mass * (lever**2).sum(axis=1)
    f = SquaredDistance()
    np.testing.assert_allclose(
        compute_locational_costs(cells.edges, points, f), expected, rtol=1e-9, atol=1e-12 * size**4
    )
    slope = 2.0 * cells.mass[:, None] * lever
    np.testing.assert_allclose(
        compute_gradients(cells.edges, points, f), slope, rtol=1e-9, atol=1e-11 * size**3
    )
    bend = 2.0 * cells.mass[:, None, None] * np.eye(2)
    np.testing.assert_allclose(
        compute_hessians(cells.edges, points, f), bend, rtol=1e-9, atol=1e-12 * size**2
    )
    np.testing.assert_allclose(
        compute_derivatives(cells.edges, points, f).area, cells.mass, rtol=1e-9, atol=1e-12 * size**2
    )


def compute_total_cost(points: np.ndarray, borders: np.ndarray, region: Region, f: Performance) -> float:
    """Return (4) for robots at `points` that look after the Voronoi cells of `borders`."""
    cells = partition(borders, region)
    return float(compute_locational_costs(cells.edges, points - cells.generators, f).sum())


@settings(max_examples=60)
@given(seeds, names, functions, st.integers(2, 9), st.floats(-4.0, 0.0))
def test_no_other_partition_is_better_than_that_of_voronoi(
    seed: int, name: str, f: Performance, n: int, far: float
) -> None:
    """(5): whatever is moved from one cell to another, the cost gets no better."""
    rng = np.random.default_rng(seed)
    region = REGIONS[name]
    points = scatter_points(region, n, rng)
    others = points + 10.0**far * region.diameter * rng.normal(size=(n, 2))
    own, theirs = compute_total_cost(points, points, region, f), compute_total_cost(points, others, region, f)
    assert f.sign * (theirs - own) >= -1e-11 * abs(own)
    if far > -1.0:
        assert theirs != own


@settings(max_examples=40)
@given(seeds, st.sampled_from(["square", "pentagon", "round"]), functions, st.integers(2, 8))
def test_boundary_terms_cancel_and_leave_equation_11(seed: int, name: str, f: Performance, n: int) -> None:
    """(8)-(11): the gradient of the whole cost, cells and all, is that with the cells held still."""
    rng = np.random.default_rng(seed)
    region = REGIONS[name]
    points = region.centroid + 0.7 * (scatter_points(region, n, rng) - region.centroid)
    gap = np.hypot(*(points[:, None] - points).T) + np.diag(np.full(n, np.inf))
    step = 1e-3 * float(min(gap.min(), 0.5))
    if isinstance(f, Sensing):
        step = min(step, 1e-2 * f.height)
    edges = partition(points, region).edges
    slopes = compute_gradients(edges, np.zeros((n, 2)), f)
    scale = np.abs(compute_total_cost(points, points, region, f)) / np.sqrt(region.area)
    for i in range(min(n, 3)):
        for axis in range(2):
            move = np.zeros((n, 2))
            move[i, axis] = step
            whole = compute_total_cost(points + move, points + move, region, f)
            whole -= compute_total_cost(points - move, points - move, region, f)
            borders = compute_total_cost(points, points + move, region, f) - compute_total_cost(
                points, points - move, region, f
            )
            noise = 1e-4 * scale + 1e-13 * scale * np.sqrt(region.area) / step
            assert whole / (2.0 * step) == pytest.approx(slopes[i, axis], rel=1e-3, abs=noise)
            assert borders / (2.0 * step) == pytest.approx(0.0, abs=noise)


def test_far_from_the_origin_nothing_is_lost() -> None:
    for f in FUNCTIONS:
        near, far = (
            partition(np.array([[1.0, 1.0]]) + shift, Region(PENTAGON.vertices + shift))
            for shift in (0.0, 2.0**20)
        )
        here = compute_locational_costs(near.edges, np.full((1, 2), 0.25), f)
        np.testing.assert_allclose(
            compute_locational_costs(far.edges, np.full((1, 2), 0.25), f), here, rtol=1e-9
        )


def test_an_edge_of_rounding_does_not_say_where_the_inside_is() -> None:
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0 + 2e-16, 1.0 - 2e-16], [0.0, 1.0]])
    assert compute_derivatives(build_cell_edges(corner), np.full((1, 2), 0.4), Distance()).clearance[
        0
    ] == pytest.approx(0.4)


def test_cells_without_area_cost_nothing() -> None:
    flat = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 0.0]])
    for f in FUNCTIONS:
        for edges in (build_cell_edges(flat), build_cell_edges(np.zeros((3, 2)))):
            assert compute_locational_costs(edges, np.zeros((1, 2)), f)[0] == pytest.approx(0.0, abs=1e-15)
            assert compute_gradients(edges, np.zeros((1, 2)), f)[0] == pytest.approx([0.0, 0.0], abs=1e-12)
        none = CellEdges(np.empty((0, 2)), np.empty((0, 2)), np.empty(0, dtype=int), np.empty(0, dtype=int))
        assert compute_locational_costs(none, np.zeros((2, 2)), f).tolist() == [0.0, 0.0]
        assert compute_hessians(none, np.zeros((2, 2)), f).shape == (2, 2, 2)


@pytest.mark.parametrize("height", [0.0, -1.0, np.nan, np.inf])
def test_a_height_is_a_positive_number(height: float) -> None:
    with pytest.raises(ParameterError, match=r"height: expected a number above 0, got .* m"):
        Sensing(height)
