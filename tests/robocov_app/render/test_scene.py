"""Scenes of records, and what was sensed."""

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
from robocov_app.figures.runs import plot_trajectories
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


@pytest.fixture(scope="module")
def record() -> Record:
    team = Team.homogeneous(4, communication_range=3.0)
    conditions = Conditions(failures=((2, 0.5),), joins=((3, 0.8, (4.5, 2.0)),))
    return Simulation(HALL, Rapf(), STARTS, team, 0.05, conditions=conditions).run(1.5)


def test_a_scene_has_working_and_failed_robots_and_obstacles(record: Record) -> None:
    first = build_record_scene(record, 0)
    later = build_record_scene(record, 12)
    last = build_record_scene(record, 30)
    assert first.numbers == (1, 2, 4)
    assert first.failed == {}
    assert later.numbers == (1, 4)
    assert list(later.failed) == [2]
    assert later.failed[2] == tuple(record.positions[12, 1].tolist())
    assert last.numbers == (1, 3, 4)
    for scene, row in ((first, 0), (later, 12), (last, 30)):
        assert scene.snapshot is not None
        rows = np.array(scene.numbers) - 1
        assert (scene.snapshot.positions == record.positions[row, rows]).all()
        assert scene.cells is not None
        assert len(scene.cells) == len(scene.team) == len(rows)
        cart = scene.environment.obstacles[0]
        assert isinstance(cart, CircleObstacle)
        assert cart.center[0] == pytest.approx(1.0 + 2.0 * float(record.time[row]))


def test_neighbors_are_renumbered(record: Record) -> None:
    scene = build_record_scene(record, 30)
    assert scene.snapshot is not None
    whole = record.snapshot(30).seen.neighbors
    part = scene.snapshot.seen.neighbors
    rows = np.array(scene.numbers) - 1
    robot, neighbor = whole.list_pairs()
    expected = set(zip(robot.tolist(), neighbor.tolist(), strict=True))
    robot, neighbor = part.list_pairs()
    assert set(zip(rows[robot].tolist(), rows[neighbor].tolist(), strict=True)) == expected


def test_a_robot_has_no_trail_before_it_joins(record: Record) -> None:
    scene = build_record_scene(record, 30)
    assert scene.trail is not None
    assert scene.starts is not None
    assert scene.starts[1].tolist() == pytest.approx([4.5, 2.0], abs=0.05)
    assert (scene.trail[:15, 1] == scene.starts[1]).all()


def test_videos_and_plots_of_changing_teams_can_be_drawn(record: Record) -> None:
    frames = [
        frame.copy()
        for frame in draw_frames(
            record, VideoSettings(colors="robots"), size=(320, 240), rows=np.array([0, 12, 30])
        )
    ]
    assert len({frame.tobytes() for frame in frames}) == 3
    figure = plot_trajectories(record)
    texts = {text.get_text() for axes in figure.axes for text in axes.texts}
    assert {"1", "2", "3", "4"} <= texts


def test_when_all_have_failed_the_map_is_still_drawn() -> None:
    conditions = Conditions(failures=((1, 0.1), (2, 0.1)))
    record = Simulation(HALL, Rapf(), STARTS[:2], conditions=conditions).run(0.5)
    scene = build_record_scene(record, len(record) - 1)
    assert scene.snapshot is None
    assert list(scene.failed) == [1, 2]
    painter = Painter(HALL, (320, 240), LIGHT, build_standard_layers(), 1.0)
    assert painter.render_frame(scene).std() > 0
    assert plot_trajectories(record).axes


def test_a_record_of_ideal_conditions_is_shown_as_ever() -> None:
    record = Simulation(HALL.static, Rapf(), STARTS).run(0.1)
    scene = build_record_scene(record, 3)
    assert scene.numbers is None
    assert scene.environment is record.environment
    assert scene.team is record.team


NOTHING = (np.nan, np.nan)


def test_points_have_the_numbers_of_their_robots():
    sensed = SensedPoints()
    sensed.add(0.0, (1, 4), np.array([[1.0, 1.0], [2.0, 2.0]]))
    sensed.add(0.5, (1, 4), np.array([[1.5, 1.0], NOTHING]))
    points, robots = sensed.get_until(1.0)
    assert len(sensed) == 3
    assert points.tolist() == [[1.0, 1.0], [2.0, 2.0], [1.5, 1.0]]
    assert robots.tolist() == [1, 4, 1]


def test_a_point_that_is_sensed_again_counts_once():
    sensed = SensedPoints()
    for k in range(50):
        sensed.add(k / 60, (1, 2), np.full((2, 2), CELL_SIZE_M * (3.1 + 0.01 * k)))
    # by each robot
    assert len(sensed) == 2
    assert sensed.get_until(9.0)[0] == pytest.approx(np.full((2, 2), CELL_SIZE_M * 3.1))
    sensed.add(1.0, (1, 2), np.full((2, 2), CELL_SIZE_M * 4.1))
    assert len(sensed) == 4
    # on both sides of the axes
    sensed.add(2.0, (1,), np.array([[0.4 * CELL_SIZE_M, 0.4 * CELL_SIZE_M]]))
    sensed.add(2.0, (1,), np.array([[-0.4 * CELL_SIZE_M, 0.4 * CELL_SIZE_M]]))
    assert len(sensed) == 6


def test_without_sensing_no_point_is_known():
    sensed = SensedPoints()
    sensed.add(0.0, (1, 2), np.array([NOTHING, NOTHING]))
    sensed.add(0.0, (), np.empty((0, 2)))
    assert len(sensed) == 0
    points, robots = sensed.get_until(1.0)
    assert points.shape == (0, 2)
    assert robots.shape == (0,)


def test_known_points_at_a_time():
    sensed = SensedPoints()
    for k in range(10):
        sensed.add(float(k), (1,), np.array([[float(k), 0.0]]))
    assert len(sensed.get_until(-0.5)[0]) == 0
    assert len(sensed.get_until(0.0)[0]) == 1
    assert sensed.get_until(4.5)[0][:, 0].tolist() == [0, 1, 2, 3, 4]
    assert len(sensed.get_until(1e9)[0]) == 10


def test_removed_points_can_be_sensed_again():
    sensed = SensedPoints()
    for k in range(10):
        sensed.add(float(k), (1,), np.array([[float(k), 0.0]]))
    sensed.remove_after(4.0)
    assert len(sensed) == 5
    sensed.add(5.0, (1,), np.array([[3.0, 0.0]]))
    assert len(sensed) == 5
    sensed.add(6.0, (1,), np.array([[9.0, 0.0]]))
    assert sensed.get_until(9.0)[0][:, 0].tolist() == [0, 1, 2, 3, 4, 9]


def test_a_copy_is_on_its_own():
    sensed = SensedPoints()
    sensed.add(0.0, (1,), np.array([[1.0, 1.0]]))
    twin = sensed.copy()
    twin.add(1.0, (1,), np.array([[2.0, 1.0]]))
    twin.remove_after(-1.0)
    twin.add(2.0, (7,), np.array([[5.0, 5.0]]))
    assert sensed.get_until(9.0)[0].tolist() == [[1.0, 1.0]]
    assert sensed.get_until(9.0)[1].tolist() == [1]
    sensed.add(3.0, (1,), np.array([[1.0, 1.0]]))
    assert len(sensed) == 1
    assert twin.get_until(9.0)[1].tolist() == [7]


def test_more_than_so_many_are_not_remembered(monkeypatch):
    monkeypatch.setattr(sensed_points, "MAX_POINTS", 1000)
    sensed = SensedPoints()
    for k in range(3000):
        sensed.add(float(k), (1, 2), np.array([[float(k), 0.0], [0.0, float(k)]]))
    assert len(sensed) == 1000
    assert sensed.get_until(1e9)[0][-1].tolist() == [0.0, 499.0]


@given(
    st.lists(
        st.tuples(
            st.floats(0.0, 1.0),
            st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)) | st.just(NOTHING), max_size=3),
            st.none() | st.floats(0.0, 1.0),
        ),
        max_size=30,
    )
)
def test_the_first_point_in_each_square_is_known(steps):
    sensed = SensedPoints()
    time = 0.0
    kept = []
    for seconds, points, back in steps:
        time += seconds
        sensed.add(time, range(len(points)), np.array(points).reshape(-1, 2))
        for number, point in enumerate(points):
            square = number, *np.floor(np.array(point) / CELL_SIZE_M).tolist()
            if point[0] == point[0] and all(square != known for _, known, _ in kept):
                kept.append((time, square, point))
        if back is not None:
            time *= back
            sensed.remove_after(time)
            kept = [each for each in kept if each[0] <= time + 1e-6]
        assert [tuple(point) for point in sensed.get_until(time)[0].tolist()] == [
            point for _, _, point in kept
        ]
        assert sensed.get_until(time)[1].tolist() == [square[0] for _, square, _ in kept]
