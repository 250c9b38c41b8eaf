"""How a team would stand at a start, beside the window."""

import time

import numpy as np
from driven_editor import of_map, sheet

from robocov.environment import PolygonObstacle
from robocov_app.editor.ui.editor import TeamThread, placed


def test_the_team_stands_where_a_run_would_begin() -> None:
    sketch = of_map("rooms")
    name = sketch.starts[0][0]
    team = placed(sketch, name, 5, 3, 0.1)
    wanted = sketch.environment().start(name).sample(5, seed=3, radius=0.1)
    assert np.array_equal(np.array(team.places), wanted) and team.words == ""


def test_why_it_cannot_stand_there_is_told() -> None:
    assert "room for about" in placed(of_map("rooms"), None, 900, 0, 0.1).words
    crossed = sheet(PolygonObstacle(((2, 2), (4, 4), (4, 2), (2, 4))))
    assert placed(crossed, None, 3, 0, 0.1).places == ()
    assert placed(crossed, None, 3, 0, 0.1).words


def test_only_the_newest_question_is_answered_and_the_same_one_once() -> None:
    sketch, thread = of_map("rooms"), TeamThread()
    try:
        for robots in range(1, 5):
            thread.ask(sketch, None, robots, 0, 0.1)
        began = time.monotonic()
        while (answer := thread.ask(sketch, None, 5, 0, 0.1)) is None:
            assert time.monotonic() - began < 60
            time.sleep(0.01)
        assert answer.robots == len(answer.places) == 5 and thread._answer is None
        time.sleep(0.05)
        assert thread.ask(sketch, None, 5, 0, 0.1) is None
    finally:
        thread.close()
