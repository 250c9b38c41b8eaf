"""Moving obstacles: pushing robots, walls that stop them, sensing, and the coverage cost."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.controllers import Lloyd, Rapf
from robocov.cost import CoverageCost, TimeVaryingCost
from robocov.environment import CircleObstacle, Environment, ObstaclePath, PolygonObstacle, WallObstacle
from robocov.errors import StartError
from robocov.metrics import MAX_RATE_WITH_MOVING_OBSTACLES_HZ, compute_clearances, compute_cost_history
from robocov.simulation import Simulation, TeamState
from robocov.team import Team
from robocov.world import MAX_PENETRATION_M

IDLE = Rapf(k_rep=0.0, k_att=0.0)


def build_box(
    x: float, y: float, width: float, height: float, path: ObstaclePath | None = None
) -> PolygonObstacle:
    corners = ((x, y), (x + width, y), (x + width, y + height), (x, y + height))
    return PolygonObstacle(corners, path=path)


def build_press(speed: float, wall_thickness: float = 0.02) -> Environment:
    """Build a room in which a plate moves to a thin wall and back."""
    path = ObstaclePath(((0, 0), (2.6, 0)), speed, "back-and-forth")
    wall = WallObstacle(((3, 0), (3, 2)), wall_thickness)
    plate = build_box(0.2, 0.05, 0.2, 1.9, path)
    return Environment("press", ((0, 0), (4, 0), (4, 2), (0, 2)), (wall, plate))


CART_PATH = ObstaclePath(((2, 1), (8, 1)), 0.5, "back-and-forth")
HALL = Environment(
    "hall",
    ((0, 0), (10, 0), (10, 6), (0, 6)),
    (WallObstacle(((5, 2), (5, 6)), 0.1), CircleObstacle((2, 1), 0.6, "cart", CART_PATH)),
)


def test_a_moving_obstacle_pushes_a_robot() -> None:
    simulation = Simulation(build_press(0.5), IDLE, [[1.0, 1.0]])
    for _ in range(180):
        simulation.step()
    # The face of the plate has moved from 0.4 m to 1.9 m.
    assert simulation.positions[0, 0] == pytest.approx(0.4 + 0.5 * simulation.time + 0.1, abs=3e-3)


@settings(max_examples=count_examples(8))
@given(
    speed=st.sampled_from([1.0, 3.0]),
    wall_thickness=st.sampled_from([0.004, 0.02, 0.3]),
    starts=st.lists(st.tuples(st.floats(0.6, 2.6), st.floats(0.15, 1.85)), min_size=1, max_size=4),
    uses_lloyd=st.booleans(),
)
def test_robots_are_pushed_neither_into_nor_through_walls(
    speed: float, wall_thickness: float, starts: list[tuple[float, float]], uses_lloyd: bool
) -> None:
    environment = build_press(speed, wall_thickness)
    controller = Lloyd() if uses_lloyd else Rapf()
    try:
        simulation = Simulation(environment, controller, np.array(starts), dt=1 / 30)
    except StartError:
        return
    rooms = environment.static.free.geoms
    left_room = next(room for room in rooms if room.contains(shapely.Point(1.5, 1.0)))
    for _ in range(int(1.2 * 5.2 / speed * 30) + 1):
        simulation.step()
        points = shapely.points(simulation.positions)
        assert shapely.contains(left_room, points).all()
        assert shapely.distance(left_room.boundary, points).min() > 0.1 - 3e-3
    assert np.isfinite(simulation.velocities).all()


@pytest.mark.parametrize("speed", [0.5, 2.0])
def test_a_robot_that_is_pushed_into_a_corner_stays_in_front_of_both_walls(speed: float) -> None:
    path = ObstaclePath(((2.0, 2.0), (3.9, 3.9)), speed)
    cart = CircleObstacle((2, 2), 0.4, path=path)
    corner = Environment("corner", ((0, 0), (4, 0), (4, 4), (0, 4)), (cart,))
    simulation = Simulation(corner, IDLE, [[2.9, 2.9]])
    for _ in range(int(3.0 / speed * 60)):
        simulation.step()
        assert simulation.positions.max() <= 3.9 + MAX_PENETRATION_M
    assert simulation.positions.max() > 3.89


@pytest.mark.parametrize("dt", [1 / 60, 0.2, 1.0])
def test_fast_thin_obstacles_do_not_jump_over_small_robots(dt: float) -> None:
    """In 0.02 s the plate covers more than its thickness and the diameter of the robot together."""
    path = ObstaclePath(((0.0, 0.0), (30.0, 0.0)), 5.0)
    plate = build_box(0.5, 0.2, 0.02, 1.6, path)
    corridor = Environment("corridor", ((0, 0), (40, 0), (40, 2), (0, 2)), (plate,))
    team = Team.homogeneous(1, radius=0.02)
    simulation = Simulation(corridor, IDLE, [[1.04, 1.0]], team, dt)
    for _ in range(round(3.0 / dt)):
        simulation.step()
        front = 0.52 + 5.0 * simulation.time
        assert simulation.positions[0, 0] > front
    assert simulation.positions[0, 0] < front + 0.05


@pytest.mark.parametrize("wall_thickness", [0.004, 0.02])
def test_robots_are_not_pushed_through_a_wall_that_an_obstacle_passes(wall_thickness: float) -> None:
    """The plate runs over the robot, which is then closer to the side beyond the wall."""
    path = ObstaclePath(((0, 0), (3.0, 0)), 0.5)
    wall = WallObstacle(((3, 0), (3, 2)), wall_thickness)
    plate = build_box(0.2, 0.05, 0.4, 1.9, path)
    rooms = Environment("rooms", ((0, 0), (5, 0), (5, 2), (0, 2)), (wall, plate))
    simulation = Simulation(rooms, IDLE, [[2.5, 1.0]])
    for _ in range(60 * 7):
        simulation.step()
        assert simulation.positions[0, 0] <= 3.0 - wall_thickness / 2 - 0.1 + MAX_PENETRATION_M


def test_robots_that_were_run_over_come_out_again() -> None:
    simulation = Simulation(build_press(0.5), IDLE, [[2.0, 1.0]])
    for _ in range(int(5.2 * 60)):
        simulation.step()
    # Now the face of the plate touches the wall.
    free = simulation.environment.at(simulation.time).free
    assert not free.contains(shapely.Point(simulation.positions[0]))
    for _ in range(2 * 60):
        simulation.step()
    free = simulation.environment.at(simulation.time).free
    assert free.buffer(-0.095).contains(shapely.Point(simulation.positions[0]))


def test_the_sensor_finds_moving_obstacles_at_their_present_position() -> None:
    simulation = Simulation(HALL, IDLE, [[4.0, 2.0]])
    steps_next_to_cart = 0
    for _ in range(240):
        position = simulation.positions[0]
        cart = HALL.at(simulation.time).obstacles[1]
        line = shapely.shortest_line(shapely.Point(position), cart.polygon)
        nearest = np.asarray(line.coords)[1]
        if np.hypot(*(nearest - position)) < 0.9:  # closer than the wall
            np.testing.assert_allclose(simulation.observe().obstacle_points[0], nearest, atol=2e-3)
            steps_next_to_cart += 1
        simulation.step()
    assert steps_next_to_cart > 30


def test_scans_hit_moving_obstacles_at_their_present_position() -> None:
    simulation = Simulation(HALL, Rapf(), [[4.0, 1.0]])
    distances, _ = simulation.sensor.scan_from(simulation.positions[0], 4, 3.0)
    assert distances[2] == pytest.approx(1.4, abs=2e-3)
    for _ in range(60):
        simulation.step(forces=np.zeros((1, 2)))
    distances, _ = simulation.sensor.scan_from(simulation.positions[0], 4, 3.0)
    assert distances[2] == pytest.approx(0.9, abs=2e-3)


def test_copies_have_moving_obstacles_of_their_own() -> None:
    original = Simulation(HALL, Lloyd(), [[1.0, 3.0], [3.5, 1.0], [3.0, 4.0]])
    for _ in range(100):
        original.step()
    twin = original.copy()
    positions = {}
    for name, simulation in (("original", original), ("twin", twin)):
        positions[name] = [simulation.positions]
        for _ in range(80):
            simulation.step()
            positions[name].append(simulation.positions)
    np.testing.assert_array_equal(positions["twin"], positions["original"])


def test_simulations_that_start_later_have_obstacles_at_that_time() -> None:
    with pytest.raises(StartError, match=r"starts\[0\] = \[4, 1\] is inside an obstacle"):
        Simulation(HALL, Rapf(), TeamState([[4.0, 1.0]], steps=240))
    Simulation(HALL, Rapf(), TeamState([[4.0, 1.0]], steps=0))
    Simulation(HALL, Rapf(), TeamState([[2.0, 1.0]], steps=240))


def test_the_cost_history_uses_the_map_of_each_time() -> None:
    record = Simulation(HALL, Rapf(), [[1.0, 3.0], [7.0, 3.0], [3.0, 4.0]]).run(3.0)
    history = compute_cost_history(record, CoverageCost(HALL, 24), 10.0)
    np.testing.assert_allclose(np.diff(history.time), 1.0 / MAX_RATE_WITH_MOVING_OBSTACLES_HZ)
    for time, mean_distance in zip(history.time.tolist(), history.mean_distance.tolist(), strict=True):
        result = CoverageCost(HALL.at(time), 24)(record.positions[round(time * 60)])
        assert mean_distance == result.mean_distance


def test_costs_of_recurring_maps_are_computed_once() -> None:
    cost = TimeVaryingCost(CoverageCost(HALL, 8))
    assert cost.get_cost(3.0) is cost.get_cost(3.0 + 24.0)
    assert cost.get_cost(3.0) is not cost.get_cost(3.5)


def test_robots_that_are_run_over_do_not_count() -> None:
    cost = TimeVaryingCost(CoverageCost(HALL, 16))
    positions = np.array([[2.0, 1.0], [8.0, 4.0]])  # The first one is under the cart.
    assert cost.find_available_robots(0.0, positions).tolist() == [False, True]
    assert cost.find_available_robots(6.0, positions).tolist() == [True, True]
    result = cost(0.0, positions)
    assert result is not None
    assert result.positions.tolist() == [[8.0, 4.0]]
    mean_distance, _, uncovered_area = cost.compute_summary(0.0, positions[:1])
    assert np.isnan(mean_distance)
    assert uncovered_area == pytest.approx(HALL.free_area)


def test_clearance_is_measured_to_the_obstacle_at_that_time() -> None:
    record = Simulation(HALL, IDLE, [[5.0, 1.0]]).run(4.0)
    clearance = compute_clearances(record)[:60, 0]
    # The cart approaches from 2.3 m at 0.5 m/s; the wall is 0.9 m away.
    np.testing.assert_allclose(clearance, np.minimum(2.3 - 0.5 * record.time[:60], 0.9), atol=2e-3)
