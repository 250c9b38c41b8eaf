"""Sharing a session: texts that simulate the run of the window again, copies, and the menu."""

from __future__ import annotations

import ast
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from driven_window import Driver, open_viewer
from sample_sessions import HALL, LLOYD, PILLAR, RAPF, advance_session

from robocov.conditions import Conditions
from robocov.environment import UniformStart
from robocov.errors import format_exactly
from robocov.mapfile import load_map
from robocov.record import Record
from robocov_app.cli import main
from robocov_app.toolkit.commands.menu import Menu
from robocov_app.toolkit.window.clipboard import Clipboard
from robocov_app.toolkit.window.share_link import ShareLink
from robocov_app.viewer.session.editing.map_edits import add_obstacle
from robocov_app.viewer.session.files.session_file import load_session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties
from robocov_app.viewer.sharing.share import ShareActions
from robocov_app.viewer.sharing.values import format_python_text

STEPS = 40
ROOMS = load_map("rooms")
GAINS = ControllerChoice("rapf", {"k_rep": 0.3, "attraction_limit": None})
CONDITIONS = Conditions(loss=0.1, position_noise=0.01, delay=0.1, message_rate=20.0, density="sensed", seed=4)

SESSIONS: dict[str, dict[str, Any]] = {
    "plain": {},
    "gains": {"controllers": (GAINS,), "robots": 5, "seed": 7},
    "robots": {"properties": RobotProperties(max_speed=0.5, communication_range=4.0)},
    "conditions": {"conditions": CONDITIONS, "seed": 4, "dt": 0.04},
    "start": {"start": "uniform"},
}


def copy_text(driver: Driver, name: str) -> str:
    """Choose an entry of the share menu, and return the text on the clipboard."""
    driver.push_button("share")
    menu = driver.window.dialogs.current
    assert isinstance(menu, Menu)
    ui = driver.window.dialogs.ui
    assert ui is not None
    option = ui.find("option", name)
    assert option is not None
    driver.click(*option.rect.center)
    assert not driver.window.model.has_error_message, driver.window.model.message
    return Clipboard().get()


def run_command(text: str, folder: Path) -> list[np.ndarray]:
    """Run a copied command, and return the last positions of its records, (n, 2) m each."""
    finals: list[np.ndarray] = []
    for number, line in enumerate(text.splitlines()):
        program, *arguments = shlex.split(line)
        assert program == "robocov"
        out = folder / f"out-{number}"
        if "--out" in arguments:
            del arguments[arguments.index("--out") :][:2]
        assert main([*arguments, "--out", str(out), "--no-figures", "--lattice", "16"]) == 0
        folders = sorted(path.parent for path in out.rglob("record.npz"))
        finals += [Record.load(path).positions[-1] for path in folders]
    return finals


def run_python(text: str) -> list[np.ndarray]:
    """Execute a copied script, and return the last positions of its records, (n, 2) m each."""
    names: dict[str, Any] = {}
    exec(text, names)
    if "record" in names:
        return [names["record"].positions[-1]]
    return [record.positions[-1] for record in names["comparison"].records.values()]


def get_positions(driver: Driver, pane: int = 0) -> np.ndarray:
    """Return the positions of all robots, working or failed, (n, 2) m."""
    return driver.session.displayed.get_snapshot(driver.session.timeline.panes[pane]).positions


@pytest.mark.parametrize("name", SESSIONS)
def test_the_command_and_the_script_repeat_the_run(name: str, tmp_path: Path) -> None:
    options = {**SESSIONS[name]}
    controllers = options.pop("controllers", (RAPF,))
    with open_viewer(tmp_path, *controllers, environment=ROOMS, map_name="rooms", **options) as driver:
        advance_session(driver.session, STEPS)
        command = copy_text(driver, "share:command")
        script = copy_text(driver, "share:python")
        expected = get_positions(driver)
    assert command.startswith("robocov run rooms --controller rapf")
    (by_command,) = run_command(command, tmp_path)
    (by_script,) = run_python(script)
    for positions in (by_command, by_script):
        assert np.array_equal(positions, expected)


def test_several_controllers_are_compared(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with open_viewer(tmp_path, GAINS, LLOYD, environment=ROOMS, map_name="rooms") as driver:
        advance_session(driver.session, STEPS)
        command = copy_text(driver, "share:command")
        script = copy_text(driver, "share:python")
        expected = [get_positions(driver, pane) for pane in (0, 1)]
    assert command.startswith("robocov compare rooms --controllers rapf lloyd --set rapf.")
    by_command = run_command(command, tmp_path)
    # The folders of a comparison are sorted by name.
    assert all(np.array_equal(*pair) for pair in zip(by_command, reversed(expected), strict=True))
    capsys.readouterr()
    assert all(np.array_equal(*pair) for pair in zip(run_python(script), expected, strict=True))
    printed = capsys.readouterr().out
    assert "mean distance" in printed
    assert [line.split()[0] for line in printed.splitlines()[1:]] == ["RAPF", "Lloyd"]


def test_a_controller_that_is_compared_with_itself_has_a_command_for_each(tmp_path: Path) -> None:
    with open_viewer(tmp_path, GAINS, RAPF, environment=ROOMS, map_name="rooms") as driver:
        advance_session(driver.session, STEPS)
        command = copy_text(driver, "share:command")
        expected = [get_positions(driver, pane) for pane in (0, 1)]
    assert all(np.array_equal(*pair) for pair in zip(run_command(command, tmp_path), expected, strict=True))


def test_changes_before_the_start_are_initial_conditions(tmp_path: Path) -> None:
    with open_viewer(tmp_path, RAPF, LLOYD, environment=ROOMS, map_name="rooms") as driver:
        session = driver.session
        session.set_controller(session.timeline.panes[0], GAINS)
        session.set_properties(RobotProperties(max_speed=0.4))
        session.remove_pane(session.timeline.panes[1])
        advance_session(session, STEPS)
        command = copy_text(driver, "share:command")
        script = copy_text(driver, "share:python")
        expected = get_positions(driver)
    assert "--max-speed 0.4" in command
    assert "max_speed=0.4" in script
    (positions,) = run_command(command, tmp_path)
    assert np.array_equal(positions, expected)
    (positions,) = run_python(script)
    assert np.array_equal(positions, expected)


def test_an_edited_map_is_saved_for_the_command(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        session = driver.session
        session.edit_map(add_obstacle(HALL, PILLAR), "circle added")
        advance_session(session, STEPS)
        command = copy_text(driver, "share:command")
        expected = get_positions(driver)
        assert str(tmp_path / "hall-1.json") in driver.window.model.message
    (positions,) = run_command(command, tmp_path)
    assert np.array_equal(positions, expected)


def test_an_edited_map_is_saved_in_the_folder_whatever_its_name(tmp_path: Path) -> None:
    folder = tmp_path / "maps"
    folder.mkdir()
    with open_viewer(folder, environment=replace(HALL, name="../escaped")) as driver:
        driver.session.edit_map(add_obstacle(driver.session.displayed.environment, PILLAR), "circle added")
        copy_text(driver, "share:command")
    assert [path.name for path in tmp_path.rglob("*.json")] == ["escaped-1.json"]
    assert (folder / "escaped-1.json").exists()


def test_later_edits_are_in_the_session_that_the_command_runs(tmp_path: Path) -> None:
    with open_viewer(tmp_path, environment=ROOMS, map_name="rooms") as driver:
        advance_session(driver.session, STEPS)
        driver.session.fail_robot(1)
        advance_session(driver.session, STEPS)
        command = copy_text(driver, "share:command")
        script = copy_text(driver, "share:python")
        expected = get_positions(driver)
        assert "without 1 later edit" in driver.window.model.message
    assert command == f"robocov run {tmp_path / 'rooms-copy-1.robocov'}"
    assert "# 0.7 s: robot 1 failed" in script
    *_, last = run_command(command, tmp_path)
    assert np.array_equal(last, expected)


def test_robots_that_fail_are_in_the_session_that_the_command_runs(tmp_path: Path) -> None:
    conditions = Conditions(failures=[(2, 0.2)], seed=0)
    with open_viewer(tmp_path, environment=ROOMS, map_name="rooms", conditions=conditions) as driver:
        advance_session(driver.session, STEPS)
        command = copy_text(driver, "share:command")
        script = copy_text(driver, "share:python")
        expected = get_positions(driver)
    *_, last = run_command(command, tmp_path)
    assert np.array_equal(last, expected)
    assert "failures=[(2, 0.2)]" in script
    assert len(run_python(script)[0]) == 3


@pytest.mark.parametrize("name", ["rapf", "frontier-median"])
def test_the_script_repeats_robots_that_fail_and_join(name: str, tmp_path: Path) -> None:
    """The window lost the maps of the robots, and the numbers of their noise, whenever the team changed."""
    conditions = Conditions(failures=[(2, 0.2)], joins=[(3, 0.3)], position_noise=0.01, loss=0.1, seed=0)
    controller = ControllerChoice(name)
    with open_viewer(
        tmp_path, controller, environment=ROOMS, map_name="rooms", robots=4, conditions=conditions
    ) as driver:
        advance_session(driver.session, STEPS)
        script = copy_text(driver, "share:python")
        expected = get_positions(driver)
        assert driver.session.displayed.numbers == (1, 3, 4)
    assert "#" not in script
    (positions,) = run_python(script)
    assert np.array_equal(positions[[0, 2, 3]], expected)


def test_the_window_lets_the_last_robot_work_and_the_script_says_so(tmp_path: Path) -> None:
    conditions = Conditions(failures=[(1, 0.1), (2, 0.2)], seed=0)
    with open_viewer(
        tmp_path, environment=ROOMS, map_name="rooms", robots=2, conditions=conditions
    ) as driver:
        advance_session(driver.session, STEPS)
        assert driver.session.displayed.numbers == (2,)
        assert "positions differ from those in the window" in copy_text(driver, "share:python")


def test_robots_that_differ_are_in_the_script(tmp_path: Path) -> None:
    properties = RobotProperties(values_by_robot={"max_speed": {2: 0.3}})
    with open_viewer(tmp_path, environment=ROOMS, map_name="rooms", properties=properties) as driver:
        advance_session(driver.session, STEPS)
        script = copy_text(driver, "share:python")
        expected = get_positions(driver)
    (positions,) = run_python(script)
    assert np.array_equal(positions, expected)


def test_headings_of_unicycles_are_in_the_script(tmp_path: Path) -> None:
    options: dict[str, Any] = {
        "properties": RobotProperties(track_width=0.3),
        "given_starts": ROOMS.start().sample(3, seed=0),
        "steering": np.array([[1.0, 0.0], [2.0, 0.5], [-1.0, 0.0]]),
    }
    with open_viewer(tmp_path, environment=ROOMS, map_name="rooms", **options) as driver:
        advance_session(driver.session, STEPS)
        script = copy_text(driver, "share:python")
        expected = get_positions(driver)
    (positions,) = run_python(script)
    assert np.array_equal(positions, expected)


def test_a_start_with_an_emoji_in_its_name_is_in_the_script(tmp_path: Path) -> None:
    name = "tür 🚪"
    rooms = replace(ROOMS, starts={name: UniformStart()})
    with open_viewer(tmp_path, RAPF, environment=rooms, map_name="rooms", start=name) as driver:
        script = copy_text(driver, "share:python")
    assert f'start="{name}"' in script


def test_a_copy_opens_this_session_which_keeps_its_own_file(driver: Driver, tmp_path: Path) -> None:
    advance_session(driver.session, STEPS)
    driver.window.run_command("save:session")
    driver.session.fail_robot(1)
    copy_text(driver, "share:copy")
    assert driver.viewer.files.workspace.path == tmp_path / "hall-1.robocov"
    assert driver.viewer.files.workspace.has_unsaved_edits
    saved = load_session(tmp_path / "hall-1-copy-1.robocov")
    assert saved.head.description == "robot 1 failed"


def test_a_link_needs_a_server(driver: Driver) -> None:
    driver.window.run_command("share:link")
    assert driver.window.model.has_error_message
    driver.push_button("share")
    menu = driver.window.dialogs.current
    assert isinstance(menu, Menu)
    assert "share:link" not in [row.name for row in menu.rows if row is not None]


class FakeRemote:
    """A remote that records its requests."""

    fps = 30
    share_link = ShareLink("http://127.0.0.1:8765/?token=watch", "127.0.0.1")

    def __init__(self) -> None:
        self.offered: list[str] = []

    def offer_file(self, name: str) -> None:
        self.offered.append(name)


def test_a_browser_gets_a_link_and_downloads_the_copy(driver: Driver) -> None:
    remote = FakeRemote()
    actions = ShareActions(driver.viewer, lambda: remote)
    message = actions.copy_link()
    assert message.startswith("Link copied, but it opens on this computer only.")
    assert "--serve --host 0.0.0.0" in message
    assert Clipboard().get() == "http://127.0.0.1:8765/?token=watch"
    actions.save_copy()
    assert remote.offered == ["hall-copy-1.robocov"]


def test_a_link_into_the_network_says_who_can_use_it(driver: Driver) -> None:
    remote = FakeRemote()
    remote.share_link = ShareLink("http://192.0.2.1:8765/?token=watch", "0.0.0.0")
    message = ShareActions(driver.viewer, lambda: remote).copy_link()
    assert message == "Link copied. Whoever opens it watches this window, and can ask for control."


def test_the_message_about_a_copy_ends_with_a_command_that_opens_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with open_viewer(Path()) as driver:
        message = ShareActions(driver.viewer, lambda: None).save_copy()
    command = message.splitlines()[-1]
    assert shlex.split(command) == ["robocov", "demo", str(tmp_path / "hall-copy-1.robocov")]
    assert load_session(Path(shlex.split(command)[-1])).head.description == "started"


@pytest.mark.parametrize("value", [2.0, 0.1, 0.1 + 0.2, 1e-7, 123456789.125, np.inf])
def test_numbers_are_exact(value: float) -> None:
    assert float(format_exactly(value)) == value


@pytest.mark.parametrize("text", ["rooms", "tür 🚪", "it's", 'a "b"', "'\"\\\n", "\x7f\u202e", "\udcff", ""])
def test_texts_are_exact(text: str) -> None:
    literal = format_python_text(text)
    assert ast.literal_eval(literal) == text
    # Surrogates are escaped, because the clipboard is in UTF-8.
    assert literal.encode().decode() == literal
