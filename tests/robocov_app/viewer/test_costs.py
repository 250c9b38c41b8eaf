"""Costs of the displayed states, computed in another process."""

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
from robocov_app.render.distance_map.pixel_distances import DistanceField
from robocov_app.viewer.costs import costs as module
from robocov_app.viewer.costs.costs import Costs, CostService

POSITIONS = np.array([[1.0, 1.0], [5.0, 3.0]])
OTHER_POSITIONS = np.array([[1.0, 3.0], [3.5, 3.0], [5.0, 3.0]])
CROSSED = replace(
    HALL,
    obstacles=(*HALL.obstacles, CircleObstacle((1.0, 2.0), 0.4, path=ObstaclePath(((1, 2), (5, 2)), 0.5))),
)
"""A hall with a moving obstacle."""
INSIDE = np.array([[4.2, 1.2]])
"""Position of a robot inside the pillar."""
FULL = Environment("full", ((0, 0), (1, 0), (1, 1), (0, 1)), (CircleObstacle((0.5, 0.5), 0.3),))
TIMEOUT_S = 60.0
"""Time after which a test gives up waiting for another process."""


def wait_for_answers(costs, count=1) -> dict[int, module.KnownCost]:
    """Poll until a number of panes have answers."""
    answers = {}
    end = time.monotonic() + TIMEOUT_S
    while time.monotonic() < end:
        answers |= dict(costs.poll())
        if len(answers) >= count:
            return answers
        time.sleep(0.005)
    raise AssertionError(costs.state)


@pytest.fixture
def worker_costs():
    costs = Costs(32)
    yield costs
    costs.close()


class StubWorker:
    """A worker that answers when a test calls `answer`."""

    def __init__(self) -> None:
        self.requests = []
        self.is_busy = False
        self.is_alive = True
        self.progress = None
        self.problem = ""
        self._service = DirectWorker(CostService(), module._CostCodec())
        self._answer = None

    def put(self, request) -> None:
        self.requests.append(request)
        self.is_busy = True
        self.progress = None
        self._service.put(request)

    def answer(self) -> None:
        self._answer = self._service.poll()
        self.problem = self._service.problem
        self.is_busy = False

    def die(self) -> None:
        self._answer = None
        self.problem = "it has ended"
        self.is_busy = False
        self.is_alive = False

    def poll(self):
        answer = self._answer
        self._answer = None
        return answer


@pytest.fixture
def stubbed():
    """Return costs with a `StubWorker`, and that worker."""
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


# in this process


def test_the_process_of_the_window_builds_no_service_and_so_compiles_no_kernels(monkeypatch) -> None:
    def build_service() -> CostService:
        raise AssertionError("the service is built in the process of the window")

    monkeypatch.setattr(module, "CostService", build_service)
    costs = Costs(32)
    try:
        costs.set_environment(HALL)
    finally:
        costs.close()


def test_answers_equal_the_coverage_cost():
    costs = Costs(32, direct=True)
    costs.set_environment(HALL)
    costs.request(0, 1.5, POSITIONS)
    costs.request(3, 1.5, OTHER_POSITIONS, np.array([3.5, 0.5]))
    assert costs.known == {}
    answers = dict(costs.poll())
    assert answers == costs.known
    cost = CoverageCost(HALL, 32)
    assert answers[0].result.mean_distance == cost(POSITIONS).mean_distance
    assert (answers[0].time, answers[0].path) == (1.5, None)
    np.testing.assert_array_equal(answers[3].path, cost.find_path(OTHER_POSITIONS, np.array([3.5, 0.5])))
    assert isinstance(answers[3].field, DistanceField)
    assert answers[3].field is answers[3].field
    assert costs.poll() == []
    costs.close()


def test_only_the_newest_request_of_a_pane_is_answered():
    costs = Costs(32, direct=True)
    costs.set_environment(HALL)
    for when in (1.0, 2.0, 3.0):
        costs.request(0, when, POSITIONS)
    assert [known.time for _, known in costs.poll()] == [3.0]


def test_positions_are_copied_when_a_request_is_sent():
    costs = Costs(32, direct=True)
    positions = POSITIONS.copy()
    costs.set_environment(HALL)
    costs.request(0, 1.0, positions)
    positions += 0.5
    ((_, known),) = costs.poll()
    np.testing.assert_array_equal(known.result.positions, POSITIONS)


def test_impossible_requests_have_no_answer():
    costs = Costs(32, direct=True)
    costs.set_environment(HALL)
    costs.request(0, 1.0, INSIDE)
    costs.request(1, 1.0, POSITIONS, INSIDE[0])
    assert [(pane, known.path) for pane, known in costs.poll()] == [(1, None)]
    assert costs.state == ""


def test_a_new_map_replaces_earlier_requests():
    costs = Costs(16, direct=True)
    costs.set_environment(HALL)
    costs.request(0, 1.0, POSITIONS)
    costs.poll()
    costs.request(0, 2.0, POSITIONS)
    costs.set_environment(replace(HALL, obstacles=()))
    assert costs.known == {}
    assert costs.poll() == [], "the request was about the previous map"
    costs.request(0, 2.0, INSIDE)
    assert len(costs.poll()) == 1
    costs = Costs(1, direct=True)
    costs.set_environment(FULL)
    costs.request(0, 1.0, POSITIONS)
    assert costs.poll() == []
    assert costs.state.startswith("no cost: ")
    costs.set_environment(HALL)
    assert costs.state == ""


def test_forget_drops_costs_and_requests():
    costs = Costs(16, direct=True)
    costs.set_environment(HALL)
    costs.request(0, 1.0, POSITIONS)
    costs.poll()
    costs.request(0, 2.0, POSITIONS)
    costs.forget()
    assert costs.known == {}
    assert costs.poll() == []


def test_moving_obstacles_are_at_the_position_of_the_time():
    costs = Costs(32, direct=True)
    costs.set_environment(CROSSED)
    assert costs.state == ""
    values = []
    for when in (0.0, 2.5, 5.0):
        costs.request(0, when, POSITIONS)
        ((_, known),) = costs.poll()
        assert known.result.mean_distance == CoverageCost(CROSSED.at(when), 32)(POSITIONS).mean_distance
        assert known.field.max_distance == known.result.distances.max()
        values.append(known.result.mean_distance)
    assert len(set(values)) == 3


def test_a_robot_under_a_moving_obstacle_owns_no_site():
    costs = Costs(32, direct=True)
    costs.set_environment(CROSSED)
    over = np.array([[1.0, 2.0], [5.0, 3.0]])
    costs.request(0, 0.0, over, np.array([5.5, 3.5]))
    ((_, known),) = costs.poll()
    np.testing.assert_array_equal(known.result.positions, over)
    assert set(known.result.owners.tolist()) == {1}
    assert known.result.mean_distance == CoverageCost(CROSSED.at(0.0), 32)(over[1:]).mean_distance
    np.testing.assert_array_equal(known.path[-1], over[1])
    # There is no other robot.
    costs.request(0, 0.0, over[:1])
    assert costs.poll() == []


def test_travel_time_of_robots_with_speeds():
    speeds = np.array([0.2, 1.0])
    costs = Costs(32, direct=True)
    costs.set_environment(HALL)
    costs.request(0, 1.0, POSITIONS)
    costs.request(1, 1.0, POSITIONS, speeds=speeds)
    (_, without), (_, timed) = costs.poll()
    assert without.travel_time is None
    assert timed.travel_time == CoverageCost(HALL, 32)(POSITIONS, speeds).mean_time
    # The distance is still that to the nearest robot.
    assert timed.result.mean_distance == without.result.mean_distance


# order of the requests


def test_requests_wait_until_the_map_is_prepared(stubbed):
    costs, worker = stubbed
    costs.request(0, 1.0, POSITIONS)
    assert costs.poll() == []
    assert costs.state == "cost: preparing the map"
    worker.progress = 0.25, 3.0
    costs.poll()
    assert costs.state == "cost: preparing the map, 25%, 3 s left"
    worker.progress = 0.5, 0.3
    costs.poll()
    assert costs.state == "cost: preparing the map, 50%"
    assert [request.positions for request in worker.requests] == [None]
    worker.answer()
    costs.poll()
    assert costs.state == ""
    assert [request.time for request in worker.requests[1:]] == [1.0]


def test_a_cost_that_waits_for_the_compiler_says_so(stubbed, monkeypatch):
    costs, worker = stubbed
    monkeypatch.setattr(module, "is_compiling_in_background", lambda: True)
    monkeypatch.setattr(module, "are_kernels_compiled", lambda examples: False)
    costs.set_environment(HALL)
    assert costs.state == "cost: compiling, once per version"
    worker.progress = 0.25, 3.0
    costs.poll()
    assert costs.state == "cost: preparing the map, 25%, 3 s left", "which begins when all is compiled"
    monkeypatch.setattr(module, "are_kernels_compiled", lambda examples: True)
    costs.set_environment(HALL)
    assert costs.state == "cost: preparing the map"


def test_panes_take_turns(ready):
    costs, worker = ready
    turns = []
    for frame in range(40):
        for pane in range(3):
            costs.request(pane, float(frame), POSITIONS)
        worker.answer()
        turns += [pane for pane, _ in costs.poll()]
    assert {turns.count(pane) for pane in range(3)} <= {13, 14}
    # Each answer belongs to a recent request.
    assert min(known.time for known in costs.known.values()) >= 36.0


def test_one_request_is_sent_at_a_time(ready):
    costs, worker = ready
    for pane in range(3):
        costs.request(pane, 1.0, POSITIONS)
    for _ in range(3):
        assert costs.poll() == []
    assert len(worker.requests) == 2  # with the map


def test_answers_to_forgotten_requests_are_ignored(ready):
    costs, worker = ready
    costs.request(0, 7.0, POSITIONS)
    costs.poll()
    costs.forget()
    costs.request(0, 0.0, OTHER_POSITIONS)
    worker.answer()
    assert costs.poll() == []
    assert costs.known == {}
    worker.answer()
    assert [(pane, known.time) for pane, known in costs.poll()] == [(0, 0.0)]


def test_answers_about_an_earlier_map_are_ignored(ready):
    costs, worker = ready
    costs.request(2, 7.0, POSITIONS)
    costs.poll()
    costs.set_environment(replace(HALL, obstacles=()))
    costs.request(2, 8.0, INSIDE)
    worker._answer = module.KnownCost(7.0, None, None, None)  # while the newest request has no answer
    assert costs.poll() == []
    assert costs.known == {}
    for _ in range(2):
        worker.answer()
        answers = costs.poll()
    assert [(pane, known.time) for pane, known in answers] == [(2, 8.0)]


def test_a_robot_in_an_obstacle_does_not_block_other_requests(ready):
    costs, worker = ready
    costs.request(0, 1.0, INSIDE)
    costs.request(1, 1.0, POSITIONS)
    costs.poll()
    worker.answer()
    assert "outside the free space" in worker.problem
    assert costs.poll() == []
    assert costs.state == ""
    worker.answer()
    assert [pane for pane, _ in costs.poll()] == [1]


def test_a_process_that_ends_repeatedly_is_reported(ready):
    costs, worker = ready
    costs.request(0, 1.0, POSITIONS)
    costs.poll()
    worker.die()
    costs.poll()
    assert costs.state == "cost: preparing the map"
    assert worker.requests[-1].positions is None
    count = len(worker.requests)
    worker.die()
    for _ in range(3):
        costs.request(0, 2.0, POSITIONS)
        costs.poll()
    assert costs.state == "no cost: it has ended"
    assert len(worker.requests) == count


# in another process


def test_another_process_gives_the_same_answers(worker_costs):
    worker_costs.set_environment(HALL)
    point = np.array([3.5, 0.5])
    worker_costs.request(0, 1.5, POSITIONS)
    worker_costs.request(5, 1.5, OTHER_POSITIONS, point)
    answers = wait_for_answers(worker_costs, 2)
    cost = CoverageCost(HALL, 32)
    for pane, positions in ((0, POSITIONS), (5, OTHER_POSITIONS)):
        assert answers[pane].time == 1.5
        assert answers[pane].result.mean_distance == cost(positions).mean_distance
        np.testing.assert_array_equal(answers[pane].result.distances, cost(positions).distances)
    assert answers[0].path is None
    np.testing.assert_array_equal(answers[5].path, cost.find_path(OTHER_POSITIONS, point))
    assert answers[5].field.max_distance > 0.0
    assert worker_costs.state == ""
    assert worker_costs.known == answers
    # There is no path from a point inside the pillar.
    worker_costs.request(0, 2.0, POSITIONS, INSIDE[0])
    assert wait_for_answers(worker_costs)[0].path is None
    worker_costs.forget()
    assert worker_costs.known == {}
    # On another map, robots may be where there was an obstacle.
    worker_costs.set_environment(replace(HALL, obstacles=()))
    worker_costs.request(0, 3.0, INSIDE)
    assert wait_for_answers(worker_costs)[0].time == 3.0


@pytest.mark.slow
def test_another_process_evaluates_moving_obstacles(worker_costs):
    worker_costs.set_environment(CROSSED)
    speeds = np.array([0.5, 1.0])
    for when in (0.0, 2.5):
        worker_costs.request(0, when, POSITIONS, speeds=speeds)
        known = wait_for_answers(worker_costs)[0]
        cost = CoverageCost(CROSSED.at(when), 32)
        assert known.time == when
        assert known.result.mean_distance == cost(POSITIONS).mean_distance
        assert known.travel_time == cost(POSITIONS, speeds).mean_time
        # The sites are those at that time.
        np.testing.assert_array_equal(known.result.points, cost.points)
        assert known.field.max_distance == known.result.distances.max()


@pytest.mark.slow
def test_a_map_without_a_cost_is_reported():
    costs = Costs(1)
    try:
        costs.set_environment(FULL)
        end = time.monotonic() + TIMEOUT_S
        while not costs.state.startswith("no cost") and time.monotonic() < end:
            costs.poll()
            time.sleep(0.005)
        assert "at least one site in the free space" in costs.state
    finally:
        costs.close()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no such signals")
def test_a_killed_process_is_replaced(worker_costs):
    worker_costs.set_environment(HALL)
    worker_costs.request(0, 1.0, POSITIONS)
    wait_for_answers(worker_costs)
    os.kill(worker_costs._worker.process.pid, signal.SIGKILL)
    end = time.monotonic() + TIMEOUT_S
    answers = []
    while not answers and time.monotonic() < end:
        worker_costs.request(0, 2.0, POSITIONS)
        answers = worker_costs.poll()
        time.sleep(0.005)
    assert answers[0][1].time == 2.0
    assert worker_costs.state == ""
