"""Cost curves of runs that started before costs could be computed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from driven_window import Driver, open_viewer
from sample_sessions import HALL, RAPF

from robocov.cost import CoverageCost
from robocov_app.viewer.costs.cost_curves import CostCurves
from robocov_app.viewer.costs.costs import Costs, KnownCost
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice

LATTICE = 16
STEPS_BEFORE_WALL = 60


def run_without_costs(driver: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run, draw a wall and run on, while no costs are computed."""
    with monkeypatch.context() as patch:
        patch.setattr(CostCurves, "update", lambda curves: None)
        for _ in range(STEPS_BEFORE_WALL):
            driver.session.playback.step()
        driver.press_key("w")
        driver.drag_at((0.5, 3.2), (1.5, 3.2))
        for _ in range(STEPS_BEFORE_WALL):
            driver.session.playback.step()


def test_a_curve_gets_its_beginning_on_the_map_before_a_wall(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_viewer(tmp_path, lattice=LATTICE) as driver:
        (pane,) = driver.session.timeline.panes
        for curve in pane.curves.values():
            curve.__init__()
        run_without_costs(driver, monkeypatch)
        assert driver.session.displayed.environment is not HALL
        assert not len(pane.distance_curve)
        driver.run_frames(60, seconds=0.0)
        curve = pane.distance_curve
        assert curve.times[0] == 0.0
        assert np.diff(curve.times).max() < 0.5
        start = driver.session.timeline.history[0].states[pane.number]
        expected = CoverageCost(HALL, LATTICE, radius=start.setup.team.min_radius)
        assert curve.values[0] == expected(start.positions).mean_distance


def answer_one_pane_per_frame(costs: Costs, monkeypatch: pytest.MonkeyPatch) -> None:
    """Answer one request in each frame, as a process does that takes about as long as a frame."""
    queued: dict[int, Callable[[], None]] = {}
    send_request = costs.request
    collect_answers = costs.poll

    def request(pane: int, *arguments: Any, **options: Any) -> None:
        queued[pane] = partial(send_request, pane, *arguments, **options)

    def poll() -> list[tuple[int, KnownCost]]:
        if queued:
            queued.pop(next(iter(queued)))()
        return collect_answers()

    monkeypatch.setattr(costs, "request", request)
    monkeypatch.setattr(costs, "poll", poll)


def test_curves_of_a_comparison_start_at_time_0_while_it_plays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_viewer(tmp_path, RAPF, ControllerChoice("lloyd"), lattice=LATTICE) as driver:
        panes = driver.session.timeline.panes
        for pane in panes:
            for curve in pane.curves.values():
                curve.__init__()
        for _ in range(STEPS_BEFORE_WALL):
            driver.session.playback.step()
        answer_one_pane_per_frame(driver.viewer.costs, monkeypatch)
        driver.session.playback.is_playing = True
        driver.run_frames(40)
        for pane in panes:
            assert pane.distance_curve.times[0] == 0.0
            assert pane.distance_curve.times[-1] > STEPS_BEFORE_WALL / 60.0


def test_a_curve_of_a_fast_run_begins_at_time_0_with_the_first_answer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_viewer(tmp_path, lattice=LATTICE) as driver:
        (pane,) = driver.session.timeline.panes
        pane.distance_curve.__init__()
        driver.viewer.costs.forget()
        run_fast(driver, 20.0)
        answer_one_pane_per_frame(driver.viewer.costs, monkeypatch)
        driver.run_frames(1, seconds=0.0)
        assert pane.distance_curve.times.tolist() == [0.0]


def run_fast(driver: Driver, duration: float) -> None:
    """Run for a duration, s, without a cost in between, like a fast run between two costs."""
    for _ in range(round(duration / driver.session.timeline.history.dt)):
        driver.session.playback.step()


def test_a_curve_of_a_fast_run_has_no_gaps(tmp_path: Path) -> None:
    with open_viewer(tmp_path, lattice=LATTICE) as driver:
        (pane,) = driver.session.timeline.panes
        run_fast(driver, 6.0)
        driver.run_frames(60, seconds=0.0)
        curve = pane.distance_curve
        assert curve.times[0] == 0.0
        assert curve.times[-1] == pytest.approx(6.0)
        assert np.diff(curve.times).max() < 0.5


def test_a_curve_without_a_cost_at_its_start_has_no_gaps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_viewer(tmp_path, lattice=LATTICE) as driver:
        (pane,) = driver.session.timeline.panes
        costs = driver.viewer.costs
        collect_answers = costs.poll

        def drop_first_cost(known_cost: KnownCost) -> KnownCost:
            if known_cost.time > 0.0:
                return known_cost
            return replace(known_cost, result=replace(known_cost.result, mean_distance=np.nan))

        monkeypatch.setattr(
            costs, "poll", lambda: [(number, drop_first_cost(cost)) for number, cost in collect_answers()]
        )
        pane.distance_curve.__init__()
        run_fast(driver, 1.0)
        driver.run_frames(2, seconds=0.0)
        run_fast(driver, 6.0)
        driver.run_frames(60, seconds=0.0)
        times = pane.distance_curve.times
        assert times[0] > 0.0
        assert np.diff(times).max() < 0.5


def test_an_empty_chart_says_what_it_waits_for(driver: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    texts: list[str] = []
    for curve in driver.session.timeline.panes[0].curves.values():
        curve.__init__()
    # The state is part of the key of the cached chart, which is therefore drawn again.
    with monkeypatch.context() as patch:
        patch.setattr(
            "robocov_app.viewer.chart.chart.draw_waiting_text",
            lambda canvas, frame, scale, text: texts.append(text),
        )
        driver.viewer.costs.state = "cost: preparing the map, 39%, 12 s left"
        driver.window.draw()
    without_text = driver.copy_frame()
    driver.viewer.costs.state = "cost: preparing the map, 40%, 12 s left"
    driver.window.draw()
    assert texts == ["Cost: preparing the map, 39%, 12 s left"]
    left, top, width, height = driver.window.layout.chart
    differs = (driver.copy_frame() != without_text).any(axis=2)
    assert differs[top : top + height, left : left + width].any()
