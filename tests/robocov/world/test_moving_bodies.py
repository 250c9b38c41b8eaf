"""Obstacles that move: what they push, what stops it, and what the robots sense of them."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.controllers import Lloyd, Rapf
from robocov.cost import CoverageCost, TimeVaryingCost
from robocov.environment import CircleObstacle, Environment, ObstaclePath, PolygonObstacle, WallObstacle
from robocov.errors import StartError
from robocov.metrics import MAX_RATE_WITH_MOVING_OBSTACLES_HZ, compute_clearances, compute_cost_history
from robocov.simulation import Simulation, TeamState
from robocov.world import MAX_PENETRATION


def box(x: float, y: float, width: float, height: float, path: ObstaclePath | None = None) -> PolygonObstacle:
    corners = ((x, y), (x + width, y), (x + width, y + height), (x, y + height))
    return PolygonObstacle(corners, path=path)


def press(speed: float, wall: float = 0.02) -> Environment:
    """A plate that goes to a thin wall and back."""
    path = ObstaclePath(((0, 0), (2.6, 0)), speed, "back-and-forth")
    shapes = (WallObstacle(((3, 0), (3, 2)), wall), box(0.2, 0.05, 0.2, 1.9, path))
    return Environment("press", ((0, 0), (4, 0), (4, 2), (0, 2)), shapes)


HALL = Environment(
    "hall",
    ((0, 0), (10, 0), (10, 6), (0, 6)),
    (
        WallObstacle(((5, 2), (5, 6)), 0.1),
        CircleObstacle((2, 1), 0.6, "cart", ObstaclePath(((2, 1), (8, 1)), 0.5, "back-and-forth")),
    ),
)


def test_a_robot_is_pushed_along() -> None:
    one = Simulation(press(0.5), Rapf(k_rep=0.0, k_att=0.0), [[1.0, 1.0]])
    for _ in range(180):
        one.step()
    # the plate's face has come from 0.4 m to 1.9 m
    assert one.positions[0, 0] == pytest.approx(0.4 + 0.5 * one.time + 0.1, abs=3e-3)


@settings(max_examples=8)
@given(
    st.sampled_from([1.0, 3.0]),
    st.sampled_from([0.004, 0.02, 0.3]),
    st.lists(st.tuples(st.floats(0.6, 2.6), st.floats(0.15, 1.85)), min_size=1, max_size=4),
    st.booleans(),
)
def test_nobody_is_pushed_into_a_wall_or_through_one(
    speed: float, wall: float, starts: list[tuple[float, float]], lloyd: bool
) -> None:
    environment = press(speed, wall)
    places = np.array(starts)
    try:
        one = Simulation(environment, Lloyd() if lloyd else Rapf(), places, dt=1 / 30)
    except StartError:
        return
    walls = environment.static.free.geoms
    side = next(part for part in walls if part.contains(shapely.Point(1.5, 1.0)))
    for _ in range(int(1.2 * 5.2 / speed * 30) + 1):
        one.step()
        for place in one.positions:
            assert side.contains(shapely.Point(place))
            assert side.boundary.distance(shapely.Point(place)) > 0.1 - 3e-3
    assert np.isfinite(one.velocities).all()


@pytest.mark.parametrize("speed", [0.5, 2.0])
def test_a_robot_that_is_pushed_into_a_corner_stays_in_front_of_both_walls(speed: float) -> None:
    route = ObstaclePath(((2.0, 2.0), (3.9, 3.9)), speed)
    corner = Environment(
        "corner", ((0, 0), (4, 0), (4, 4), (0, 4)), (CircleObstacle((2, 2), 0.4, path=route),)
    )
    simulation = Simulation(corner, Rapf(), [[2.9, 2.9]])
    for _ in range(int(3.0 / speed * 60)):
        simulation.step(forces=np.zeros((1, 2)))
        assert simulation.positions.max() <= 3.9 + MAX_PENETRATION
    assert simulation.positions.max() > 3.89


def test_who_was_run_over_comes_out_again() -> None:
    one = Simulation(press(0.5), Rapf(k_rep=0.0, k_att=0.0), [[2.0, 1.0]])
    for _ in range(int(5.2 * 60)):
        one.step()  # the plate is where its face touches the wall
    under = one.environment.at(one.time)
    assert not under.free.contains(shapely.Point(one.positions[0]))
    for _ in range(2 * 60):
        one.step()
    gone = one.environment.at(one.time)
    assert gone.free.buffer(-0.095).contains(shapely.Point(one.positions[0]))


def test_the_sensor_sees_it_where_it_is() -> None:
    one = Simulation(HALL, Rapf(k_rep=0.0, k_att=0.0), [[4.0, 2.0]])
    close = 0
    for _ in range(240):
        seen = one.observe()
        cart = HALL.at(one.time).obstacles[1]
        nearest = shapely.shortest_line(shapely.Point(one.positions[0]), cart.polygon)
        there = np.asarray(nearest.coords)[1]
        if np.hypot(*(there - one.positions[0])) < 0.9:  # nearer than the wall
            np.testing.assert_allclose(seen.obstacle_points[0], there, atol=2e-3)
            close += 1
        one.step()
    assert close > 30


def test_scans_see_it_where_it_is() -> None:
    one = Simulation(HALL, Rapf(), [[4.0, 1.0]])
    before, _ = one.sensor.scan_from(one.positions[0], 4, 3.0)
    assert before[2] == pytest.approx(1.4, abs=2e-3)
    for _ in range(60):
        one.step(forces=np.zeros((1, 2)))
    after, _ = one.sensor.scan_from(one.positions[0], 4, 3.0)
    assert after[2] == pytest.approx(0.9, abs=2e-3)


def test_copies_share_no_time() -> None:
    one = Simulation(HALL, Lloyd(), [[1.0, 3.0], [3.5, 1.0], [3.0, 4.0]])
    for _ in range(100):
        one.step()
    twin = one.copy()
    expected = [one.positions.tobytes()]
    for _ in range(80):
        one.step()
        expected.append(one.positions.tobytes())
    found = [twin.positions.tobytes()]
    for _ in range(80):
        twin.step()
        found.append(twin.positions.tobytes())
    assert found == expected


def test_a_simulation_that_begins_later_has_the_obstacles_where_they_are_then() -> None:
    with pytest.raises(StartError, match=r"starts\[0\] = \[4, 1\] is inside an obstacle"):
        Simulation(HALL, Rapf(), TeamState([[4.0, 1.0]], steps=240))
    Simulation(HALL, Rapf(), TeamState([[4.0, 1.0]], steps=0))
    Simulation(HALL, Rapf(), TeamState([[2.0, 1.0]], steps=240))


def test_cost_is_of_the_map_as_it_is() -> None:
    record = Simulation(HALL, Rapf(), [[1.0, 3.0], [7.0, 3.0], [3.0, 4.0]]).run(3.0)
    history = compute_cost_history(record, CoverageCost(HALL, 24), 10.0)
    np.testing.assert_allclose(np.diff(history.time), 1.0 / MAX_RATE_WITH_MOVING_OBSTACLES_HZ)
    for time, mean in zip(history.time.tolist(), history.mean_distance.tolist(), strict=True):
        k = round(time * 60)
        assert mean == CoverageCost(HALL.at(time), 24)(record.positions[k]).mean_distance


def test_the_cost_of_a_place_that_comes_by_again_is_known() -> None:
    momentary = TimeVaryingCost(CoverageCost(HALL, 8))
    assert momentary.get_cost(3.0) is momentary.get_cost(3.0 + 24.0)
    assert momentary.get_cost(3.0) is not momentary.get_cost(3.5)
    standing = CoverageCost(HALL.static, 8)
    assert TimeVaryingCost(standing).get_cost(9.0) is standing


def test_who_is_run_over_covers_nothing() -> None:
    cost = TimeVaryingCost(CoverageCost(HALL, 16))
    places = np.array([[2.0, 1.0], [8.0, 4.0]])  # the first is where the cart is
    assert cost.find_counted_robots(0.0, places).tolist() == [False, True]
    assert cost.find_counted_robots(6.0, places).tolist() == [True, True]
    result = cost(0.0, places)
    assert result is not None
    assert result.positions.tolist() == [[8.0, 4.0]]
    alone = cost.compute_figures(0.0, places[:1])
    assert np.isnan(alone[0])
    assert alone[2] == pytest.approx(HALL.free_area)


def test_clearance_is_to_where_it_was() -> None:
    record = Simulation(HALL, Rapf(k_rep=0.0, k_att=0.0), [[5.0, 1.0]]).run(4.0)
    gap = compute_clearances(record)[:, 0]
    # the cart's rim comes from 2.6 m at half a metre a second, then it pushes
    np.testing.assert_allclose(gap[:60], np.minimum(2.3 - 0.5 * record.time[:60], 0.9), atol=2e-3)
