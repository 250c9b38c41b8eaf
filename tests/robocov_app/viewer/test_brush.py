"""The brush: strokes that raise and lower the density while the run goes on, and their way back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from driven_window import opened
from sample_sessions import HALL, LLOYD, RAPF, advance_session, describe_state, start_session

from robocov.cost import CoverageCost
from robocov.density import Gaussian, Gaussians, Raster, Uniform
from robocov.environment import CircleObstacle
from robocov.mapfile import load_map
from robocov_app.render.density import density_range
from robocov_app.viewer.costs import Costs
from robocov_app.viewer.session.map_edits import (
    MAX_PAINTED_DENSITY,
    MIN_PAINTED_DENSITY,
    PAINTED_RASTER_CELLS,
    build_paintable_raster,
)
from robocov_app.viewer.tools.brush import BrushTool

REACH = 0.1


def stroke(brush, session, *points, lowers=False) -> str | None:
    brush.lowers = lowers
    brush.press(session, points[0], REACH, None)
    for point in points[1:]:
        brush.move(session, point)
    return brush.release(session, points[-1])


def value_at(session, point) -> float:
    density = session.displayed.environment.density
    return 1.0 if density is None else float(density.evaluate(np.array([point]))[0])


def test_left_raises_and_right_lowers():
    brush, session = BrushTool(radius=0.8), start_session()
    assert stroke(brush, session, (1.0, 1.0), (2.0, 1.0)) == "density raised"
    raised = value_at(session, (1.5, 1.0))
    assert raised > 1.3 and value_at(session, (1.5, 1.5)) > 1.0
    assert value_at(session, (5.0, 3.0)) == 1.0
    assert stroke(brush, session, (1.0, 1.0), (2.0, 1.0), lowers=True) == "density lowered"
    assert value_at(session, (1.5, 1.0)) == pytest.approx(1.0, abs=0.01)
    for _ in range(60):
        stroke(brush, session, (5.0, 3.0), (5.2, 3.0), lowers=True)
    low, _ = density_range(session.displayed.environment)
    assert low == pytest.approx(MIN_PAINTED_DENSITY, abs=0.02)
    for _ in range(90):
        stroke(brush, session, (5.0, 3.0), (5.2, 3.0))
    assert density_range(session.displayed.environment)[1] == pytest.approx(MAX_PAINTED_DENSITY, rel=0.1)


def test_a_stroke_is_undone_as_a_whole_and_done_again():
    brush, session = BrushTool(radius=0.5), advance_session(start_session(), 5)
    before = session.displayed.environment
    stroke(brush, session, (1.0, 1.0), (2.0, 1.0), (3.0, 2.0))
    painted = session.displayed.environment
    stroke(brush, session, (4.0, 3.0), (4.5, 3.0))
    assert session.undo() == "density raised"
    assert session.displayed.environment == painted
    session.undo()
    assert session.displayed.environment == before and session.displayed.environment.density is None
    assert session.timeline.head.parent is None
    session.redo()
    assert session.displayed.environment == painted
    assert [event.kind for event in session.timeline.events] == ["density"]


def test_robots_know_of_it_while_it_is_painted():
    now = [0.0]
    brush, session = BrushTool(radius=1.0, clock=lambda: now[0]), start_session(RAPF, LLOYD)
    brush.press(session, (5.0, 3.0), REACH, None)
    for k in range(20):
        now[0] += 0.1
        brush.move(session, (5.0 - 0.02 * k, 3.0))
        advance_session(session, 1)
        for pane in session.timeline.panes:
            assert pane.simulation.observe_and_decide().seen.density is session.displayed.environment.density
    assert session.displayed.environment.density is not None
    assert session.timeline.head.parent is not None
    assert brush.is_painting
    brush.release(session, (4.6, 3.0))
    assert not brush.is_painting and session.timeline.head.parent is not None


def test_it_does_not_tell_the_robots_more_often_than_is_seen():
    now, told = [0.0], []
    brush, session = BrushTool(radius=1.0, clock=lambda: now[0]), start_session()
    brush.press(session, (1.0, 1.0), REACH, None)
    for k in range(200):
        now[0] += 0.01
        brush.move(session, (1.0 + 0.02 * k, 1.0))
        told.append(session.displayed.environment.density)
    assert 15 <= len(set(map(id, told))) <= 30


def test_escape_gives_the_stroke_up():
    brush, session = BrushTool(radius=1.0), start_session()
    before = session.displayed.environment
    brush.press(session, (1.0, 1.0), REACH, None)
    assert session.displayed.environment != before
    assert brush.cancel(session)
    assert session.displayed.environment == before and session.timeline.head.parent is None
    assert brush.release(session, (1.0, 1.0)) is None
    assert brush.build_preview(session) is None


def test_it_goes_on_where_robots_lean_on_something_and_keeps_what_was_drawn():
    """Only the density changes: nobody is pushed, and an obstacle of in between stays."""
    brush, session = BrushTool(radius=0.5), advance_session(start_session(), 3)
    places = session.timeline.panes[0].simulation.positions.copy()
    stroke(brush, session, (1.0, 1.0), (2.0, 1.0))
    assert np.array_equal(session.timeline.panes[0].simulation.positions, places)
    pillar = CircleObstacle((5.0, 2.5), 0.2)
    with_pillar = replace(session.displayed.environment, obstacles=(*HALL.obstacles, pillar))
    session.edit_map(with_pillar, "circle drawn")
    stroke(brush, session, (3.0, 1.0), (3.5, 1.0))
    assert session.displayed.environment.obstacles == with_pillar.obstacles
    for _ in range(3):
        session.undo()
    assert (
        session.displayed.environment.obstacles == HALL.obstacles
        and session.displayed.environment.density is None
    )


def test_another_map_in_the_midst_of_a_stroke_ends_it():
    brush, session = BrushTool(radius=0.5), start_session()
    brush.press(session, (1.0, 1.0), REACH, None)
    session.restart(environment=load_map("square"))
    brush.move(session, (2.0, 1.0))
    assert brush.release(session, (2.0, 1.0)) is None
    assert session.displayed.environment.boundary == load_map("square").boundary


def test_what_is_painted_on():
    peak = Gaussians((Gaussian((2.0, 2.0), 3.0, sigma=0.5),), 0.5)
    raster = build_paintable_raster(HALL.with_density(peak))
    assert raster.values.shape == (
        round(PAINTED_RASTER_CELLS * 4 / 6),
        PAINTED_RASTER_CELLS,
    ) and raster.extent == (0.0, 0.0, 6.0, 4.0)
    assert build_paintable_raster(HALL.with_density(raster)) is raster
    assert build_paintable_raster(HALL.with_density(Uniform(2.0))).values.max() == 2.0
    cells = Raster(np.ones((2, 2)), (0.0, 0.0, 1.0, 1.0), "cells")
    assert build_paintable_raster(HALL.with_density(cells)).interpolation == "bilinear"


def test_its_size():
    brush, session = BrushTool(), start_session()
    first = brush.get_radius(session)
    assert first == pytest.approx(0.1 * HALL.region.diameter, rel=0.05)
    assert brush.resize(session, 2.0).startswith("the brush has a radius of ")
    assert brush.get_radius(session) == pytest.approx(2.0 * first, rel=0.01)
    for factor, most in ((100.0, 0.5), (1e-4, 0.005)):
        brush.resize(session, factor)
        assert brush.get_radius(session) == pytest.approx(most * HALL.region.diameter, rel=0.01)
    brush.move(session, (1.0, 1.0))
    shown = brush.build_preview(session)
    assert shown is not None and shown.label == "φ 1" and not shown.has_marks


def test_nothing_is_touched_before_a_press():
    brush, session = BrushTool(), start_session()
    before = describe_state(session)
    brush.move(session, (1.0, 1.0))
    assert brush.release(session, (1.0, 1.0)) is None and not brush.cancel(session)
    assert describe_state(session) == before


def test_in_the_window(tmp_path):
    """G takes it; buttons, wheel and keys; the map that is saved has what was painted."""
    with opened(tmp_path, RAPF, LLOYD) as driver:
        plain = driver.picture()
        driver.key("g")
        brush = driver.viewer.tool
        driver.wheel(*driver.pixel((3.0, 2.0)), 2)
        larger = brush.radius
        driver.key("[")
        assert brush.radius < larger and "radius" in driver.viewer.message
        driver.drag(*(driver.pixel((1.0 + 0.3 * k, 3.0)) for k in range(5)))
        assert driver.viewer.message == "density raised"
        high = value_at(driver.session, (1.6, 3.0))
        driver.drag(*(driver.pixel((4.5 + 0.2 * k, 3.2)) for k in range(4)), button=3)
        assert driver.viewer.message == "density lowered"
        assert high > 1.1 and value_at(driver.session, (4.8, 3.2)) < 0.9
        assert not driver.same(plain)
        assert {pane.setup.environment for pane in driver.session.timeline.panes} == {
            driver.session.displayed.environment
        }
        driver.key("ctrl+shift+s")
        assert load_map(driver.viewer.files.map_name) == driver.session.displayed.environment
        driver.key("ctrl+z", 2)
        assert driver.session.displayed.environment.density is None
        assert "φ" not in driver.window.canvas._scenes[0].cost
        driver.key("ctrl+y")
        driver.frames(3)
        assert "mean distance by φ" in driver.window.canvas._scenes[0].cost


def test_a_density_alone_needs_no_preparation_of_the_map():
    peak = Gaussians((Gaussian((5.0, 3.0), 5.0, sigma=0.7),), 0.5)
    places, costs = np.array([[1.0, 1.0], [5.0, 3.2]]), Costs(24, direct=True)
    found = []
    for environment in (HALL, HALL.with_density(peak), HALL):
        costs.set_environment(environment)
        costs.ask(0, 0.0, places)
        ((_, known),) = costs.poll()
        found.append(known.result.mean_distance)
        assert found[-1] == CoverageCost(environment, 24)(places).mean_distance
    assert found[0] == found[2] != found[1]
