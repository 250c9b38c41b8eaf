"""The exchange of scans by messages: what arrives, what is repaired, and what robots do without it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from message_replay import extract_robot_decisions, hide_undelivered, record_run, replay
from property_examples import count_examples

from robocov.conditions import Conditions
from robocov.controllers import CONTROLLERS, make_controller
from robocov.controllers.exploration.scan_exchange import MAX_REPAIRS, Digest, ScanExchange, _count_sendable
from robocov.controllers.exploration.teammates import TeammateReport
from robocov.environment import Environment, WallObstacle
from robocov.observation import Message
from robocov.planning.scan_log import NumberedScan
from robocov.simulation import Simulation
from robocov.team import Team

ROOMS = Environment(
    "two rooms",
    ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)),
    (WallObstacle(((4.0, 0.0), (4.0, 5.0)), 0.2), WallObstacle(((4.0, 6.2), (4.0, 8.0)), 0.2)),
)
HALL = Environment("hall", ((0.0, 0.0), (20.0, 0.0), (20.0, 3.0), (0.0, 3.0)))
CORNER = [[0.8, 0.8], [1.3, 0.8], [0.8, 1.3], [1.3, 1.3]]
NAMES = ("frontier-median", "greedy-submodular", "voronoi-graph", "atlas-shared")
LOSSY = Conditions(loss=0.3, delay=0.5, message_rate=2.0)


def build_simulation(
    name: str = "greedy-submodular", conditions: Conditions | None = None, **limits: float
) -> Simulation:
    """Return a simulation of four robots that start in a corner of the two rooms."""
    gains = {"nodes": 100.0} if name != "atlas-shared" else {}
    team = Team.homogeneous(len(CORNER), **limits)
    return Simulation(ROOMS, make_controller(name, gains), CORNER, team, dt=0.05, conditions=conditions)


def run_until(simulation: Simulation, time: float) -> None:
    """Step a simulation until its time is at least this, s."""
    while simulation.time < time - 1e-9:
        simulation.step()


def get_exchange(simulation: Simulation) -> ScanExchange:
    """Return the exchange of the robots, with the maps of all scans."""
    exchange: ScanExchange = simulation.memory.exchange
    return exchange.update_maps(range(len(exchange.robots)))


def list_scans(exchange: ScanExchange, robot: int) -> list[NumberedScan]:
    """Return the scans that a robot has."""
    rounds = exchange.robots[robot].log.rounds
    return [scan for round_scans in rounds for scan in round_scans if scan is not None]


def test_robots_in_range_of_all_others_share_one_log_and_one_map() -> None:
    simulation = build_simulation()
    run_until(simulation, 3.1)
    exchange = get_exchange(simulation)
    assert exchange.round_count == 7
    assert len({id(state.log) for state in exchange.robots}) == 1
    assert exchange.robots[0].log.is_present.shape == (7, 4)
    assert exchange.robots[0].log.is_present.all()


@pytest.mark.parametrize("delay", [0.0, 0.3, 2.0])
def test_no_scan_of_another_robot_arrives_before_its_message(delay: float) -> None:
    simulation = build_simulation(conditions=Conditions(delay=delay))
    for _ in range(100):
        now = simulation.time
        simulation.step()
        for robot in range(len(CORNER)):
            scans = list_scans(simulation.memory.exchange, robot)
            ages = [now - scan.time for scan in scans if scan.robot != robot]
            assert min(ages, default=np.inf) >= max(delay, simulation.dt) - 1e-9
    assert len(list_scans(simulation.memory.exchange, 0)) > 4 * len(CORNER)


def test_lost_messages_are_repaired() -> None:
    simulation = build_simulation(conditions=LOSSY)
    run_until(simulation, 8.0)
    before = get_exchange(simulation)
    maps = [known_map.state.tobytes() for known_map in before.maps]
    assert len(set(maps)) > 1
    simulation = simulation.with_changes(conditions=Conditions())
    run_until(simulation, 11.1)
    after = get_exchange(simulation)
    assert all(state.log.is_present.all() for state in after.robots)
    assert len({known_map.state.tobytes() for known_map in after.maps}) == 1


def test_scans_travel_over_several_hops() -> None:
    """Robots 1 and 3 are out of range of each other; robot 2 is in range of both."""
    starts = [[2.0, 1.5], [6.0, 1.5], [10.0, 1.5]]
    team = Team.homogeneous(3, communication_range=5.0, sensing_range=2.0)
    simulation = Simulation(HALL, make_controller("greedy-submodular"), starts, team, dt=0.05)
    for _ in range(42):
        # The robots stay where they are.
        decision = simulation.observe_and_decide().decision
        simulation = simulation.with_changes(
            positions=np.array(starts), velocities=np.zeros((3, 2))
        ).with_memory(simulation.memory, simulation.inbox)
        assert np.isfinite(decision.forces).all()
        simulation.step()
    senders = {scan.robot for scan in list_scans(simulation.memory.exchange, 0)}
    assert senders == {0, 1, 2}


def test_robots_that_meet_exchange_what_they_have_missed() -> None:
    starts = np.array([[2.0, 1.5], [18.0, 1.5]])
    team = Team.homogeneous(2, communication_range=5.0, sensing_range=3.0)
    simulation = Simulation(HALL, make_controller("greedy-submodular"), starts, team, dt=0.05)
    run_until(simulation, 4.0)
    assert {scan.robot for scan in list_scans(simulation.memory.exchange, 0)} == {0}
    simulation = simulation.with_changes(team=Team.homogeneous(2, sensing_range=3.0))
    run_until(simulation, 6.1)
    exchange = get_exchange(simulation)
    assert all(state.log.is_present.all() for state in exchange.robots)
    np.testing.assert_array_equal(exchange.maps[0].state, exchange.maps[1].state)


def test_every_message_fits_the_limits_and_has_its_size() -> None:
    simulation = build_simulation(conditions=Conditions(loss=0.3, delay=0.2, bandwidth=2000.0))
    sent_bytes = np.zeros(len(CORNER))
    for _ in range(160):
        snapshot = simulation.observe_and_decide()
        limits = snapshot.seen.send_limits
        for robot, messages in enumerate(snapshot.decision.messages):
            sizes = [message.size for message in messages]
            assert sizes == [message.payload.size for message in messages]
            assert max(sizes, default=0) <= 1400
            if limits is not None and len(sizes) > 1:
                assert sum(sizes) <= limits[robot]
            sent_bytes[robot] += sum(sizes)
        simulation.step()
    assert (sent_bytes > 0.0).all()
    assert (sent_bytes <= 2000.0 * simulation.time + 1400.0).all()


def test_a_robot_sends_its_scan_a_digest_and_a_limited_number_of_repairs() -> None:
    simulation = build_simulation(conditions=Conditions(loss=0.9))
    repair_counts = []
    for _ in range(120):
        for messages in simulation.observe_and_decide().decision.messages:
            kinds = [type(message.payload) for message in messages]
            if kinds:
                assert kinds[:2] == [NumberedScan, Digest]
                repair_counts.append(kinds.count(NumberedScan) - 1)
        simulation.step()
    assert 0 < max(repair_counts) <= MAX_REPAIRS


def test_nothing_is_sent_twice_under_ideal_communication() -> None:
    simulation = build_simulation()
    sent = []
    for _ in range(60):
        for messages in simulation.observe_and_decide().decision.messages:
            scans = [each.payload for each in messages if isinstance(each.payload, NumberedScan)]
            sent += [(scan.robot, scan.round_number) for scan in scans]
        simulation.step()
    assert sorted(sent) == [(robot, number) for robot in range(len(CORNER)) for number in range(6)]


@pytest.mark.parametrize(
    ("sizes", "limit", "expected"),
    [
        ([100, 100, 100], np.inf, 3),
        ([100, 100, 100], 250.0, 2),
        ([100, 100], 200.0, 2),
        ([100, 100], 1.0, 1),
        ([100], 0.0, 0),
        ([], 100.0, 0),
    ],
)
def test_messages_within_the_limit_or_a_single_one_are_sent(
    sizes: list[int], limit: float, expected: int
) -> None:
    assert _count_sendable([Message(None, size) for size in sizes], limit) == expected


@pytest.mark.parametrize("name", NAMES)
def test_a_single_robot_sends_nothing(name: str) -> None:
    simulation = Simulation(ROOMS, make_controller(name), CORNER[:1], dt=0.05)
    run_until(simulation, 1.1)
    assert simulation.sent_bytes == 0
    assert len(list_scans(simulation.memory.exchange, 0)) == 3


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=count_examples(3), phases=[Phase.generate])
@given(seed=st.integers(0, 2**32 - 1), loss=st.sampled_from([0.0, 0.3, 0.8]), robot=st.integers(0, 3))
def test_undelivered_messages_change_no_decision(name: str, seed: int, loss: float, robot: int) -> None:
    """A robot decides the same, bit for bit, if all that it does not receive is replaced."""
    conditions = Conditions(loss=loss, delay=0.2, message_rate=4.0, bandwidth=4000.0, seed=seed)
    simulation = build_simulation(name, conditions, communication_range=3.0)
    observations, decisions = record_run(simulation, 70)
    repeated = replay(simulation, hide_undelivered(observations, robot, seed))
    assert extract_robot_decisions(repeated, robot) == extract_robot_decisions(decisions, robot)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_copies_continue_identically_while_messages_are_lost(name: str) -> None:
    simulation = build_simulation(name, LOSSY)
    run_until(simulation, 3.0)
    copy = simulation.copy()
    for each in (simulation, copy):
        run_until(each, 6.0)
    assert simulation.positions.tobytes() == copy.positions.tobytes()
    maps = [get_exchange(each).maps[0].state.tobytes() for each in (simulation, copy)]
    assert maps[0] == maps[1]


@pytest.mark.parametrize("name", NAMES)
def test_controllers_exchange_scans(name: str) -> None:
    assert CONTROLLERS[name].scanning.rays == 240
    simulation = build_simulation(name)
    simulation.step()
    assert simulation.sent_bytes == len(CORNER) * (542 + 8 + 12 * len(CORNER) + 1)


def test_reports_are_sent_if_a_neighbor_is_not_in_range_of_all_others() -> None:
    """Robot 2, in the middle, is in range of robots 1 and 3, which are out of range of each other."""
    team = Team.homogeneous(3, communication_range=5.0)
    starts = [[6.5, 1.5], [10.0, 1.5], [13.5, 1.5]]
    simulation = Simulation(HALL, make_controller("atlas-shared"), starts, team, dt=0.05)
    reporters = set()
    for _ in range(12):
        for robot, messages in enumerate(simulation.observe_and_decide().decision.messages):
            reports = [each for each in messages if isinstance(each.payload, TeammateReport)]
            if reports:
                reporters.add(robot)
                assert reports[0].size == 28 * len(reports[0].payload.robots)
        simulation.step()
    assert reporters == {1}


def test_robots_in_range_of_all_others_send_no_reports() -> None:
    simulation = build_simulation("atlas-shared")
    for _ in range(30):
        for messages in simulation.observe_and_decide().decision.messages:
            assert not any(isinstance(each.payload, TeammateReport) for each in messages)
        simulation.step()


def test_a_message_replaces_one_of_the_same_kind_that_waits() -> None:
    exchange: ScanExchange = build_simulation().memory.exchange
    first = Message(1.0, size=8)
    other = Message("report", size=6)
    second = Message(2.0, size=8)
    for message in (first, other, second):
        exchange = exchange.add_message(2, message)
    assert exchange.robots[2].outgoing == (second, other)
    assert exchange.robots[0].outgoing == ()
