from __future__ import annotations

import os
import signal
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from sample_sessions import HALL

from robocov.cost import CoverageCost
from robocov.environment import CircleObstacle, Environment, ObstaclePath
from robocov_app.jobs.workers import DirectWorker
from robocov_app.render.distance_field import Field
from robocov_app.viewer import costs as module
from robocov_app.viewer.costs import Costs, CostService

PLACES = np.array([[1.0, 1.0], [5.0, 3.0]])
OTHERS = np.array([[1.0, 3.0], [3.5, 3.0], [5.0, 3.0]])
CROSSED = replace(
    HALL,
    obstacles=(*HALL.obstacles, CircleObstacle((1.0, 2.0), 0.4, path=ObstaclePath(((1, 2), (5, 2)), 0.5))),
)
"""A hall through which something goes."""
INSIDE = np.array([[4.2, 1.2]])
"""Of the pillar."""
FULL = Environment("full", ((0, 0), (1, 0), (1, 1), (0, 1)), (CircleObstacle((0.5, 0.5), 0.3),))
PATIENCE = 60.0
"""Seconds after which nothing will come any more."""


def answered(costs, wanted=1) -> dict[int, module.KnownCost]:
    """Poll until so many panes have been answered."""
    answers, end = {}, time.monotonic() + PATIENCE
    while time.monotonic() < end:
        answers |= dict(costs.poll())
        if len(answers) >= wanted:
            return answers
        time.sleep(0.005)
    raise AssertionError(costs.state)


@pytest.fixture
def worker_costs():
    costs = Costs(32)
    yield costs
    costs.close()


class StubWorker:
    """Answers when it is told to."""

    def __init__(self) -> None:
        self.asked, self.busy, self.is_alive, self.progress, self.trouble = [], False, True, None, ""
        self._service, self._answer = DirectWorker(CostService(), module._CostWire()), None

    def put(self, question) -> None:
        self.asked.append(question)
        self.busy, self.progress = True, None
        self._service.put(question)

    def answer(self) -> None:
        self._answer, self.trouble = self._service.poll(), self._service.trouble
        self.busy = False

    def die(self) -> None:
        self._answer, self.trouble, self.busy, self.is_alive = None, "it has ended", False, False

    def poll(self):
        answer, self._answer = self._answer, None
        return answer


@pytest.fixture
def stubbed():
    """Give costs whose worker does what the test says."""
    costs = Costs(16, direct=True)
    costs._worker = StubWorker()
    costs.set_environment(HALL)
    return costs, costs._worker


@pytest.fixture
def ready(stubbed):
    costs, worker = stubbed
    worker.answer()
    costs.poll()
    return costs, worker


# at once


def test_answers_are_those_of_the_cost():
    costs = Costs(32, direct=True)
    costs.set_environment(HALL)
    costs.ask(0, 1.5, PLACES)
    costs.ask(3, 1.5, OTHERS, np.array([3.5, 0.5]))
    assert costs.known == {}
    answers = dict(costs.poll())
    assert answers == costs.known
    cost = CoverageCost(HALL, 32)
    assert answers[0].result.mean_distance == cost(PLACES).mean_distance
    assert (answers[0].time, answers[0].path) == (1.5, None)
    np.testing.assert_array_equal(answers[3].path, cost.find_path(OTHERS, np.array([3.5, 0.5])))
    assert isinstance(answers[3].field, Field)
    assert answers[3].field is answers[3].field
    assert costs.poll() == []
    costs.close()


def test_only_the_newest_question_of_a_pane_counts():
    costs = Costs(32, direct=True)
    costs.set_environment(HALL)
    for when in (1.0, 2.0, 3.0):
        costs.ask(0, when, PLACES)
    assert [known.time for _, known in costs.poll()] == [3.0]


def test_positions_are_those_when_it_was_asked():
    costs, places = Costs(32, direct=True), PLACES.copy()
    costs.set_environment(HALL)
    costs.ask(0, 1.0, places)
    places += 0.5
    ((_, known),) = costs.poll()
    np.testing.assert_array_equal(known.result.positions, PLACES)


def test_what_cannot_be_computed_is_left_out():
    costs = Costs(32, direct=True)
    costs.set_environment(HALL)
    costs.ask(0, 1.0, INSIDE)
    costs.ask(1, 1.0, PLACES, INSIDE[0])
    assert [(pane, known.path) for pane, known in costs.poll()] == [(1, None)]
    assert costs.state == ""


def test_another_map():
    costs = Costs(16, direct=True)
    costs.set_environment(HALL)
    costs.ask(0, 1.0, PLACES)
    costs.poll()
    costs.ask(0, 2.0, PLACES)
    costs.set_environment(replace(HALL, obstacles=()))
    assert costs.known == {}
    # what was asked was asked of the map before
    assert costs.poll() == []
    costs.ask(0, 2.0, INSIDE)
    assert len(costs.poll()) == 1
    costs = Costs(1, direct=True)
    costs.set_environment(FULL)
    costs.ask(0, 1.0, PLACES)
    assert costs.poll() == []
    assert costs.state.startswith("no cost: ")
    costs.set_environment(HALL)
    assert costs.state == ""


def test_what_was_of_another_run_is_forgotten():
    costs = Costs(16, direct=True)
    costs.set_environment(HALL)
    costs.ask(0, 1.0, PLACES)
    costs.poll()
    costs.ask(0, 2.0, PLACES)
    costs.forget()
    assert costs.known == {}
    assert costs.poll() == []


def test_obstacles_that_move_stand_where_they_are_at_the_time():
    costs = Costs(32, direct=True)
    costs.set_environment(CROSSED)
    assert costs.state == ""
    values = []
    for when in (0.0, 2.5, 5.0):
        costs.ask(0, when, PLACES)
        ((_, known),) = costs.poll()
        assert known.result.mean_distance == CoverageCost(CROSSED.at(when), 32)(PLACES).mean_distance
        assert known.field.largest == known.result.distances.max()
        values.append(known.result.mean_distance)
    assert len(set(values)) == 3


def test_a_robot_below_an_obstacle_that_moves_is_nearest_to_nothing():
    costs = Costs(32, direct=True)
    costs.set_environment(CROSSED)
    over = np.array([[1.0, 2.0], [5.0, 3.0]])
    costs.ask(0, 0.0, over, np.array([5.5, 3.5]))
    ((_, known),) = costs.poll()
    np.testing.assert_array_equal(known.result.positions, over)
    assert set(known.result.owner.tolist()) == {1}
    assert known.result.mean_distance == CoverageCost(CROSSED.at(0.0), 32)(over[1:]).mean_distance
    np.testing.assert_array_equal(known.path[-1], over[1])
    # nobody is left
    costs.ask(0, 0.0, over[:1])
    assert costs.poll() == []


def test_the_time_until_the_first_robot_comes():
    speeds = np.array([0.2, 1.0])
    costs = Costs(32, direct=True)
    costs.set_environment(HALL)
    costs.ask(0, 1.0, PLACES)
    costs.ask(1, 1.0, PLACES, speeds=speeds)
    without, timed = (known for _, known in costs.poll())
    assert without.travel_time is None
    assert timed.travel_time == CoverageCost(HALL, 32)(PLACES, speeds).mean_time
    # the distance is that of the nearest one all the same
    assert timed.result.mean_distance == without.result.mean_distance


# in turn


def test_nothing_is_asked_before_the_map_is_ready(stubbed):
    costs, worker = stubbed
    costs.ask(0, 1.0, PLACES)
    assert costs.poll() == []
    assert costs.state == "cost: preparing the map"
    worker.progress = 0.25, 3.0
    costs.poll()
    assert costs.state == "cost: preparing the map, 25%, 3 s left"
    worker.progress = 0.5, 0.3
    costs.poll()
    assert costs.state == "cost: preparing the map, 50%"
    assert [each.positions for each in worker.asked] == [None]
    worker.answer()
    costs.poll()
    assert costs.state == ""
    assert [each.time for each in worker.asked[1:]] == [1.0]


def test_every_pane_has_its_turn(ready):
    costs, worker = ready
    turns = []
    for frame in range(40):
        for pane in range(3):
            costs.ask(pane, float(frame), PLACES)
        worker.answer()
        turns += [pane for pane, _ in costs.poll()]
    assert {turns.count(pane) for pane in range(3)} <= {13, 14}
    # each answer is of the newest question
    assert min(known.time for known in costs.known.values()) >= 36.0


def test_one_question_at_a_time(ready):
    costs, worker = ready
    for pane in range(3):
        costs.ask(pane, 1.0, PLACES)
    for _ in range(3):
        assert costs.poll() == []
    assert len(worker.asked) == 2  # with the map


def test_answers_to_another_run_are_passed_over(ready):
    costs, worker = ready
    costs.ask(0, 7.0, PLACES)
    costs.poll()
    costs.forget()
    costs.ask(0, 0.0, OTHERS)
    worker.answer()
    assert costs.poll() == []
    assert costs.known == {}
    worker.answer()
    assert [(pane, known.time) for pane, known in costs.poll()] == [(0, 0.0)]


def test_so_are_those_of_another_map(ready):
    costs, worker = ready
    costs.ask(2, 7.0, PLACES)
    costs.poll()
    costs.set_environment(replace(HALL, obstacles=()))
    costs.ask(2, 8.0, INSIDE)
    worker._answer = module.KnownCost(7.0, None, None, None)  # while the newest question has no answer
    assert costs.poll() == []
    assert costs.known == {}
    for _ in range(2):
        worker.answer()
        answers = costs.poll()
    assert [(pane, known.time) for pane, known in answers] == [(2, 8.0)]


def test_a_robot_in_an_obstacle_stops_nothing(ready):
    costs, worker = ready
    costs.ask(0, 1.0, INSIDE)
    costs.ask(1, 1.0, PLACES)
    costs.poll()
    worker.answer()
    assert "outside the free space" in worker.trouble
    assert costs.poll() == []
    assert costs.state == ""
    worker.answer()
    assert [pane for pane, _ in costs.poll()] == [1]


def test_a_process_that_ends_again_and_again_is_said(ready):
    costs, worker = ready
    costs.ask(0, 1.0, PLACES)
    costs.poll()
    worker.die()
    costs.poll()
    assert costs.state == "cost: preparing the map"
    assert worker.asked[-1].positions is None
    count = len(worker.asked)
    worker.die()
    for _ in range(3):
        costs.ask(0, 2.0, PLACES)
        costs.poll()
    assert costs.state == "no cost: it has ended"
    assert len(worker.asked) == count


# by another process


def test_another_process_says_the_same(worker_costs):
    worker_costs.set_environment(HALL)
    point = np.array([3.5, 0.5])
    worker_costs.ask(0, 1.5, PLACES)
    worker_costs.ask(5, 1.5, OTHERS, point)
    answers = answered(worker_costs, 2)
    cost = CoverageCost(HALL, 32)
    for pane, places in ((0, PLACES), (5, OTHERS)):
        assert answers[pane].time == 1.5
        assert answers[pane].result.mean_distance == cost(places).mean_distance
        np.testing.assert_array_equal(answers[pane].result.distances, cost(places).distances)
    assert answers[0].path is None
    np.testing.assert_array_equal(answers[5].path, cost.find_path(OTHERS, point))
    assert answers[5].field.largest > 0.0
    assert worker_costs.state == ""
    assert worker_costs.known == answers
    # no way from the pillar's middle
    worker_costs.ask(0, 2.0, PLACES, INSIDE[0])
    assert answered(worker_costs)[0].path is None
    worker_costs.forget()
    assert worker_costs.known == {}
    # another map, on which robots are where there was an obstacle
    worker_costs.set_environment(replace(HALL, obstacles=()))
    worker_costs.ask(0, 3.0, INSIDE)
    assert answered(worker_costs)[0].time == 3.0


@pytest.mark.slow
def test_another_process_knows_where_obstacles_are(worker_costs):
    worker_costs.set_environment(CROSSED)
    speeds = np.array([0.5, 1.0])
    for when in (0.0, 2.5):
        worker_costs.ask(0, when, PLACES, speeds=speeds)
        known = answered(worker_costs)[0]
        cost = CoverageCost(CROSSED.at(when), 32)
        assert known.time == when
        assert known.result.mean_distance == cost(PLACES).mean_distance
        assert known.travel_time == cost(PLACES, speeds).mean_time
        # of the sites as they are then
        np.testing.assert_array_equal(known.result.points, cost.points)
        assert known.field.largest == known.result.distances.max()


@pytest.mark.slow
def test_a_map_without_a_cost_is_said():
    costs = Costs(1)
    try:
        costs.set_environment(FULL)
        end = time.monotonic() + PATIENCE
        while not costs.state.startswith("no cost") and time.monotonic() < end:
            costs.poll()
            time.sleep(0.005)
        assert "at least one site in the free space" in costs.state
    finally:
        costs.close()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no such signals")
def test_a_process_that_dies_is_replaced(worker_costs):
    worker_costs.set_environment(HALL)
    worker_costs.ask(0, 1.0, PLACES)
    answered(worker_costs)
    os.kill(worker_costs._worker.process.pid, signal.SIGKILL)
    end = time.monotonic() + PATIENCE
    answers = []
    while not answers and time.monotonic() < end:
        worker_costs.ask(0, 2.0, PLACES)
        answers = worker_costs.poll()
        time.sleep(0.005)
    assert answers[0][1].time == 2.0
    assert worker_costs.state == ""
