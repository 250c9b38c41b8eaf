"""What keys do: no key twice, nothing named that does not exist, everything in words."""

from __future__ import annotations

import ast
from pathlib import Path

import pygame
import pytest
from driven_window import KEYS, Driver, build_key_event, open_viewer, run_command
from hypothesis import given
from hypothesis import strategies as st
from pointer_events import build_event

import robocov_app.viewer as package
from robocov.controllers import CONTROLLERS, get_gains
from robocov_app.render.picture import standard_layers
from robocov_app.toolkit.command import Command, find_commands
from robocov_app.toolkit.input import format_key
from robocov_app.viewer.commands import GROUPS, list_viewer_commands
from robocov_app.viewer.inspection import Inspection
from robocov_app.viewer.lesson_guide import COMMANDS_WITHIN_LESSON
from robocov_app.viewer.panel import ViewerPanel
from robocov_app.viewer.tools.toolbox import ViewerToolbox

TITLES = {layer.name: layer.title for layer in standard_layers()}
TEXTS = [path.read_text() for path in Path(package.__path__[0]).glob("*.py")]

HARMLESS = frozenset({"quit", "video", "screenshot", "save:run", "save:map", "fullscreen"})
"""Left out where each action is done: tested for themselves, or they write files."""


@pytest.fixture(scope="module")
def actions(shared: Driver) -> list[Command]:
    return shared.window.commands.commands


def test_no_key_does_two_things(actions: list[Command]) -> None:
    keys = [key for action in actions for key in action.keys]
    assert len(keys) == len(set(keys))


def test_no_two_actions_have_one_name_or_one_title(actions: list[Command]) -> None:
    for words in ([action.name for action in actions], [action.title for action in actions]):
        assert len(words) == len(set(words))


def test_everything_has_a_key_or_is_typed_and_is_in_a_group_of_the_help(actions: list[Command]) -> None:
    for action in actions:
        assert action.keys or action.argument, action.name
        assert action.title[0].isupper() and not action.title.endswith(".")
        assert action.group in GROUPS
    assert {action.group for action in actions} == set(GROUPS)


def test_all_layers_and_all_tools_are_there(shared: Driver) -> None:
    named = [each.name for each in list_viewer_commands(shared.viewer, TITLES)]
    assert [name for name in named if name.startswith("tool:")] == [
        f"tool:{name}" for name in ViewerToolbox(Inspection()).by_name
    ]
    assert {name for name in named if name.startswith("layer:")} == {f"layer:{name}" for name in TITLES}


def test_a_layer_that_nobody_foresaw_has_an_action_without_a_key(shared: Driver) -> None:
    listed = list_viewer_commands(shared.viewer, {**TITLES, "dust": "Dust"})
    assert [each.keys for each in listed if each.name == "layer:dust"] == [()]


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("ctrl+shift+z", "Ctrl Shift Z"),
        ("shift+=", "Shift ="),
        ("ctrl++", "Ctrl +"),
        ("+", "+"),
        ("shift+left", "Shift ←"),
        ("return", "Enter"),
        ("enter", "Enter"),
        ("f12", "F12"),
        ("page down", "Page down"),
        ("shift+/", "Shift /"),
        ("[", "["),
    ],
)
def test_keys_are_written_as_on_the_keyboard(key: str, words: str) -> None:
    assert format_key(key) == words


def test_every_key_is_one_that_there_is(actions: list[Command]) -> None:
    for key in (key for action in actions for key in action.keys):
        *held, last = [*key[:-1].split("+"), "+"] if key.endswith("++") or key == "+" else key.split("+")
        assert {each for each in held if each} <= {"ctrl", "alt", "shift"}
        code = KEYS.get(last) or pygame.key.key_code(last)
        assert pygame.key.name(code) == last


def test_what_panel_pages_and_window_name_exists(actions: list[Command]) -> None:
    """Every text that looks like an action's name, and is used where one is wanted, is one."""
    names = {action.name for action in actions}
    calls = {"_show_button", "do", "_do"}
    for text in TEXTS:
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Call) and getattr(node.func, "attr", "") in calls:
                for arg in node.args:
                    if (
                        isinstance(arg, ast.Constant)
                        and isinstance(arg.value, str)
                        and arg.value[0].islower()
                    ):
                        assert arg.value in names, arg.value
    assert names >= COMMANDS_WITHIN_LESSON


def test_every_button_of_the_panel_that_has_a_name_does_that_action_or_is_the_panels_own(
    shared: Driver, actions: list[Command]
) -> None:
    names = {action.name for action in actions}
    options = {name for law in CONTROLLERS.values() for name in get_gains(law)}
    for tab in ViewerPanel.tabs:
        shared.window.panel.show_tab(tab)
        shared.settle()
        for each in shared.window.panel.ui.widgets.values():
            own = each.key.partition(":")[0] in {"tab", "reset", "close", "team.kinematics", *options}
            assert each.kind != "button" or own or each.key in names, each.key


def state_of(driver: Driver) -> list[object]:
    """Return whatever an action might change."""
    viewer, session, its = driver.viewer, driver.session, driver.window
    camera = its.canvas._painters[0].camera
    told: list[object] = [
        viewer.view.layers.copy(),
        viewer.view.theme,
        viewer.view.fades_trajectories,
        viewer.view.has_panel,
        viewer.tool,
        viewer.active_pane,
    ]
    told += [
        viewer.inspection.selected,
        viewer.message,
        viewer.files.map_name,
        session.playback.is_playing,
        session.displayed.time,
        session.timeline.end_time,
    ]
    told += [
        session.timeline.past_version,
        session.playback.clock.speed,
        session.playback.stop_when_settled,
        session.displayed.environment,
    ]
    told += [
        session.timeline.scenario,
        len(session.timeline.panes),
        [pane.controller for pane in session.timeline.panes],
        camera,
    ]
    told += [
        viewer.tool.build_draw_state(session),
        session.displayed.get_setup(session.timeline.panes[0]),
        its.is_help_open,
        its.dialogs.is_open,
        its.lesson.player,
        its.panel.tab,
    ]
    return told


@pytest.mark.slow
def test_every_action_does_something(shared: Driver) -> None:
    for action in shared.window.commands.commands:
        if action.name in HARMLESS or action.argument is not None:
            continue
        driver = prepared(shared)
        before = state_of(driver)
        driver.window.do(action.name)
        assert state_of(driver) != before, action.name


def test_every_key_does_its_action(shared: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[str] = []
    shared.window.dialogs.close()
    shared.window.panel.ui.stop_typing()
    monkeypatch.setattr(shared.window, "do", done.append)
    for action in shared.window.commands.commands:
        for key in action.keys:
            shared.post(pygame.KEYDOWN, **build_key_event(key))
            shared.post(pygame.KEYUP, **build_key_event(key))
    shared.window.advance(0.0)
    assert done == [action.name for action in shared.window.commands.commands for _ in action.keys]


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory):
    with open_viewer(tmp_path_factory.mktemp("window")) as driver:
        yield driver


def prepared(driver: Driver) -> Driver:
    """Bring a window into a state in which every action has something to do."""
    its, viewer, session = driver.window, driver.viewer, driver.session
    its.is_help_open = False
    its.dialogs.close()
    its.lesson.end()
    viewer.attempt(lambda: viewer.files.open_map("square"))
    while len(session.timeline.panes) > 1:
        session.remove_pane(session.timeline.panes[-1])
    viewer.comparison.add_pane()
    for _ in range(90):
        session.playback.step()
    viewer.inspection.selected = 2
    session.add_robot((8.0, 8.0))
    session.add_robot((8.0, 2.0))
    session.undo()
    session.playback.is_playing = False
    run_command(viewer, "tool:polygon")
    viewer.tool.press(session, build_event((6.0, 6.0)))
    viewer.tool.press(session, build_event((7.0, 6.0)))
    viewer.tool.press(session, build_event((7.0, 7.0)))
    viewer.tool.move(session, build_event((6.5, 7.5)))
    session.playback.step()
    session.show_time(0.7)
    its.canvas.fit()
    its.canvas.zoom(1.4, (200, 200))
    its.canvas.pan(20, 20)
    viewer.message = ""
    return driver


@given(st.text(max_size=30))
def test_what_is_found_holds_all_words_typed(actions: list[Command], typed: str) -> None:
    found = find_commands(actions, typed)
    for action in actions:
        assert (action in found) == all(
            word in f"{action.title} {action.name}".lower() for word in typed.lower().split()
        )


def test_what_begins_with_the_words_comes_first(actions: list[Command]) -> None:
    found = [action.title for action in find_commands(actions, "re")]
    first = [title for title in found if title.lower().startswith("re")]
    assert first and found[: len(first)] == first
