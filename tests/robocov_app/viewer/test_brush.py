"""The brush: strokes that raise and lower the density while time passes, and that can be undone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from driven_window import open_viewer
from pointer_events import build_event
from sample_sessions import HALL, LLOYD, RAPF, advance_session, describe_state, get_positions, start_session

from robocov.cost import CoverageCost
from robocov.density import Gaussian, Gaussians, Raster, Uniform
from robocov.environment import CircleObstacle
from robocov.mapfile import load_map
from robocov_app.render.density_shading import get_density_range
from robocov_app.viewer.costs.costs import Costs
from robocov_app.viewer.session.editing.map_edits import (
    DAB_FACTOR,
    MAX_PAINTED_DENSITY,
    MIN_PAINTED_DENSITY,
    PAINTED_RASTER_CELLS,
    build_paintable_raster,
    paint_density,
)
from robocov_app.viewer.tools.brush import BrushTool
from robocov_app.viewer.tools.tool import ViewerToolOverlay


class Clock:
    """Time that a test advances."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def paint_stroke(brush, session, *points, lowers=False) -> str | None:
    """Paint a stroke, and return the message."""
    brush.press(session, build_event(points[0], is_right=lowers))
    for point in points[1:]:
        brush.move(session, build_event(point))
    return brush.release(session, build_event(points[-1]), is_click=False)


def get_density(session, point) -> float:
    density = session.displayed.environment.density
    if density is None:
        return 1.0
    return float(density.evaluate(np.array([point]))[0])


def test_a_stroke_raises_or_lowers_the_density():
    brush = BrushTool(radius=0.8)
    session = start_session()
    assert paint_stroke(brush, session, (1.0, 1.0), (2.0, 1.0)) == "density raised"
    assert get_density(session, (1.5, 1.0)) > 1.3
    assert get_density(session, (1.5, 1.5)) > 1.0
    assert get_density(session, (5.0, 3.0)) == 1.0
    assert paint_stroke(brush, session, (1.0, 1.0), (2.0, 1.0), lowers=True) == "density lowered"
    assert get_density(session, (1.5, 1.0)) == pytest.approx(1.0, abs=0.01)


def test_the_painted_density_is_limited():
    brush = BrushTool(radius=0.8)
    session = start_session()
    for _ in range(60):
        paint_stroke(brush, session, (5.0, 3.0), (5.2, 3.0), lowers=True)
    low, _ = get_density_range(session.displayed.environment)
    assert low == pytest.approx(MIN_PAINTED_DENSITY, abs=0.02)
    for _ in range(90):
        paint_stroke(brush, session, (5.0, 3.0), (5.2, 3.0))
    _, high = get_density_range(session.displayed.environment)
    assert high == pytest.approx(MAX_PAINTED_DENSITY, rel=0.1)


@pytest.mark.parametrize(
    ("density", "raised", "lowered"),
    [
        (100.0, 100.0, 100.0 / DAB_FACTOR),
        (0.0004, MIN_PAINTED_DENSITY * DAB_FACTOR, 0.0004),
        (0.0, MIN_PAINTED_DENSITY * DAB_FACTOR, 0.0),
    ],
)
def test_a_density_outside_the_limits_of_the_brush_is_kept(density, raised, lowered):
    values = np.full((5, 5), density)
    values[0, 0] = 0.00012  # so that the density is not 0 everywhere
    painted_map = HALL.with_density(Raster(values, (0.0, 0.0, 6.0, 4.0)))
    for lowers, expected in ((False, raised), (True, lowered)):
        painted = paint_density(painted_map, [(3.0, 2.0)], 0.5, lowers=lowers).values
        assert painted[2, 2] == pytest.approx(expected, abs=0.5e-3)
        is_changed = painted != values
        is_changed[2, 2] = False
        assert not is_changed.any()
    assert paint_density(painted_map, [(3.0, 2.0)], 0.5, lowers=True).values[2, 2] == (
        pytest.approx(lowered, rel=1e-4)
    )


def test_a_stroke_is_undone_and_redone_as_a_whole():
    brush = BrushTool(radius=0.5)
    session = advance_session(start_session(), 5)
    before = session.displayed.environment
    paint_stroke(brush, session, (1.0, 1.0), (2.0, 1.0), (3.0, 2.0))
    painted = session.displayed.environment
    paint_stroke(brush, session, (4.0, 3.0), (4.5, 3.0))
    assert session.undo() == "density raised"
    assert session.displayed.environment == painted
    session.undo()
    assert session.displayed.environment == before
    assert session.displayed.environment.density is None
    assert session.timeline.head.parent is None
    session.redo()
    assert session.displayed.environment == painted
    assert [event.kind for event in session.timeline.events] == ["density"]


def test_robots_know_the_density_while_it_is_painted():
    clock = Clock()
    brush = BrushTool(radius=1.0, clock=clock)
    session = start_session(RAPF, LLOYD)
    brush.press(session, build_event((5.0, 3.0)))
    for move in range(20):
        clock.now += 0.1
        brush.move(session, build_event((5.0 - 0.02 * move, 3.0)))
        advance_session(session, 1)
        for pane in session.timeline.panes:
            seen = pane.simulation.observe_and_decide().seen
            assert seen.density is session.displayed.environment.density
    assert session.displayed.environment.density is not None
    assert brush.is_painting
    brush.release(session, build_event((4.6, 3.0)), is_click=False)
    assert not brush.is_painting
    assert session.timeline.head.parent is not None


def test_the_density_changes_no_more_often_than_it_is_displayed():
    clock = Clock()
    brush = BrushTool(radius=1.0, clock=clock)
    session = start_session()
    densities = []
    brush.press(session, build_event((1.0, 1.0)))
    for move in range(200):
        clock.now += 0.01
        brush.move(session, build_event((1.0 + 0.02 * move, 1.0)))
        densities.append(session.displayed.environment.density)
    assert 15 <= len(set(map(id, densities))) <= 30


def test_a_stroke_can_be_cancelled():
    brush = BrushTool(radius=1.0)
    session = start_session()
    before = session.displayed.environment
    brush.press(session, build_event((1.0, 1.0)))
    assert session.displayed.environment != before
    assert brush.cancel(session)
    assert session.displayed.environment == before
    assert session.timeline.head.parent is None
    assert brush.release(session, build_event((1.0, 1.0)), is_click=False) is None
    assert brush.build_overlay(session) == ViewerToolOverlay()


def test_a_stroke_moves_no_robots():
    brush = BrushTool(radius=0.5)
    session = advance_session(start_session(), 3)
    positions = get_positions(session)[0]
    paint_stroke(brush, session, (1.0, 1.0), (2.0, 1.0))
    np.testing.assert_array_equal(get_positions(session)[0], positions)


def test_a_stroke_keeps_obstacles_that_were_drawn_before():
    brush = BrushTool(radius=0.5)
    session = advance_session(start_session(), 3)
    paint_stroke(brush, session, (1.0, 1.0), (2.0, 1.0))
    pillar = CircleObstacle((5.0, 2.5), 0.2)
    with_pillar = replace(session.displayed.environment, obstacles=(*HALL.obstacles, pillar))
    session.edit_map(with_pillar, "circle drawn")
    paint_stroke(brush, session, (3.0, 1.0), (3.5, 1.0))
    assert session.displayed.environment.obstacles == with_pillar.obstacles
    for _ in range(3):
        session.undo()
    assert session.displayed.environment.obstacles == HALL.obstacles
    assert session.displayed.environment.density is None


def test_another_map_ends_a_stroke():
    brush = BrushTool(radius=0.5)
    session = start_session()
    square = load_map("square")
    brush.press(session, build_event((1.0, 1.0)))
    session.restart(environment=square)
    brush.move(session, build_event((2.0, 1.0)))
    assert brush.release(session, build_event((2.0, 1.0)), is_click=False) is None
    assert session.displayed.environment.boundary == square.boundary


def test_any_density_becomes_a_raster_that_can_be_painted():
    peak = Gaussians((Gaussian((2.0, 2.0), 3.0, sigma=0.5),), 0.5)
    raster = build_paintable_raster(HALL.with_density(peak))
    assert raster.values.shape == (round(PAINTED_RASTER_CELLS * 4 / 6), PAINTED_RASTER_CELLS)
    assert raster.extent == (0.0, 0.0, 6.0, 4.0)
    assert build_paintable_raster(HALL.with_density(raster)) is raster
    assert build_paintable_raster(HALL.with_density(Uniform(2.0))).values.max() == 2.0
    cells = Raster(np.ones((2, 2)), (0.0, 0.0, 1.0, 1.0), "cells")
    assert build_paintable_raster(HALL.with_density(cells)).interpolation == "bilinear"


def test_the_size_of_the_brush_is_relative_to_the_map():
    brush = BrushTool()
    session = start_session()
    radius = brush.get_radius(session)
    assert radius == pytest.approx(0.1 * HALL.region.diameter, rel=0.05)
    assert brush.resize(session, 2.0).startswith("the brush has a radius of ")
    assert brush.get_radius(session) == pytest.approx(2.0 * radius, rel=0.01)
    for factor, limit in ((100.0, 0.5), (1e-4, 0.005)):
        brush.resize(session, factor)
        assert brush.get_radius(session) == pytest.approx(limit * HALL.region.diameter, rel=0.01)


def test_the_density_under_the_brush_is_displayed():
    brush = BrushTool()
    session = start_session()
    brush.move(session, build_event((1.0, 1.0)))
    state = brush.build_overlay(session)
    assert state.label == "φ 1"
    assert not state.has_marks


def test_nothing_is_painted_before_a_press():
    brush = BrushTool()
    session = start_session()
    before = describe_state(session)
    brush.move(session, build_event((1.0, 1.0)))
    assert brush.release(session, build_event((1.0, 1.0)), is_click=False) is None
    assert not brush.cancel(session)
    assert describe_state(session) == before


def test_the_brush_is_used_in_the_window(tmp_path):
    with open_viewer(tmp_path, RAPF, LLOYD) as driver:
        session = driver.session
        plain = driver.copy_frame()
        driver.press_key("g")
        brush = driver.viewer.tool
        driver.turn_wheel(*driver.find_pixel((3.0, 2.0)), 2)
        radius = brush.radius
        driver.press_key("[")
        assert brush.radius < radius
        assert "radius" in driver.viewer.message
        driver.drag(*(driver.find_pixel((1.0 + 0.3 * k, 3.0)) for k in range(5)))
        assert driver.viewer.message == "Density raised"
        assert get_density(session, (1.6, 3.0)) > 1.1
        driver.drag(*(driver.find_pixel((4.5 + 0.2 * k, 3.2)) for k in range(4)), button=3)
        assert driver.viewer.message == "Density lowered"
        assert get_density(session, (4.8, 3.2)) < 0.9
        assert not driver.shows_frame(plain)
        environments = {pane.setup.environment for pane in session.timeline.panes}
        assert environments == {session.displayed.environment}
        driver.press_key("ctrl+shift+s")
        assert load_map(driver.viewer.files.map_name) == session.displayed.environment
        driver.press_key("ctrl+z", 2)
        assert session.displayed.environment.density is None
        assert "φ" not in driver.window.canvas._scenes[0].cost
        driver.press_key("ctrl+y")
        driver.run_frames(3)
        assert "mean distance weighted by φ" in driver.window.canvas._scenes[0].cost


def test_the_cost_is_computed_for_each_density():
    peak = Gaussians((Gaussian((5.0, 3.0), 5.0, sigma=0.7),), 0.5)
    positions = np.array([[1.0, 1.0], [5.0, 3.2]])
    costs = Costs(24, direct=True)
    distances = []
    for environment in (HALL, HALL.with_density(peak), HALL):
        costs.set_environment(environment)
        costs.request(0, 0.0, positions)
        ((_, answer),) = costs.poll()
        distances.append(answer.result.mean_distance)
        assert distances[-1] == CoverageCost(environment, 24)(positions).mean_distance
    assert distances[0] == distances[2] != distances[1]
