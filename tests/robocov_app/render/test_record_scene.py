import numpy as np
import pytest

from robocov.conditions import Conditions
from robocov.controllers import Rapf
from robocov.environment import CircleObstacle, Environment, ObstaclePath
from robocov.record import Record
from robocov.robots import Team
from robocov.simulation import Simulation
from robocov_app.figures.runs import plot_trajectories
from robocov_app.render.picture import Painter, standard_layers
from robocov_app.render.record_scene import record_scene
from robocov_app.render.theme import LIGHT
from robocov_app.runs.film import iter_frames

CART = CircleObstacle((1.0, 3.0), 0.4, "cart", ObstaclePath(((1, 3), (5, 3)), 2.0, "back-and-forth"))
HALL = Environment("hall", ((0, 0), (6, 0), (6, 4), (0, 4)), (CART,))
STARTS = np.array([[1.0, 1.0], [2.0, 1.5], [4.0, 1.0], [5.0, 1.2]])


@pytest.fixture(scope="module")
def record() -> Record:
    team = Team.homogeneous(4, communication_range=3.0)
    conditions = Conditions(failures=((2, 0.5),), joins=((3, 0.8, (4.5, 2.0)),))
    return Simulation(HALL, Rapf(), STARTS, team, 0.05, conditions=conditions).run(1.5)


def test_robots_that_work_failed_ones_and_obstacles_where_they_are(record: Record) -> None:
    first, later, last = (record_scene(record, row) for row in (0, 12, 30))
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


def test_neighbours_are_renumbered(record: Record) -> None:
    scene = record_scene(record, 30)
    assert scene.snapshot is not None
    whole, part = record.snapshot(30).seen.neighbours, scene.snapshot.seen.neighbours
    rows = np.array(scene.numbers) - 1
    expected = {(i, j) for i, j in zip(*(x.tolist() for x in whole.pairs()), strict=True)}
    found = {(int(rows[i]), int(rows[j])) for i, j in zip(*(x.tolist() for x in part.pairs()), strict=True)}
    assert found == expected


def test_who_joins_has_no_trail_before(record: Record) -> None:
    scene = record_scene(record, 30)
    assert scene.trail is not None
    assert scene.starts is not None
    assert scene.starts[1].tolist() == pytest.approx([4.5, 2.0], abs=0.05)
    assert (scene.trail[:15, 1] == scene.starts[1]).all()


def test_films_and_plots_of_it_can_be_drawn(record: Record) -> None:
    frames = [frame.copy() for frame in iter_frames(record, size=(320, 240), rows=np.array([0, 12, 30]))]
    assert len({frame.tobytes() for frame in frames}) == 3
    figure = plot_trajectories(record)
    texts = {text.get_text() for axes in figure.axes for text in axes.texts}
    assert {"1", "2", "3", "4"} <= texts


def test_when_all_have_failed_the_map_is_still_drawn() -> None:
    conditions = Conditions(failures=((1, 0.1), (2, 0.1)))
    record = Simulation(HALL, Rapf(), STARTS[:2], conditions=conditions).run(0.5)
    scene = record_scene(record, len(record) - 1)
    assert scene.snapshot is None
    assert list(scene.failed) == [1, 2]
    painter = Painter(HALL, (320, 240), LIGHT, standard_layers(), 1.0)
    assert painter.frame(scene).std() > 0
    assert plot_trajectories(record).axes


def test_a_record_of_ideal_conditions_is_shown_as_ever() -> None:
    record = Simulation(HALL.static, Rapf(), STARTS).run(0.1)
    scene = record_scene(record, 3)
    assert scene.numbers is None
    assert scene.environment is record.environment
    assert scene.team is record.team
