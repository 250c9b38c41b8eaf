"""The triangulation that is updated in each step: it is Delaunay and does not change the cells."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from voronoi_cases import (
    FAMILIES,
    PENTAGON,
    REGIONS,
    SQUARE,
    Family,
    assert_same_ring,
    build_lattice,
    families,
    names,
    partition_by_clipping,
    place_on_circle,
    scatter_points,
    seeds,
)

from robocov.compiled import kernel
from robocov.controllers import IndividualControllerAdapter, Lloyd, OwnView, Rapf
from robocov.controllers.base import Controller
from robocov.environment import Environment, PolygonObstacle
from robocov.observation.region import Region
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.typing import FloatArray
from robocov.voronoi import VoronoiPartition, partition
from robocov.voronoi.delaunay import Mesh, update_triangulation

CORNERS = 40.0 * np.array([[np.cos(a), np.sin(a)] for a in 2 * np.pi / 3 * np.arange(3) + 0.2])


@kernel
def update_mesh(mesh: Mesh, points: FloatArray) -> bool:
    return update_triangulation(mesh, points, np.empty(mesh.shape[1]), np.empty(mesh.shape[1], np.intp))


def triangulate(points: FloatArray, previous: Mesh | None = None) -> Mesh:
    """Return the triangulation of points and corners, starting from a previous mesh if there is one."""
    if previous is None:
        mesh = np.full((2, 8 * len(points) + 4), -1, np.int32)
    else:
        mesh = previous.copy()
    assert update_mesh(mesh, np.concatenate([points, CORNERS]))
    return mesh


def list_triangles(mesh: Mesh) -> list[tuple[int, int, int]]:
    """Return the triangles. Each starts with its corner of the lowest number."""
    triangles = []
    for row in mesh[0].reshape(-1, 4).tolist():
        corners = row[:3]
        first = corners.index(min(corners))
        triangles.append(tuple(corners[first:] + corners[:first]))
    return sorted(triangles)


def assert_delaunay(mesh: Mesh, points: FloatArray) -> None:
    """Assert that twin half-edges match and that no circumcircle contains a point, up to rounding."""
    corner, twin = mesh.tolist()
    for h in range(len(corner)):
        if h % 4 < 3 and twin[h] >= 0:
            end = corner[h + 1 if h % 4 < 2 else h - 2]
            assert (twin[twin[h]], corner[twin[h]]) == (h, end)
    nodes = [tuple(map(Fraction, point)) for point in np.concatenate([points, CORNERS]).tolist()]
    for triangle in list_triangles(mesh):
        for k, (px, py) in enumerate(nodes):
            if k not in triangle:
                rows = [
                    (x - px, y - py, (x - px) ** 2 + (y - py) ** 2)
                    for x, y in [nodes[corner] for corner in triangle]
                ]
                (a, b, c), (d, e, f), (g, h, i) = rows
                depth = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
                terms = abs(a * e * i) + abs(b * f * g) + abs(c * d * h) + abs(a * f * h) + abs(b * d * i)
                assert depth <= 1e-12 * (terms + abs(c * e * g))


def assert_same_cells(updated: VoronoiPartition, built: VoronoiPartition, region: Region) -> None:
    size = region.area
    assert updated.masses == pytest.approx(built.masses, rel=1e-12, abs=1e-12 * size)
    moments = [cells.masses[:, None] * (cells.centroids - cells.generators) for cells in (updated, built)]
    assert moments[0] == pytest.approx(moments[1], rel=1e-12, abs=1e-12 * size * region.diameter)
    if updated.triangulation is None or built.triangulation is None:
        return
    if list_triangles(updated.triangulation) == list_triangles(built.triangulation):
        assert updated.masses.tobytes() == built.masses.tobytes()
        assert updated.centroids.tobytes() == built.centroids.tobytes()
        assert updated.edges.starts.tobytes() == built.edges.starts.tobytes()


def test_robots_on_the_boundary_and_outside_have_complete_polygons() -> None:
    rng = np.random.default_rng(5)
    inner = scatter_points(SQUARE, 30, rng) * 0.8 + 0.6
    points = np.concatenate([inner, [[3.0, -0.05], [6.0, 2.5], [0.0, 1.0]]])
    cells = partition(points, SQUARE)
    assert cells.triangulation is not None
    for a, b in zip(cells.polygons, partition_by_clipping(points, SQUARE).polygons, strict=True):
        assert_same_ring(a, b, 1e-9)


@pytest.mark.parametrize("name", REGIONS)
@pytest.mark.parametrize("n", [16, 50, 200])
def test_triangulated_and_clipped_cells_agree(n: int, name: str) -> None:
    region = REGIONS[name]
    points = scatter_points(region, n, np.random.default_rng(n))
    triangulated = partition(points, region)
    clipped = partition_by_clipping(points, region)
    assert triangulated.triangulation is not None
    assert triangulated.masses == pytest.approx(clipped.masses, rel=1e-9, abs=1e-12 * region.area)
    assert triangulated.centroids == pytest.approx(clipped.centroids, abs=1e-9 * region.diameter)
    for cells in (triangulated, clipped):
        assert cells.masses.sum() == pytest.approx(region.area, rel=1e-12)
    assert triangulated.adjacency.tolist() == clipped.adjacency.tolist()
    assert triangulated.polar_moments == pytest.approx(clipped.polar_moments, rel=1e-9)
    for a, b in zip(triangulated.polygons, clipped.polygons, strict=True):
        assert_same_ring(a, b, 1e-9 * region.diameter)


@pytest.mark.parametrize("name", REGIONS)
@pytest.mark.parametrize("side", [4, 7, 12])
def test_lattices_are_triangulated(side: int, name: str) -> None:
    """The points are cocircular by fours, sides of the hull are collinear, and some rays end in corners."""
    region = REGIONS[name]
    points = 0.75 * region.centroid + 0.25 * build_lattice(region, side * side, np.random.default_rng(side))
    cells = partition(points, region)
    assert cells.triangulation is not None
    # Far away the rounding of coordinates makes edges between cocircular points.
    if name != "far away":
        links = 2 * side * (side - 1)
        assert len(cells.adjacency) == links
        assert len(partition_by_clipping(points, region).adjacency) == links
    turned = region.centroid + (points - region.centroid) @ np.array([[1.0, 1.0], [-1.0, 1.0]])
    cells = partition(turned, region)
    assert cells.triangulation is not None
    assert cells.masses == pytest.approx(
        partition_by_clipping(turned, region).masses, abs=1e-12 * region.area
    )


@settings(deadline=None, max_examples=count_examples(60))
@given(seeds, names, families, st.integers(16, 50), st.floats(-6.0, 0.0))
def test_cells_do_not_depend_on_the_previous_triangulation(
    seed: int, name: str, family: Family, n: int, exponent: float
) -> None:
    region = REGIONS[name]
    rng = np.random.default_rng(seed)
    points = family(region, n, rng)
    previous = None
    for _ in range(8):
        cells = partition(points, region, triangulation=previous)
        assert_same_cells(cells, partition(points, region), region)
        if cells.triangulation is not None:
            previous = cells.triangulation
        points = move_points(points, region, 10.0**exponent, rng)


def move_points(points: FloatArray, region: Region, step: float, rng: np.random.Generator) -> FloatArray:
    """Return the points after one of several motions, none of them far out of the region."""
    middle = points.mean(axis=0)
    line = rng.normal(size=2)
    line /= np.hypot(*line)
    one_moved = points.copy()
    one_moved[rng.integers(len(points))] = scatter_points(region, 1, rng)[0]
    grid = step * region.diameter * 0.1
    motions = [
        points + step * rng.normal(size=points.shape),
        points + step * line,
        middle + (1.0 - 0.5 * step) * (points - middle),
        points - 0.9 * ((points - middle) @ line)[:, None] * line,
        np.round(points / grid) * grid,
        points[rng.permutation(len(points))],
        one_moved,
    ]
    offsets = motions[rng.integers(len(motions))] - region.centroid
    return region.centroid + np.clip(offsets, -region.diameter, region.diameter)


@pytest.mark.slow
@settings(deadline=None, max_examples=count_examples(40))
@given(seeds, st.sampled_from(FAMILIES[:3]), st.integers(4, 25), st.floats(-4.0, 0.5))
def test_a_repaired_mesh_is_delaunay(seed: int, family: Family, n: int, exponent: float) -> None:
    rng = np.random.default_rng(seed)
    points = family(SQUARE, n, rng)
    mesh = None
    for _ in range(4):
        mesh = triangulate(points, mesh)
        assert_delaunay(mesh, points)
        points = np.clip(points + 10.0**exponent * rng.normal(size=points.shape), -9.0, 15.0)


@pytest.mark.slow
@settings(deadline=None, max_examples=count_examples(60))
@given(seeds, st.integers(16, 40))
def test_a_triangulation_of_other_points_can_be_passed(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    foreign = partition(scatter_points(PENTAGON, n, rng), PENTAGON).triangulation
    points = scatter_points(SQUARE, n, rng)
    assert_same_cells(partition(points, SQUARE, triangulation=foreign), partition(points, SQUARE), SQUARE)
    mirrored = points * [-1.0, 1.0]
    assert_delaunay(triangulate(mirrored, triangulate(points)), mirrored)


@pytest.mark.slow
def test_the_mesh_of_slow_robots_is_repaired() -> None:
    """Flips alone keep it Delaunay, also for robots that leave or enter the hull."""
    rng = np.random.default_rng(8)
    x, y = np.meshgrid(np.linspace(0.0, 6.0, 8), np.linspace(0.0, 6.0, 8))
    home = np.column_stack([x.ravel(), y.ravel()])
    points = home + rng.uniform(-0.1, 0.1, home.shape)
    mesh = triangulate(points)
    shapes = set()
    velocity = rng.normal(size=points.shape)
    for _ in range(150):
        points = points + 0.004 * velocity
        velocity -= 0.1 * (points - home)
        mesh = triangulate(points, mesh)
        shapes.add(tuple(list_triangles(mesh)))
    assert_delaunay(mesh, points)
    assert (mesh != triangulate(points)).any()
    assert len(shapes) > 50


@pytest.mark.parametrize("name", REGIONS)
def test_a_team_on_a_circle_needs_no_clipping(name: str) -> None:
    """Rounding decides all edges here, and many teams start on a circle."""
    for n in (16, 102, 400):
        for seed in range(9):
            points = place_on_circle(REGIONS[name], n, np.random.default_rng(seed))
            cells = partition(points, REGIONS[name])
            assert cells.triangulation is not None
            assert cells.masses.sum() == pytest.approx(REGIONS[name].area, rel=1e-12)
            # All bisectors meet in one corner of the cells.
            assert cells.masses == pytest.approx(
                partition_by_clipping(points, REGIONS[name]).masses, rel=1e-9
            )


def test_small_teams_have_no_triangulation() -> None:
    points = scatter_points(SQUARE, 20, np.random.default_rng(0))
    mesh = partition(points, SQUARE).triangulation
    assert mesh is not None
    assert_same_cells(
        partition(points[:19], SQUARE, triangulation=mesh), partition(points[:19], SQUARE), SQUARE
    )
    with pytest.raises(ValueError, match="read-only"):
        mesh[0, 0] = 1
    points[3] = points[4]
    assert partition(points, SQUARE, triangulation=mesh).triangulation is None
    assert partition(points[:3], SQUARE).triangulation is None


class CentroidController:
    """A controller for one robot that moves to the centroid of its cell."""

    def force(self, own: OwnView) -> FloatArray:
        return 2.0 * (own.centroid - own.position)


@pytest.mark.slow
@pytest.mark.parametrize(
    "controller",
    [Rapf(), Lloyd(), IndividualControllerAdapter(CentroidController())],
    ids=lambda controller: controller.name,
)
def test_repairs_stay_correct_for_thousands_of_steps(controller: Controller) -> None:
    room = Environment(
        "room",
        ((0, 0), (14, 0), (14, 9), (0, 9)),
        (
            PolygonObstacle(((4, 3), (6, 3), (6, 6), (4, 6))),
            PolygonObstacle(((9, 0.5), (10, 0.5), (10, 5), (9, 5))),
        ),
    )
    team = Team.homogeneous(30)
    starts = np.array([[0.5 + 0.6 * (k % 5), 0.5 + 0.6 * (k // 5)] for k in range(30)])
    simulation = Simulation(room, controller, starts, team)
    copy = simulation.copy()
    shapes = set()
    for step in range(1500):
        simulation.step()
        if step % 10 == 0:
            cells = simulation.observe_and_decide().decision.cells
            assert isinstance(cells, VoronoiPartition)
            assert_same_cells(cells, partition(simulation.positions, room.region), room.region)
            assert cells.triangulation is not None
            shapes.add(tuple(list_triangles(cells.triangulation)))
        if step == 700:
            copy = simulation.copy()
        elif step > 700:
            copy.step()
    assert copy.positions.tobytes() == simulation.positions.tobytes()
    assert len(shapes) > 25
