from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from drawn_run import ROOMS
from robocov_app.live.cost_worker import CostWorker
from robocov_app.live.messages import Answer, Building, Failed, Ready, receive, send

from robocov.cost import CoverageCost
from robocov.environment import CircleObstacle, Environment, PolygonObstacle
from robocov_app.live import talk
from robocov_app.render.field import Field, FieldLattice

PLACES = np.array([[2.0, 2.0], [12.0, 7.0], [10.0, 1.0]])
PATIENCE = 60.0
"""Seconds after which nothing will come any more."""


def crowded(count: int, seed: int = 0) -> Environment:
    """A map that takes a second or so."""
    rng = np.random.default_rng(seed)
    places = [(x, y) for x in range(1, 40) for y in range(1, 40)]
    rng.shuffle(places)
    turn = np.linspace(0.0, 2.0 * np.pi, 9)[:-1]
    rings = (
        tuple((x + 0.3 * np.cos(a + rng.random() * 0.1), y + 0.3 * np.sin(a)) for a in turn)
        for x, y in places[:count]
    )
    square = ((0, 0), (40, 0), (40, 40), (0, 40))
    return Environment("crowded", square, tuple(PolygonObstacle(ring) for ring in rings))


def until(worker: CostWorker, wanted, ask=None):
    """Poll until an event is as wanted; return it and all before it."""
    events, end = [], time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if ask is not None:
            worker.ask(*ask)
        for event in worker.poll():
            events.append(event)
            if wanted(event):
                return event, events
        time.sleep(0.005)
    raise AssertionError(events)


def is_answer_for(generation):
    return lambda event: isinstance(event, Answer) and event.generation == generation


def test_answers_are_those_of_the_cost():
    with CostWorker() as worker:
        generation = worker.environment(ROOMS, 48)
        ready, events = until(worker, lambda event: isinstance(event, Ready))
        assert isinstance(events[0], Building)
        assert events[0].fraction == 0.0
        assert events[0].seconds_left == pytest.approx(CostWorker().estimate(ROOMS, 48))
        answer, _ = until(worker, is_answer_for(generation), (7.5, PLACES))
    expected = CoverageCost(ROOMS, 48)(PLACES)
    assert answer.time == 7.5
    assert answer.seconds > 0.0
    for name in ("mean_distance", "value", "uncovered_area"):
        assert getattr(answer.result, name) == getattr(expected, name)
    for name in ("distances", "owner", "corner", "last_corner", "points", "corners", "positions", "gradient"):
        np.testing.assert_array_equal(getattr(answer.result, name), getattr(expected, name))
    # all that a picture needs is there
    assert (
        Field(FieldLattice(ready.sites), answer.result).largest
        == expected.distances[expected.owner >= 0].max()
    )


def test_only_the_newest_question_counts():
    with CostWorker() as worker:
        generation = worker.environment(ROOMS, 32)
        until(worker, lambda event: isinstance(event, Ready))
        for k in range(2000):
            worker.ask(float(k), PLACES)
        _, events = until(worker, lambda event: isinstance(event, Answer) and event.time == 1999.0)
        times = [event.time for event in events if isinstance(event, Answer)]
        assert times == sorted(times)
        assert len(times) < 1000
        assert {event.generation for event in events} == {generation}


def test_the_old_map_answers_until_the_new_one_is_ready():
    with CostWorker() as worker:
        first = worker.environment(ROOMS, 32)
        until(worker, is_answer_for(first), (0.0, PLACES))
        second = worker.environment(crowded(150), 200)
        _, events = until(worker, is_answer_for(second), (1.0, PLACES + 0.5))
        building = [event for event in events if isinstance(event, Building)]
        assert {event.generation for event in building} == {second}
        fractions = [event.fraction for event in building]
        assert fractions == sorted(fractions)
        assert all(event.seconds_left >= 0.0 for event in building)
        kinds = [type(event) for event in events]
        assert Answer in kinds[: kinds.index(Ready)]
        assert all(e.generation == first for e in events[: kinds.index(Ready)] if isinstance(e, Answer))


def test_a_map_that_is_overtaken_is_not_finished():
    with CostWorker() as worker:
        worker.environment(crowded(150), 400)
        until(worker, lambda event: isinstance(event, Building) and event.fraction > 0.0)
        second = worker.environment(crowded(151), 400)
        third = worker.environment(ROOMS, 32)
        ready, _ = until(worker, lambda event: isinstance(event, Ready))
        assert (second, ready.generation) == (2, third)


def test_no_call_waits(monkeypatch):
    """A frame loop goes on while maps are built, answered and replaced, and while nobody reads."""
    gate, waited = threading.Event(), []
    real = talk.send

    def slow(stream, message):
        waited.append(gate.wait(PATIENCE))
        real(stream, message)

    monkeypatch.setattr(talk, "send", slow)
    worker = CostWorker()
    for k in range(300):
        if k % 50 == 0:
            worker.environment(replace(ROOMS, obstacles=ROOMS.obstacles[: k // 50]), 32)
        worker.ask(k / 60.0, PLACES)
        assert all(isinstance(event, Building) for event in worker.poll())
    gate.set()
    answer, _ = until(worker, lambda event: isinstance(event, Answer))
    assert answer.generation == 6
    worker.close()
    assert all(waited), "nobody had to wait until the gate gave up"


def test_what_cannot_be_is_said_and_the_next_can():
    blocked = Environment("blocked", ((0, 0), (1, 0), (1, 1), (0, 1)), (CircleObstacle((0.5, 0.5), 0.3),))
    with CostWorker() as worker:
        worker.environment(blocked, 1)
        failed, _ = until(worker, lambda event: isinstance(event, Failed))
        assert "none of its sites is free" in failed.message
        generation = worker.environment(ROOMS, 32)
        until(worker, lambda event: isinstance(event, Ready))
        failed, _ = until(worker, lambda event: isinstance(event, Failed), (0.0, np.array([[4.5, 4.0]])))
        assert "outside the free space" in failed.message
        until(worker, is_answer_for(generation), (0.0, PLACES))


@pytest.mark.skipif(sys.platform == "win32", reason="no such signals")
def test_a_process_that_dies_is_said_and_replaced():
    with CostWorker() as worker:
        generation = worker.environment(ROOMS, 32)
        until(worker, is_answer_for(generation), (0.0, PLACES))
        os.kill(worker._talk._process.pid, signal.SIGKILL)
        failed, _ = until(worker, lambda event: isinstance(event, Failed))
        assert "has ended" in failed.message
        until(worker, is_answer_for(generation), (1.0, PLACES))


PARENT = """
import signal, time
# whoever starts the tests may have had this one ignored
signal.signal(signal.SIGINT, signal.default_int_handler)
from robocov.mapfile import load_map
from robocov_app.live.cost_worker import CostWorker
worker = CostWorker()
worker.environment(load_map("museum"), 64)
while not any(type(event).__name__ == "Ready" for event in worker.poll()):
    time.sleep(0.01)
print(worker._talk._process.pid, flush=True)
while True:  # a signal just before a sleep does not end it
    time.sleep(0.1)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no such signals")
@pytest.mark.parametrize("way", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_no_process_outlives_its_parent(way):
    parent = subprocess.Popen(
        [sys.executable, "-c", PARENT], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    with parent:
        try:
            child = int(parent.stdout.readline())
            parent.send_signal(way)
            parent.wait(PATIENCE)
        finally:
            parent.kill()
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        try:
            os.kill(child, 0)
        except ProcessLookupError:
            return
        # in a container there may be nobody to take away what has ended
        with open(f"/proc/{child}/stat") as file:  # noqa: PTH123
            if file.read().rpartition(")")[2].split()[0] == "Z":
                return
        time.sleep(0.02)
    raise AssertionError("it goes on")


def test_estimates_learn_from_what_it_took():
    worker = CostWorker()
    before = worker.estimate(ROOMS, 128)
    assert worker.estimate(ROOMS, 256) > 2.0 * before
    assert worker.estimate(crowded(150), 128) > before
    worker._expected = {1: before, 2: before}
    for generation in (1, 2):
        worker._learn(Ready(generation, None, None, 4.0 * before))
    assert worker.estimate(ROOMS, 128) == pytest.approx(before * 4.0**0.75)
    # from the cache
    worker._expected = {3: before}
    worker._learn(Ready(3, None, None, 1e-4 * before))
    assert worker.estimate(ROOMS, 128) == pytest.approx(before * 4.0**0.75)


@pytest.mark.parametrize("cut", [0, 3, 8, 20])
def test_a_message_that_ends_too_early_is_the_end(tmp_path, cut):
    path = tmp_path / "pipe"
    with path.open("wb") as file:
        send(file, {"a": np.arange(5)})
    whole = path.read_bytes()
    path.write_bytes(whole + whole[:cut])
    with path.open("rb") as file:
        assert receive(file)["a"].tolist() == [0, 1, 2, 3, 4]
        assert receive(file) is None


def test_closing_twice_or_without_a_process_is_no_fault():
    worker = CostWorker()
    assert worker.poll() == []
    worker.ask(0.0, PLACES)
    worker.close()
    worker.environment(ROOMS, 32)
    worker.close()
    worker.close()
