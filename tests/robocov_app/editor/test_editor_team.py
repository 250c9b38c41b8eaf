"""The team that the editor shows at a start."""

import time

import numpy as np
from driven_editor import build_sheet, load_sketch

from robocov.environment import PolygonObstacle
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.team import TeamRequest, TeamSampler, sample_team


def build_request(sketch: Sketch, robots: int, start: str | None = None, seed: int = 0) -> TeamRequest:
    return TeamRequest(sketch, start, robots, seed, radius=0.1)


def test_the_team_has_the_positions_of_a_run() -> None:
    sketch = load_sketch("rooms")
    name = sketch.starts[0][0]
    team = sample_team(build_request(sketch, 5, name, seed=3))
    expected = sketch.build_environment().start(name).sample(5, seed=3, radius=0.1)
    assert np.array_equal(np.array(team.positions), expected)
    assert team.message == ""


def test_a_team_that_does_not_fit_has_a_message() -> None:
    assert "space for about" in sample_team(build_request(load_sketch("rooms"), 900)).message
    crossed = build_sheet(PolygonObstacle(((2, 2), (4, 4), (4, 2), (2, 4))))
    team = sample_team(build_request(crossed, 3))
    assert team.positions == ()
    assert team.message


def test_only_the_newest_team_is_returned_and_only_once() -> None:
    sketch = load_sketch("rooms")
    sampler = TeamSampler()
    try:
        for robots in range(1, 5):
            sampler.poll(build_request(sketch, robots))
        newest = build_request(sketch, 5)
        deadline = time.monotonic() + 60
        team = sampler.poll(newest)
        while team is None:
            assert time.monotonic() < deadline
            time.sleep(0.01)
            team = sampler.poll(newest)
        assert team.robots == len(team.positions) == 5
        time.sleep(0.05)
        assert sampler.poll(newest) is None
    finally:
        sampler.close()
