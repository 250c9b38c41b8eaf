import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.render import sensed as module
from robocov_app.render.sensed import CELL, Sensed

NOTHING = (np.nan, np.nan)


def test_points_come_with_their_robots():
    sensed = Sensed()
    sensed.add(0.0, (1, 4), np.array([[1.0, 1.0], [2.0, 2.0]]))
    sensed.add(0.5, (1, 4), np.array([[1.5, 1.0], NOTHING]))
    points, robots = sensed.until(1.0)
    assert len(sensed) == 3
    assert points.tolist() == [[1.0, 1.0], [2.0, 2.0], [1.5, 1.0]]
    assert robots.tolist() == [1, 4, 1]


def test_what_is_sensed_again_counts_once():
    sensed = Sensed()
    for k in range(50):
        sensed.add(k / 60, (1, 2), np.full((2, 2), CELL * (3.1 + 0.01 * k)))
    # by each robot
    assert len(sensed) == 2
    assert sensed.until(9.0)[0] == pytest.approx(np.full((2, 2), CELL * 3.1))
    sensed.add(1.0, (1, 2), np.full((2, 2), CELL * 4.1))
    assert len(sensed) == 4
    # on both sides of the axes
    sensed.add(2.0, (1,), np.array([[0.4 * CELL, 0.4 * CELL]]))
    sensed.add(2.0, (1,), np.array([[-0.4 * CELL, 0.4 * CELL]]))
    assert len(sensed) == 6


def test_nothing_sensed_is_nothing_known():
    sensed = Sensed()
    sensed.add(0.0, (1, 2), np.array([NOTHING, NOTHING]))
    sensed.add(0.0, (), np.empty((0, 2)))
    assert len(sensed) == 0
    points, robots = sensed.until(1.0)
    assert points.shape == (0, 2)
    assert robots.shape == (0,)


def test_what_was_known_at_a_time():
    sensed = Sensed()
    for k in range(10):
        sensed.add(float(k), (1,), np.array([[float(k), 0.0]]))
    assert len(sensed.until(-0.5)[0]) == 0
    assert len(sensed.until(0.0)[0]) == 1
    assert sensed.until(4.5)[0][:, 0].tolist() == [0, 1, 2, 3, 4]
    assert len(sensed.until(1e9)[0]) == 10


def test_what_was_sensed_later_is_forgotten_and_can_be_sensed_again():
    sensed = Sensed()
    for k in range(10):
        sensed.add(float(k), (1,), np.array([[float(k), 0.0]]))
    sensed.cut(4.0)
    assert len(sensed) == 5
    sensed.add(5.0, (1,), np.array([[3.0, 0.0]]))
    assert len(sensed) == 5
    sensed.add(6.0, (1,), np.array([[9.0, 0.0]]))
    assert sensed.until(9.0)[0][:, 0].tolist() == [0, 1, 2, 3, 4, 9]


def test_a_copy_is_on_its_own():
    sensed = Sensed()
    sensed.add(0.0, (1,), np.array([[1.0, 1.0]]))
    twin = sensed.copy()
    twin.add(1.0, (1,), np.array([[2.0, 1.0]]))
    twin.cut(-1.0)
    twin.add(2.0, (7,), np.array([[5.0, 5.0]]))
    assert sensed.until(9.0)[0].tolist() == [[1.0, 1.0]]
    assert sensed.until(9.0)[1].tolist() == [1]
    sensed.add(3.0, (1,), np.array([[1.0, 1.0]]))
    assert len(sensed) == 1
    assert twin.until(9.0)[1].tolist() == [7]


def test_more_than_so_many_are_not_remembered(monkeypatch):
    monkeypatch.setattr(module, "MOST", 1000)
    sensed = Sensed()
    for k in range(3000):
        sensed.add(float(k), (1, 2), np.array([[float(k), 0.0], [0.0, float(k)]]))
    assert len(sensed) == 1000
    assert sensed.until(1e9)[0][-1].tolist() == [0.0, 499.0]


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
def test_it_is_what_was_sensed_first_in_each_square(steps):
    sensed, time, kept = Sensed(), 0.0, []
    for seconds, points, back in steps:
        time += seconds
        sensed.add(time, range(len(points)), np.array(points).reshape(-1, 2))
        for number, point in enumerate(points):
            square = number, *np.floor(np.array(point) / CELL).tolist()
            if point[0] == point[0] and all(square != known for _, known, _ in kept):
                kept.append((time, square, point))
        if back is not None:
            time *= back
            sensed.cut(time)
            kept = [each for each in kept if each[0] <= time + 1e-6]
        assert [tuple(point) for point in sensed.until(time)[0].tolist()] == [point for _, _, point in kept]
        assert sensed.until(time)[1].tolist() == [square[0] for _, square, _ in kept]
