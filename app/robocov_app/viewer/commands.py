"""Commands of the viewer that need no window: keys, buttons, tool tips, help and palette read this list."""

import math
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path

from robocov.errors import ParameterError
from robocov_app.toolkit.command import Argument, Command
from robocov_app.viewer.parameters import Parameter
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.clock import SPEEDS, format_speed

GROUPS = ("Run", "Time", "Compare", "Edit", "Tools", "View", "File", "Help", "Show")
"""Headings of the help, in their order."""

RESIZE_STEP = 1.25  # factor of the keys [ and ]
MIN_SPEED = 0.01
MAX_SPEED = 1000.0

_LAYER_KEYS = {
    "cells": "1",
    "centroids": "2",
    "trajectories": "3",
    "velocities": "4",
    "force_attraction": "5",
    "force_repulsion_robots": "6",
    "force_repulsion_obstacle": "7",
    "force_viscosity": "8",
    "force_resultant": "9",
    "links": "0",
    "distances": "shift+1",
    "geodesic_cells": "shift+2",
    "path": "shift+3",
    "scan": "shift+4",
    "sensed": "shift+5",
    "sensing": "shift+6",
    "communication": "shift+7",
    "obstacle_points": "shift+8",
    "goals": "shift+9",
    "starts": "shift+0",
    "obstacles": "alt+1",
    "boundary": "alt+2",
    "grid": "alt+3",
    "robots": "alt+4",
    "failed": "alt+5",
    "selection": "alt+6",
    "legend": "alt+7",
    "scale_bar": "alt+8",
    "status": "alt+9",
    "color_bar": "alt+0",
    "density": "alt+d",
}


def list_viewer_commands(viewer: Presenter, layer_titles: dict[str, str]) -> list[Command]:
    """Return the commands that need no window.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    layer_titles : dict of str to str
        Titles of the layers by their names.

    Returns
    -------
    list of Command
        The commands, in the order of help and palette.
    """
    return [
        *_list_run_commands(viewer),
        *_list_time_commands(viewer),
        *_list_compare_commands(viewer),
        *_list_edit_commands(viewer),
        *_list_view_commands(viewer),
        *_list_file_commands(viewer),
        *_list_tool_commands(viewer),
        *_list_layer_commands(viewer, layer_titles),
    ]


def _list_run_commands(viewer: Presenter) -> list[Command]:
    playback = viewer.playback
    files = viewer.files
    add_robot = partial(playback.restart_with_more_robots, 1)
    remove_robot = partial(playback.restart_with_more_robots, -1)
    slower = partial(playback.change_speed, -1)
    faster = partial(playback.change_speed, 1)
    next_map = partial(files.open_next_map, 1)
    previous_map = partial(files.open_next_map, -1)
    speeds = [format_speed(speed).rstrip("×") for speed in SPEEDS]
    robots_argument = _build_whole_number_argument("robots")
    start_argument = Argument("start", list_values=playback.list_starts)
    map_argument = Argument("map or file", list_values=files.list_maps)
    speed_argument = Argument("factor", _read_speed, lambda: speeds)

    def set_robots(robots: int) -> None:
        playback.restart(robots=robots)

    def set_seed(seed: int) -> None:
        playback.restart(seed=seed)

    def set_start(name: str) -> None:
        playback.restart(start=name)

    return [
        Command("pause", "Play or pause", "Run", playback.toggle_pause, ("space",)),
        Command("step", "Single step", "Run", playback.step, (".",), repeats=True),
        Command("restart", "Restart", "Run", playback.restart, ("r",)),
        Command("settle", "Play until settled, then stop", "Run", playback.toggle_settling, ("s",)),
        Command("slower", "Slower", "Run", slower, ("-",), repeats=True),
        Command("faster", "Faster", "Run", faster, ("=", "+"), repeats=True),
        Command(
            "seed:next", "New starting positions (next seed)", "Run", playback.restart_with_next_seed, ("n",)
        ),
        Command("start:next", "Next start of the map", "Run", playback.restart_at_next_start, ("shift+n",)),
        Command(
            "more", "Restart with one more robot", "Run", add_robot, ("shift+=", "shift++"), repeats=True
        ),
        Command("fewer", "Restart with one fewer robot", "Run", remove_robot, ("shift+-",), repeats=True),
        Command("map:next", "Next map", "Run", next_map, ("page down",)),
        Command("map:previous", "Previous map", "Run", previous_map, ("page up",)),
        Command("robots", "Number of robots", "Run", set_robots, argument=robots_argument),
        Command("seed", "Seed", "Run", set_seed, argument=_build_whole_number_argument("seed")),
        Command("start", "Start of the map", "Run", set_start, argument=start_argument),
        Command("map", "Open a map", "Run", files.open_map, argument=map_argument),
        Command("speed", "Speed", "Run", playback.set_speed, argument=speed_argument),
    ]


def _list_time_commands(viewer: Presenter) -> list[Command]:
    playback = viewer.playback
    step_back = partial(playback.look_by, -1)
    step_forward = partial(playback.look_by, 1)
    second_back = partial(playback.look_by_seconds, -1.0)
    second_forward = partial(playback.look_by_seconds, 1.0)
    go_to_start = partial(playback.look_at, 0.0)
    previous_branch = partial(playback.enter_next_branch, -1)
    next_branch = partial(playback.enter_next_branch, 1)
    time_argument = Argument("seconds", partial(_read_positive_number, "time"))
    branch_argument = Argument("branch", list_values=playback.list_branch_names)
    return [
        Command("back", "Step back", "Time", step_back, ("left",), repeats=True),
        Command("forward", "Step forward", "Time", step_forward, ("right",), repeats=True),
        Command("back:second", "Back by a second", "Time", second_back, ("shift+left",), repeats=True),
        Command(
            "forward:second", "Forward by a second", "Time", second_forward, ("shift+right",), repeats=True
        ),
        Command("first", "Go to the start", "Time", go_to_start, ("home",)),
        Command("live", "Go to the present", "Time", playback.look_at_present, ("end",)),
        Command("branch:here", "Continue from here", "Time", playback.branch, ("b",)),
        Command("branch:previous", "Previous branch", "Time", previous_branch, ("alt+left",)),
        Command("branch:next", "Next branch", "Time", next_branch, ("alt+right",)),
        Command("time", "Go to a time", "Time", playback.look_at, argument=time_argument),
        Command("branch", "Enter a branch", "Time", playback.enter_branch, argument=branch_argument),
    ]


def _list_compare_commands(viewer: Presenter) -> list[Command]:
    comparison = viewer.comparison
    controller_argument = Argument("controller", list_values=lambda: viewer.controllers)
    return [
        Command(
            "controller:next",
            "Next controller in this pane",
            "Compare",
            comparison.choose_next_controller,
            ("o",),
        ),
        Command("pane:add", "Compare with one more controller", "Compare", comparison.add_pane, ("k",)),
        Command("pane:remove", "Remove this pane", "Compare", comparison.remove_pane, ("shift+k",)),
        Command("pane:next", "Next pane", "Compare", comparison.activate_next_pane, ("`",)),
        Command(
            "controller", "Controller", "Compare", comparison.use_controller, argument=controller_argument
        ),
    ]


def _list_edit_commands(viewer: Presenter) -> list[Command]:
    playback = viewer.playback
    robots = viewer.robots
    select_next = partial(robots.select_next, 1)
    select_previous = partial(robots.select_next, -1)
    enlarge = partial(viewer.resize_tool, RESIZE_STEP)
    shrink = partial(viewer.resize_tool, 1 / RESIZE_STEP)
    robot_argument = _build_whole_number_argument("robot", lambda: map(str, viewer.robot_numbers))
    return [
        Command("undo", "Undo", "Edit", playback.undo, ("ctrl+z",), repeats=True),
        Command("redo", "Redo", "Edit", playback.redo, ("ctrl+y", "ctrl+shift+z"), repeats=True),
        Command("robot:next", "Inspect the next robot", "Edit", select_next, ("tab",), repeats=True),
        Command(
            "robot:previous",
            "Inspect the previous robot",
            "Edit",
            select_previous,
            ("shift+tab",),
            repeats=True,
        ),
        Command("robot:fail", "Fail or revive selected robot", "Edit", robots.fail_or_revive, ("shift+d",)),
        Command("robot:remove", "Remove selected robot", "Edit", robots.remove, ("delete",)),
        Command("finish", "Finish drawing", "Edit", viewer.finish_drawing, ("return", "enter")),
        Command("cancel", "Cancel", "Edit", viewer.cancel, ("escape",)),
        Command("wider", "Wider walls; a larger brush", "Edit", enlarge, ("]",), repeats=True),
        Command("narrower", "Narrower walls; a smaller brush", "Edit", shrink, ("[",), repeats=True),
        Command("robot", "Inspect a robot", "Edit", robots.select, argument=robot_argument),
    ]


def _list_view_commands(viewer: Presenter) -> list[Command]:
    view = viewer.view
    return [
        Command("theme", "Light or dark", "View", view.toggle_theme, ("t",)),
        Command("fade", "Fading trajectories", "View", view.toggle_fading, ("shift+t",)),
        Command("suggestions", "Suggestions when settled", "View", view.toggle_suggestions, ("shift+h",)),
        Command("panel", "Hide or show the panel", "View", view.toggle_panel, ("h",)),
    ]


def _list_file_commands(viewer: Presenter) -> list[Command]:
    files = viewer.files
    session_argument = Argument("file", Path, files.list_sessions)
    target_argument = Argument("file", _read_path)
    return [
        Command("save:session", "Save session", "File", files.save_session, ("ctrl+s",)),
        Command("recover", "Recover a session", "File", files.recover, ("ctrl+shift+o",)),
        Command("save:map", "Save map", "File", files.save_map, ("ctrl+shift+s",)),
        Command("open", "Open a session", "File", files.open_session, argument=session_argument),
        Command("save", "Save session as", "File", files.save_session, argument=target_argument),
    ]


def _list_tool_commands(viewer: Presenter) -> list[Command]:
    commands: list[Command] = []
    for tool in viewer.toolbox.by_name.values():
        title = f"{tool.title}: {tool.hint}"
        choose = partial(viewer.choose_tool, tool.name)
        commands.append(Command(f"tool:{tool.name}", title, "Tools", choose, (tool.key,)))
    return commands


def _list_layer_commands(viewer: Presenter, titles: dict[str, str]) -> list[Command]:
    """Return the commands that show or hide layers: those with keys first, in the order of the keys."""
    names = [name for name in _LAYER_KEYS if name in titles]
    names += [name for name in titles if name not in _LAYER_KEYS]
    commands: list[Command] = []
    for name in names:
        keys = (_LAYER_KEYS[name],) if name in _LAYER_KEYS else ()
        toggle = partial(viewer.view.toggle_layer, name)
        commands.append(Command(f"layer:{name}", titles[name], "Show", toggle, keys))
    return commands


def list_parameter_commands(viewer: Presenter) -> Iterator[Command]:
    """Yield a typed command for each gain of the controller in use and each limit of the team."""
    for parameter in viewer.comparison.list_parameters():
        title = f"Set {parameter.label}"
        set_value = partial(viewer.comparison.set_parameter, parameter.name)
        argument = _build_parameter_argument(parameter)
        short_name = parameter.name.removeprefix("team.")
        yield Command(short_name, title, "Run", set_value, argument=argument)
        if short_name != parameter.name:
            yield Command(parameter.name, title, "Run", set_value, argument=argument, hidden=True)


def _build_parameter_argument(parameter: Parameter) -> Argument:
    return Argument(f"now {parameter.format()}", parameter.parse, lambda: parameter.choices)


def _build_whole_number_argument(name: str, options: Callable[[], Iterable[str]] = tuple) -> Argument:
    def read(text: str) -> int:
        try:
            return int(text)
        except ValueError:
            raise ParameterError(f"{name}: expected a whole number, got {text!r}") from None

    return Argument("whole number", read, options)


def _read_path(text: str) -> Path | None:
    """Return a path; None for an empty text, for the session's own file."""
    return Path(text) if text else None


def _read_speed(text: str) -> float:
    if text in ("max", "inf"):
        return math.inf
    return _read_positive_number("speed", text, MIN_SPEED, MAX_SPEED)


def _read_positive_number(name: str, text: str, low: float = 0.0, high: float = 1e300) -> float:
    try:
        value = float(text.rstrip("×x"))
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        raise ParameterError(f"{name}: expected a positive number, got {text!r}")
    return value
