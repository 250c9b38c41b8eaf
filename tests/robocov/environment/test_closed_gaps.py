"""Closed gaps: hand-made maps, and a comparison with the eroded free space on random ones."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.environment import CircleObstacle, Environment, PolygonObstacle, WallObstacle
from robocov.environment.obstacle_paths import ObstaclePath
from robocov.environment.obstacles import Obstacle
from robocov.errors import ParameterError
from robocov.geodesic import Geodesics

HALL = ((0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0))
RADIUS_M = 0.1


def build_hall(*obstacles: Obstacle) -> Environment:
    return Environment("hall", HALL, obstacles)


def build_box(low_x: float, low_y: float, high_x: float, high_y: float) -> PolygonObstacle:
    return PolygonObstacle(((low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y)))


def find_component(environment: Environment, x: float, y: float) -> int:
    is_inside = shapely.intersects_xy(np.array(environment.free.geoms), x, y)
    return int(np.flatnonzero(is_inside)[0])


def are_connected(environment: Environment, first: tuple[float, float], second: tuple[float, float]) -> bool:
    return find_component(environment, *first) == find_component(environment, *second)


def build_house() -> Environment:
    """Build three rooms: a door of 0.8 m leads into the second one, a crack of 0.1 m into the third."""
    return build_hall(
        build_box(3.0, 0.0, 3.2, 2.0),
        build_box(3.0, 2.8, 3.2, 6.0),
        build_box(7.0, 0.0, 7.2, 4.0),
        build_box(7.0, 4.1, 7.2, 6.0),
    )


def test_crack_is_closed_and_door_stays_open() -> None:
    house = build_house()
    assert are_connected(house, (1.0, 1.0), (9.0, 1.0))
    closed = house.close_gaps(RADIUS_M)
    assert are_connected(closed, (1.0, 1.0), (5.0, 1.0))
    assert not are_connected(closed, (5.0, 1.0), (9.0, 1.0))
    assert house.free_area - closed.free_area < 1e-5


@pytest.mark.parametrize("radius", [0.0, 0.05, 0.049])
def test_disc_that_fits_leaves_the_same_map(radius: float) -> None:
    house = build_house()
    assert house.close_gaps(radius) is house


def test_larger_disc_closes_the_door() -> None:
    closed = build_house().close_gaps(0.41)
    assert len(closed.free.geoms) == 3


@pytest.mark.parametrize(
    "obstacles",
    [
        (build_box(4.0, 0.0, 5.0, 2.0), build_box(5.1, 0.0, 6.0, 2.0)),  # a deep slot
        (build_box(4.0, 0.0, 5.0, 2.0), build_box(5.1, 0.0, 6.0, 2.0), build_box(5.0, 0.0, 5.1, 1.9)),
        (PolygonObstacle(((4.0, 0.0), (6.0, 3.0), (4.1, 0.0))), build_box(5.0, 0.0, 9.0, 1.0)),
        (build_box(4.0, 0.1, 5.0, 2.0), build_box(4.0, 0.0, 4.1, 0.1)),  # a slot below a box
    ],
)
def test_niches_stay_open(obstacles: tuple[Obstacle, ...]) -> None:
    hall = build_hall(*obstacles)
    closed = hall.close_gaps(RADIUS_M)
    assert len(closed.free.geoms) == len(hall.free.geoms) == 1


def test_paths_lead_around_a_box_near_the_wall() -> None:
    hall = build_hall(build_box(4.0, 0.05, 5.0, 2.0))
    left = [3.9, 0.02]
    right = [5.1, 0.02]
    slot = [4.5, 0.02]
    distances = Geodesics(hall.close_gaps(RADIUS_M)).compute_distances([left], [right, slot])
    assert distances[0, 0] > 4.0
    # The slot below the box is a niche that is open on one side.
    assert np.isfinite(distances[0, 1])
    assert Geodesics(hall).compute_distances([left], [right])[0, 0] < 1.3


def test_acute_corner_is_not_an_obstacle_to_the_bar() -> None:
    spike = PolygonObstacle(((5.0, 0.08), (5.4, 6.0), (5.3, 6.0)))
    closed = build_hall(spike).close_gaps(RADIUS_M)
    assert not are_connected(closed, (1.0, 1.0), (9.0, 1.0))


@pytest.mark.parametrize(("radius", "components"), [(0.06, 2), (0.08, 1)])
def test_a_courtyard_is_a_component_if_the_disc_fits_in_it(radius: float, components: int) -> None:
    pillars = [build_box(x, y, x + 0.2, y + 0.2) for x in (4.0, 4.3) for y in (2.0, 2.3)]
    closed = build_hall(*pillars).close_gaps(radius)
    # A small disc fits in the courtyard, but not through the gaps. For a larger one, it is a niche.
    assert len(closed.free.geoms) == components


def test_round_pillars_are_joined() -> None:
    pillars = [CircleObstacle((5.0, y), 0.45) for y in (0.5, 1.5, 2.5, 3.5, 4.5, 5.5)]
    closed = build_hall(*pillars).close_gaps(RADIUS_M)
    assert not are_connected(closed, (1.0, 1.0), (9.0, 1.0))


def test_moving_obstacles_stand_at_time_zero() -> None:
    moving = WallObstacle(((5.0, 0.1), (5.0, 6.0)), 0.2, path=ObstaclePath(((0.0, 0.0), (0.0, 2.0)), 1.0))
    hall = build_hall(moving)
    closed = hall.close_gaps(RADIUS_M)
    assert not closed.has_moving_obstacles
    assert len(closed.free.geoms) == 2
    later = hall.at(1.0)
    assert later.close_gaps(RADIUS_M) is later


@pytest.mark.parametrize("radius", [-0.1, np.nan, np.inf, "wide"])
def test_an_invalid_radius_is_rejected(radius: object) -> None:
    with pytest.raises(ParameterError, match="radius"):
        build_hall().close_gaps(radius)  # type: ignore[arg-type]


@st.composite
def draw_cluttered_halls(draw: st.DrawFn) -> Environment:
    """Draw halls with boxes at multiples of 5 cm, slanted quadrilaterals, and pillars."""
    obstacles: list[Obstacle] = []
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    for _ in range(draw(st.integers(1, 14))):
        kind = rng.integers(3)
        center = rng.uniform([0.0, 0.0], [10.0, 6.0])
        if kind == 0:
            low = np.round(center / 0.05) * 0.05
            size = rng.integers(1, 50, 2) * 0.05
            obstacles.append(build_box(*low.tolist(), *(low + size).tolist()))
        elif kind == 1:
            angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, 4))
            points = center + rng.uniform(0.5, 2.0) * np.column_stack([np.cos(angles), np.sin(angles)])
            obstacles.append(PolygonObstacle(tuple((x, y) for x, y in points.tolist())))
        else:
            obstacles.append(CircleObstacle(tuple(center.tolist()), float(rng.uniform(0.1, 1.0))))
    return build_hall(*obstacles)


@settings(deadline=None, max_examples=count_examples(60))
@given(draw_cluttered_halls(), st.sampled_from([0.05, 0.1, 0.3]))
def test_components_are_those_of_a_disc(hall: Environment, radius: float) -> None:
    # Erosion by 2% more and 2% less than the radius brackets the errors of both methods.
    reach_of_larger_disc = hall.free.buffer(-1.02 * radius, quad_segs=64)
    reach_of_smaller_disc = hall.free.buffer(-0.98 * radius, quad_segs=64)
    closed = np.array(hall.close_gaps(radius).free.geoms)
    parts_of_smaller_disc = shapely.get_parts(reach_of_smaller_disc)
    part_by_component: dict[int, int] = {}
    for part in shapely.get_parts(reach_of_larger_disc):
        point = part.point_on_surface()
        (component,) = np.flatnonzero(shapely.intersects(closed, point)).tolist()
        # What a larger disc can reach stays connected.
        assert shapely.covers(closed[component].buffer(1e-5), part)
        # What a smaller disc cannot reach is not connected.
        (smaller_part,) = np.flatnonzero(shapely.intersects(parts_of_smaller_disc, point)).tolist()
        part_by_component.setdefault(component, smaller_part)
        assert part_by_component[component] == smaller_part


@settings(deadline=None, max_examples=count_examples(30))
@given(draw_cluttered_halls())
def test_closed_gaps_take_hardly_any_area(hall: Environment) -> None:
    closed = hall.close_gaps(RADIUS_M)
    assert abs(hall.free_area - closed.free_area) < 1e-4
    # Closing once is enough: no component has another gap between parts where the disc fits.
    again = closed.close_gaps(RADIUS_M)
    assert len(again.free.geoms) == len(closed.free.geoms)
