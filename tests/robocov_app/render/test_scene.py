"""Scenes of records, and the points that robots have sensed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.conditions import Conditions
from robocov.controllers import Rapf
from robocov.environment import CircleObstacle, Environment, ObstaclePath
from robocov.record import Record
from robocov.simulation import Simulation
from robocov.team import Team
from robocov_app.figures.map_pages import plot_trajectories
from robocov_app.look.theme import LIGHT
from robocov_app.render import sensed_points
from robocov_app.render.layer_catalog import build_standard_layers
from robocov_app.render.painter import Painter
from robocov_app.render.record_scene import build_record_scene
from robocov_app.render.sensed_points import CELL_SIZE_M, SensedPoints
from robocov_app.runs.frames import draw_frames
from robocov_app.runs.settings import VideoSettings

CART = CircleObstacle((1.0, 3.0), 0.4, "cart", ObstaclePath(((1, 3), (5, 3)), 2.0, "back-and-forth"))
HALL = Environment("hall", ((0, 0), (6, 0), (6, 4), (0, 4)), (CART,))
STARTS = np.array([[1.0, 1.0], [2.0, 1.5], [4.0, 1.0], [5.0, 1.2]])


FAILURE_ROW = 10
"""Row of the record at which robot 2 fails."""
LAST_ROW = 30


@pytest.fixture(scope="module")
def record() -> Record:
    """A run in which robot 2 fails at 0.5 s and robot 3 joins at 0.8 s."""
    team = Team.homogeneous(4, communication_range=3.0)
    conditions = Conditions(failures=((2, 0.5),), joins=((3, 0.8, (4.5, 2.0)),))
    return Simulation(HALL, Rapf(), STARTS, team, 0.05, conditions=conditions).run(1.5)


@pytest.mark.parametrize(
    ("row", "numbers"), [(0, (1, 2, 4)), (FAILURE_ROW + 2, (1, 4)), (LAST_ROW, (1, 3, 4))]
)
def test_a_scene_has_the_working_robots_and_their_cells(
    record: Record, row: int, numbers: tuple[int, ...]
) -> None:
    scene = build_record_scene(record, row)
    assert scene.numbers == numbers
    assert scene.snapshot is not None
    robots = np.array(numbers) - 1
    assert (scene.snapshot.positions == record.positions[row, robots]).all()
    assert scene.cells is not None
    assert len(scene.cells) == len(numbers)
    assert len(scene.team) == len(numbers)


def test_a_scene_has_the_failed_robots_and_their_positions(record: Record) -> None:
    assert build_record_scene(record, 0).failed == {}
    row = FAILURE_ROW + 2
    position = record.positions[row, 1]
    assert build_record_scene(record, row).failed == {2: tuple(position.tolist())}


@pytest.mark.parametrize("row", [0, FAILURE_ROW + 2, LAST_ROW])
def test_a_scene_has_the_obstacles_of_its_time(record: Record, row: int) -> None:
    (cart,) = build_record_scene(record, row).environment.obstacles
    assert isinstance(cart, CircleObstacle)
    assert cart.center[0] == pytest.approx(1.0 + 2.0 * float(record.time[row]))


def test_neighbors_are_those_of_the_record(record: Record) -> None:
    """Neighbors in a scene are numbered without the robots that do not work."""
    scene = build_record_scene(record, LAST_ROW)
    assert scene.snapshot is not None
    robots = np.array(scene.numbers) - 1
    in_record = np.column_stack(record.snapshot(LAST_ROW).seen.neighbors.list_pairs())
    in_scene = np.column_stack(scene.snapshot.seen.neighbors.list_pairs())
    assert sorted(robots[in_scene].tolist()) == sorted(in_record.tolist())


def test_a_robot_has_no_trail_before_it_joins(record: Record) -> None:
    scene = build_record_scene(record, LAST_ROW)
    assert scene.trail is not None
    assert scene.starts is not None
    start_of_robot_3 = scene.starts[1]
    assert start_of_robot_3.tolist() == pytest.approx([4.5, 2.0], abs=0.05)
    assert (scene.trail[:15, 1] == start_of_robot_3).all()


def test_a_changing_team_can_be_drawn_in_a_video(record: Record) -> None:
    settings = VideoSettings(colors="robots")
    rows = np.array([0, FAILURE_ROW + 2, LAST_ROW])
    frames = {frame.tobytes() for frame in draw_frames(record, settings, size=(320, 240), rows=rows)}
    assert len(frames) == 3


def test_a_figure_of_a_changing_team_has_the_numbers_of_all_robots(record: Record) -> None:
    figure = plot_trajectories(record)
    texts = {text.get_text() for axes in figure.axes for text in axes.texts}
    assert {"1", "2", "3", "4"} <= texts


def test_the_map_is_drawn_after_all_robots_have_failed() -> None:
    conditions = Conditions(failures=((1, 0.1), (2, 0.1)))
    record = Simulation(HALL, Rapf(), STARTS[:2], conditions=conditions).run(0.5)
    scene = build_record_scene(record, len(record) - 1)
    assert scene.snapshot is None
    assert list(scene.failed) == [1, 2]
    painter = Painter(HALL, (320, 240), LIGHT, build_standard_layers(), 1.0)
    assert painter.render_frame(scene).std() > 0
    assert plot_trajectories(record).axes


def test_a_scene_of_ideal_conditions_has_the_whole_map_and_team() -> None:
    record = Simulation(HALL.static, Rapf(), STARTS).run(0.1)
    scene = build_record_scene(record, 3)
    assert scene.numbers is None
    assert scene.environment is record.environment
    assert scene.team is record.team


NOTHING = (np.nan, np.nan)
"""The point of a robot that senses no obstacle."""


def sense_ten_points() -> SensedPoints:
    """Return the points (k, 0) m that robot 1 senses at k seconds, for k from 0 to 9."""
    sensed = SensedPoints()
    for k in range(10):
        sensed.add(float(k), (1,), np.array([[float(k), 0.0]]))
    return sensed


class TestSensedPoints:
    def test_points_have_the_numbers_of_their_robots(self) -> None:
        sensed = SensedPoints()
        sensed.add(0.0, (1, 4), np.array([[1.0, 1.0], [2.0, 2.0]]))
        sensed.add(0.5, (1, 4), np.array([[1.5, 1.0], NOTHING]))
        points, robots = sensed.get_until(1.0)
        assert len(sensed) == 3
        assert points.tolist() == [[1.0, 1.0], [2.0, 2.0], [1.5, 1.0]]
        assert robots.tolist() == [1, 4, 1]

    def test_each_robot_stores_one_point_per_square(self) -> None:
        sensed = SensedPoints()
        for k in range(50):
            sensed.add(k / 60, (1, 2), np.full((2, 2), CELL_SIZE_M * (3.1 + 0.01 * k)))
        points, _ = sensed.get_until(9.0)
        assert points == pytest.approx(np.full((2, 2), CELL_SIZE_M * 3.1))
        sensed.add(1.0, (1, 2), np.full((2, 2), CELL_SIZE_M * 4.1))
        assert len(sensed) == 4

    def test_squares_on_both_sides_of_an_axis_differ(self) -> None:
        sensed = SensedPoints()
        sensed.add(2.0, (1,), np.array([[0.4 * CELL_SIZE_M, 0.4 * CELL_SIZE_M]]))
        sensed.add(2.0, (1,), np.array([[-0.4 * CELL_SIZE_M, 0.4 * CELL_SIZE_M]]))
        assert len(sensed) == 2

    def test_robots_that_sense_nothing_add_no_points(self) -> None:
        sensed = SensedPoints()
        sensed.add(0.0, (1, 2), np.array([NOTHING, NOTHING]))
        sensed.add(0.0, (), np.empty((0, 2)))
        points, robots = sensed.get_until(1.0)
        assert len(sensed) == 0
        assert points.shape == (0, 2)
        assert robots.shape == (0,)

    @pytest.mark.parametrize(("time", "n_points"), [(-0.5, 0), (0.0, 1), (4.5, 5), (1e9, 10)])
    def test_only_points_sensed_until_a_time_are_returned(self, time: float, n_points: int) -> None:
        points, _ = sense_ten_points().get_until(time)
        assert points[:, 0].tolist() == list(range(n_points))

    def test_removed_points_can_be_sensed_again(self) -> None:
        sensed = sense_ten_points()
        sensed.remove_after(4.0)
        assert len(sensed) == 5
        sensed.add(6.0, (1,), np.array([[9.0, 0.0]]))
        points, _ = sensed.get_until(9.0)
        assert points[:, 0].tolist() == [0, 1, 2, 3, 4, 9]

    def test_points_that_were_not_removed_are_not_sensed_again(self) -> None:
        sensed = sense_ten_points()
        sensed.remove_after(4.0)
        sensed.add(5.0, (1,), np.array([[3.0, 0.0]]))
        assert len(sensed) == 5

    def test_a_copy_is_independent(self) -> None:
        sensed = SensedPoints()
        sensed.add(0.0, (1,), np.array([[1.0, 1.0]]))
        twin = sensed.copy()
        twin.add(1.0, (1,), np.array([[2.0, 1.0]]))
        twin.remove_after(-1.0)
        twin.add(2.0, (7,), np.array([[5.0, 5.0]]))
        points, robots = sensed.get_until(9.0)
        assert points.tolist() == [[1.0, 1.0]]
        assert robots.tolist() == [1]
        _, robots_of_twin = twin.get_until(9.0)
        assert robots_of_twin.tolist() == [7]
        # The original still knows that it has sensed this point.
        sensed.add(3.0, (1,), np.array([[1.0, 1.0]]))
        assert len(sensed) == 1

    def test_the_number_of_points_is_limited(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(sensed_points, "MAX_POINTS", 1000)
        sensed = SensedPoints()
        for k in range(3000):
            sensed.add(float(k), (1, 2), np.array([[float(k), 0.0], [0.0, float(k)]]))
        points, _ = sensed.get_until(1e9)
        assert len(sensed) == 1000
        assert points[-1].tolist() == [0.0, 499.0]


class PlainSensedPoints:
    """A slow but simple model of `SensedPoints`: a list of times, robots and points."""

    def __init__(self) -> None:
        self.entries: list[tuple[float, int, tuple[float, float]]] = []

    def is_known(self, number: int, point: tuple[float, float]) -> bool:
        square = np.floor(np.array(point) / CELL_SIZE_M)
        for _, known_number, known_point in self.entries:
            known_square = np.floor(np.array(known_point) / CELL_SIZE_M)
            if number == known_number and (square == known_square).all():
                return True
        return False

    def add(self, time: float, number: int, point: tuple[float, float]) -> None:
        if not np.isnan(point).any() and not self.is_known(number, point):
            self.entries.append((time, number, point))

    def remove_after(self, time: float) -> None:
        self.entries = [entry for entry in self.entries if entry[0] <= time + 1e-6]


coordinates = st.floats(-1, 1)
steps = st.tuples(
    st.floats(0.0, 1.0),
    st.lists(st.tuples(coordinates, coordinates) | st.just(NOTHING), max_size=3),
    st.none() | st.floats(0.0, 1.0),
)
"""Seconds that pass, a point for each robot, and the fraction of the time to go back to."""


@given(st.lists(steps, max_size=30))
def test_sensed_points_agree_with_a_simple_model(
    steps: list[tuple[float, list[tuple[float, float]], float | None]],
) -> None:
    sensed = SensedPoints()
    model = PlainSensedPoints()
    time = 0.0
    for seconds, points, fraction in steps:
        time += seconds
        sensed.add(time, range(len(points)), np.array(points).reshape(-1, 2))
        for number, point in enumerate(points):
            model.add(time, number, point)
        if fraction is not None:
            time *= fraction
            sensed.remove_after(time)
            model.remove_after(time)
        stored_points, stored_robots = sensed.get_until(time)
        assert stored_points.tolist() == [list(point) for _, _, point in model.entries]
        assert stored_robots.tolist() == [number for _, number, _ in model.entries]
