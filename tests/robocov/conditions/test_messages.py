"""Messages of controllers: their way from the decision of one robot to the observations of others."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.conditions import Conditions
from robocov.conditions.communication import MAX_PACKET_BYTES, POSITION_BYTES
from robocov.controllers import Lloyd
from robocov.controllers.individual import OwnView
from robocov.cost import CoverageCost
from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.metrics import compute_cost_history, summarize
from robocov.metrics.communication import compute_sent_rate
from robocov.observation import Decision, Message, Observations
from robocov.observation.region import Region
from robocov.record import Record
from robocov.simulation import Simulation, SimulationBatch
from robocov.team import Team

DT = 0.1
HALL = Environment("hall", ((0, 0), (20, 0), (20, 10), (0, 10)))
STARTS = np.array([[1.0, 5.0], [3.0, 5.0], [12.0, 5.0]])


@dataclass(frozen=True)
class Chatter:
    """Each robot sends a message of some size with the time at every step, and remembers all that it gets."""

    size: int = 8
    name = "chatter"
    label = "Chatter"
    summary = "sends the time"

    def begin(self, region: Region, team: Team) -> Any:
        return [[] for _ in range(len(team))]

    def decide(self, seen: Observations, memory: Any) -> Decision:
        heard = [
            [*memory[robot], *((seen.time, *message) for message in seen.get_messages(robot))]
            for robot in range(len(seen.positions))
        ]
        message = Message(round(seen.time, 6), self.size)
        forces = np.zeros_like(seen.positions)
        return Decision(forces, memory=heard, messages=[[message]] * len(forces))


def simulate(
    conditions: Conditions | None = None, *, steps: int = 20, size: int = 8, **team: Any
) -> Simulation:
    """Return a simulation of chatting robots after some steps."""
    robots = Team.homogeneous(len(STARTS), **team)
    simulation = Simulation(HALL, Chatter(size), STARTS, robots, DT, conditions=conditions)
    for _ in range(steps):
        simulation.step()
    return simulation


def list_heard(simulation: Simulation, robot: int, sender: int) -> list[tuple[float, float]]:
    """Return when a robot heard a sender, and when the messages were sent, s."""
    heard = simulation.memory[robot]
    return [(round(time, 6), payload) for time, other, payload in heard if other == sender]


def test_messages_arrive_in_the_next_step_at_all_robots_in_range() -> None:
    simulation = simulate(steps=3, communication_range=5.0)
    assert list_heard(simulation, 0, 1) == [(0.1, 0.0), (0.2, 0.1)]
    assert list_heard(simulation, 1, 0) == [(0.1, 0.0), (0.2, 0.1)]
    assert simulation.memory[2] == []
    assert simulation.sent_bytes == 3 * 3 * 8


def test_records_contain_the_bytes_sent_so_far() -> None:
    record = simulate(steps=2).copy().run(1.0)
    assert record.sent_bytes is not None
    assert record.sent_bytes.tolist() == [24.0 * step for step in range(2, 13)]
    assert compute_sent_rate(record) == pytest.approx(8 / DT)
    assert compute_sent_rate(record.until(0.7)) == pytest.approx(8 / DT)
    batch = SimulationBatch(HALL, Chatter(), [STARTS, STARTS], dt=DT)
    for run_record in batch.run(1.0):
        assert run_record.sent_bytes is not None
        assert run_record.sent_bytes.tolist() == [24.0 * step for step in range(11)]


def test_bytes_sent_are_saved(tmp_path: Path) -> None:
    record = simulate(steps=0).run(1.0)
    record.save(tmp_path)
    loaded = Record.load(tmp_path)
    np.testing.assert_array_equal(loaded.sent_bytes, record.sent_bytes)
    history = compute_cost_history(record, CoverageCost(HALL, lattice=8))
    assert summarize(record, history)["sent_bytes_per_s"] == pytest.approx(8 / DT)
    silent = Simulation(HALL, Lloyd(), STARTS).run(1.0)
    assert silent.sent_bytes is None
    assert "sent_bytes_per_s" not in summarize(silent, history)
    assert compute_sent_rate(silent) == 0.0


@pytest.mark.parametrize(("delay", "steps"), [(0.0, 1), (0.1, 1), (0.2, 2), (0.25, 3)])
def test_messages_are_as_late_as_positions(delay: float, steps: int) -> None:
    heard = list_heard(simulate(Conditions(delay=delay)), 0, 1)
    assert heard == [(round(k * DT, 6), round((k - steps) * DT, 6)) for k in range(steps, 20)]


def test_messages_wait_until_positions_are_sent() -> None:
    simulation = simulate(Conditions(message_rate=2.0))
    arrivals = [time for time, _ in list_heard(simulation, 0, 1)]
    assert set(arrivals) == {0.1, 0.6, 1.1, 1.6}
    assert arrivals.count(1.1) == 5


def test_all_messages_can_be_lost() -> None:
    assert all(not heard for heard in simulate(Conditions(loss=1.0)).memory)


def test_a_message_is_lost_with_any_of_its_packets() -> None:
    size = 2 * MAX_PACKET_BYTES + 1
    heard = list_heard(simulate(Conditions(loss=0.2, seed=3), steps=500, size=size), 0, 1)
    assert len(heard) / 500 == pytest.approx(0.8**3, abs=0.08)


@settings(max_examples=count_examples(20), deadline=None)
@given(bandwidth=st.floats(100.0, 5e3), size=st.integers(1, 3000), rate=st.sampled_from([None, 2.0]))
def test_the_bandwidth_limits_what_robots_send(bandwidth: float, size: int, rate: float | None) -> None:
    conditions = Conditions(bandwidth=bandwidth, message_rate=rate)
    simulation = simulate(conditions, steps=100, size=size)
    assert simulation.sent_bytes / 3 <= bandwidth * 100 * DT + bandwidth + size
    sent = [payload for _, payload in list_heard(simulation, 0, 1)]
    assert sent == [round(k * DT, 6) for k in range(len(sent))]
    # Positions still get through.
    assert simulation.inbox is not None
    assert simulation.inbox.sent_steps[0, 1] >= 0
    if bandwidth * DT > size + POSITION_BYTES and rate is None:
        assert len(sent) == 99


def test_a_robot_knows_how_much_it_can_send() -> None:
    simulation = simulate(Conditions(bandwidth=1000.0), steps=0)
    limits = simulation.observe().send_limits
    np.testing.assert_allclose(limits, 1000.0 * DT - POSITION_BYTES)
    busy = simulate(Conditions(bandwidth=1000.0), steps=5, size=5000)
    np.testing.assert_array_equal(busy.observe().send_limits, 0.0)
    assert simulate().observe().send_limits is None


def test_robots_that_do_not_work_send_and_receive_nothing() -> None:
    simulation = simulate(Conditions(failures=((2, 0.5),), joins=((3, 1.0),)))
    assert max(sent for _, sent in list_heard(simulation, 0, 1)) < 0.5
    assert min(sent for _, sent in list_heard(simulation, 0, 2)) >= 1.0
    assert min(time for time, _, _ in simulation.memory[2]) > 1.0


@settings(max_examples=count_examples(15), deadline=None)
@given(
    loss=st.sampled_from([0.0, 0.4]),
    delay=st.sampled_from([0.0, 0.35]),
    rate=st.sampled_from([None, 3.0]),
    bandwidth=st.sampled_from([None, 500.0]),
)
def test_copies_continue_with_the_same_messages(
    loss: float, delay: float, rate: float | None, bandwidth: float | None
) -> None:
    conditions = Conditions(loss=loss, delay=delay, message_rate=rate, bandwidth=bandwidth)
    simulation = simulate(conditions, steps=7, size=200)
    twin = simulation.copy()
    resumed = simulate(conditions, steps=0, size=200).with_memory(simulation.memory, simulation.inbox)
    resumed._steps = simulation._steps
    for _ in range(10):
        simulation.step()
    for other in (twin, resumed):
        for _ in range(10):
            other.step()
        assert other.memory == simulation.memory


def test_another_controller_does_not_get_the_messages() -> None:
    simulation = simulate(Conditions(delay=0.5))
    assert simulation.inbox is not None and simulation.inbox.has_messages
    changed = simulation.with_changes(controller=Chatter(9))
    assert changed.inbox is not None and not changed.inbox.has_messages
    kept = simulation.with_changes(positions=simulation.positions)
    assert kept.inbox is simulation.inbox


def test_changed_copies_continue_the_totals_of_the_run() -> None:
    simulation = simulate()
    simulation.decision_time = 7.0
    changed = simulation.with_changes(controller=Chatter(9))
    assert (changed.sent_bytes, changed.decision_time) == (simulation.sent_bytes, 7.0)


def test_runs_of_a_batch_exchange_messages_like_single_runs() -> None:
    team = Team.homogeneous(3, communication_range=5.0)
    batch = SimulationBatch(HALL, Chatter(), [STARTS, STARTS + [0.0, 2.0]], team, DT)
    for _ in range(5):
        batch.step()
    for run, starts in enumerate([STARTS, STARTS + [0.0, 2.0]]):
        single = Simulation(HALL, Chatter(), starts, team, DT)
        for _ in range(5):
            single.step()
        assert batch._memories[run] == single.memory


@dataclass
class Counter:
    """A controller of one robot that sends and counts messages."""

    def force(self, own: OwnView) -> tuple[float, float]:
        own.memory = (own.memory or 0) + len(own.messages)
        own.send({"number": own.number}, 4)
        return 0.0, 0.0


def test_controllers_of_one_robot_can_send_messages() -> None:
    simulation = Simulation(HALL, Counter(), STARTS, dt=DT)
    for _ in range(4):
        simulation.step()
    assert list(simulation.memory.by_robot) == [6, 6, 6]


@pytest.mark.parametrize("size", [0, -1, 1.5, True, None])
def test_sizes_of_messages_are_checked(size: Any) -> None:
    with pytest.raises(ParameterError, match="message: size: expected a whole number of bytes"):
        Message("text", size)


@pytest.mark.parametrize("messages", [3, [[]], [["text"], [], []]])
def test_other_things_than_messages_are_rejected(messages: Any) -> None:
    class Wrong(Chatter):
        def decide(self, seen: Observations, memory: Any) -> Decision:
            return Decision(np.zeros_like(seen.positions), messages=messages)

    with pytest.raises(ParameterError, match="returned messages"):
        Simulation(HALL, Wrong(), STARTS).step()
