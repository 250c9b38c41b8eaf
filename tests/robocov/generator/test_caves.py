"""Caves: connected free space inside rock, without passages narrower than the gap."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from shapely import LineString, Point
from shapely.geometry.base import BaseGeometry

from robocov.environment import Gap, PolygonObstacle, find_narrowest_gap
from robocov.generator import generate_map
from robocov.generator.caves import (
    build_gap_tunnel,
    build_tunnels,
    extract_area_below_zero,
    sample_random_field,
)
from robocov.generator.request import MapRequest
from robocov.typing import FloatArray

SEEDS = range(10)


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_rock_surrounds_the_cave_and_pillars_stand_apart(seed: int) -> None:
    environment = generate_map(seed, kind="caves")
    rock, *pillars = environment.obstacles
    assert isinstance(rock, PolygonObstacle)
    assert (rock.name, len(rock.holes), len(rock.vertices)) == ("rock", 1, 4)
    (free,) = environment.free.geoms
    low_x, low_y, high_x, high_y = free.bounds
    assert min(low_x, low_y) >= 0.12 - 1e-9
    assert max(high_x, high_y) <= 9.88 + 1e-9
    start = environment.starts["corner"]
    assert start.radius == 0.72
    assert free.contains(Point(start.center).buffer(start.radius))
    assert len(free.interiors) == len(pillars)
    for pillar in pillars:
        assert pillar.name == "pillar"
        assert pillar.polygon.distance(rock.polygon) >= 0.6
        assert pillar.polygon.area > 0.1


@pytest.mark.slow
def test_walls_are_smooth_and_have_few_vertices() -> None:
    for seed in SEEDS:
        (free,) = generate_map(seed, kind="caves").free.geoms
        rings = [np.asarray(ring.coords)[:-1] for ring in (free.exterior, *free.interiors)]
        assert sum(map(len, rings)) < 200
        ring_turns = []
        for ring in rings:
            step = np.roll(ring, -1, axis=0) - ring
            angle = np.arctan2(step[:, 1], step[:, 0])
            ring_turns.append(np.abs((np.roll(angle, -1) - angle + np.pi) % (2.0 * np.pi) - np.pi))
        turns = np.degrees(np.concatenate(ring_turns))
        # At a vertex a wall turns by less than 30 degrees on average; spikes are rare.
        assert turns.mean() < 30.0
        assert (turns > 100.0).mean() < 0.02


@pytest.mark.slow
def test_caves_have_chambers_and_tunnels_and_sometimes_pillars() -> None:
    chamber_counts = []
    pillar_count = 0
    for seed in range(20):
        environment = generate_map(seed, kind="caves")
        (free,) = environment.free.geoms
        pillar_count += len(free.interiors)
        # A disc of twice the gap does not fit through the tunnels between chambers.
        chamber_counts.append(len(shapely.get_parts(free.buffer(-0.6))))
    assert pillar_count >= 10
    assert sum(count > 1 for count in chamber_counts) >= 10


@pytest.mark.slow
@settings(max_examples=count_examples(25))
@given(
    st.integers(0, 2**32),
    st.sampled_from([2, 8, 30]),
    st.floats(0.3, 0.7),
    st.sampled_from([0.22, 0.3, 0.5, 0.9, 1.4]),
)
def test_no_passage_is_narrower_than_the_gap(seed: int, chambers: int, area: float, gap: float) -> None:
    environment = generate_map(seed, kind="caves", obstacles=chambers, area=area, gap=gap, width=12, height=9)
    narrowest = find_narrowest_gap(environment.free)
    assert narrowest is None or narrowest.width >= gap
    (free,) = environment.free.geoms
    room = free.buffer(-gap / 2.0 + 1e-6)
    assert room.geom_type == "Polygon"
    assert len(room.interiors) == len(free.interiors)


@settings(max_examples=count_examples(50))
@given(st.lists(st.tuples(st.floats(0, 10), st.floats(0, 10)), min_size=1, max_size=8, unique=True))
def test_tunnels_join_all_parts_without_loops(
    centers: list[tuple[float, float]],
) -> None:
    parts = [Point(center).buffer(0.01) for center in centers]
    parts = [*shapely.get_parts(shapely.union_all(parts))]
    lines = build_tunnels(np.array(parts), np.random.default_rng(0))
    assert len(lines) == len(parts) - 1
    union = shapely.union_all([*parts, *lines]).buffer(1e-6)
    assert union.geom_type == "Polygon"


def test_a_tunnel_leads_through_a_narrow_gap_from_part_to_part() -> None:
    # Two parallel lines that are dilated by 1 meet in a narrow gap.
    core = shapely.union_all([LineString([(0, 0), (0, 4)]), LineString([(1.8, 0), (1.8, 4)])])
    gap = Gap(0.9, ((0.9, 1.5), (0.9, 2.4)))
    line = shapely.get_coordinates(build_gap_tunnel(gap, core, 1.0))
    np.testing.assert_allclose(line[line[:, 0].argsort()], [[0.0, 1.95], [0.9, 1.95], [1.8, 1.95]])


def test_a_gap_without_a_part_of_the_core_on_one_side_is_widened() -> None:
    gap = Gap(0.9, ((0.9, 1.5), (0.9, 2.4)))
    assert build_gap_tunnel(gap, LineString([(0, 0), (0, 4)]), 1.0) == Point(0.9, 1.95)


REQUEST = MapRequest(9, 0.4, 0.6, 12.0, 9.0)


def extract_area_below(
    function: Callable[[FloatArray, FloatArray], FloatArray], level: float
) -> BaseGeometry:
    points = np.stack(np.meshgrid(*[np.linspace(0.0, 10.0, 101)] * 2), axis=-1)
    return extract_area_below_zero(points, function(points[..., 0], points[..., 1]) - level)


def test_the_area_below_a_level_of_a_cone_is_a_disc() -> None:
    (disc,) = shapely.get_parts(extract_area_below(lambda x, y: np.hypot(x - 5.0, y - 4.0), 2.0))
    assert disc.area == pytest.approx(4.0 * np.pi, rel=2e-3)
    assert disc.hausdorff_distance(shapely.Point(5, 4).buffer(2.0, quad_segs=64)) < 0.01


def test_rings_have_holes_and_islands_in_holes_are_parts() -> None:
    waves = extract_area_below(lambda x, y: np.cos(np.hypot(x - 5.0, y - 5.0) * 3.0), 0.0)
    # The waves are below zero from pi/6 to 3 pi/6, from 5 pi/6 to 7 pi/6, and beyond 9 pi/6.
    parts = sorted(shapely.get_parts(waves), key=lambda part: part.area)
    rings = [part for part in parts if part.interiors]
    for ring, (low, high) in zip(rings, ((1, 3), (5, 7)), strict=False):
        assert len(ring.interiors) == 1
        assert ring.area == pytest.approx(np.pi * (high**2 - low**2) * (np.pi / 6.0) ** 2, rel=0.01)


def test_the_edge_of_the_mesh_is_above_every_level() -> None:
    (area,) = shapely.get_parts(extract_area_below(lambda x, y: x * 0.0 - 5.0, 0.0))
    low_x, low_y, high_x, high_y = area.bounds
    assert 0.0 < low_x < 0.1
    assert 0.0 < low_y < 0.1
    assert 9.9 < high_x < 10.0
    assert 9.9 < high_y < 10.0
    assert extract_area_below(lambda x, y: x * 0.0 - 5.0, -6.0).is_empty


@settings(max_examples=count_examples(30))
@given(st.integers(0, 2**32), st.floats(-1.0, 1.0))
def test_points_of_the_mesh_with_lower_values_are_in_the_area(seed: int, level: float) -> None:
    points, values = sample_random_field(REQUEST, np.random.default_rng(seed))
    area = extract_area_below_zero(points, values - level)
    assert area.is_valid
    inner = points[1:-1, 1:-1].reshape(-1, 2)
    is_inside = shapely.contains_xy(area, inner[:, 0], inner[:, 1])
    np.testing.assert_array_equal(is_inside, values[1:-1, 1:-1].ravel() < level)


def test_a_field_has_mean_zero_and_variance_one_and_is_smooth() -> None:
    fields = [sample_random_field(REQUEST, np.random.default_rng(seed)) for seed in range(40)]
    values = np.stack([field for _, field in fields])
    assert abs(values.mean()) < 0.1
    assert values.var() == pytest.approx(1.0, abs=0.15)
    points, first_values = fields[0]
    assert points[-1, -1].tolist() == [12.0, 9.0]
    # The shortest waves are eight steps of the mesh long.
    assert np.abs(np.diff(values, axis=2)).std() < 0.5
    assert first_values.min() < -1.0
    assert first_values.max() > 1.0
