"""The list of the viewer's commands: keys, buttons, tool tips, help and palette all read it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from robocov.errors import ParameterError
from robocov_app.toolkit.command import Command, Takes
from robocov_app.viewer.presenter import Desk
from robocov_app.viewer.session.clock import SPEEDS, speed_words
from robocov_app.viewer.session.file import SUFFIX

GROUPS = ("Run", "Time", "Compare", "Touch", "Tools", "View", "Keep", "Help", "Show")
"""Headings of the help, in their order."""

_LAYER_KEYS = (
    ("cells", "1"),
    ("centroids", "2"),
    ("trajectories", "3"),
    ("velocities", "4"),
    ("force_attraction", "5"),
    ("force_repulsion_robots", "6"),
    ("force_repulsion_obstacle", "7"),
    ("force_viscosity", "8"),
    ("force_resultant", "9"),
    ("links", "0"),
    ("distances", "shift+1"),
    ("geodesic_cells", "shift+2"),
    ("path", "shift+3"),
    ("scan", "shift+4"),
    ("sensed", "shift+5"),
    ("sensing", "shift+6"),
    ("communication", "shift+7"),
    ("obstacle_points", "shift+8"),
    ("goals", "shift+9"),
    ("starts", "shift+0"),
    ("obstacles", "alt+1"),
    ("boundary", "alt+2"),
    ("grid", "alt+3"),
    ("robots", "alt+4"),
    ("failed", "alt+5"),
    ("selection", "alt+6"),
    ("legend", "alt+7"),
    ("scale_bar", "alt+8"),
    ("status", "alt+9"),
    ("colour_bar", "alt+0"),
    ("density", "alt+d"),
)

_TOOL_KEYS = {
    "hand": "v",
    "polygon": "p",
    "wall": "w",
    "circle": "c",
    "brush": "g",
    "eraser": "x",
    "robot": "a",
    "failure": "d",
    "ruler": "m",
}


def desk_commands(desk: Desk, titles: dict[str, str]) -> list[Command]:
    """Return the commands that need no window; `titles` are the layers', by their names."""
    return [
        Command("pause", "Play or pause", "Run", desk.pause, ("space",)),
        Command("step", "Single step", "Run", lambda: desk.session.step(), (".",), repeats=True),
        Command("restart", "Restart", "Run", desk.restart, ("r",)),
        Command("settle", "Play until settled, then stop", "Run", desk.settle, ("s",)),
        Command("slower", "Slower", "Run", lambda: desk.change_speed(-1), ("-",), repeats=True),
        Command(
            "faster",
            "Faster",
            "Run",
            lambda: desk.change_speed(1),
            (
                "=",
                "+",
            ),
            repeats=True,
        ),
        Command(
            "seed:next",
            "Other starting positions (next seed)",
            "Run",
            lambda: desk.restart(seed=desk.session.scenario.seed + 1),
            ("n",),
        ),
        Command("start:next", "Next start of the map", "Run", desk.next_start, ("shift+n",)),
        Command(
            "more",
            "One robot more, from the start",
            "Run",
            lambda: desk.restart(robots=desk.robots + 1),
            (
                "shift+=",
                "shift++",
            ),
            repeats=True,
        ),
        Command(
            "fewer",
            "One robot fewer, from the start",
            "Run",
            lambda: desk.restart(robots=desk.robots - 1),
            ("shift+-",),
            repeats=True,
        ),
        Command("map:next", "Next map", "Run", lambda: desk.next_map(1), ("page down",)),
        Command("map:previous", "Previous map", "Run", lambda: desk.next_map(-1), ("page up",)),
        Command("back", "Back by a moment", "Time", lambda: desk.look_by(-1), ("left",), repeats=True),
        Command("forward", "On by a moment", "Time", lambda: desk.look_by(1), ("right",), repeats=True),
        Command(
            "back:second",
            "Back by a second",
            "Time",
            lambda: desk.look_at(desk.session.time - 1.0),
            ("shift+left",),
            repeats=True,
        ),
        Command(
            "forward:second",
            "On by a second",
            "Time",
            lambda: desk.look_at(desk.session.time + 1.0),
            ("shift+right",),
            repeats=True,
        ),
        Command("first", "To the beginning", "Time", lambda: desk.look_at(0.0), ("home",)),
        Command("live", "To the present", "Time", lambda: desk.session.look_at(desk.session.end), ("end",)),
        Command("branch:here", "Go on from the moment that is shown", "Time", desk.branch, ("b",)),
        Command("law", "Next controller in this pane", "Compare", desk.next_law, ("o",)),
        Command("pane:add", "Compare with one more controller", "Compare", desk.add_pane, ("k",)),
        Command(
            "pane:remove",
            "Remove this pane",
            "Compare",
            lambda: desk.session.remove_pane(desk.lane),
            ("shift+k",),
        ),
        Command("pane:next", "Next pane", "Compare", desk.next_pane, ("`",)),
        Command("undo", "Undo", "Touch", desk.undo, ("ctrl+z",), repeats=True),
        Command(
            "redo",
            "Redo",
            "Touch",
            desk.redo,
            (
                "ctrl+y",
                "ctrl+shift+z",
            ),
            repeats=True,
        ),
        Command(
            "robot:next", "Ask the next robot", "Touch", lambda: desk.ask_next(1), ("tab",), repeats=True
        ),
        Command(
            "robot:previous",
            "Ask the previous robot",
            "Touch",
            lambda: desk.ask_next(-1),
            ("shift+tab",),
            repeats=True,
        ),
        Command(
            "robot:fail",
            "Let the robot that is asked fail, or revive it",
            "Touch",
            desk.fail_or_revive,
            ("shift+d",),
        ),
        Command("robot:remove", "Take the robot that is asked out", "Touch", desk.remove_robot, ("delete",)),
        Command(
            "finish",
            "Finish what is being drawn",
            "Touch",
            lambda: desk.say(desk.tool.finish(desk.session) or ""),
            (
                "return",
                "enter",
            ),
        ),
        Command("cancel", "Give up; close", "Touch", desk.cancel, ("escape",)),
        Command(
            "wider", "Wider walls; a larger brush", "Touch", lambda: desk.widen(1.25), ("]",), repeats=True
        ),
        Command(
            "narrower",
            "Narrower walls; a smaller brush",
            "Touch",
            lambda: desk.widen(0.8),
            ("[",),
            repeats=True,
        ),
        Command("theme", "Light or dark", "View", desk.switch_theme, ("t",)),
        Command("fade", "Trajectories fade", "View", desk.switch_fade, ("shift+t",)),
        Command(
            "suggestions",
            "Suggestions once the team has settled",
            "View",
            desk.switch_suggestions,
            ("shift+h",),
        ),
        Command("panel", "Hide or show the panel", "View", desk.switch_panel, ("h",)),
        Command("save:session", "Save the session", "Keep", desk.save_session, ("ctrl+s",)),
        Command("recover", "Recover a session", "Keep", desk.recover, ("ctrl+shift+o",)),
        Command("branch:previous", "Branch before", "Time", lambda: desk.enter_branch(-1), ("alt+left",)),
        Command("branch:next", "Next branch", "Time", lambda: desk.enter_branch(1), ("alt+right",)),
        Command("save:map", "Save the map", "Keep", desk.save_map, ("ctrl+shift+s",)),
        *_typed_commands(desk),
        *tool_commands(desk),
        *layer_commands(desk, titles),
    ]


def tool_commands(desk: Desk) -> list[Command]:
    """Return a command for each tool."""
    return [
        Command(
            f"tool:{name}",
            f"{tool.title}: {tool.hint}",
            "Tools",
            partial(desk.take_tool, name),
            (_TOOL_KEYS[name],),
        )
        for name, tool in desk.tools.items()
    ]


def layer_commands(desk: Desk, titles: dict[str, str]) -> list[Command]:
    """Return a command for each layer."""
    keys = dict(_LAYER_KEYS)
    names = [name for name in keys if name in titles]
    names += [name for name in titles if name not in keys]
    return [
        Command(
            f"layer:{name}",
            titles[name],
            "Show",
            partial(desk.switch_layer, name),
            (keys[name],) if name in keys else (),
        )
        for name in names
    ]


def _typed_commands(desk: Desk) -> list[Command]:
    """Return the commands that take something: ``robots 12``, ``map office``."""

    def robot_numbers() -> list[str]:
        circumstances = desk.session.circumstances(desk.lane)
        return [str(number) for number in sorted([*circumstances.numbers, *circumstances.failed])]

    def speeds() -> list[str]:
        return [speed_words(speed).rstrip("×") for speed in SPEEDS]

    def files() -> list[str]:
        return sorted(str(path) for path in desk.folder.glob(f"*{SUFFIX}"))

    def branches() -> list[str]:
        return [str(k + 1) for k in range(len(desk.session.branches))]

    def save(name: object) -> None:
        desk.save_session(Path(str(name)) if name else None)

    return [
        Command(
            "robots", "Number of robots", "Run", lambda n: desk.restart(robots=n), takes=_whole("robots")
        ),
        Command("seed", "Seed", "Run", lambda n: desk.restart(seed=n), takes=_whole("seed")),
        Command(
            "start",
            "Start of the map",
            "Run",
            lambda s: desk.restart(start=s),
            takes=Takes("start", options=desk.starts),
        ),
        Command("map", "Open a map", "Run", desk.open_map, takes=Takes("map or file", options=desk.maps)),
        Command("speed", "Speed", "Run", desk.set_speed, takes=Takes("factor", _speed, speeds)),
        Command(
            "controller",
            "Controller",
            "Compare",
            desk.use_law,
            takes=Takes("controller", options=lambda: desk.laws),
        ),
        Command(
            "time", "Go to a time", "Time", desk.look_at, takes=Takes("seconds", partial(_positive, "time"))
        ),
        Command("robot", "Ask a robot", "Touch", desk.ask, takes=_whole("robot", robot_numbers)),
        Command(
            "open",
            "Open a session",
            "Keep",
            lambda f: desk.open_session(Path(f)),
            takes=Takes("file", options=files),
        ),
        Command("save", "Save the session as", "Keep", save, takes=Takes("file")),
        Command(
            "branch",
            "Enter a branch",
            "Time",
            desk.enter_named_branch,
            takes=Takes("branch", options=branches),
        ),
    ]


def parameter_commands(desk: Desk) -> Iterator[Command]:
    """Return a command for each gain of the chosen controller and each limit of the team: ``k_rep 0.5``."""
    for each in desk.parameters():
        run = partial(desk.set_parameter, each.name)
        words = tuple(getattr(each, "offered", ()))
        takes = Takes(f"now {each.words()}", each.read, lambda words=words: words)  # type: ignore[misc]
        plain = each.name.removeprefix("team.")
        yield Command(plain, f"Set {each.label}", "Run", run, takes=takes)
        if plain != each.name:
            yield Command(each.name, f"Set {each.label}", "Run", run, takes=takes, hidden=True)


def _whole(word: str, options: object = None) -> Takes:
    def read(text: str) -> int:
        try:
            return int(text)
        except ValueError:
            raise ParameterError(f"{word}: {text!r}, but a whole number was wanted") from None

    return Takes("whole number", read, options if callable(options) else tuple)


def _speed(text: str) -> float:
    if text in ("max", "inf"):
        return math.inf
    value = _positive("speed", text)
    if not 0.01 <= value <= 1000.0:
        raise ParameterError(f"speed: {text!r}, but a positive number was wanted")
    return value


def _positive(word: str, text: str) -> float:
    try:
        value = float(text.rstrip("×x"))
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value >= 0.0):
        raise ParameterError(f"{word}: {text!r}, but a positive number was wanted")
    return value
