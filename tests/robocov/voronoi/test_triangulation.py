"""The triangulation from step to step: Delaunay in exact arithmetic, and the same cells as without it."""

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
    circle,
    families,
    names,
    scattered,
    seeds,
)

from robocov.arrays import Array, ComplexArray
from robocov.controllers import Individually, Lloyd, Rapf
from robocov.controllers.base import Controller
from robocov.controllers.individual import OwnView
from robocov.environment import Environment, PolygonObstacle
from robocov.observation.region import Region
from robocov.robots import Team
from robocov.simulation import Simulation
from robocov.voronoi import VoronoiPartition, partition, triangulation
from robocov.voronoi.delaunay_cells import delaunay_cells
from robocov.voronoi.triangulation import SENTINELS, Fitted, Triangulation, triangulated

CORNERS = 40.0 * np.exp(2j * np.pi / 3 * np.arange(3) + 0.2j)


def with_sentinels(points: Array) -> ComplexArray:
    return np.concatenate([points @ [1.0, 1j], CORNERS])


def fitted(points: Array, warm: Triangulation | None = None) -> Fitted:
    found = triangulated(with_sentinels(points), warm)
    assert found is not None
    return found


def triangles(mesh: Triangulation) -> set[frozenset[int]]:
    return {
        frozenset((i, j, apex))
        for i, j, left, right in zip(*mesh.ends.tolist(), *mesh.apexes.tolist(), strict=True)
        for apex in (left, right)
    }


def cross(a: complex, b: complex, c: complex) -> Fraction:
    x, y = Fraction(a.real), Fraction(a.imag)
    return (Fraction(b.real) - x) * (Fraction(c.imag) - y) - (Fraction(b.imag) - y) * (Fraction(c.real) - x)


def depth_in_circle(a: complex, b: complex, c: complex, d: complex) -> float:
    """Return how far d is inside the circle through a, b, c, exactly, as the sine that `_ROUNDING` bounds."""

    def angle(at: complex, start: complex, stop: complex) -> tuple[Fraction, Fraction, float]:
        u = (Fraction(start.real) - Fraction(at.real), Fraction(start.imag) - Fraction(at.imag))
        v = (Fraction(stop.real) - Fraction(at.real), Fraction(stop.imag) - Fraction(at.imag))
        return u[0] * v[0] + u[1] * v[1], u[0] * v[1] - u[1] * v[0], abs(start - at) * abs(stop - at)

    cosine, sine, size = angle(c, a, b)
    other_cosine, other_sine, other_size = angle(d, b, a)
    return -float(cosine * other_sine + sine * other_cosine) / (size * other_size)


def assert_delaunay(mesh: Triangulation, points: ComplexArray) -> None:
    """Every triangle turns left, no edge fails the circle test, all fill the sentinels' triangle."""
    z = points.tolist()
    for i, j, left, right in zip(*mesh.ends.tolist(), *mesh.apexes.tolist(), strict=True):
        assert cross(z[i], z[j], z[left]) > 0
        assert cross(z[j], z[i], z[right]) > 0
        assert depth_in_circle(z[i], z[j], z[left], z[right]) <= 1e-14
    found = triangles(mesh)
    assert len(found) == 2 * mesh.robots + 1
    area = sum(abs(cross(*(z[corner] for corner in corners))) for corners in found)
    assert area == cross(*z[-SENTINELS:])


def assert_in_order(mesh: Triangulation) -> None:
    pairs = list(zip(*mesh.ends.tolist(), strict=True))
    assert all(i < j for i, j in pairs)
    assert pairs == sorted(pairs, key=lambda pair: (pair[1], pair[0]))


def assert_same_cells(warm: VoronoiPartition, cold: VoronoiPartition, region: Region) -> None:
    size = region.area
    assert warm.mass == pytest.approx(cold.mass, rel=1e-12, abs=1e-12 * size)
    moments = [cells.mass[:, None] * (cells.centroid - cells.generators) for cells in (warm, cold)]
    assert moments[0] == pytest.approx(moments[1], rel=1e-12, abs=1e-12 * size * region.diameter)
    if (
        warm.triangulation is not None
        and cold.triangulation is not None
        and warm.triangulation.ends.tobytes() == cold.triangulation.ends.tobytes()
    ):
        assert warm.mass.tobytes() == cold.mass.tobytes()
        assert warm.centroid.tobytes() == cold.centroid.tobytes()


def edges(mesh: Triangulation) -> set[tuple[int, int]]:
    return set(zip(*mesh.ends.tolist(), strict=True))


def lattice_of(side: int) -> Array:
    x, y = np.meshgrid(np.arange(side) - side / 2, np.arange(side) - side / 2)
    return np.column_stack([x.ravel(), y.ravel()])


def forbid_qhull(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(points: ComplexArray) -> Triangulation:
        raise AssertionError("triangulated anew")

    monkeypatch.setattr(triangulation, "_by_qhull", refuse)


@settings(deadline=None, max_examples=60)
@given(seeds, st.integers(1, 30))
def test_a_triangulation_is_delaunay_by_every_circle(seed: int, n: int) -> None:
    points = scattered(SQUARE, n, np.random.default_rng(seed))
    z = with_sentinels(points)
    mesh = fitted(points).triangulation
    assert_delaunay(mesh, z)
    assert_in_order(mesh)
    places = z.tolist()
    for corners in triangles(mesh):
        a, b, c = (places[corner] for corner in corners)
        if cross(a, b, c) < 0:
            a, b = b, a
        for other in set(range(n)) - corners:
            assert depth_in_circle(a, b, c, places[other]) <= 1e-14


def test_one_flip(monkeypatch: pytest.MonkeyPatch) -> None:
    lozenge = np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, -0.9], [0.0, 0.9]])
    before = fitted(lozenge).triangulation
    forbid_qhull(monkeypatch)
    narrow = lozenge * [0.85, 1.0]
    after = fitted(narrow, before).triangulation
    assert edges(before) - edges(after) == {(2, 3)}
    assert edges(after) - edges(before) == {(0, 1)}
    assert_delaunay(after, with_sentinels(narrow))
    assert_in_order(after)
    assert fitted(lozenge, after).triangulation.apexes.tolist() == before.apexes.tolist()


def test_a_robot_leaves_the_hull_and_comes_back(monkeypatch: pytest.MonkeyPatch) -> None:
    def places(height: float) -> Array:
        return np.array([[0.0, 0.0], [1.0, height], [2.0, 0.0], [0.2, 2.0], [1.9, 2.1], [1.1, 1.2]])

    mesh = fitted(places(0.3)).triangulation
    assert (0, 2) in edges(mesh)
    forbid_qhull(monkeypatch)
    for height in [*np.linspace(0.3, -0.3, 13), *np.linspace(-0.3, 0.3, 4)]:
        mesh = fitted(places(height), mesh).triangulation
        assert_delaunay(mesh, with_sentinels(places(height)))
        assert ((0, 2) in edges(mesh)) == (height > 0.05)


def test_slow_robots_need_no_second_triangulation(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(8)
    points = lattice_of(15) + rng.uniform(-0.1, 0.1, (225, 2))
    mesh = fitted(points).triangulation
    forbid_qhull(monkeypatch)
    seen = {mesh.ends.tobytes()}
    velocity = rng.normal(size=points.shape)
    for _ in range(150):
        points = points + 0.004 * velocity
        velocity -= 0.1 * (points - lattice_of(15))
        mesh = fitted(points, mesh).triangulation
        seen.add(mesh.ends.tobytes())
    assert_delaunay(mesh, with_sentinels(points))
    assert len(seen) > 100


@settings(deadline=None, max_examples=60)
@given(seeds, names, families, st.integers(7, 50), st.floats(-6.0, 0.0))
def test_cells_do_not_depend_on_the_way_here(
    seed: int, name: str, family: Family, n: int, exponent: float
) -> None:
    region, rng = REGIONS[name], np.random.default_rng(seed)
    points, warm = family(region, n, rng), None
    for _ in range(8):
        cells, cold = partition(points, region, warm=warm), partition(points, region)
        assert_same_cells(cells, cold, region)
        if cells.triangulation is not None:
            assert_in_order(cells.triangulation)
        warm = cells.triangulation or warm
        points = moved(points, region, 10.0**exponent, rng)


def moved(points: Array, region: Region, step: float, rng: np.random.Generator) -> Array:
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


@settings(deadline=None, max_examples=40)
@given(seeds, st.sampled_from(FAMILIES[:3]), st.integers(4, 40), st.floats(-4.0, -0.5))
def test_what_is_mended_is_delaunay(seed: int, family: Family, n: int, exponent: float) -> None:
    rng = np.random.default_rng(seed)
    points, warm = family(SQUARE, n, rng), None
    for _ in range(5):
        warm = fitted(points, warm).triangulation
        assert_delaunay(warm, with_sentinels(points))
        assert_in_order(warm)
        points = points + 10.0**exponent * rng.normal(size=points.shape)


@settings(deadline=None, max_examples=60)
@given(seeds, st.integers(7, 40))
def test_a_triangulation_of_other_places_does_no_harm(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    elsewhere = fitted(scattered(PENTAGON, n, rng)).triangulation
    points = scattered(SQUARE, n, rng)
    assert_same_cells(partition(points, SQUARE, warm=elsewhere), partition(points, SQUARE), SQUARE)
    assert_delaunay(fitted(points, elsewhere).triangulation, with_sentinels(points))
    mirrored = points * [-1.0, 1.0]
    assert_delaunay(fitted(mirrored, fitted(points).triangulation).triangulation, with_sentinels(mirrored))


@pytest.mark.parametrize("name", REGIONS)
def test_a_team_on_a_circle_needs_no_clipping(name: str) -> None:
    """Rounding decides every one of its edges, and a circle is how many a team starts."""
    for n in (10, 100, 400):
        points = circle(REGIONS[name], n, np.random.default_rng(n))
        cells = partition(points, REGIONS[name])
        assert cells.triangulation is not None
        assert cells.mass.sum() == pytest.approx(REGIONS[name].area, rel=1e-12)


@pytest.mark.parametrize("size", [19, 21])
def test_a_triangulation_of_another_team_is_not_used(size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    points = scattered(SQUARE, 20, rng)
    other = fitted(scattered(SQUARE, size, rng)).triangulation
    right = fitted(points).triangulation
    assert fitted(points, other).triangulation.ends.tobytes() == right.ends.tobytes()
    forbid_qhull(monkeypatch)
    with pytest.raises(AssertionError, match="anew"):
        fitted(points, other)


def test_without_triangulation_there_is_nothing_to_hand_on() -> None:
    points = scattered(SQUARE, 20, np.random.default_rng(0))
    mesh = partition(points, SQUARE).triangulation
    assert mesh is not None
    with pytest.raises(ValueError, match="read-only"):
        mesh.ends[0, 0] = 1
    points[3] = points[4]
    assert partition(points, SQUARE, warm=mesh).triangulation is None
    assert partition(points[:3], SQUARE).triangulation is None
    assert triangulated(with_sentinels(points)) is None


def test_what_qhull_gets_wrong_is_put_right(monkeypatch: pytest.MonkeyPatch) -> None:
    lozenge = np.array([[1.0, 3.0], [3.0, 2.0], [5.0, 3.0], [3.0, 4.0]])
    right = fitted(lozenge).triangulation
    wrong = fitted(lozenge * [0.3, 1.0]).triangulation
    assert edges(right) != edges(wrong)
    monkeypatch.setattr(triangulation, "_by_qhull", lambda points: wrong)
    assert edges(fitted(lozenge).triangulation) == edges(right)
    assert delaunay_cells(lozenge, SQUARE) is not None
    upside_down = lozenge * [1.0, -1.0] + [0.0, 6.0]
    assert triangulated(with_sentinels(upside_down)) is None
    assert delaunay_cells(upside_down, SQUARE) is None


def test_flips_that_lead_nowhere_are_noticed() -> None:
    def flip(points: Array, edge: tuple[int, int]) -> list[bool]:
        mesh = fitted(points).triangulation
        ends, apexes = mesh.ends.copy(), mesh.apexes.copy()
        number = np.array([list(zip(*ends.tolist(), strict=True)).index(edge)])
        return [triangulation._flip(ends, apexes, number) is not None for _ in range(2)]

    corners = [[0.0, 0.0], [4.0, 0.0], [2.0, 3.0]]
    # the middle one has three neighbours: the other diagonal is there already
    assert flip(np.array([*corners, [2.0, 1.0]]), (0, 3)) == [True, False]
    # between two sentinels: the other diagonal would be their own
    assert flip(np.array([[0.0, 0.0]]), (0, 1)) == [False, False]


class Home:
    """A law for one robot."""

    def force(self, own: OwnView) -> Array:
        return 2.0 * (own.centroid - own.position)


@pytest.mark.parametrize("controller", [Rapf(), Lloyd(), Individually(Home())], ids=lambda law: law.name)
def test_thousands_of_steps_have_the_cells_of_the_first(
    controller: Controller, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And nearly all of them come about without Qhull."""
    calls = []
    cold = triangulation._by_qhull
    monkeypatch.setattr(triangulation, "_by_qhull", lambda points: calls.append(1) or cold(points))
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
    changes = 0
    before = b""
    for step in range(1500):
        simulation.step()
        cells = simulation.snapshot.decision.cells
        assert cells is not None
        if step % 10 == 0:
            assert_same_cells(cells, partition(simulation.positions, room.region), room.region)
            calls.pop()
        if cells.triangulation is not None:
            changes += cells.triangulation.ends.tobytes() != before
            before = cells.triangulation.ends.tobytes()
        if step == 700:
            twin = simulation.copy()
        elif step > 700:
            twin.step()
    assert twin.positions.tobytes() == simulation.positions.tobytes()
    assert changes > 50
    assert len(calls) < 20
