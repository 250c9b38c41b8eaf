"""Commands of the viewer: their keys, names and titles, and the state that they change."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pygame
import pytest
from driven_window import KEYS, Driver, build_key_event, open_viewer, run_command
from hypothesis import given
from hypothesis import strategies as st
from pointer_events import build_event

import robocov_app.viewer as package
from robocov.controllers import CONTROLLERS, get_gains
from robocov_app.render.layer_catalog import build_standard_layers
from robocov_app.toolkit.commands.command import Command, find_commands
from robocov_app.toolkit.window.input import format_key
from robocov_app.viewer.commands.viewer_commands import GROUPS, list_viewer_commands
from robocov_app.viewer.inspection import Inspection
from robocov_app.viewer.lessons.guide import COMMANDS_WITHIN_LESSON
from robocov_app.viewer.panel.panel import ViewerPanel
from robocov_app.viewer.tools.toolbox import ViewerToolbox

TITLES = {layer.name: layer.title for layer in build_standard_layers()}
TEXTS = [path.read_text() for path in Path(package.__path__[0]).glob("*.py")]

UNTRIED = frozenset({"quit", "video", "screenshot", "save:run", "save:map", "fullscreen"})
"""Commands that are not run here, because other tests cover them or they write files."""


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Driver]:
    with open_viewer(tmp_path_factory.mktemp("window")) as driver:
        yield driver


@pytest.fixture(scope="module")
def commands(shared: Driver) -> list[Command]:
    return shared.window.commands.commands


def test_no_key_belongs_to_two_commands(commands: list[Command]) -> None:
    keys = [key for command in commands for key in command.keys]
    assert len(keys) == len(set(keys))


def test_names_and_titles_of_commands_are_unique(commands: list[Command]) -> None:
    names = [command.name for command in commands]
    titles = [command.title for command in commands]
    assert len(names) == len(set(names))
    assert len(titles) == len(set(titles))


def test_every_command_has_a_key_or_an_argument_and_a_group(commands: list[Command]) -> None:
    for command in commands:
        # The menu of the share button has a key, but its rows do not.
        is_row_of_menu = command.name.startswith("share:")
        assert command.keys or command.argument or is_row_of_menu, command.name
        assert command.title[0].isupper()
        assert not command.title.endswith(".")
        assert command.group in GROUPS
    assert {command.group for command in commands} == set(GROUPS)


def test_all_layers_and_tools_have_commands(shared: Driver) -> None:
    names = [command.name for command in list_viewer_commands(shared.viewer, TITLES)]
    tools = [name.removeprefix("tool:") for name in names if name.startswith("tool:")]
    layers = {name.removeprefix("layer:") for name in names if name.startswith("layer:")}
    assert tools == list(ViewerToolbox(Inspection()).by_name)
    assert layers == set(TITLES)


def test_a_new_layer_has_a_command_without_a_key(shared: Driver) -> None:
    listed = list_viewer_commands(shared.viewer, {**TITLES, "dust": "Dust"})
    assert [command.keys for command in listed if command.name == "layer:dust"] == [()]


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("ctrl+shift+z", "Ctrl+Shift+Z"),
        ("shift+=", "Shift+="),
        ("ctrl++", "Ctrl++"),
        ("+", "+"),
        ("shift+left", "Shift+←"),
        ("return", "Enter"),
        ("enter", "Enter"),
        ("f12", "F12"),
        ("page down", "Page down"),
        ("shift+/", "Shift+/"),
        ("[", "["),
    ],
)
def test_keys_are_written_as_on_the_keyboard(key: str, text: str) -> None:
    assert format_key(key) == text


def test_every_key_exists_in_pygame(commands: list[Command]) -> None:
    for key in (key for command in commands for key in command.keys):
        # The key "+" is written behind the plus signs that join the modifiers.
        is_plus = key == "+" or key.endswith("++")
        parts = [*key[:-1].split("+"), "+"] if is_plus else key.split("+")
        *modifiers, name = parts
        assert {modifier for modifier in modifiers if modifier} <= {"ctrl", "alt", "shift"}
        code = KEYS.get(name) or pygame.key.key_code(name)
        assert pygame.key.name(code) == name


def test_commands_named_in_the_code_exist(commands: list[Command]) -> None:
    """Calls of functions that expect the name of a command have one."""
    names = {command.name for command in commands}
    functions = {"_show_button", "run_command", "_run_command"}
    for text in TEXTS:
        for node in ast.walk(ast.parse(text)):
            if not isinstance(node, ast.Call) or getattr(node.func, "attr", "") not in functions:
                continue
            values = [argument.value for argument in node.args if isinstance(argument, ast.Constant)]
            # Texts that start with a capital letter are titles.
            used = {value for value in values if isinstance(value, str) and value[0].islower()}
            assert used <= names
    assert names >= COMMANDS_WITHIN_LESSON


def test_buttons_of_the_panel_run_commands(shared: Driver, commands: list[Command]) -> None:
    """Every button runs the command of its name, or belongs to the panel alone."""
    names = {command.name for command in commands}
    gains = {name for controller in CONTROLLERS.values() for name in get_gains(controller)}
    own_keys = {"tab", "reset", "close", "team.kinematics", *gains}
    for tab in ViewerPanel.tabs:
        shared.window.panel.show_tab(tab)
        shared.settle()
        buttons = [widget for widget in shared.window.panel.ui.widgets.values() if widget.kind == "button"]
        for button in buttons:
            assert button.key in names or button.key.partition(":")[0] in own_keys, button.key


def prepare_session(driver: Driver) -> None:
    """Bring a window into a state in which every command changes something."""
    window = driver.window
    viewer = driver.viewer
    session = driver.session
    # Nothing that the previous command has opened may cover the map.
    window.help_page.close()
    window.dialogs.close()
    window.lesson.end()
    # A run of two panes, so that one can be closed and the other one selected.
    viewer.attempt(lambda: viewer.files.open_map("square"))
    while len(session.timeline.panes) > 1:
        session.remove_pane(session.timeline.panes[-1])
    viewer.comparison.add_pane("rpf")
    for _ in range(90):
        session.playback.step()
    # A selected robot, an edit that can be undone, and one that can be redone.
    viewer.inspection.selected = 2
    session.add_robot((8.0, 8.0))
    session.add_robot((8.0, 2.0))
    session.undo()
    session.playback.is_playing = False
    # A polygon that can be finished or canceled.
    run_command(viewer, "tool:polygon")
    viewer.tool.press(session, build_event((6.0, 6.0)))
    viewer.tool.press(session, build_event((7.0, 6.0)))
    viewer.tool.press(session, build_event((7.0, 7.0)))
    viewer.tool.move(session, build_event((6.5, 7.5)))
    # A displayed time between the start and the end of the run.
    session.playback.step()
    session.show_time(0.7)
    # A view that does not show the whole map, so that it can be fitted.
    window.canvas.camera.fit()
    window.canvas.zoom(1.4, (200, 200))
    window.canvas.camera.pan(20, 20)
    viewer.message = ""


def list_state(driver: Driver) -> list[object]:
    """Return the parts of the state that commands change."""
    viewer = driver.viewer
    session = driver.session
    window = driver.window
    return [
        viewer.view.layers.copy(),
        viewer.view.theme,
        viewer.view.fades_trajectories,
        viewer.view.has_panel,
        viewer.tool,
        viewer.tool.build_overlay(session),
        viewer.active_pane,
        viewer.inspection.selected,
        viewer.message,
        viewer.files.map_name,
        session.playback.is_playing,
        session.playback.clock.speed,
        session.playback.stop_when_settled,
        session.displayed.time,
        session.displayed.environment,
        session.displayed.get_setup(session.timeline.panes[0]),
        session.timeline.end_time,
        session.timeline.past_version,
        session.timeline.scenario,
        [pane.controller for pane in session.timeline.panes],
        window.canvas._painters[0].camera,
        [group.focus for group in window._list_focus_groups()],
        window.help_page.is_open,
        window.layer_bar.is_open,
        window.dialogs.is_open,
        window.lesson.player,
        window.panel.tab,
    ]


@pytest.mark.slow
def test_every_command_changes_something(shared: Driver) -> None:
    for command in shared.window.commands.commands:
        if command.name in UNTRIED or command.argument is not None:
            continue
        prepare_session(shared)
        before = list_state(shared)
        shared.window.run_command(command.name)
        assert list_state(shared) != before, command.name


def test_every_key_runs_its_command(shared: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[str] = []
    shared.window.dialogs.close()
    shared.window.panel.ui.clear_focus()
    shared.window.focus.leave()
    monkeypatch.setattr(shared.window, "run_command", done.append)
    for command in shared.window.commands.commands:
        for key in command.keys:
            shared.post(pygame.KEYDOWN, **build_key_event(key))
            shared.post(pygame.KEYUP, **build_key_event(key))
    shared.window.advance(0.0)
    assert done == [command.name for command in shared.window.commands.commands for _ in command.keys]


@given(st.text(max_size=30))
def test_found_commands_contain_all_typed_words(commands: list[Command], typed: str) -> None:
    matches = find_commands(commands, typed)
    for command in commands:
        text = f"{command.title} {command.name}".lower()
        assert (command in matches) == all(word in text for word in typed.lower().split())


def test_titles_that_start_with_the_text_come_first(commands: list[Command]) -> None:
    matches = [command.title for command in find_commands(commands, "re")]
    first = [title for title in matches if title.lower().startswith("re")]
    assert first
    assert matches[: len(first)] == first
