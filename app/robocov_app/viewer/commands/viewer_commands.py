"""Commands of the viewer that need no window, with the keys and texts for buttons, tooltips and help."""

import math
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path

from robocov.errors import ParameterError
from robocov_app.toolkit.commands.command import Argument, Command, CommandGroup
from robocov_app.viewer.layer_presets import LAYER_PRESETS
from robocov_app.viewer.panel.parameters import Parameter
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.clock import SPEEDS, format_speed

GROUPS = ("Run", "Time", "Compare", "Edit", "Tools", "View", "File", "Help", "Show")
"""Headings of the help page, in the order in which they are shown."""

RESIZE_STEP = 1.25  # factor by which the keys [ and ] change the size of a tool
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
    "contacts": "alt+c",
}


def list_viewer_commands(viewer: Presenter, layer_titles: dict[str, str]) -> list[Command]:
    """Return the commands that need no window.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    layer_titles : dict of str to str
        Title of each layer, by its name.

    Returns
    -------
    list of Command
        The commands, in the order of the help page and the palette.
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
    """Return the commands that play and restart the simulation, or change its initial conditions."""
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

    group = CommandGroup("Run")
    group.add("pause", "Play or pause", playback.toggle_pause, "space")
    group.add("step", "Single step", playback.step, ".", repeats=True)
    group.add("restart", "Restart", playback.restart, "r")
    group.add("settle", "Play until settled, then stop", playback.toggle_settling, "s")
    group.add("slower", "Slower", slower, "-", repeats=True)
    group.add("faster", "Faster", faster, "=", "+", repeats=True)
    group.add("seed:next", "New starting positions: the next seed", playback.restart_with_next_seed, "n")
    group.add("start:next", "Next start of the map", playback.restart_at_next_start, "shift+n")
    group.add("more", "Restart with one more robot", add_robot, "shift+=", "shift++", repeats=True)
    group.add("fewer", "Restart with one fewer robot", remove_robot, "shift+-", repeats=True)
    group.add("map:next", "Next map", next_map, "page down")
    group.add("map:previous", "Previous map", previous_map, "page up")
    group.add("robots", "Number of robots", set_robots, argument=robots_argument)
    group.add("seed", "Seed", set_seed, argument=_build_whole_number_argument("seed"))
    group.add("start", "Start of the map", set_start, argument=start_argument)
    group.add("map", "Open a map", files.open_map, argument=map_argument)
    group.add("speed", "Speed", playback.set_speed, argument=speed_argument)
    return group.commands


def _list_time_commands(viewer: Presenter) -> list[Command]:
    """Return the commands that go to another time or branch."""
    playback = viewer.playback
    step_back = partial(playback.show_offset, -1)
    step_forward = partial(playback.show_offset, 1)
    second_back = partial(playback.shift_time, -1.0)
    second_forward = partial(playback.shift_time, 1.0)
    go_to_start = partial(playback.show_time, 0.0)
    previous_branch = partial(playback.go_to_next_branch, -1)
    next_branch = partial(playback.go_to_next_branch, 1)
    time_argument = Argument("seconds", _read_time)
    branch_argument = Argument("branch", list_values=playback.list_branch_names)
    group = CommandGroup("Time")
    group.add("back", "Step back", step_back, "left", repeats=True)
    group.add("forward", "Step forward", step_forward, "right", repeats=True)
    group.add("back:second", "Back by a second", second_back, "shift+left", repeats=True)
    group.add("forward:second", "Forward by a second", second_forward, "shift+right", repeats=True)
    group.add("first", "Go to the start", go_to_start, "home")
    group.add("live", "Go to the present", playback.show_present, "end")
    group.add("branch:here", "Continue from here", playback.branch, "b")
    group.add("branch:previous", "Previous branch", previous_branch, "alt+left")
    group.add("branch:next", "Next branch", next_branch, "alt+right")
    group.add("time", "Go to a time", playback.show_time, argument=time_argument)
    group.add("branch", "Go to a branch", playback.go_to_branch, argument=branch_argument)
    return group.commands


def _list_compare_commands(viewer: Presenter) -> list[Command]:
    comparison = viewer.comparison
    controller_argument = Argument("controller", list_values=lambda: viewer.controllers)
    group = CommandGroup("Compare")
    group.add("controller:next", "Next controller in this pane", comparison.choose_next_controller, "o")
    group.add("pane:remove", "Remove this pane", comparison.remove_pane, "shift+k")
    group.add("pane:next", "Next pane", comparison.activate_next_pane, "`")
    group.add("controller", "Controller", comparison.use_controller, argument=controller_argument)
    return group.commands


def _list_edit_commands(viewer: Presenter) -> list[Command]:
    """Return the commands for undo, the selected robot, and the drawing tools."""
    playback = viewer.playback
    robots = viewer.robots
    select_next = partial(robots.select_next, 1)
    select_previous = partial(robots.select_next, -1)
    enlarge = partial(viewer.resize_tool, RESIZE_STEP)
    shrink = partial(viewer.resize_tool, 1 / RESIZE_STEP)
    robot_argument = _build_whole_number_argument("robot", lambda: map(str, viewer.robot_numbers))
    group = CommandGroup("Edit")
    group.add("undo", "Undo", playback.undo, "ctrl+z", repeats=True)
    group.add("redo", "Redo", playback.redo, "ctrl+y", "ctrl+shift+z", repeats=True)
    group.add("robot:next", "Inspect the next robot", select_next, "i", repeats=True)
    group.add("robot:previous", "Inspect the previous robot", select_previous, "shift+i", repeats=True)
    group.add("robot:fail", "Fail or revive selected robot", robots.fail_or_revive, "shift+d")
    group.add(
        "robot:follow", "Follow selected robot: the view moves with it", robots.toggle_following, "shift+v"
    )
    group.add("robot:remove", "Remove selected robot", robots.remove, "shift+delete")
    group.add("robot:add", "Add a robot here", robots.add_at_cursor, "shift+a")
    group.add("delete", "Delete the selection", viewer.selection.delete, "delete")
    group.add("duplicate", "Duplicate selected obstacle", viewer.selection.duplicate, "ctrl+d")
    group.add("finish", "Finish drawing", viewer.finish_drawing, "return", "enter")
    group.add("cancel", "Cancel", viewer.cancel, "escape")
    group.add("wider", "Wider wall or brush", enlarge, "]", repeats=True)
    group.add("narrower", "Narrower wall or brush", shrink, "[", repeats=True)
    group.add("robot", "Inspect a robot", robots.select, argument=robot_argument)
    return group.commands


def _list_view_commands(viewer: Presenter) -> list[Command]:
    view = viewer.view
    group = CommandGroup("View")
    group.add("theme", "Light or dark", view.toggle_theme, "t")
    group.add("fade", "Fading trajectories", view.toggle_fading, "shift+t")
    group.add("suggestions", "Suggestions when settled", view.toggle_suggestions, "shift+h")
    group.add("motion", "Smooth or instant zooming", view.toggle_motion, "shift+f")
    group.add("panel", "Hide or show the settings", view.toggle_panel, "h")
    return group.commands


def _list_file_commands(viewer: Presenter) -> list[Command]:
    """Return the commands that open and save sessions, and save maps."""
    files = viewer.files
    session_argument = Argument("file", Path, files.list_sessions)
    target_argument = Argument("file", _read_path)
    group = CommandGroup("File")
    group.add("save:session", "Save session", files.save_session, "ctrl+s")
    group.add("recover", "Recover a session", files.recover, "ctrl+shift+o")
    group.add("save:map", "Save map", files.save_map, "ctrl+shift+s")
    group.add("open", "Open a session", files.open_session, argument=session_argument)
    group.add("save", "Save session as", files.save_session, argument=target_argument)
    return group.commands


def _list_tool_commands(viewer: Presenter) -> list[Command]:
    group = CommandGroup("Tools")
    for tool in viewer.toolbox.by_name.values():
        choose = partial(viewer.choose_tool, tool.name)
        group.add(f"tool:{tool.name}", f"{tool.title}: {tool.hint}", choose, tool.key)
    return group.commands


def _list_layer_commands(viewer: Presenter, titles: dict[str, str]) -> list[Command]:
    """Return the commands that show or hide layers; those with keys come first, in the order of the keys."""
    names = [name for name in _LAYER_KEYS if name in titles]
    names += [name for name in titles if name not in _LAYER_KEYS]
    group = CommandGroup("Show")
    for name in names:
        keys = [_LAYER_KEYS[name]] if name in _LAYER_KEYS else []
        group.add(f"layer:{name}", titles[name], partial(viewer.view.toggle_layer, name), *keys)
    group.add("preset:next", "Next preset of layers", viewer.view.use_next_preset, "shift+l")
    for number, preset in enumerate(LAYER_PRESETS, 1):
        key = f"alt+shift+{number}"
        name = preset.title.removesuffix("?")
        title = f"{name}: {preset.description[0].lower()}{preset.description[1:]}"
        group.add(f"preset:{preset.name}", title, partial(viewer.view.use_preset, preset), key)
    return group.commands


def list_parameter_commands(viewer: Presenter) -> Iterator[Command]:
    """Yield a command for each gain of the controller in use and each limit of the team.

    A limit can also be typed with the prefix ``team.``, for which a hidden command is yielded.
    """
    for parameter in viewer.comparison.list_parameters():
        title = f"{parameter.label} ({parameter.symbol})"
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
    """Convert typed text to a path; None, which means the session's own file, if it is empty."""
    if text:
        return Path(text)
    return None


def _read_speed(text: str) -> float:
    if text in ("max", "inf"):
        return math.inf
    value = _parse_number(text.rstrip("×x"))
    if not MIN_SPEED <= value <= MAX_SPEED:
        raise ParameterError(f"speed: expected a number from {MIN_SPEED:g} to {MAX_SPEED:g}, got {text!r}")
    return value


def _read_time(text: str) -> float:
    value = _parse_number(text)
    if not 0.0 <= value < math.inf:
        raise ParameterError(f"time: expected a number of at least 0, got {text!r}")
    return value


def _parse_number(text: str) -> float:
    """Convert typed text to a number; nan if it is not one."""
    try:
        return float(text)
    except ValueError:
        return math.nan
