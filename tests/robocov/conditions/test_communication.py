"""Messages, against a plain simulation of every one of them."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import floor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.conditions import LOSS, Conditions
from robocov.conditions.communication import Inbox, Radio
from robocov.conditions.random_streams import RandomStream
from robocov.controllers import CONTROLLERS, Controller, atlas, inform_controller
from robocov.environment import Environment
from robocov.errors import InputError
from robocov.observation import Observations, Scans
from robocov.observation.neighbours import Neighbours
from robocov.observation.region import Region
from robocov.team import Team
from robocov.voronoi import partition

DT = 0.1
OPEN = Environment("open", ((0, 0), (10, 0), (10, 10), (0, 10)))
SQUARE = Region(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]]))


def build_radio(conditions: Conditions, ranges: np.ndarray, dt: float = DT) -> Radio:
    return Radio(conditions, ranges, dt)


def walks(n: int, steps: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.asarray(
        rng.uniform(2, 8, size=(n, 2)) + np.cumsum(rng.normal(scale=0.2, size=(steps, n, 2)), axis=0)
    )


def told_one_by_one(
    conditions: Conditions, ranges: np.ndarray, places: np.ndarray, working: np.ndarray
) -> list[dict[tuple[int, int], tuple[int, np.ndarray]]]:
    """Return what each robot knows of each other at every step, by looking through all messages each time."""
    chance = RandomStream(conditions.seed, LOSS)
    messages, known, sent = [], [], 0
    for step, now in enumerate(places):
        rate = conditions.message_rate
        if rate is None or step * DT + 1e-9 >= sent / rate:
            sent += 1
            for i in range(len(now)):
                for j in range(len(now)):
                    far = np.hypot(*(now[i] - now[j])) > min(ranges[i], ranges[j])
                    if i == j or far or not (working[step, i] and working[step, j]):
                        continue
                    if chance.draw_uniform(step, np.array([i]), np.array([j]))[0] >= conditions.loss:
                        messages.append((step * DT + conditions.delay, step, i, j, now[j].copy()))
        found: dict[tuple[int, int], tuple[int, np.ndarray]] = {}
        for arrives, when, i, j, place in messages:
            # it is there at the first step not before it arrives
            arrived = np.ceil(arrives / DT - 1e-9)
            if (
                arrived <= step
                and (step - arrived) * DT <= conditions.forget_after + 1e-9
                and working[step, i]
            ):
                found[i, j] = (when, place)
        known.append(found)
    return known


@settings(max_examples=30)
@given(
    st.integers(2, 5),
    st.sampled_from([0.0, 0.3, 0.9, 1.0]),
    st.sampled_from([0.0, 0.05, 0.1, 0.34]),
    st.sampled_from([None, 10.0, 4.0, 2.5]),
    st.sampled_from([0.4, 1.0, 9.0]),
    st.sampled_from([2.0, np.inf]),
    st.integers(0, 2**20),
)
def test_messages_agree_with_a_simulation_of_each_message(
    n: int, loss: float, delay: float, rate: float | None, forget: float, reach: float, seed: int
) -> None:
    conditions = Conditions(loss=loss, delay=delay, message_rate=rate, forget_after=forget, seed=seed)
    places, ranges = walks(n, 25, seed), np.full(n, reach)
    ranges[0] *= 0.7
    working = np.ones((25, n), dtype=bool)
    working[12:, 1] = False
    radio, inbox = build_radio(conditions, ranges, DT), Inbox.create_empty(n)
    expected = told_one_by_one(conditions, ranges, places, working)
    for step, now in enumerate(places):
        inbox = radio.exchange_messages(inbox, step, now, now, working[step])
        neighbours, heard, ages = radio.read_reports(inbox, step, working[step])
        robot, other = neighbours.list_pairs()
        assert list(zip(robot.tolist(), other.tolist(), strict=True)) == sorted(expected[step])
        for k, pair in enumerate(sorted(expected[step])):
            when, place = expected[step][pair]
            assert (heard[k] == place).all()
            assert ages[k] == pytest.approx((step - when) * DT)


@pytest.mark.parametrize(("delay", "dt", "steps"), [(0.14, 0.02, 7), (0.7, DT, 7), (0.71, DT, 8)])
def test_latency_and_silence_of_whole_steps_are_exact(delay: float, dt: float, steps: int) -> None:
    """Also where 0.14 / 0.02 is more than 7, and 3 x 0.1 more than 0.3."""
    radio = build_radio(Conditions(delay=delay, forget_after=round(3 * dt, 2)), np.ones(2), dt)
    inbox, working, heard = Inbox.create_empty(2), np.ones(2, dtype=bool), []
    for step in range(16):
        places = np.array([[0.0, 0.0], [9.0 * step, 0.0]])  # out of range after the first message
        inbox = radio.exchange_messages(inbox, step, places, places, working)
        heard.append(len(radio.read_reports(inbox, step, working)[1]) > 0)
    assert np.flatnonzero(heard).tolist() == list(range(steps, steps + 4))


@pytest.mark.parametrize(("dt", "rate"), [("0.03", 30), ("0.03", 15), ("0.1", 4)])
def test_messages_are_sent_whenever_a_period_has_passed(dt: str, rate: int) -> None:
    """Also where 30 * (0.03 * 30) is less than 27 by rounding."""
    radio = Radio(Conditions(message_rate=rate), np.full(2, np.inf), float(dt))
    positions = np.array([[0.0, 0.0], [1.0, 0.0]])
    working = np.ones(2, dtype=bool)
    inbox = Inbox.create_empty(2)
    sent_steps = []
    for step in range(100):
        inbox = radio.exchange_messages(inbox, step, positions, positions, working)
        if inbox.sent[0, 1] == step:
            sent_steps.append(step)
    messages = [floor(Fraction(dt) * rate * step) for step in range(-1, 100)]
    assert sent_steps == [step for step in range(100) if messages[step + 1] > messages[step]]


def test_inboxes_are_immutable() -> None:
    """So that a copy of a run can hold the same one."""
    radio = build_radio(Conditions(delay=0.2, loss=0.2), np.full(3, np.inf), DT)
    inbox, working = Inbox.create_empty(3), np.ones(3, dtype=bool)
    for step, now in enumerate(walks(3, 12, 4)):
        before = [
            inbox.sent.tobytes(),
            inbox.arrived.tobytes(),
            inbox.places.tobytes(),
            len(inbox.in_flight),
        ]
        once = radio.exchange_messages(inbox, step, now, now, working)
        again = radio.exchange_messages(inbox, step, now, now, working)
        assert once.places.tobytes() == again.places.tobytes()
        assert [
            inbox.sent.tobytes(),
            inbox.arrived.tobytes(),
            inbox.places.tobytes(),
            len(inbox.in_flight),
        ] == before
        inbox = once


def test_messages_are_lost_with_the_given_probability() -> None:
    n, steps = 40, 30
    radio = build_radio(Conditions(loss=0.3, forget_after=0.01, seed=1), np.full(n, np.inf), DT)
    inbox, working, got = Inbox.create_empty(n), np.ones(n, dtype=bool), 0
    for step, now in enumerate(walks(n, steps, 1)):
        inbox = radio.exchange_messages(inbox, step, now, now, working)
        got += len(radio.read_reports(inbox, step, working)[1])
    sent = steps * n * (n - 1)
    assert abs(got / sent - 0.7) < 5 * np.sqrt(0.21 / sent)


# what controllers make of it


def seen_by(
    kind: type, places: np.ndarray, neighbours: Neighbours, heard: np.ndarray | None, seed: int
) -> Observations:
    rng = np.random.default_rng(seed)
    points = places + rng.normal(scale=0.8, size=places.shape)
    scanning = getattr(kind(), "scanning", None)
    scans = None
    if scanning is not None:
        distances = rng.uniform(1.0, 3.0, size=(len(places), scanning.rays))
        scans = Scans(distances, rng.random(distances.shape) < 0.3)
    return Observations(
        places,
        rng.normal(size=places.shape),
        neighbours,
        points,
        SQUARE,
        max_speeds=np.ones(len(places)),
        scans=scans,
        reported_positions=heard,
        report_ages=None if heard is None else np.zeros(len(heard)),
    )


def made(kind: type) -> Controller:
    """Return a controller, the informed ones with the map."""
    controller: Controller = inform_controller(kind(), OPEN)
    return controller


SHARING = ("atlas-shared", "frontier-median", "greedy-submodular", "voronoi-graph")
PLANNING = ("atlas", *SHARING)
"""Controllers that take long to decide: one example is enough."""

LIGHT = tuple(kind for kind in CONTROLLERS.values() if kind.name not in PLANNING)


@pytest.mark.parametrize("kind", LIGHT, ids=lambda kind: str(kind.name))
@settings(max_examples=15)
@given(n=st.integers(2, 14), seed=st.integers(0, 2**32), reach=st.floats(2.0, 12.0))
def test_reports_of_true_positions_change_no_decision(kind: type, n: int, seed: int, reach: float) -> None:
    """Bit for bit: where messages say what is, the decisions are those without messages."""
    places = np.random.default_rng(seed).uniform(1, 9, size=(n, 2))
    neighbours = Neighbours.from_ranges(places, np.full(n, reach))
    controller = made(kind)
    team = Team.homogeneous(n, communication_range=reach)
    plain = controller.decide(seen_by(kind, places, neighbours, None, seed), controller.begin(SQUARE, team))
    heard = places[neighbours.list_pairs()[1]]
    told = controller.decide(seen_by(kind, places, neighbours, heard, seed), controller.begin(SQUARE, team))
    assert told.forces.tobytes() == plain.forces.tobytes()
    if plain.goals is not None and told.goals is not None:
        assert told.goals.tobytes() == plain.goals.tobytes()


@pytest.mark.parametrize("kind", LIGHT, ids=lambda kind: str(kind.name))
@settings(max_examples=15)
@given(n=st.integers(2, 14), seed=st.integers(0, 2**32))
def test_robots_decide_by_reports_and_not_by_true_positions(kind: type, n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = rng.uniform(1, 9, size=(n, 2))
    pairs = [(i, j) for i in range(n) for j in range(n) if i != j and rng.random() < 0.7]
    robot, other = (np.array([pair[k] for pair in pairs], dtype=np.intp) for k in (0, 1))
    neighbours = Neighbours.from_pairs(n, robot, other)
    heard = places[other] + rng.normal(scale=0.5, size=(len(pairs), 2))
    i = int(rng.integers(n))
    controller = made(kind)
    team = Team.homogeneous(n)
    seen = seen_by(kind, places, neighbours, heard, seed)
    before = controller.decide(seen, controller.begin(SQUARE, team)).forces[i]
    # all others are elsewhere, and have heard other things
    elsewhere = np.where((np.arange(n) == i)[:, None], places, rng.uniform(1, 9, size=(n, 2)))
    otherwise = np.where((robot == i)[:, None], heard, rng.uniform(1, 9, size=heard.shape))
    moved = replace(seen, positions=elsewhere, reported_positions=otherwise)
    after = controller.decide(moved, controller.begin(SQUARE, team)).forces[i]
    assert before.tobytes() == after.tobytes()


@pytest.mark.parametrize("kind", CONTROLLERS.values(), ids=lambda kind: str(kind.name))
def test_reports_affect_decisions(kind: type) -> None:
    """The property above is not empty: what robot 1 is told is near makes a difference to it."""
    places = np.array([[4.0, 4.0], [5.0, 4.5], [8.0, 6.0]])
    neighbours = Neighbours.from_ranges(places, np.full(3, 20.0))
    heard = places[neighbours.list_pairs()[1]]
    nearer = heard.copy()
    nearer[0] = [3.77, 4.0]
    controller, team = made(kind), Team.homogeneous(3)
    forces = [
        controller.decide(seen_by(kind, places, neighbours, told, 1), controller.begin(SQUARE, team)).forces
        for told in (heard, nearer)
    ]
    assert not np.array_equal(forces[0][0], forces[1][0])
    if kind.name not in SHARING:
        assert forces[0][1:].tobytes() == forces[1][1:].tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANNING)
def test_planning_controllers_decide_by_reports(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(atlas, "_LISTENING_S", 0.0)
    kind, team = CONTROLLERS[name], Team.homogeneous(4)
    places = np.random.default_rng(5).uniform(1, 9, size=(4, 2))
    neighbours = Neighbours.from_ranges(places, np.full(4, 20.0))
    heard = places[neighbours.list_pairs()[1]]
    plain, told, moved = (
        made(kind).decide(seen_by(kind, *seen, 5), made(kind).begin(SQUARE, team)).forces
        for seen in (
            (places, neighbours, None),
            (places, neighbours, heard),
            (places, neighbours, np.where(np.arange(len(heard))[:, None] < 3, heard, heard + 0.7)),
        )
    )
    assert told.tobytes() == plain.tobytes()
    if name == "atlas":
        assert moved[0].tobytes() == told[0].tobytes()


@given(st.integers(1, 20), st.integers(0, 2**32))
def test_cells_by_reports_agree_with_a_partition_for_each_robot(n: int, seed: int) -> None:
    """Row by row against a partition of that robot and the others where it believes them to be."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(0.5, 9.5, size=(n, 2))
    robot, other = np.nonzero((rng.random((n, n)) < 0.6) & ~np.eye(n, dtype=bool))
    heard = rng.uniform(0, 10, size=(len(robot), 2))
    cells = partition(places, SQUARE, Neighbours.from_pairs(n, robot, other), reported_positions=heard)
    for i in range(n):
        picture = np.concatenate([places[i : i + 1], heard[robot == i]])
        own = partition(picture, SQUARE, Neighbours(len(picture)))
        assert cells.mass[i] == pytest.approx(own.mass[0], rel=1e-9, abs=1e-12)
        np.testing.assert_allclose(cells.centroid[i], own.centroid[0], atol=1e-9)
        assert set(cells.edges.beyond[cells.edges.cell == i].tolist()) <= {-1, *other[robot == i].tolist()}


@pytest.mark.parametrize("n", [3, 63, 66, 120])
def test_cells_by_true_reports_equal_ordinary_cells(n: int) -> None:
    """Bit for bit, also where only the nearest of those that a robot hears are sorted at first."""
    places = np.random.default_rng(n).uniform(0.5, 9.5, size=(n, 2))
    places[: n // 2] *= 0.05  # a crowd, whose far neighbours matter
    neighbours = Neighbours.from_ranges(places, np.full(n, 20.0))
    plain = partition(places, SQUARE, neighbours)
    told = partition(places, SQUARE, neighbours, reported_positions=places[neighbours.list_pairs()[1]])
    assert told.mass.tobytes() == plain.mass.tobytes()
    assert told.centroid.tobytes() == plain.centroid.tobytes()


def test_reported_positions_without_neighbours_are_rejected() -> None:
    with pytest.raises(InputError, match="reported_positions: expected None without limited communication"):
        partition(np.ones((2, 2)), SQUARE, reported_positions=np.ones((2, 2)))


def test_inboxes_can_be_selected_for_another_team() -> None:
    radio, inbox = build_radio(Conditions(delay=0.2), np.full(3, np.inf), DT), Inbox.create_empty(3)
    working = np.ones(3, dtype=bool)
    for step, now in enumerate(walks(3, 6, 2)):
        inbox = radio.exchange_messages(inbox, step, now, now, working)
    other = inbox.select_robots(np.array([2, -1, 0]))
    assert other.sent[0, 2] == inbox.sent[2, 0]
    assert (other.places[0, 2] == inbox.places[2, 0]).all()
    assert (other.sent[1] == -1).all()
    assert (other.sent[:, 1] == -1).all()
    assert len(other.in_flight) == len(inbox.in_flight) == 2
    assert not other.in_flight[0].is_received[:, 1].any()
    assert other.in_flight[0].is_received[0, 2]
