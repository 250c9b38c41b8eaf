"""The locational cost (4): quadrature, dilogarithms, formulas of the paper, and general properties."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
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
from robocov.locational_cost.integrals import _integrate_edge, _RelativeEdge
from robocov.locational_cost.performance import SENSING
from robocov.observation.region import Region
from robocov.voronoi import partition

FUNCTIONS: list[Performance] = [SquaredDistance(), Distance(), Sensing(0.02), Sensing(1.0), Sensing(60.0)]
functions = st.sampled_from(FUNCTIONS)


def compute_hessians(edges: CellEdges, points: np.ndarray, f: Performance) -> np.ndarray:
    derivatives = compute_derivatives(edges, points, f)
    rows = np.column_stack([derivatives.xx, derivatives.xy, derivatives.xy, derivatives.yy])
    return rows.reshape(-1, 2, 2)


def build_cell_edges(ring: np.ndarray) -> CellEdges:
    """Return a ring of vertices as the single cell of a generator at the origin."""
    count = len(ring)
    return CellEdges(ring, np.roll(ring, -1, axis=0), np.zeros(count, dtype=int), np.full(count, -1))


def integrate_by_quadrature(
    ring: np.ndarray, p: np.ndarray, f: Performance, tolerance: float = 1e-10
) -> float:
    """Return ∫ f(|q-p|) dq over a convex ring by adaptive quadrature between the x of its corners."""
    edges = list(pairwise([*ring.tolist(), ring[0].tolist()]))

    def find_heights(x: float) -> tuple[float, float]:
        heights = [
            y + (v - y) * (x - u) / (w - u)
            for (u, y), (w, v) in edges
            if u != w and min(u, w) <= x <= max(u, w)
        ]
        return min(heights), max(heights)

    limits = set(ring[:, 0].tolist())
    if min(limits) < p[0] < max(limits):
        limits.add(p[0])
    total = 0.0
    for low, high in pairwise(sorted(limits)):
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
    cost = compute_locational_costs(build_cell_edges(PENTAGON.vertices), np.array([p]), f)[0]
    assert cost == pytest.approx(integrate_by_quadrature(PENTAGON.vertices, np.array(p), f, 1e-8), rel=3e-8)


def integrate_by_dilogarithms(ring: np.ndarray, p: np.ndarray, h: float) -> float:
    """Return ∫ dq / (|q-p|² + h²) over a ring in closed form, by the imaginary parts of dilogarithms.

    In polar coordinates about p, an edge at the distance d contributes ½ ∫ ln(1 + d² / (h² cos² θ)) dθ. With
    q = (h / (d + √(d² + h²)))², the logarithm is ln|1 + q e^(2iθ)|² - ln|1 + e^(2iθ)|² - ln q, and an
    antiderivative of ln|1 + q e^(2iθ)|² with respect to θ is -Im Li₂(-q e^(2iθ)).
    """

    def evaluate_imag_dilogarithm(z: complex) -> float:
        """Return Im Li₂(-z)."""
        return float(np.imag(spence(1.0 + z)))

    total = 0.0
    for a, b in pairwise([*(ring - p), ring[0] - p]):
        along = (b - a) / np.hypot(*(b - a))
        d = a[0] * along[1] - a[1] * along[0]
        q = (h / (abs(d) + np.hypot(d, h))) ** 2
        ends = []
        for s in (a @ along, b @ along):
            angle = np.arctan2(s, abs(d))
            ends.append(
                -angle * np.log(q)
                - evaluate_imag_dilogarithm(q * np.exp(2j * angle))
                + evaluate_imag_dilogarithm(np.exp(2j * angle))
            )
        total += np.sign(d) * 0.5 * (ends[1] - ends[0])
    return total


@settings(max_examples=count_examples(200))
@given(seeds, names, st.floats(-2.5, 1.0))
def test_sensing_is_a_sum_of_dilogarithms(seed: int, name: str, size: float) -> None:
    rng = np.random.default_rng(seed)
    ring = REGIONS[name].vertices - REGIONS[name].centroid
    p = rng.normal(scale=3.0, size=2)
    h = 10.0**size
    assert compute_locational_costs(build_cell_edges(ring), p[None], Sensing(h))[0] == pytest.approx(
        integrate_by_dilogarithms(ring, p, h), rel=1e-10
    )


@pytest.mark.parametrize("h", [1e-9, 1e-4, 1.0, 1e4, 1e9])
@pytest.mark.parametrize("width", [1e-12, 1e-6, 1.0, 1e6])
def test_sensing_is_accurate_for_any_height_and_width(h: float, width: float) -> None:
    """For a rectangle about a generator, by an integral that the implementation does not use."""
    ring = np.array([[-width, -1.0], [width, -1.0], [width, 1.0], [-width, 1.0]]) / 2.0

    def evaluate_strip(t: float) -> float:
        # The substitution y = e^t resolves the neighborhood of the generator.
        y = np.exp(t)
        root = np.hypot(y, h)
        return float(y * 4.0 * np.arctan(0.5 * width / root) / root)

    low = np.log(0.5 * min(1.0, h, width)) - 40.0
    points = [np.log(length) for length in (h, width) if np.exp(low) < length < 0.5]
    expected, _ = quad(
        evaluate_strip, low, np.log(0.5), points=points or None, limit=500, epsabs=0.0, epsrel=1e-12
    )
    assert compute_locational_costs(build_cell_edges(ring), np.zeros((1, 2)), Sensing(h))[0] == pytest.approx(
        expected, rel=1e-11
    )


@settings(max_examples=count_examples(120))
@given(seeds, names, functions)
def test_gradient_and_hessian_agree_with_finite_differences(seed: int, name: str, f: Performance) -> None:
    rng = np.random.default_rng(seed)
    region = REGIONS[name]
    ring = region.vertices - region.centroid
    p = scatter_points(region, 1, rng) - region.centroid
    size = region.diameter
    if isinstance(f, Sensing):
        size = min(size, f.height)
    if isinstance(f, Sensing) and f.height < 1.0:
        # At the edge of a cell the cost of a low sensor has a step that finite differences do not resolve.
        p = 0.8 * p
        step = 1e-3 * f.height
    else:
        p = p + rng.normal(scale=2.0, size=2)
        step = 1e-4 * min(1.0, np.sqrt(region.area))
    edges = build_cell_edges(ring)
    slope = []
    curvature = []
    for shift in step * np.eye(2):
        cost_difference = compute_locational_costs(edges, p + shift, f) - compute_locational_costs(
            edges, p - shift, f
        )
        slope.append(cost_difference[0] / (2.0 * step))
        gradient_difference = compute_gradients(edges, p + shift, f) - compute_gradients(edges, p - shift, f)
        curvature.append(gradient_difference[0] / (2.0 * step))
    noise = 1e-13 * compute_locational_costs(edges, p, f)[0] / step
    gradient = compute_gradients(edges, p, f)[0]
    tolerance = 2e-5 * np.abs(gradient).max() + noise
    np.testing.assert_allclose(gradient, slope, rtol=0, atol=tolerance)
    hessian = compute_hessians(edges, p, f)[0]
    tolerance = 2e-5 * np.abs(hessian).max() + noise / size
    np.testing.assert_allclose(hessian, curvature, rtol=0, atol=tolerance)


@settings(max_examples=count_examples(60))
@given(seeds, names, st.integers(1, 9))
def test_squared_distances_obey_the_parallel_axis_theorem(seed: int, name: str, n: int) -> None:
    """Check (2), (3) and (13) with integrals that do not use mass and centroid."""
    rng = np.random.default_rng(seed)
    region = REGIONS[name]
    cells = partition(scatter_points(region, n, rng), region)
    points = rng.normal(scale=2.0, size=(n, 2))
    lever = points + cells.generators - cells.centroids
    size = region.diameter
    expected = compute_moment_about_centroid(cells) + cells.masses * (lever**2).sum(axis=1)
    f = SquaredDistance()
    np.testing.assert_allclose(
        compute_locational_costs(cells.edges, points, f), expected, rtol=1e-9, atol=1e-12 * size**4
    )
    slope = 2.0 * cells.masses[:, None] * lever
    np.testing.assert_allclose(
        compute_gradients(cells.edges, points, f), slope, rtol=1e-9, atol=1e-11 * size**3
    )
    curvature = 2.0 * cells.masses[:, None, None] * np.eye(2)
    np.testing.assert_allclose(
        compute_hessians(cells.edges, points, f), curvature, rtol=1e-9, atol=1e-12 * size**2
    )
    np.testing.assert_allclose(
        compute_derivatives(cells.edges, points, f).areas, cells.masses, rtol=1e-9, atol=1e-12 * size**2
    )


def compute_total_cost(points: np.ndarray, borders: np.ndarray, region: Region, f: Performance) -> float:
    """Return (4) for robots at `points` that cover the Voronoi cells of `borders`."""
    cells = partition(borders, region)
    return float(compute_locational_costs(cells.edges, points - cells.generators, f).sum())


@settings(max_examples=count_examples(60))
@given(seeds, names, functions, st.integers(2, 9), st.floats(-4.0, 0.0))
def test_no_other_partition_is_better_than_the_voronoi_partition(
    seed: int, name: str, f: Performance, n: int, log_distance: float
) -> None:
    """Check (5): the cells of other generators do not improve the cost."""
    rng = np.random.default_rng(seed)
    region = REGIONS[name]
    points = scatter_points(region, n, rng)
    others = points + 10.0**log_distance * region.diameter * rng.normal(size=(n, 2))
    cost = compute_total_cost(points, points, region, f)
    other_cost = compute_total_cost(points, others, region, f)
    assert f.sign * (other_cost - cost) >= -1e-11 * abs(cost)
    if log_distance > -1.0:
        assert other_cost != cost


@settings(max_examples=count_examples(40))
@given(seeds, st.sampled_from(["square", "pentagon", "round"]), functions, st.integers(2, 8))
def test_boundary_terms_cancel_and_leave_equation_11(seed: int, name: str, f: Performance, n: int) -> None:
    """Check (8) to (11): the gradient of the cost with moving cells equals that with fixed cells."""
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
            total_change = compute_total_cost(points + move, points + move, region, f)
            total_change -= compute_total_cost(points - move, points - move, region, f)
            border_change = compute_total_cost(points, points + move, region, f)
            border_change -= compute_total_cost(points, points - move, region, f)
            noise = 1e-4 * scale + 1e-13 * scale * np.sqrt(region.area) / step
            assert total_change / (2.0 * step) == pytest.approx(slopes[i, axis], rel=1e-3, abs=noise)
            assert border_change / (2.0 * step) == pytest.approx(0.0, abs=noise)


def test_costs_far_from_the_origin_are_equally_accurate() -> None:
    shift = 2.0**20
    cells = partition(np.array([[1.0, 1.0]]), Region(PENTAGON.vertices))
    shifted_cells = partition(np.array([[1.0, 1.0]]) + shift, Region(PENTAGON.vertices + shift))
    offsets = np.full((1, 2), 0.25)
    for f in FUNCTIONS:
        costs = compute_locational_costs(cells.edges, offsets, f)
        shifted_costs = compute_locational_costs(shifted_cells.edges, offsets, f)
        np.testing.assert_allclose(shifted_costs, costs, rtol=1e-9)


def test_edges_as_short_as_rounding_errors_do_not_affect_the_clearance() -> None:
    ring = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0 + 2e-16, 1.0 - 2e-16], [0.0, 1.0]])
    derivatives = compute_derivatives(build_cell_edges(ring), np.full((1, 2), 0.4), Distance())
    assert derivatives.clearances[0] == pytest.approx(0.4)


def test_cells_without_area_cost_nothing() -> None:
    flat = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 0.0]])
    for f in FUNCTIONS:
        for edges in (build_cell_edges(flat), build_cell_edges(np.zeros((3, 2)))):
            assert compute_locational_costs(edges, np.zeros((1, 2)), f)[0] == pytest.approx(0.0, abs=1e-15)
            assert compute_gradients(edges, np.zeros((1, 2)), f)[0] == pytest.approx([0.0, 0.0], abs=1e-12)
        no_edges = CellEdges(
            np.empty((0, 2)), np.empty((0, 2)), np.empty(0, dtype=int), np.empty(0, dtype=int)
        )
        assert compute_locational_costs(no_edges, np.zeros((2, 2)), f).tolist() == [0.0, 0.0]
        assert compute_hessians(no_edges, np.zeros((2, 2)), f).shape == (2, 2, 2)


@pytest.mark.parametrize("height", [0.0, -1.0, np.nan, np.inf])
def test_heights_must_be_positive_numbers(height: float) -> None:
    with pytest.raises(ParameterError, match=r"height: expected a number above 0, got .* m"):
        Sensing(height)


def test_kernels_reject_unknown_functions() -> None:
    edge = _RelativeEdge(normal_x=1.0, normal_y=0.0, length=1.0, distance=1.0, start=0.0)
    with pytest.raises(ValueError, match="kind: expected the number of a performance function"):
        _integrate_edge(kind=SENSING + 1, height=1.0, edge=edge, half_perimeter=1.0)
