"""Messages between robots, and what controllers make of them."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace
from fractions import Fraction
from math import floor
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.conditions import LOSS_STREAM, Conditions
from robocov.conditions.communication import NEVER, Inbox, Radio
from robocov.conditions.random_streams import create_generator
from robocov.controllers import CONTROLLERS, Controller, inform_controller
from robocov.controllers.exploration import atlas
from robocov.environment import Environment
from robocov.errors import InputError
from robocov.observation import Observations, Scans
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.team import Team
from robocov.voronoi import partition

DT = 0.1
OPEN = Environment("open", ((0, 0), (10, 0), (10, 10), (0, 10)))
SQUARE = Region(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]]))


def draw_walks(robots: int, steps: int, seed: int) -> np.ndarray:
    """Return random walks, (steps, robots, 2) m."""
    rng = np.random.default_rng(seed)
    starts = rng.uniform(2, 8, size=(robots, 2))
    return np.asarray(starts + np.cumsum(rng.normal(scale=0.2, size=(steps, robots, 2)), axis=0))


class Message(NamedTuple):
    arrives: float
    step: int
    receiver: int
    sender: int
    position: np.ndarray


def simulate_messages(
    conditions: Conditions, ranges: np.ndarray, walks: np.ndarray, working: np.ndarray
) -> list[dict[tuple[int, int], Message]]:
    """Return the message that each robot knows of each other one in each step, from a list of all."""
    rate = conditions.message_rate
    messages = []
    known_messages = []
    broadcasts = 0
    for step, positions in enumerate(walks):
        is_working = working[step]
        if rate is None or step * DT + 1e-9 >= broadcasts / rate:
            broadcasts += 1
            uniform = create_generator(conditions.seed, LOSS_STREAM, step).random(2 * (len(positions),))
            for receiver, sender in np.ndindex(len(positions), len(positions)):
                distance = np.hypot(*(positions[receiver] - positions[sender]))
                is_in_range = distance <= min(ranges[receiver], ranges[sender])
                if receiver == sender or not (is_in_range and is_working[receiver] and is_working[sender]):
                    continue
                if uniform[receiver, sender] >= conditions.loss:
                    arrives = step * DT + conditions.delay
                    messages.append(Message(arrives, step, receiver, sender, positions[sender].copy()))
        known = {}
        for message in messages:
            # A message is delivered in the first step that is not before its arrival.
            arrival_step = np.ceil(message.arrives / DT - 1e-9)
            is_recent = (step - arrival_step) * DT <= conditions.forget_after + 1e-9
            if arrival_step <= step and is_recent and is_working[message.receiver]:
                known[message.receiver, message.sender] = message
        known_messages.append(known)
    return known_messages


@settings(max_examples=count_examples(30))
@given(
    robots=st.integers(2, 5),
    loss=st.sampled_from([0.0, 0.3, 0.9, 1.0]),
    delay=st.sampled_from([0.0, 0.05, 0.1, 0.34]),
    rate=st.sampled_from([None, 10.0, 4.0, 2.5]),
    forget_after=st.sampled_from([0.4, 1.0, 9.0]),
    communication_range=st.sampled_from([2.0, np.inf]),
    seed=st.integers(0, 2**20),
)
def test_messages_agree_with_a_simulation_of_each_message(
    robots: int,
    loss: float,
    delay: float,
    rate: float | None,
    forget_after: float,
    communication_range: float,
    seed: int,
) -> None:
    conditions = Conditions(loss=loss, delay=delay, message_rate=rate, forget_after=forget_after, seed=seed)
    walks = draw_walks(robots, 25, seed)
    ranges = np.full(robots, communication_range)
    ranges[0] *= 0.7
    working = np.ones((25, robots), dtype=bool)
    working[12:, 1] = False
    radio = Radio(conditions, ranges, DT)
    inbox = Inbox.create_empty(robots)
    known_messages = simulate_messages(conditions, ranges, walks, working)
    for step, positions in enumerate(walks):
        inbox = radio.exchange_positions(inbox, step, positions, positions, working[step])
        reports = radio.read_reports(inbox, step, working[step])
        robot, other = reports.neighbors.list_pairs()
        pairs = sorted(known_messages[step])
        assert list(zip(robot.tolist(), other.tolist(), strict=True)) == pairs
        for k, pair in enumerate(pairs):
            message = known_messages[step][pair]
            np.testing.assert_array_equal(reports.positions[k], message.position)
            assert reports.ages[k] == pytest.approx((step - message.step) * DT)


@pytest.mark.parametrize(("delay", "dt", "steps"), [(0.14, 0.02, 7), (0.7, DT, 7), (0.71, DT, 8)])
def test_latency_and_silence_of_whole_steps_are_exact(delay: float, dt: float, steps: int) -> None:
    """Also where 0.14 / 0.02 is more than 7, and 3 * 0.1 more than 0.3, by rounding."""
    radio = Radio(Conditions(delay=delay, forget_after=round(3 * dt, 2)), np.ones(2), dt)
    inbox = Inbox.create_empty(2)
    working = np.ones(2, dtype=bool)
    steps_with_report = []
    for step in range(16):
        # The robots are out of range after the first message.
        positions = np.array([[0.0, 0.0], [9.0 * step, 0.0]])
        inbox = radio.exchange_positions(inbox, step, positions, positions, working)
        reported = radio.read_reports(inbox, step, working).positions
        if len(reported) > 0:
            steps_with_report.append(step)
    assert steps_with_report == list(range(steps, steps + 4))


@pytest.mark.parametrize(("dt", "rate"), [("0.03", 30), ("0.03", 15), ("0.1", 4)])
def test_messages_are_sent_whenever_a_period_has_passed(dt: str, rate: int) -> None:
    """Also where 30 * (0.03 * 30) is less than 27 by rounding."""
    radio = Radio(Conditions(message_rate=rate), np.full(2, np.inf), float(dt))
    positions = np.array([[0.0, 0.0], [1.0, 0.0]])
    working = np.ones(2, dtype=bool)
    inbox = Inbox.create_empty(2)
    sent_steps = []
    for step in range(100):
        inbox = radio.exchange_positions(inbox, step, positions, positions, working)
        if inbox.sent_steps[0, 1] == step:
            sent_steps.append(step)
    messages = [floor(Fraction(dt) * rate * step) for step in range(-1, 100)]
    assert sent_steps == [step for step in range(100) if messages[step + 1] > messages[step]]


def test_inboxes_are_immutable() -> None:
    """A copy of a simulation shares its inbox."""
    radio = Radio(Conditions(delay=0.2, loss=0.2), np.full(3, np.inf), DT)
    inbox = Inbox.create_empty(3)
    working = np.ones(3, dtype=bool)
    for step, positions in enumerate(draw_walks(3, 12, 4)):
        content = deepcopy(inbox)
        first = radio.exchange_positions(inbox, step, positions, positions, working)
        second = radio.exchange_positions(inbox, step, positions, positions, working)
        np.testing.assert_array_equal(first.positions, second.positions)
        np.testing.assert_array_equal(inbox.sent_steps, content.sent_steps)
        np.testing.assert_array_equal(inbox.arrival_steps, content.arrival_steps)
        np.testing.assert_array_equal(inbox.positions, content.positions)
        assert len(inbox.in_flight) == len(content.in_flight)
        inbox = first


def test_messages_are_lost_with_the_given_probability() -> None:
    """The bound is five standard errors wide."""
    robots = 40
    steps = 30
    radio = Radio(Conditions(loss=0.3, forget_after=0.01, seed=1), np.full(robots, np.inf), DT)
    inbox = Inbox.create_empty(robots)
    working = np.ones(robots, dtype=bool)
    received = 0
    for step, positions in enumerate(draw_walks(robots, steps, 1)):
        inbox = radio.exchange_positions(inbox, step, positions, positions, working)
        reported = radio.read_reports(inbox, step, working).positions
        received += len(reported)
    sent = steps * robots * (robots - 1)
    assert abs(received / sent - 0.7) < 5 * np.sqrt(0.21 / sent)


def build_observations(
    controller: Controller,
    positions: np.ndarray,
    neighbors: Neighbors,
    reported: np.ndarray | None,
    seed: int,
) -> Observations:
    """Build observations with random velocities, obstacle points and scans."""
    rng = np.random.default_rng(seed)
    obstacle_points = positions + rng.normal(scale=0.8, size=positions.shape)
    scanning = getattr(controller, "scanning", None)
    scans = None
    if scanning is not None:
        distances = rng.uniform(1.0, 3.0, size=(len(positions), scanning.rays))
        scans = Scans(distances, rng.random(distances.shape) < 0.3)
    return Observations(
        positions,
        rng.normal(size=positions.shape),
        neighbors,
        obstacle_points,
        SQUARE,
        max_speeds=np.ones(len(positions)),
        scans=scans,
        reported_positions=reported,
        report_ages=None if reported is None else np.zeros(len(reported)),
    )


def build_controller(controller_type: type) -> Controller:
    """Build a controller, and inform it of the map if it needs it."""
    controller: Controller = inform_controller(controller_type(), OPEN)
    return controller


SHARING = ("atlas-shared", "frontier-median", "greedy-submodular", "voronoi-graph")
PLANNING = ("atlas", *SHARING)
"""Controllers that take long to decide: one example is enough."""

LIGHT = tuple(kind for kind in CONTROLLERS.values() if kind.name not in PLANNING)


@pytest.mark.parametrize("controller_type", LIGHT, ids=lambda controller_type: str(controller_type.name))
@settings(max_examples=count_examples(15))
@given(n=st.integers(2, 14), seed=st.integers(0, 2**32), communication_range=st.floats(2.0, 12.0))
def test_reports_of_true_positions_change_no_decision(
    controller_type: type, n: int, seed: int, communication_range: float
) -> None:
    positions = np.random.default_rng(seed).uniform(1, 9, size=(n, 2))
    neighbors = Neighbors.from_ranges(positions, np.full(n, communication_range))
    controller = build_controller(controller_type)
    memory = controller.begin(SQUARE, Team.homogeneous(n, communication_range=communication_range))
    _, other = neighbors.list_pairs()
    ideal = controller.decide(build_observations(controller, positions, neighbors, None, seed), memory)
    by_reports = controller.decide(
        build_observations(controller, positions, neighbors, positions[other], seed), memory
    )
    assert by_reports.forces.tobytes() == ideal.forces.tobytes()
    if ideal.goals is not None and by_reports.goals is not None:
        assert by_reports.goals.tobytes() == ideal.goals.tobytes()


@pytest.mark.parametrize("controller_type", LIGHT, ids=lambda controller_type: str(controller_type.name))
@settings(max_examples=count_examples(15))
@given(n=st.integers(2, 14), seed=st.integers(0, 2**32))
def test_robots_decide_by_reports_and_not_by_true_positions(controller_type: type, n: int, seed: int) -> None:
    """All other robots are elsewhere, and have received other reports: the force of one stays the same."""
    rng = np.random.default_rng(seed)
    positions = rng.uniform(1, 9, size=(n, 2))
    is_linked = (rng.random((n, n)) < 0.7) & ~np.eye(n, dtype=bool)
    robot, other = np.nonzero(is_linked)
    neighbors = Neighbors.from_pairs(n, robot, other)
    reported = positions[other] + rng.normal(scale=0.5, size=(len(robot), 2))
    i = int(rng.integers(n))
    controller = build_controller(controller_type)
    memory = controller.begin(SQUARE, Team.homogeneous(n))
    seen = build_observations(controller, positions, neighbors, reported, seed)
    other_positions = rng.uniform(1, 9, size=(n, 2))
    other_positions[i] = positions[i]
    other_reports = rng.uniform(1, 9, size=reported.shape)
    other_reports[robot == i] = reported[robot == i]
    changed = replace(seen, positions=other_positions, reported_positions=other_reports)
    force = controller.decide(seen, memory).forces[i]
    assert controller.decide(changed, memory).forces[i].tobytes() == force.tobytes()


@pytest.mark.parametrize(
    "controller_type", CONTROLLERS.values(), ids=lambda controller_type: str(controller_type.name)
)
def test_reports_affect_decisions(controller_type: type) -> None:
    """A message to robot 1 reports that robot 2 is close. It affects other robots only if maps are shared."""
    positions = np.array([[4.0, 4.0], [5.0, 4.5], [8.0, 6.0]])
    neighbors = Neighbors.from_ranges(positions, np.full(3, 20.0))
    _, other = neighbors.list_pairs()
    true_reports = positions[other]
    close_reports = true_reports.copy()
    close_reports[0] = [3.77, 4.0]
    controller = build_controller(controller_type)
    memory = controller.begin(SQUARE, Team.homogeneous(3))
    forces = [
        controller.decide(build_observations(controller, positions, neighbors, reports, 1), memory).forces
        for reports in (true_reports, close_reports)
    ]
    assert not np.array_equal(forces[0][0], forces[1][0])
    if controller_type.name not in SHARING:
        assert forces[0][1:].tobytes() == forces[1][1:].tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANNING)
def test_planning_controllers_decide_by_reports(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(atlas, "_LISTENING_S", 0.0)
    controller_type = CONTROLLERS[name]
    positions = np.random.default_rng(5).uniform(1, 9, size=(4, 2))
    neighbors = Neighbors.from_ranges(positions, np.full(4, 20.0))
    robot, other = neighbors.list_pairs()
    true_reports = positions[other]
    # Reports to all robots but the first one are wrong.
    wrong_reports = np.where(robot[:, None] == 0, true_reports, true_reports + 0.7)
    forces = []
    for reports in (None, true_reports, wrong_reports):
        controller = build_controller(controller_type)
        memory = controller.begin(SQUARE, Team.homogeneous(4))
        seen = build_observations(controller, positions, neighbors, reports, 5)
        forces.append(controller.decide(seen, memory).forces)
    assert forces[1].tobytes() == forces[0].tobytes()
    if name == "atlas":
        assert forces[2][0].tobytes() == forces[1][0].tobytes()


@given(n=st.integers(1, 20), seed=st.integers(0, 2**32))
def test_cells_by_reports_agree_with_a_partition_for_each_robot(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    positions = rng.uniform(0.5, 9.5, size=(n, 2))
    robot, other = np.nonzero((rng.random((n, n)) < 0.6) & ~np.eye(n, dtype=bool))
    reported = rng.uniform(0, 10, size=(len(robot), 2))
    neighbors = Neighbors.from_pairs(n, robot, other)
    cells = partition(positions, SQUARE, neighbors, reported_positions=reported)
    for i in range(n):
        known_positions = np.concatenate([positions[i : i + 1], reported[robot == i]])
        own_cells = partition(known_positions, SQUARE)
        assert cells.masses[i] == pytest.approx(own_cells.masses[0], rel=1e-9, abs=1e-12)
        np.testing.assert_allclose(cells.centroids[i], own_cells.centroids[0], atol=1e-9)
        other_cells = cells.edges.other_cells[cells.edges.cells == i]
        assert set(other_cells.tolist()) <= {-1, *other[robot == i].tolist()}


@pytest.mark.parametrize("n", [3, 63, 66, 120])
def test_cells_by_true_reports_equal_ordinary_cells(n: int) -> None:
    """Half of the robots are a crowd, whose distant neighbors matter."""
    positions = np.random.default_rng(n).uniform(0.5, 9.5, size=(n, 2))
    positions[: n // 2] *= 0.05
    neighbors = Neighbors.from_ranges(positions, np.full(n, 20.0))
    _, other = neighbors.list_pairs()
    ordinary = partition(positions, SQUARE, neighbors)
    by_reports = partition(positions, SQUARE, neighbors, reported_positions=positions[other])
    assert by_reports.masses.tobytes() == ordinary.masses.tobytes()
    assert by_reports.centroids.tobytes() == ordinary.centroids.tobytes()


def test_reported_positions_without_neighbors_are_rejected() -> None:
    with pytest.raises(InputError, match="reported_positions: expected None without limited communication"):
        partition(np.ones((2, 2)), SQUARE, reported_positions=np.ones((2, 2)))


def test_an_inbox_is_adapted_to_another_team() -> None:
    radio = Radio(Conditions(delay=0.2), np.full(3, np.inf), DT)
    inbox = Inbox.create_empty(3)
    working = np.ones(3, dtype=bool)
    for step, positions in enumerate(draw_walks(3, 6, 2)):
        inbox = radio.exchange_positions(inbox, step, positions, positions, working)
    # Robots 3 and 1 of the old team, with a new one between them.
    selected = inbox.select_robots(np.array([2, -1, 0]))
    assert selected.sent_steps[0, 2] == inbox.sent_steps[2, 0]
    np.testing.assert_array_equal(selected.positions[0, 2], inbox.positions[2, 0])
    assert (selected.sent_steps[1] == NEVER).all()
    assert (selected.sent_steps[:, 1] == NEVER).all()
    reports = radio.read_reports(selected, 5, working)
    robots, others = reports.neighbors.list_pairs()
    assert (robots.tolist(), others.tolist()) == ([0, 2], [2, 0])
    assert len(selected.in_flight) == len(inbox.in_flight) == 2
    for new, old in zip(selected.in_flight, inbox.in_flight, strict=True):
        assert new.is_received.tolist() == [[False, False, True], [False] * 3, [True, False, False]]
        np.testing.assert_array_equal(new.positions[[0, 2]], old.positions[[2, 0]])
