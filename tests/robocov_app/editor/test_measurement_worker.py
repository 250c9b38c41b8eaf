"""Measurement in the background, with only the changes of a sketch."""

import time
from contextlib import closing

import pytest
from drawn_sketches import HALL, changes, valid_sketches
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.environment import CircleObstacle, PolygonObstacle, WallObstacle
from robocov_app.editor.edits import properties, transform
from robocov_app.editor.model.measurement import (
    MeasurementCodec,
    SketchMeasurer,
    create_measurement_worker,
    measure,
)
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import Sketch
from robocov_app.jobs.messages import Channel

PATIENCE = 60.0
"""Seconds after which no more answers are expected."""

SKETCH, _ = Sketch("Hall", boundary=HALL).with_obstacles(
    [CircleObstacle((3.0, 3.0), 1.0), WallObstacle(((6.0, -1.0), (6.0, 7.7)), 0.2)]
)


def are_equal(a, b) -> bool:
    """Return whether two measurements are equal."""
    numbers = ("free_area", "components", "reached", "gap", "vertices", "radius")
    words = [[problem.message for problem in each.problems] for each in (a, b)]
    return (
        all(getattr(a, name) == getattr(b, name) for name in numbers)
        and a.impassable.equals(b.impassable)
        and words[0] == words[1]
    )


@pytest.mark.slow
def test_the_worker_agrees_with_the_function_after_every_change():
    history = [SKETCH]
    history.append(transform.move(history[-1], Selection.of(0), 1.0, 0.0).sketch)
    history.append(history[-1].with_obstacles([PolygonObstacle(((9.0, 1.0), (11.0, 1.0), (10.0, 3.0)))])[0])
    history.append(history[-1].without([0]))
    history.append(properties.restack(history[-1], Selection.of(1), "top").sketch)
    history.append(SKETCH)
    with (
        closing(create_measurement_worker()) as worker,
        closing(create_measurement_worker(direct=True)) as direct,
    ):
        for sketch in history:
            for each in (worker, direct):
                each.put((sketch, 0.2))
                result = each.poll()
                end = time.monotonic() + PATIENCE
                while each.is_busy and time.monotonic() < end:
                    result = each.poll()
                    time.sleep(0.002)
                assert are_equal(result, measure(sketch, 0.2))


@settings(max_examples=count_examples(20))
@given(st.data())
def test_changes_are_enough_to_rebuild_the_sketch(data):
    measuring = SketchMeasurer()
    codec = MeasurementCodec()
    sketch = data.draw(valid_sketches(min_size=1))
    known = {}
    requests = []
    for _ in range(4):
        requests.append(codec.encode((sketch, 0.2)))
        assert [item.key for item in requests[-1].sketch.obstacles] == [
            item.key for item in sketch.obstacles if known.get(item.key) is not item
        ]
        known = {item.key: item for item in sketch.obstacles}
        last = sketch
        change = data.draw(changes(sketch))
        sketch = sketch if change is None else change.sketch
    measuring(requests[:2], Channel())
    answer = measuring(requests[2:], Channel())
    expected = measure(last, 0.2)
    assert (answer.vertices, answer.free_area) == (expected.vertices, expected.free_area)
