import os
import signal
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from drawn_sketches import HALL, changes, sound_sketches
from hypothesis import given, settings
from hypothesis import strategies as st
from robocov_app.live.latest import Service

from robocov.environment import CircleObstacle, PolygonObstacle, WallObstacle
from robocov_app.editor.edits import properties, transform
from robocov_app.editor.model import measurement_worker
from robocov_app.editor.model.measurement import measure
from robocov_app.editor.model.measurement_worker import MeasurementWorker, Question
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import Sketch

PATIENCE = 60.0
"""Seconds after which nothing will come any more."""

SKETCH, _ = Sketch("Hall", boundary=HALL).added(
    [CircleObstacle((3.0, 3.0), 1.0), WallObstacle(((6.0, -1.0), (6.0, 7.7)), 0.2)]
)


def crowded(count: int) -> Sketch:
    rng = np.random.default_rng(0)
    side = int(np.ceil(np.sqrt(count)))
    shapes = []
    for k in range(count):
        x, y = 1.0 + 1.2 * (k % side), 1.0 + 1.2 * (k // side)
        if k % 3 == 0:
            shapes.append(CircleObstacle((x, y), round(float(rng.uniform(0.1, 0.45)), 3)))
        elif k % 3 == 1:
            shapes.append(
                WallObstacle(((x - 0.3, y), (x + 0.3, round(y + float(rng.uniform(-0.3, 0.3)), 3))), 0.1)
            )
        else:
            turn = np.sort(rng.uniform(0.0, 2.0 * np.pi, 9))
            ring = np.round(np.column_stack([np.cos(turn), np.sin(turn)]) * 0.4 + (x, y), 4)
            shapes.append(PolygonObstacle(tuple((u, v) for u, v in ring.tolist())))
    far = 1.2 * side + 2.0
    return Sketch("crowded", boundary=((0.0, 0.0), (far, 0.0), (far, far), (0.0, far))).added(shapes)[0]


def answered(worker: MeasurementWorker):
    end = time.monotonic() + PATIENCE
    result = None
    while time.monotonic() < end:
        result = worker.poll() or result
        if not worker.busy:
            return result
        time.sleep(0.005)
    raise AssertionError("no answer")


def same(a, b) -> bool:
    """Whether two readouts say the same."""
    numbers = ("free_area", "components", "reached", "gap", "vertices", "radius")
    words = [[problem.words for problem in each.problems] for each in (a, b)]
    return (
        all(getattr(a, name) == getattr(b, name) for name in numbers)
        and a.impassable.equals(b.impassable)
        and words[0] == words[1]
    )


def test_it_says_what_the_function_says_after_every_change():
    history = [SKETCH]
    history.append(transform.moved(history[-1], Selection.of(0), 1.0, 0.0).sketch)
    history.append(history[-1].added([PolygonObstacle(((9.0, 1.0), (11.0, 1.0), (10.0, 3.0)))])[0])
    history.append(history[-1].without([0]))
    history.append(properties.raised(history[-1], Selection.of(1), "top").sketch)
    history.append(SKETCH)
    with MeasurementWorker() as worker:
        for sketch in history:
            worker.ask(sketch, 0.2)
            assert worker.busy
            result = answered(worker)
            assert same(result, measure(sketch, 0.2))
            assert worker.trouble == ""
        worker.ask(SKETCH, 0.2)
        assert not worker.busy, "asked about the same again"
        worker.ask(SKETCH, 0.1)
        assert answered(worker).radius == 0.1


@settings(max_examples=20)
@given(st.data())
def test_what_has_changed_is_enough_to_know_the_whole(data):
    measuring = measurement_worker.Measuring()
    sketch, known = data.draw(sound_sketches(least=1)), {}
    questions = []
    for _ in range(4):
        questions.append(Question.about(sketch, 0.2, known))
        known = {item.key: item for item in sketch.obstacles}
        change = data.draw(changes(sketch))
        assert all(item in sketch.obstacles for item in questions[-1].changed)
        last = sketch
        sketch = sketch if change is None else change.sketch
    measuring(questions[:2])
    answer = measuring(questions[2:])
    assert answer.vertices == measure(last, 0.2).vertices
    assert answer.free_area == measure(last, 0.2).free_area


def test_only_the_newest_question_counts():
    sketch = crowded(100)
    with MeasurementWorker() as worker:
        for k in range(200):
            worker.ask(transform.moved(sketch, Selection.of(0), 0.001 * k, 0.0).sketch, 0.2)
        result = answered(worker)
        assert (
            result.free_area == measure(transform.moved(sketch, Selection.of(0), 0.199, 0.0).sketch).free_area
        )


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_a_process_that_was_killed_comes_back():
    with MeasurementWorker() as worker:
        worker.ask(SKETCH, 0.2)
        first = answered(worker)
        worker.ask(replace(SKETCH, name="other"), 0.2)
        os.kill(worker._talk._process.pid, signal.SIGKILL)
        while worker.busy:
            worker.poll()
            time.sleep(0.005)
        # the question may have been answered before
        assert worker.trouble in ("", "the process that measures the map has ended")
        end = time.monotonic() + PATIENCE
        while not worker._talk.ended and time.monotonic() < end:
            time.sleep(0.005)
        worker.ask(SKETCH, 0.2)
        assert same(answered(worker), first)
        assert worker.trouble == ""


def test_what_fails_is_said_and_the_next_goes_on(monkeypatch, capsys):
    service = Service(measurement_worker.Measuring(), "the map could not be measured")
    monkeypatch.setattr(measurement_worker, "measure", lambda sketch, radius: 1 / 0)
    reply = service.reply([(1, Question.about(SKETCH, 0.2, {}))])
    assert (reply.number, reply.answer) == (1, None)
    assert reply.trouble == "the map could not be measured: division by zero"
    assert "ZeroDivisionError" in capsys.readouterr().err
    monkeypatch.undo()
    known = {item.key: item for item in SKETCH.obstacles}
    reply = service.reply([(2, Question.about(SKETCH, 0.2, known))])
    assert (reply.number, reply.trouble) == (2, "")
    assert reply.answer.vertices == measure(SKETCH, 0.2).vertices


def test_nothing_is_there_before_one_asks():
    worker = MeasurementWorker()
    assert worker.poll() is None
    assert not worker.busy
    worker.close()
    worker.close()


def test_asked_among_many_obstacles_is_only_what_changed(monkeypatch):
    sent = []
    about = Question.about
    monkeypatch.setattr(Question, "about", lambda *what: sent.append(about(*what)) or sent[-1])
    sketch = crowded(400)
    keys = [item.key for item in sketch.obstacles]
    with MeasurementWorker() as worker:
        worker.ask(sketch)
        answered(worker)
        first = len(sent)
        for k in range(60):
            sketch = transform.moved(sketch, Selection.of(keys[k]), 0.001, 0.0).sketch
            worker.ask(sketch)
            worker.poll()
        result = answered(worker)
    assert result.vertices > 1200
    assert sent[first:]
    assert sum(len(question.changed) for question in sent[first:]) <= 60
