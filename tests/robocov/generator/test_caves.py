"""Caves: one piece of free space inside a rim of rock, and no window narrower than the gap."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Point

from robocov.environment import PolygonObstacle
from robocov.environment.passages import Gap, narrowest_gap
from robocov.generator import generated_map
from robocov.generator.caves import _through, _tunnels

SEEDS = range(10)


@pytest.mark.parametrize("seed", SEEDS)
def test_rock_goes_all_round_and_pillars_stand_apart(seed: int) -> None:
    environment = generated_map(seed, kind="caves")
    rock, *pillars = environment.obstacles
    assert isinstance(rock, PolygonObstacle)
    assert (rock.name, len(rock.holes), len(rock.vertices)) == ("rock", 1, 4)
    (free,) = environment.free.geoms
    low_x, low_y, high_x, high_y = free.bounds
    assert min(low_x, low_y) >= 0.12 - 1e-9 and max(high_x, high_y) <= 9.88 + 1e-9
    start = environment.starts["corner"]
    assert start.radius == 0.72 and free.contains(Point(start.center).buffer(start.radius))
    assert len(free.interiors) == len(pillars)
    for pillar in pillars:
        assert pillar.name == "pillar"
        assert pillar.polygon.distance(rock.polygon) >= 0.6
        assert pillar.polygon.area > 0.1


def test_vertices_are_few_and_walls_smooth() -> None:
    for seed in SEEDS:
        (free,) = generated_map(seed, kind="caves").free.geoms
        rings = [np.asarray(ring.coords)[:-1] for ring in (free.exterior, *free.interiors)]
        assert sum(map(len, rings)) < 200
        turns = []
        for ring in rings:
            step = np.roll(ring, -1, axis=0) - ring
            angle = np.arctan2(step[:, 1], step[:, 0])
            turns.append(np.abs((np.roll(angle, -1) - angle + np.pi) % (2.0 * np.pi) - np.pi))
        turn = np.degrees(np.concatenate(turns))
        # at a vertex a wall turns by less than 30 degrees on average, and it hardly ever juts
        assert turn.mean() < 30.0
        assert (turn > 100.0).mean() < 0.02


def test_caves_have_chambers_and_tunnels_and_sometimes_pillars() -> None:
    narrow, pillars = [], 0
    for seed in range(20):
        environment = generated_map(seed, kind="caves")
        (free,) = environment.free.geoms
        pillars += len(free.interiors)
        # what a disc of twice the gap does not get through
        narrow.append(len(shapely.get_parts(free.buffer(-0.6))))
    assert pillars >= 10
    assert sum(count > 1 for count in narrow) >= 10


@settings(max_examples=25)
@given(
    st.integers(0, 2**32),
    st.sampled_from([2, 8, 30]),
    st.floats(0.3, 0.7),
    st.sampled_from([0.22, 0.3, 0.5, 0.9, 1.4]),
)
def test_no_passage_is_narrower_than_the_gap(seed: int, chambers: int, area: float, gap: float) -> None:
    environment = generated_map(
        seed, kind="caves", obstacles=chambers, area=area, gap=gap, width=12, height=9
    )
    found = narrowest_gap(environment.free)
    assert found is None or found.width >= gap
    (free,) = environment.free.geoms
    room = free.buffer(-gap / 2.0 + 1e-6)
    assert room.geom_type == "Polygon" and len(room.interiors) == len(free.interiors)


@settings(max_examples=50)
@given(st.lists(st.tuples(st.floats(0, 10), st.floats(0, 10)), min_size=1, max_size=8, unique=True))
def test_tunnels_join_everything_and_there_are_no_more_than_that_takes(
    places: list[tuple[float, float]],
) -> None:
    parts = [Point(place).buffer(0.01) for place in places]
    parts = [*shapely.get_parts(shapely.union_all(parts))]
    tunnels = _tunnels(parts, np.random.default_rng(0))
    assert len(tunnels) == len(parts) - 1
    whole = shapely.union_all([*parts, *tunnels]).buffer(1e-6)
    assert whole.geom_type == "Polygon"


def test_a_window_is_passed_from_side_to_side() -> None:
    # two parts side by side; when they are widened by 1, they meet above each other in a window
    core = shapely.union_all([LineString([(0, 0), (0, 4)]), LineString([(1.8, 0), (1.8, 4)])])
    gap = Gap(0.9, ((0.9, 1.5), (0.9, 2.4)))
    line = shapely.get_coordinates(_through(gap, core, 1.0))
    np.testing.assert_allclose(line[line[:, 0].argsort()], [[0.0, 1.95], [0.9, 1.95], [1.8, 1.95]])


def test_where_there_is_nothing_on_one_side_the_window_itself_is_made_room_in() -> None:
    gap = Gap(0.9, ((0.9, 1.5), (0.9, 2.4)))
    assert _through(gap, LineString([(0, 0), (0, 4)]), 1.0) == Point(0.9, 1.95)
