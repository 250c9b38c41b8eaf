"""Visits of robots to targets on frontiers."""

from __future__ import annotations

import numpy as np

from robocov.controllers.exploration.visits import (
    NO_VISIT,
    TARGET_BYTES,
    VISIT_RADIUS_M,
    VisitReport,
    Visits,
)
from robocov.observation.messages import HEADER_BYTES

NO_ARRIVALS = np.zeros(2, dtype=bool)


def start_visit() -> Visits:
    """Return a visit of the second of two robots to a target at (1, 1), which may take 5 s."""
    return Visits.build_empty(2).start(np.array([1.0, 1.0]), np.array([False, True]), limit=5.0)


def test_a_visit_is_over_after_an_arrival() -> None:
    visits = start_visit()
    assert visits.current.tolist() == [NO_VISIT, 0]
    assert visits.is_over.tolist() == [False]
    visits = visits.stop(visits.current, has_arrived=np.array([False, True]), time_spent=1.0)
    assert visits.is_over.tolist() == [True]
    assert visits.current.tolist() == [NO_VISIT, NO_VISIT]
    near = [1.0, 1.0 + 0.9 * VISIT_RADIUS_M]
    far = [1.0, 1.0 + 1.1 * VISIT_RADIUS_M]
    assert visits.find_excluded(np.array([near, far])).tolist() == [True, False]


def test_arrivals_of_robots_without_a_visit_do_not_count() -> None:
    visits = start_visit()
    visits = visits.stop(visits.current, has_arrived=np.array([True, False]), time_spent=1.0)
    assert visits.is_over.tolist() == [False]


def test_a_visit_is_over_when_its_time_has_passed() -> None:
    visits = start_visit()
    for _ in range(4):
        visits = visits.stop(np.array([NO_VISIT, 0]), NO_ARRIVALS, time_spent=1.0)
    assert visits.is_over.tolist() == [False]
    visits = visits.stop(np.array([NO_VISIT, 0]), NO_ARRIVALS, time_spent=1.0)
    assert visits.is_over.tolist() == [True]


def test_the_time_of_robots_on_the_same_visit_counts_once() -> None:
    visits = start_visit().stop(np.array([0, 0]), NO_ARRIVALS, time_spent=1.5)
    assert visits.durations.tolist() == [1.5]


def test_a_target_close_to_an_earlier_one_continues_the_visit() -> None:
    """Otherwise, targets that shift a little would never be given up."""
    visits = start_visit()
    visits = visits.stop(visits.current, NO_ARRIVALS, time_spent=3.0)
    visits = visits.start(np.array([1.2, 1.0]), np.array([True, False]), limit=2.0)
    assert visits.positions.tolist() == [[1.0, 1.0]]
    assert visits.current.tolist() == [0, NO_VISIT]
    assert visits.durations.tolist() == [3.0]
    assert visits.limits.tolist() == [5.0]
    visits = visits.start(np.array([3.0, 1.0]), np.array([False, True]), limit=2.0)
    assert visits.current.tolist() == [0, 1]


def test_reports_contain_only_visits_that_are_over() -> None:
    visits = start_visit()
    visits = visits.stop(visits.current, has_arrived=np.array([False, True]), time_spent=1.0)
    visits = visits.start(np.array([4.0, 5.0]), np.array([False, True]), limit=5.0)
    message = visits.build_report()
    assert isinstance(message.payload, VisitReport)
    assert message.payload.targets.tolist() == [[1.0, 1.0]]
    assert message.size == HEADER_BYTES + TARGET_BYTES


def test_reported_visits_are_over_and_change_no_others() -> None:
    visits = start_visit().add_reported(np.array([[3.0, 1.0]]))
    assert visits.is_over.tolist() == [False, True]
    assert visits.current.tolist() == [NO_VISIT, 0]
    assert visits.find_excluded(np.array([[1.0, 1.0], [3.2, 1.0]])).tolist() == [False, True]


def test_targets_close_to_a_reported_one_are_excluded() -> None:
    visits = start_visit().add_reported(np.array([[1.1, 1.0]]))
    assert visits.find_excluded(np.array([[1.0, 1.0]])).tolist() == [True]


def test_new_targets_are_found_by_exact_comparison() -> None:
    """Otherwise, robots with different targets close to each other would never exclude the same ones."""
    visits = start_visit().add_reported(np.array([[3.0, 1.0]]))
    targets = np.array([[1.0, 1.0], [3.0, 1.0], [3.0, 1.0 + 0.9 * VISIT_RADIUS_M]])
    assert visits.select_new(targets).tolist() == [targets[0].tolist(), targets[2].tolist()]
