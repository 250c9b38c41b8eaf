"""The list of the viewer's commands: keys, buttons, tool tips, help and palette all read it."""

import math
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

from robocov.errors import ParameterError
from robocov_app.toolkit.command import Command, Takes
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.clock import SPEEDS, format_speed
from robocov_app.viewer.session.file import SUFFIX
from robocov_app.viewer.tools import Tool

# headings of the help, in their order
GROUPS = ("Run", "Time", "Compare", "Touch", "Tools", "View", "Keep", "Help", "Show")
_NUMBERED = (
    "cells centroids trajectories velocities force_attraction force_repulsion_robots "
    "force_repulsion_obstacle force_viscosity force_resultant links "
    "distances geodesic_cells path scan sensed sensing communication obstacle_points goals starts "
    "obstacles boundary grid robots failed selection legend scale_bar status color_bar"
)
_NUMBER_KEYS = [f"{modifier}{digit}" for modifier in ("", "shift+", "alt+") for digit in "1234567890"]
_LAYER_KEYS = {**dict(zip(_NUMBERED.split(), _NUMBER_KEYS, strict=True)), "density": "alt+d"}
_TOOLS = "hand polygon wall circle brush eraser robot failure ruler"
_TOOL_KEYS = dict(zip(_TOOLS.split(), "vpwcgxadm", strict=True))
REPEATS = True


class Row(NamedTuple):
    """A command of a group; its keys are separated by commas."""

    name: str
    title: str
    run: Callable[..., object]
    keys: str = ""
    repeats: bool = False
    takes: Takes | None = None


def grouped(rows: dict[str, Iterable[Row]]) -> list[Command]:
    return [
        Command(name, title, group, run, tuple(filter(None, keys.split(", "))), repeats=repeats, takes=takes)
        for group, each in rows.items()
        for name, title, run, keys, repeats, takes in each
    ]


def viewer_commands(viewer: Presenter, titles: dict[str, str]) -> list[Command]:
    """Return the commands that need no window; `titles` are the layers', by their names."""

    def files() -> list[str]:
        return sorted(str(path) for path in viewer.folder.glob(f"*{SUFFIX}"))

    def branches() -> list[str]:
        return [str(k + 1) for k in range(len(viewer.session.timeline.document.list_branches()))]

    def next_seed() -> None:
        viewer.restart(seed=viewer.session.timeline.scenario.seed + 1)

    def look_on(seconds: float) -> None:
        viewer.look_at(viewer.session.displayed.time + seconds)

    def more(robots: int) -> None:
        viewer.restart(robots=len(viewer.numbers) + robots)

    def enter(branch: str) -> None:
        viewer.session.seek(viewer.session.timeline.document.find_branch(branch).node)

    start, law = Takes("start", options=viewer.starts), Takes("controller", options=lambda: viewer.laws)
    target = Takes("file", lambda text: Path(text) if text else None)
    ask_next, speeds = viewer.ask_next, [format_speed(each).rstrip("×") for each in SPEEDS]

    def tool_row(tool: Tool) -> Row:
        run = partial(viewer.take_tool, tool.name)
        return Row(f"tool:{tool.name}", f"{tool.title}: {tool.hint}", run, _TOOL_KEYS[tool.name])

    def switch(layer: str) -> None:
        viewer.shown ^= {layer}

    def layer_row(name: str) -> Row:
        return Row(f"layer:{name}", titles[name], partial(switch, name), _LAYER_KEYS.get(name, ""))

    layers = dict.fromkeys([*(name for name in _LAYER_KEYS if name in titles), *titles])
    groups: dict[str, Iterable[Row]] = {
        "Run": [
            Row("pause", "Play or pause", viewer.pause, "space"),
            Row("step", "Single step", lambda: viewer.session.playback.step(), ".", REPEATS),
            Row("restart", "Restart", viewer.restart, "r"),
            Row("settle", "Play until settled, then stop", viewer.settle, "s"),
            Row("slower", "Slower", lambda: viewer.change_speed(-1), "-", REPEATS),
            Row("faster", "Faster", lambda: viewer.change_speed(1), "=, +", REPEATS),
            Row("seed:next", "Other starting positions (next seed)", next_seed, "n"),
            Row("start:next", "Next start of the map", viewer.next_start, "shift+n"),
            Row("more", "One robot more, from the start", partial(more, 1), "shift+=, shift++", REPEATS),
            Row("fewer", "One robot fewer, from the start", partial(more, -1), "shift+-", REPEATS),
            Row("map:next", "Next map", lambda: viewer.next_map(1), "page down"),
            Row("map:previous", "Previous map", lambda: viewer.next_map(-1), "page up"),
            Row("robots", "Number of robots", lambda n: viewer.restart(robots=n), takes=_whole("robots")),
            Row("seed", "Seed", lambda n: viewer.restart(seed=n), takes=_whole("seed")),
            Row("start", "Start of the map", lambda name: viewer.restart(start=name), takes=start),
            Row("map", "Open a map", viewer.open_map, takes=Takes("map or file", options=viewer.maps)),
            Row("speed", "Speed", viewer.set_speed, takes=Takes("factor", _speed, lambda: speeds)),
        ],
        "Time": [
            Row("back", "Back by a moment", lambda: viewer.look_by(-1), "left", REPEATS),
            Row("forward", "On by a moment", lambda: viewer.look_by(1), "right", REPEATS),
            Row("back:second", "Back by a second", lambda: look_on(-1.0), "shift+left", REPEATS),
            Row("forward:second", "On by a second", lambda: look_on(1.0), "shift+right", REPEATS),
            Row("first", "To the beginning", lambda: viewer.look_at(0.0), "home"),
            Row(
                "live",
                "To the present",
                lambda: viewer.session.show_time(viewer.session.timeline.end_time),
                "end",
            ),
            Row("branch:here", "Go on from the moment shown", viewer.branch, "b"),
            Row("branch:previous", "Branch before", lambda: viewer.enter_branch(-1), "alt+left"),
            Row("branch:next", "Next branch", lambda: viewer.enter_branch(1), "alt+right"),
            Row("time", "Go to a time", viewer.look_at, takes=Takes("seconds", partial(_positive, "time"))),
            Row("branch", "Enter a branch", enter, takes=Takes("branch", options=branches)),
        ],
        "Compare": [
            Row("law", "Next controller in this pane", viewer.next_law, "o"),
            Row("pane:add", "Compare with one more controller", viewer.add_pane, "k"),
            Row("pane:remove", "Remove this pane", viewer.remove_pane, "shift+k"),
            Row("pane:next", "Next pane", viewer.next_pane, "`"),
            Row("controller", "Controller", viewer.use_law, takes=law),
        ],
        "Touch": [
            Row("undo", "Undo", viewer.undo, "ctrl+z", REPEATS),
            Row("redo", "Redo", viewer.redo, "ctrl+y, ctrl+shift+z", REPEATS),
            Row("robot:next", "Ask the next robot", partial(ask_next, 1), "tab", REPEATS),
            Row("robot:previous", "Ask the previous robot", partial(ask_next, -1), "shift+tab", REPEATS),
            Row("robot:fail", "Fail or revive the robot asked", viewer.fail_or_revive, "shift+d"),
            Row("robot:remove", "Take the robot that is asked out", viewer.remove_robot, "delete"),
            Row("finish", "Finish what is being drawn", viewer.finish, "return, enter"),
            Row("cancel", "Give up; close", viewer.cancel, "escape"),
            Row("wider", "Wider walls; a larger brush", lambda: viewer.widen(1.25), "]", REPEATS),
            Row("narrower", "Narrower walls; a smaller brush", lambda: viewer.widen(0.8), "[", REPEATS),
            Row("robot", "Ask a robot", viewer.ask, takes=_whole("robot", lambda: map(str, viewer.numbers))),
        ],
        "View": [
            Row("theme", "Light or dark", viewer.switch_theme, "t"),
            Row("fade", "Trajectories fade", viewer.switch_fade, "shift+t"),
            Row("suggestions", "Suggestions when settled", viewer.switch_suggestions, "shift+h"),
            Row("panel", "Hide or show the panel", viewer.switch_panel, "h"),
        ],
        "Keep": [
            Row("save:session", "Save the session", viewer.save_session, "ctrl+s"),
            Row("recover", "Recover a session", viewer.recover, "ctrl+shift+o"),
            Row("save:map", "Save the map", viewer.save_map, "ctrl+shift+s"),
            Row("open", "Open a session", viewer.open_session, takes=Takes("file", Path, files)),
            Row("save", "Save the session as", viewer.save_session, takes=target),
        ],
        "Tools": map(tool_row, viewer.tools.values()),
        "Show": map(layer_row, layers),
    }
    return grouped(groups)


def parameter_commands(viewer: Presenter) -> Iterator[Command]:
    for each in viewer.parameters():
        run, words = partial(viewer.set_parameter, each.name), tuple(getattr(each, "offered", ()))
        takes = Takes(f"now {each.words()}", each.read, lambda words=words: words)  # type: ignore[misc]
        plain = each.name.removeprefix("team.")
        yield Command(plain, f"Set {each.label}", "Run", run, takes=takes)
        if plain != each.name:
            yield Command(each.name, f"Set {each.label}", "Run", run, takes=takes, hidden=True)


def _whole(word: str, options: Callable[[], Iterable[str]] = tuple) -> Takes:
    def read(text: str) -> int:
        try:
            return int(text)
        except ValueError:
            raise ParameterError(f"{word}: expected a whole number, got {text!r}") from None

    return Takes("whole number", read, options)


def _speed(text: str) -> float:
    return math.inf if text in ("max", "inf") else _positive("speed", text, 0.01, 1000.0)


def _positive(word: str, text: str, low: float = 0.0, high: float = 1e300) -> float:
    try:
        value = float(text.rstrip("×x"))
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        raise ParameterError(f"{word}: expected a positive number, got {text!r}")
    return value
