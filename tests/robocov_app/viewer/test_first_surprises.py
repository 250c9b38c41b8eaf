"""Behavior that surprised people who used the window for the first time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pygame
import pytest
from driven_window import Driver, build_key_event, open_viewer
from sample_sessions import HALL, advance_session

from robocov.conditions import Conditions, Failure
from robocov.environment import CircleObstacle, WallObstacle
from robocov.errors import StartError
from robocov.mapfile import save_map
from robocov_app.commands import demo
from robocov_app.toolkit.window.input import drop_late_repeats
from robocov_app.viewer.panel.parameters import list_limit_parameters
from robocov_app.viewer.session.editing.map_edits import add_obstacle
from robocov_app.viewer.session.files.session_file import MAX_FILE_SAMPLES
from robocov_app.viewer.session.past.curves import Curve
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties
from robocov_app.viewer.window.status import list_facts


def post_tap_while_busy(driver: Driver, name: str, repeats: int) -> None:
    """Post the events of a key that was tapped while the window was busy: it seems to be held."""
    attributes = build_key_event(name)
    for _ in range(1 + repeats):
        driver.post(pygame.KEYDOWN, **attributes)
    driver.post(pygame.KEYUP, **attributes)
    driver.settle()


def test_a_tap_undoes_one_edit_however_long_the_frame_takes(driver: Driver) -> None:
    for number in (1, 2):
        driver.viewer.attempt(lambda number=number: driver.session.fail_robot(number))
    post_tap_while_busy(driver, "ctrl+z", repeats=3)
    assert len(driver.session.timeline.events) == 1
    post_tap_while_busy(driver, "ctrl+z", repeats=3)
    assert driver.session.timeline.events == []


def test_a_key_that_is_held_still_repeats(driver: Driver) -> None:
    for number in (1, 2):
        driver.viewer.attempt(lambda number=number: driver.session.fail_robot(number))
    attributes = build_key_event("ctrl+z")
    for _ in range(2):
        driver.post(pygame.KEYDOWN, **attributes)
        driver.settle()
    assert driver.session.timeline.events == []


def test_keys_pressed_one_after_the_other_within_a_frame_all_count() -> None:
    down = pygame.event.Event(pygame.KEYDOWN, key=pygame.K_z)
    up = pygame.event.Event(pygame.KEYUP, key=pygame.K_z)
    held: set[int] = set()
    assert drop_late_repeats([down, up, down, up], held) == [down, up, down, up]
    assert drop_late_repeats([down, down, up], held) == [down, up]
    assert drop_late_repeats([down, down], held) == [down, down]
    assert held == {pygame.K_z}


@pytest.mark.parametrize("scale", [1.0, 1.5])
def test_all_of_a_new_map_is_shown(driver: Driver, tmp_path: Path, scale: float) -> None:
    """Also of one with the same name and bounds, and of one with another shape."""
    boundary = tuple((scale * x, y) for x, y in HALL.boundary)
    other = replace(HALL, boundary=boundary, obstacles=(), starts={})
    save_map(other, tmp_path / "hall.json")
    driver.turn_wheel(200, 150, 5)
    driver.turn_wheel(200, 150, 5)
    driver.post(pygame.DROPFILE, file=str(tmp_path / "hall.json"))
    driver.settle()
    driver.run_frames(2)
    left, top, width, height = driver.window.layout.panes[0]
    for corner in boundary:
        x, y = driver.find_pixel(corner)
        assert left <= x <= left + width
        assert top <= y <= top + height


def test_edits_and_restarts_keep_the_zoom(driver: Driver) -> None:
    fitted = driver.find_pixel((1.0, 1.0))
    driver.turn_wheel(200, 150, 5)
    before = driver.find_pixel((1.0, 1.0))
    assert before != pytest.approx(fitted)
    driver.viewer.attempt(lambda: driver.session.edit_map(replace(HALL, obstacles=()), "emptied"))
    driver.run_frames(2)
    driver.press_key("ctrl+z")
    driver.run_frames(2)
    # N starts again with the next seed.
    driver.press_key("n")
    driver.run_frames(2)
    assert driver.find_pixel((1.0, 1.0)) == pytest.approx(before)


def test_no_limit_is_called_unlimited(driver: Driver) -> None:
    parameters = {parameter.name: parameter for parameter in list_limit_parameters(RobotProperties())}
    communication = parameters["team.communication_range"]
    assert communication.format() == "unlimited"
    assert communication.parse(" Unlimited ") is None
    entry = driver.get_widget("entry", "team.communication_range")
    assert entry.text == "unlimited"
    assert driver.find_widget("label", "unit:team.communication_range") is None


def test_escape_closes_the_help_before_the_lesson(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.press_key("f2")
        driver.press_key("f1")
        assert driver.window.help_page.is_open
        driver.press_key("escape")
        assert not driver.window.help_page.is_open
        assert driver.window.lesson.player is not None
        driver.press_key("escape")
        assert driver.window.lesson.player is None


def test_a_comparison_says_what_it_does_not_repeat(driver: Driver) -> None:
    driver.viewer.attempt(lambda: driver.session.fail_robot(2))
    driver.viewer.attempt(lambda: driver.session.place_robot(1, (1.0, 3.0)))
    driver.add_pane()
    message = driver.viewer.message
    assert message == (
        "Both controllers start again at 0 s, without these edits: robot 2 failed, robot 1 was moved."
    )
    driver.press_key("ctrl+z")
    assert [event.text for event in driver.session.timeline.events] == ["robot 2 failed", "robot 1 was moved"]


def test_a_comparison_repeats_failures_of_the_conditions(tmp_path: Path) -> None:
    conditions = Conditions(failures=(Failure(2, 0.1),))
    with open_viewer(tmp_path, conditions=conditions) as driver:
        advance_session(driver.session, 12)
        assert [event.text for event in driver.session.timeline.events] == ["robot 2 failed"]
        driver.add_pane()
        assert driver.viewer.message == "Both controllers start again at 0 s."


def test_scans_of_the_past_do_not_end_at_obstacles_that_were_added_later(tmp_path: Path) -> None:
    with open_viewer(tmp_path, shown={"robots", "scan"}) as driver:
        session = advance_session(driver.session, 12)

        def list_rays() -> list[np.ndarray]:
            session.show_time(0.1)
            driver.run_frames(1)
            return [ends for _, ends in driver.window.canvas.scenes[0].scans]

        rays = list_rays()
        session.show_time(session.timeline.end_time)
        x, y = session.timeline.panes[0].simulation.positions[0].tolist()
        session.edit_map(add_obstacle(HALL, CircleObstacle((x + 1.0, y + 1.0), 0.3)), "circle drawn")
        advance_session(session, 1)
        assert len(rays) == 3
        for later_ends, ends in zip(list_rays(), rays, strict=True):
            np.testing.assert_array_equal(later_ends, ends)


@pytest.mark.parametrize("key", ["f1", "k"])
def test_a_run_waits_while_a_page_or_list_covers_the_map(key: str, driver: Driver) -> None:
    driver.session.playback.is_playing = True
    driver.run_frames(10)
    driver.press_key(key)
    time = driver.session.displayed.time
    driver.run_frames(10)
    assert driver.session.displayed.time == time
    driver.press_key("escape")
    driver.run_frames(10)
    assert driver.session.displayed.time > time
    driver.session.playback.is_playing = False
    driver.press_key(key)
    driver.press_key("escape")
    driver.run_frames(10)
    assert not driver.session.playback.is_playing


def test_the_run_before_a_comparison_stays_until_a_controller_is_chosen(driver: Driver) -> None:
    driver.session.playback.is_playing = True
    driver.run_frames(30)
    time = driver.session.displayed.time
    driver.push_button("pane:add")
    assert driver.window.dialogs.current.title == (
        "Compare RAPF with… All start at 0 s; undo returns to this run."
    )
    driver.press_key("escape")
    assert len(driver.session.timeline.panes) == 1
    assert driver.session.displayed.time >= time
    driver.push_button("pane:add")
    driver.type("lloyd")
    driver.press_key("return")
    assert [pane.controller.name for pane in driver.session.timeline.panes] == ["rapf", "lloyd"]
    driver.press_key("ctrl+z")
    assert len(driver.session.timeline.panes) == 1
    assert driver.session.displayed.time >= time


def test_a_comparison_names_the_controllers_of_the_present(driver: Driver) -> None:
    advance_session(driver.session, 30)
    driver.session.set_controller(driver.session.timeline.panes[0], ControllerChoice("lloyd"))
    advance_session(driver.session, 30)
    driver.session.show_time(0.0)
    driver.push_button("pane:add")
    dialog = driver.window.dialogs.current
    assert dialog.title.startswith("Compare Lloyd with…")
    options = dialog.options("")
    assert (options[-1].text, options[-1].note) == ("Lloyd", "already shown")
    driver.type("rpf")
    driver.press_key("return")
    assert [pane.controller.name for pane in driver.session.timeline.panes] == ["lloyd", "rpf"]


def test_controllers_that_are_shown_are_offered_last(driver: Driver) -> None:
    driver.push_button("pane:add")
    options = driver.window.dialogs.current.options("")
    assert options[0].text == "RPF"
    assert (options[-1].text, options[-1].note) == ("RAPF", "already shown")


def test_controllers_to_compare_with_are_described(driver: Driver) -> None:
    driver.push_button("pane:add")
    options = {option.text: option for option in driver.window.dialogs.current.options("")}
    assert options["Lloyd"].description.startswith("Lloyd's algorithm: each robot moves")
    for name, option in options.items():
        assert option.description or name == "RAPF"


def test_a_comparison_of_an_unchanged_run_has_nothing_to_say(driver: Driver) -> None:
    driver.add_pane()
    assert driver.viewer.message == "Both controllers start again at 0 s."


def test_a_curve_in_a_file_has_its_beginning() -> None:
    curve = Curve()
    for sample in range(MAX_FILE_SAMPLES + 100):
        curve.add(0.1 * sample, 5.0)
    times, _ = curve.sample(MAX_FILE_SAMPLES)
    assert len(times) <= MAX_FILE_SAMPLES
    assert times[0] == 0.0
    assert times[-1] == pytest.approx(0.1 * (MAX_FILE_SAMPLES + 99))
    assert np.diff(times).max() < 0.6


def test_the_beginning_of_a_curve_is_computed_after_an_edit_too(driver: Driver) -> None:
    """A session may be recovered after its first edit, with a curve that starts later."""
    session = driver.session
    advance_session(session, 60)
    session.fail_robot(2)
    advance_session(session, 30)
    for pane in session.timeline.panes:
        pane.distance_curve._times.clear()
        pane.distance_curve._values.clear()
    driver.run_frames(30)
    times = session.timeline.panes[0].distance_curve.times
    assert times[0] == pytest.approx(0.0, abs=0.35)


def test_what_is_cut_off_is_shown_next_to_the_cost(tmp_path: Path) -> None:
    wall = WallObstacle(((2.0, 0.0), (2.0, 4.0)), 0.1)
    sealed = replace(HALL, obstacles=(wall,), starts={"corner": HALL.starts["corner"]})
    for environment, is_cut_off in ((HALL, False), (sealed, True)):
        with open_viewer(tmp_path, environment=environment) as driver:
            driver.session.playback.is_playing = True
            driver.run_frames(20)
            caption = driver.window.canvas._scenes[0].cost
            assert ("m² cut off" in caption) == is_cut_off, caption


def test_facts_keep_their_order_at_any_frame_rate(driver: Driver) -> None:
    driver.move(*driver.find_pixel((1.0, 3.0)))
    orders = []
    for rate in (5.0, 29.9, 30.1, 60.0):
        facts = list_facts(driver.viewer, rate, 60.0, None)
        orders.append([index for index, fact in enumerate(facts) if fact.endswith("fps")])
    assert all(order == orders[0] for order in orders)


@pytest.mark.parametrize("name", ["letter.docx", "letter", "plan.pdf"])
def test_a_dropped_file_of_another_kind_is_rejected_with_a_way_out(
    name: str, driver: Driver, tmp_path: Path
) -> None:
    path = tmp_path / name
    path.write_bytes(b"PK\x03\x04")
    driver.post(pygame.DROPFILE, file=str(path))
    driver.settle()
    assert driver.viewer.has_error_message
    assert "expected a session (.robocov) or a map (.json)" in driver.viewer.message


def test_more_robots_than_fit_at_the_start_start_uniformly(driver: Driver) -> None:
    driver.viewer.attempt(lambda: driver.viewer.playback.restart(start="far"))
    driver.viewer.attempt(lambda: driver.viewer.playback.restart(robots=40))
    assert len(driver.session.displayed.numbers) == 40
    assert driver.session.timeline.scenario.start_name == "uniform"
    assert (
        driver.viewer.message
        == "No space for 40 robots at start “far”: they start anywhere in the free space"
    )
    driver.press_key("ctrl+z")
    assert driver.session.timeline.scenario.start_name == "far"
    driver.viewer.attempt(lambda: driver.viewer.playback.restart(robots=40, start="far"))
    assert driver.viewer.has_error_message, "a start that was asked for is not replaced"


def test_the_command_starts_more_robots_than_fit_uniformly(capsys: pytest.CaptureFixture[str]) -> None:
    options = demo.Arguments(map="city", robots=200)
    session = demo.build_session(options)
    assert len(session.displayed.numbers) == 200
    assert (
        "not enough space for 200 robots at start 'market'; using --start uniform" in capsys.readouterr().err
    )
    with pytest.raises(StartError, match="space for about"):
        demo.build_session(replace(options, start="market"))


def test_the_trajectory_of_a_failed_robot_stays_visible(tmp_path: Path) -> None:
    with open_viewer(tmp_path, shown={"trajectories"}, size=(1200, 800)) as driver:
        color = np.array(driver.window.theme.failed_trajectory)

        def count_pixels() -> int:
            left, top, width, height = driver.window.layout.arena
            arena = driver.copy_frame()[top : top + height, left : left + width]
            return int((np.abs(arena - color).max(axis=2) < 12).sum())

        driver.session.playback.is_playing = True
        driver.run_frames(60)
        before = count_pixels()
        driver.viewer.attempt(lambda: driver.session.fail_robot(1))
        driver.run_frames(2)
        assert count_pixels() > before + 10
