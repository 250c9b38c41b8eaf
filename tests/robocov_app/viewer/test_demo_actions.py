"""What keys do: no key twice, nothing named that does not exist, everything in words."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from driven_window import KEYS, Driver, opened
from hypothesis import given
from hypothesis import strategies as st

import robocov_app.viewer as package
from robocov.controllers import CONTROLLERS, gains_of
from robocov_app.render.picture import standard_layers
from robocov_app.viewer import panel, window
from robocov_app.viewer.actions import all_actions, key_words, layer_actions, matching, tool_actions
from robocov_app.viewer.overlays import _GROUPS
from robocov_app.viewer.tools import toolbox

TITLES = {layer.name: layer.title for layer in standard_layers()}
ACTIONS = all_actions(TITLES)
KEYED = [(key, action) for action in ACTIONS for key in action.keys]
TEXTS = [path.read_text() for path in Path(package.__path__[0]).glob("*.py")]

HARMLESS = frozenset({"quit", "film", "screenshot", "save:run", "save:map", "fullscreen"})
"""Left out where each action is done: tested for themselves, or they write files."""


def test_no_key_does_two_things() -> None:
    keys = [key for key, _ in KEYED]
    assert len(keys) == len(set(keys))


def test_no_two_actions_have_one_name_or_one_title() -> None:
    for words in ([action.name for action in ACTIONS], [action.title for action in ACTIONS]):
        assert len(words) == len(set(words))


def test_everything_has_a_key_and_is_in_a_group_that_the_help_shows() -> None:
    for action in ACTIONS:
        assert action.keys, action.name
        assert action.title[0].isupper() and not action.title.endswith(".")
        assert action.group in _GROUPS
    assert {action.group for action in ACTIONS} == set(_GROUPS)


def test_all_layers_and_all_tools_are_there() -> None:
    assert [action.name for action in tool_actions()] == [f"tool:{name}" for name in toolbox()]
    assert {action.name for action in layer_actions(TITLES)} == {f"layer:{name}" for name in TITLES}


def test_a_layer_that_nobody_foresaw_has_an_action_without_a_key() -> None:
    (new,) = (action for action in layer_actions({**TITLES, "dust": "Dust"}) if action.name == "layer:dust")
    assert new.title == "Dust" and new.keys == ()


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
    assert key_words(key) == words


@pytest.mark.parametrize(("key", "action"), KEYED, ids=[key for key, _ in KEYED])
def test_every_key_is_one_that_there_is(key: str, action) -> None:
    import pygame

    *held, last = [*key[:-1].split("+"), "+"] if key.endswith("++") or key == "+" else key.split("+")
    assert {each for each in held if each} <= {"ctrl", "alt", "shift"}
    pygame.display.init()  # which knows the names of keys
    try:
        code = KEYS.get(last) or pygame.key.key_code(last)
        assert pygame.key.name(code) == last
    finally:
        pygame.display.quit()


def test_what_panel_pages_and_window_name_exists() -> None:
    """Every text that looks like an action's name, and is used where one is wanted, is one."""
    names = {action.name for action in ACTIONS}
    calls = {"does", "do", "_do"}
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
    assert set(window._GOES_ON_WITH) <= names


def test_every_button_of_the_panel_that_has_a_name_does_that_action_or_is_the_panels_own(
    tmp_path: Path,
) -> None:
    names = {action.name for action in ACTIONS}
    options = {name for law in CONTROLLERS.values() for name in gains_of(law)}
    with opened(tmp_path) as driver:
        for tab in panel.TABS:
            driver.window.panel.show_tab(tab)
            driver.settle()
            for each in driver.window.panel.ui.shown.values():
                own = each.key.partition(":")[0] in {"tab", "reset", "close", *options}
                assert each.kind != "button" or own or each.key in names, each.key


def state_of(driver: Driver) -> list[object]:
    """Return whatever an action might change."""
    desk, session, its = driver.desk, driver.session, driver.window
    camera = its.arena._painters[0].camera
    told: list[object] = [desk.shown.copy(), desk.theme, desk.fade, desk.panel, desk.tool, desk.active]
    told += [desk.hand.selected, desk.message, desk.map_name, session.playing, session.time, session.end]
    told += [session.serial, session.clock.speed, session.stop_when_settled, session.environment]
    told += [session.scenario, len(session.lanes), [lane.law for lane in session.lanes], camera]
    told += [
        desk.tool.preview(session),
        session.circumstances(session.lanes[0]),
        its.help,
        its.palette.open,
        its.tour,
        its.panel.tab,
    ]
    return told


@pytest.mark.parametrize("action", [a for a in ACTIONS if a.name not in HARMLESS], ids=lambda a: a.name)
def test_every_action_does_something(action, shared: Driver) -> None:
    driver = prepared(shared)
    before = state_of(driver)
    driver.window.do(action.name)
    assert state_of(driver) != before


@pytest.mark.parametrize(("key", "action"), KEYED, ids=[key for key, _ in KEYED])
def test_every_key_does_its_action(key: str, action, shared: Driver, monkeypatch) -> None:
    done: list[str] = []
    monkeypatch.setattr(shared.window, "do", done.append)
    shared.key(key)
    assert done == [action.name]


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory):
    with opened(tmp_path_factory.mktemp("window")) as driver:
        yield driver


def prepared(driver: Driver) -> Driver:
    """Bring a window into a state in which every action has something to do."""
    its, desk, session = driver.window, driver.desk, driver.session
    its.help = its.palette.open = False
    its._end_tour()
    desk.attempt(lambda: desk.open_map("square"))
    while len(session.lanes) > 1:
        session.remove_pane(session.lanes[-1])
    desk.add_pane()
    for _ in range(90):
        session.step()
    desk.hand.selected = 2
    session.add_robot((8.0, 8.0))
    session.add_robot((8.0, 2.0))
    session.undo()
    session.playing = False
    desk.do("tool:polygon")
    desk.tool.press(session, (6.0, 6.0), 0.1, None)
    desk.tool.press(session, (7.0, 6.0), 0.1, None)
    desk.tool.press(session, (7.0, 7.0), 0.1, None)
    desk.tool.move(session, (6.5, 7.5))
    session.step()
    session.look_at(0.7)
    its.arena.fit()
    its.arena.zoom(1.4, (200, 200))
    its.arena.pan(20, 20)
    desk.message = ""
    return driver


@given(st.text(max_size=30))
def test_what_is_found_holds_all_words_typed(typed: str) -> None:
    found = matching(ACTIONS, typed)
    for action in ACTIONS:
        assert (action in found) == all(word in action.title.lower() for word in typed.lower().split())


def test_what_begins_with_the_words_comes_first() -> None:
    found = [action.title for action in matching(ACTIONS, "re")]
    first = [title for title in found if title.lower().startswith("re")]
    assert first and found[: len(first)] == first
