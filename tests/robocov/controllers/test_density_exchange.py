"""Exchange of parameters and measurements between robots that learn a density."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from message_replay import (
    extract_robot_decisions,
    hide_undelivered,
    record_run,
    remove_messages,
    replace_density_sensor,
    replay,
)
from property_examples import count_examples

from robocov.conditions import Conditions
from robocov.controllers import make_controller
from robocov.controllers.density_exchange import (
    MAX_SENT_MEASUREMENTS,
    MeasurementExchange,
    Measurements,
    MessageLists,
    ParameterExchange,
    add_received_measurements,
)
from robocov.density import Gaussian, Gaussians
from robocov.environment import Environment
from robocov.observation import Observations, ReceivedMessage
from robocov.observation.neighbors import Neighbors
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.typing import FloatArray

SQUARE = Environment("square", ((0, 0), (10, 0), (10, 10), (0, 10)))
REGION = SQUARE.region
HOT = Gaussians((Gaussian((7.0, 6.0), weight=6.0, sigma=2.0),), floor=0.3)
POSITIONS = np.array([[1.0, 1.0], [2.0, 1.0], [9.0, 9.0]])


def observe(
    messages: Sequence[Sequence[ReceivedMessage]] = (),
    *,
    reach: float = np.inf,
    send_limits: FloatArray | None = None,
    time: float = 0.0,
) -> Observations:
    """Return the observations of three robots, two of which are near each other."""
    return Observations(
        POSITIONS,
        np.zeros((3, 2)),
        Neighbors.from_ranges(POSITIONS, np.full(3, reach)),
        np.full((3, 2), np.nan),
        REGION,
        time,
        messages=messages,
        send_limits=send_limits,
    )


def list_sizes(messages: MessageLists) -> list[list[int]]:
    return [[message.size for message in own] for own in messages]


def test_the_newest_parameters_of_each_neighbor_are_averaged() -> None:
    own = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])
    exchange = ParameterExchange.build_empty(3)
    np.testing.assert_array_equal(exchange.compute_means(own), own)
    old = ReceivedMessage(1, np.array([10.0, 10.0]))
    new = ReceivedMessage(1, np.array([20.0, 30.0]))
    other = ReceivedMessage(2, np.array([40.0, 50.0]))
    exchange = exchange.receive(observe([(old, other), (), ()]))
    exchange = exchange.receive(observe([(new,), (), ()]))
    means = exchange.receive(observe()).compute_means(own)
    np.testing.assert_array_equal(means, [[30.0, 40.0], *own[1:]])


def test_parameters_of_silent_robots_are_forgotten() -> None:
    exchange = ParameterExchange.build_empty(3)
    far = ReceivedMessage(2, np.array([40.0]))
    near = ReceivedMessage(1, np.array([20.0]))
    exchange = exchange.receive(observe([(far, near), (), ()]))
    exchange = exchange.forget_silent_robots(observe(reach=3.0).neighbors)
    assert exchange.compute_means(np.zeros((3, 1))).ravel().tolist() == [20.0, 0.0, 0.0]


@pytest.mark.parametrize("count", [4, 64])
def test_parameters_are_sent_once_in_a_period(count: int) -> None:
    parameters = np.ones((3, count))
    exchange = ParameterExchange.build_empty(3)
    assert exchange.send(observe(), parameters)[1] == ()
    exchange = exchange.start_period()
    exchange, messages = exchange.send(observe(send_limits=np.array([0.0, 1.0, np.inf])), parameters)
    size = 4 + 8 * count
    assert list_sizes(messages) == [[], [size], [size]]
    exchange, messages = exchange.send(observe(), parameters)
    assert list_sizes(messages) == [[size], [], []]
    assert exchange.send(observe(), parameters)[1] == ()


def list_sent_squares(messages: MessageLists) -> list[int]:
    """Return the numbers of the squares in the messages of the first robot."""
    return [int(square) for message in messages[0] for square in message.payload.squares]


def test_new_measurements_are_sent_first_and_old_ones_again() -> None:
    measurements = np.full((3, 400), np.nan)
    measurements[0, :120] = 1.0
    exchange = MeasurementExchange.build_empty(3, 400)
    sent = []
    for period in range(3):
        exchange = exchange.start_period(measurements)
        exchange, messages = exchange.send(observe(time=float(period)), measurements)
        assert list_sizes(messages) == [[4 + 10 * MAX_SENT_MEASUREMENTS], [], []]
        sent += list_sent_squares(messages)
    assert sent == [*range(120), *range(30)]
    measurements[0, 300] = 2.0
    exchange = exchange.start_period(measurements)
    _, messages = exchange.send(observe(time=3.0), measurements)
    assert list_sent_squares(messages) == [300, *range(30, 79)]


@pytest.mark.parametrize(("limit", "count"), [(1.0, 1), (34.0, 3), (43.9, 3), (1e6, 5)])
def test_measurements_are_split_by_the_send_limits(limit: float, count: int) -> None:
    measurements = np.full((3, 9), np.nan)
    measurements[1, :5] = 1.0
    exchange = MeasurementExchange.build_empty(3, 9).start_period(measurements)
    waiting, messages = exchange.send(observe(send_limits=np.zeros(3)), measurements)
    assert list_sizes(messages) == [[], [], []]
    sent = []
    for _ in range(5):
        waiting, messages = waiting.send(observe(send_limits=np.full(3, limit)), measurements)
        sent += [len(message.payload.squares) for own in messages for message in own]
    assert sent[0] == count
    assert sum(sent) == 5


def test_robots_keep_their_own_measurements() -> None:
    measurements = np.full((3, 3), np.nan)
    measurements[0, 0] = 1.0
    content = Measurements(np.array([0, 2]), np.array([7.0, 8.0]))
    seen = observe([(ReceivedMessage(1, content),), (), ()])
    added = add_received_measurements(seen, measurements)
    np.testing.assert_array_equal(added, [[1.0, np.nan, 8.0], [np.nan] * 3, [np.nan] * 3])
    assert np.isnan(measurements[0, 2])
    assert add_received_measurements(observe(), measurements) is measurements


LEARNERS = {
    "adaptive": {"period": 0.25},
    "gp-ucb": {"period": 0.25},
    # Without exploration, goals are centroids, which depend on all measurements.
    "exploring-lloyd": {"period": 0.25, "squares": 10.0, "exploration": 1.0},
}
"""Gains of controllers whose robots learn a density together, so that they plan often."""


@pytest.mark.parametrize("name", LEARNERS)
@settings(max_examples=count_examples(12), phases=[Phase.generate])
@given(seed=st.integers(0, 2**32 - 1), robot=st.integers(0, 3))
def test_robots_learn_a_density_from_delivered_messages_only(name: str, seed: int, robot: int) -> None:
    """A robot decides the same, bit for bit, if all that it does not receive is replaced.

    It decides differently if it receives neither measurements nor parameters.
    """
    starts = SQUARE.start().sample(4, seed=seed % 2**16, radius=0.1)
    conditions = Conditions(
        density="sensed", loss=0.3, delay=0.2, message_rate=4.0, bandwidth=4000.0, seed=seed
    )
    simulation = Simulation(
        SQUARE.with_density(HOT),
        make_controller(name, LEARNERS[name]),
        starts,
        Team.homogeneous(4, sensing_range=1.5, communication_range=15.0),
        dt=0.05,
        conditions=conditions,
    )
    observations, decisions = record_run(simulation, 50)
    decided = extract_robot_decisions(decisions, robot)
    received = hide_undelivered(observations, robot, seed)
    assert extract_robot_decisions(replay(simulation, received), robot) == decided
    measurable = replace_density_sensor(received, HOT)
    assert extract_robot_decisions(replay(simulation, measurable), robot) == decided
    silent = remove_messages(measurable, (Measurements, np.ndarray))
    goals = [goal for _, goal, _ in extract_robot_decisions(replay(simulation, silent), robot)]
    assert goals != [goal for _, goal, _ in decided]
