"""The triangulation from step to step: Delaunay, and the same cells as without it."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from voronoi_cases import (
    FAMILIES,
    PENTAGON,
    REGIONS,
    SQUARE,
    Family,
    assert_same_ring,
    circle,
    families,
    lattice,
    names,
    partition_by_clipping,
    scattered,
    seeds,
)

from robocov.arrays import Array
from robocov.compiled import kernel
from robocov.controllers import IndividualControllerAdapter, Lloyd, OwnView, Rapf
from robocov.controllers.base import Controller
from robocov.environment import Environment, PolygonObstacle
from robocov.observation.region import Region
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.voronoi import VoronoiPartition, partition
from robocov.voronoi.delaunay import Mesh, update_triangulation

CORNERS = 40.0 * np.array([[np.cos(a), np.sin(a)] for a in 2 * np.pi / 3 * np.arange(3) + 0.2])


@kernel
def update(mesh: Mesh, points: Array) -> bool:
    return update_triangulation(mesh, points, np.empty(mesh.shape[1]), np.empty(mesh.shape[1], np.intp))


def triangulate(points: Array, warm: Mesh | None = None) -> Mesh:
    mesh = np.full((2, 8 * len(points) + 4), -1, np.int32) if warm is None else warm.copy()
    assert update(mesh, np.concatenate([points, CORNERS]))
    return mesh


def list_triangles(mesh: Mesh) -> list[tuple[int, int, int]]:
    """Return the triangles, each from its lowest corner on."""
    found = [row[:3] for row in mesh[0].reshape(-1, 4).tolist()]
    return sorted(tuple(row[row.index(min(row)) :] + row[: row.index(min(row))]) for row in found)


def assert_delaunay(mesh: Mesh, points: Array) -> None:
    """Assert that twins fit, and that no point lies within a circle, exactly computed, but for rounding."""
    corner, twin = mesh.tolist()
    for h in range(len(corner)):
        if h % 4 < 3 and twin[h] >= 0:
            end = corner[h + 1 if h % 4 < 2 else h - 2]
            assert (twin[twin[h]], corner[twin[h]]) == (h, end)
    places = [[Fraction(value) for value in point] for point in np.concatenate([points, CORNERS]).tolist()]
    for triangle in list_triangles(mesh):
        for k, (px, py) in enumerate(places):
            if k not in triangle:
                (a, b, c), (d, e, f), (g, h, i) = (
                    (x - px, y - py, (x - px) ** 2 + (y - py) ** 2) for x, y in (places[j] for j in triangle)
                )
                depth = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
                terms = abs(a * e * i) + abs(b * f * g) + abs(c * d * h) + abs(a * f * h) + abs(b * d * i)
                assert depth <= 1e-12 * (terms + abs(c * e * g))


def assert_same_cells(warm: VoronoiPartition, cold: VoronoiPartition, region: Region) -> None:
    size = region.area
    assert warm.mass == pytest.approx(cold.mass, rel=1e-12, abs=1e-12 * size)
    moments = [cells.mass[:, None] * (cells.centroid - cells.generators) for cells in (warm, cold)]
    assert moments[0] == pytest.approx(moments[1], rel=1e-12, abs=1e-12 * size * region.diameter)
    if warm.triangulation is None or cold.triangulation is None:
        return
    if list_triangles(warm.triangulation) == list_triangles(cold.triangulation):
        assert warm.mass.tobytes() == cold.mass.tobytes()
        assert warm.centroid.tobytes() == cold.centroid.tobytes()
        assert warm.edges.start.tobytes() == cold.edges.start.tobytes()


def test_robots_on_the_boundary_and_outside_have_complete_polygons() -> None:
    rng = np.random.default_rng(5)
    inner = scattered(SQUARE, 30, rng) * 0.8 + 0.6
    points = np.concatenate([inner, [[3.0, -0.05], [6.0, 2.5], [0.0, 1.0]]])
    cells = partition(points, SQUARE)
    assert cells.triangulation is not None
    for a, b in zip(cells.polygons, partition_by_clipping(points, SQUARE).polygons, strict=True):
        assert_same_ring(a, b, 1e-9)


@pytest.mark.parametrize("name", REGIONS)
@pytest.mark.parametrize("n", [16, 50, 200])
def test_triangulated_and_clipped_cells_agree(n: int, name: str) -> None:
    region = REGIONS[name]
    points = scattered(region, n, np.random.default_rng(n))
    quick, slow = partition(points, region), partition_by_clipping(points, region)
    assert quick.triangulation is not None
    assert quick.mass == pytest.approx(slow.mass, rel=1e-9, abs=1e-12 * region.area)
    assert quick.centroid == pytest.approx(slow.centroid, abs=1e-9 * region.diameter)
    for cells in (quick, slow):
        assert cells.mass.sum() == pytest.approx(region.area, rel=1e-12)
    assert quick.adjacency.tolist() == slow.adjacency.tolist()
    assert quick.polar_moment == pytest.approx(slow.polar_moment, rel=1e-9)
    for a, b in zip(quick.polygons, slow.polygons, strict=True):
        assert_same_ring(a, b, 1e-9 * region.diameter)


@pytest.mark.parametrize("name", REGIONS)
@pytest.mark.parametrize("side", [4, 7, 12])
def test_lattices_are_triangulated(side: int, name: str) -> None:
    """All cocircular by fours, hulls collinear, and in the square and the round rays that end in corners."""
    region = REGIONS[name]
    points = 0.75 * region.centroid + 0.25 * lattice(region, side * side, np.random.default_rng(side))
    cells = partition(points, region)
    assert cells.triangulation is not None
    if name != "far away":  # rounding of the coordinates there makes edges between the cocircular
        links = 2 * side * (side - 1)
        assert len(cells.adjacency) == links
        assert len(partition_by_clipping(points, region).adjacency) == links
    eighth = region.centroid + (points - region.centroid) @ np.array([[1.0, 1.0], [-1.0, 1.0]])
    cells = partition(eighth, region)
    assert cells.triangulation is not None
    assert cells.mass == pytest.approx(partition_by_clipping(eighth, region).mass, abs=1e-12 * region.area)


@settings(deadline=None, max_examples=60)
@given(seeds, names, families, st.integers(16, 50), st.floats(-6.0, 0.0))
def test_cells_do_not_depend_on_the_previous_triangulation(
    seed: int, name: str, family: Family, n: int, exponent: float
) -> None:
    region, rng = REGIONS[name], np.random.default_rng(seed)
    points, warm = family(region, n, rng), None
    for _ in range(8):
        cells = partition(points, region, triangulation=warm)
        assert_same_cells(cells, partition(points, region), region)
        warm = warm if cells.triangulation is None else cells.triangulation
        points = move_points(points, region, 10.0**exponent, rng)


def move_points(points: Array, region: Region, step: float, rng: np.random.Generator) -> Array:
    """Return the points after one of several ways to go, none far out of the region."""
    middle = points.mean(axis=0)
    line = rng.normal(size=2)
    line /= np.hypot(*line)
    one = points.copy()
    one[rng.integers(len(points))] = scattered(region, 1, rng)[0]
    grid = step * region.diameter * 0.1
    ways = [
        points + step * rng.normal(size=points.shape),
        points + step * line,
        middle + (1.0 - 0.5 * step) * (points - middle),
        points - 0.9 * ((points - middle) @ line)[:, None] * line,
        np.round(points / grid) * grid,
        points[rng.permutation(len(points))],
        one,
    ]
    return region.centroid + np.clip(
        ways[rng.integers(len(ways))] - region.centroid, -region.diameter, region.diameter
    )


@pytest.mark.slow
@settings(deadline=None, max_examples=40)
@given(seeds, st.sampled_from(FAMILIES[:3]), st.integers(4, 25), st.floats(-4.0, 0.5))
def test_a_repaired_mesh_is_delaunay(seed: int, family: Family, n: int, exponent: float) -> None:
    rng = np.random.default_rng(seed)
    points, warm = family(SQUARE, n, rng), None
    for _ in range(4):
        warm = triangulate(points, warm)
        assert_delaunay(warm, points)
        points = np.clip(points + 10.0**exponent * rng.normal(size=points.shape), -9.0, 15.0)


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(seeds, st.integers(16, 40))
def test_a_triangulation_of_other_points_can_be_passed(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    elsewhere = partition(scattered(PENTAGON, n, rng), PENTAGON).triangulation
    points = scattered(SQUARE, n, rng)
    assert_same_cells(partition(points, SQUARE, triangulation=elsewhere), partition(points, SQUARE), SQUARE)
    mirrored = points * [-1.0, 1.0]
    assert_delaunay(triangulate(mirrored, triangulate(points)), mirrored)


@pytest.mark.slow
def test_the_mesh_of_slow_robots_is_repaired() -> None:
    """Flips alone keep it Delaunay: robots on the hull included, which may leave and enter it."""
    rng = np.random.default_rng(8)
    x, y = np.meshgrid(np.linspace(0.0, 6.0, 8), np.linspace(0.0, 6.0, 8))
    home = np.column_stack([x.ravel(), y.ravel()])
    points = home + rng.uniform(-0.1, 0.1, home.shape)
    mesh = triangulate(points)
    shapes, velocity = set(), rng.normal(size=points.shape)
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
    """Rounding decides every one of its edges, and a circle is how many a team starts."""
    for n in (16, 102, 400):
        for seed in range(9):
            points = circle(REGIONS[name], n, np.random.default_rng(seed))
            cells = partition(points, REGIONS[name])
            assert cells.triangulation is not None
            assert cells.mass.sum() == pytest.approx(REGIONS[name].area, rel=1e-12)
            # where the others cut a cell, all their bisectors meet in one of its corners
            assert cells.mass == pytest.approx(partition_by_clipping(points, REGIONS[name]).mass, rel=1e-9)


def test_small_teams_have_no_triangulation() -> None:
    points = scattered(SQUARE, 20, np.random.default_rng(0))
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


class Home:
    """A law for one robot."""

    def force(self, own: OwnView) -> Array:
        return 2.0 * (own.centroid - own.position)


@pytest.mark.slow
@pytest.mark.parametrize(
    "controller", [Rapf(), Lloyd(), IndividualControllerAdapter(Home())], ids=lambda law: law.name
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
    twin = simulation.copy()
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
            twin = simulation.copy()
        elif step > 700:
            twin.step()
    assert twin.positions.tobytes() == simulation.positions.tobytes()
    assert len(shapes) > 25
