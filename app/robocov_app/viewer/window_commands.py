"""Commands of the viewer that need its window: camera, screenshots, videos, help."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from robocov_app.toolkit.command import Command
from robocov_app.toolkit.command_window import Action, WindowActions
from robocov_app.viewer.canvas import ViewerCanvas
from robocov_app.viewer.chart import Chart

ZOOM_STEP = 1.25
PAN_STEP_PX = 60


@dataclass(frozen=True)
class ViewerWindowActions(WindowActions):
    """Actions of the window that commands start.

    Attributes
    ----------
    show_next_tab, toggle_fullscreen, save_screenshot, toggle_help, open_palette
        See `WindowActions`.
    zoom : callable
        Zooms by a factor.
    toggle_recording : callable
        Starts or stops a video.
    save_run : callable
        Saves the run in a new folder.
    open_file : callable
        Asks for a session or a map, and opens it.
    list_branches : callable
        Asks for a branch, and enters it.
    toggle_lesson : callable
        Starts a lesson, leaves it, or returns to it.
    quit : callable
        Closes the window.
    """

    zoom: Callable[[float], None]
    toggle_recording: Action
    save_run: Action
    open_file: Action
    list_branches: Action
    toggle_lesson: Action
    quit: Action


def list_window_commands(canvas: ViewerCanvas, chart: Chart, actions: ViewerWindowActions) -> list[Command]:
    """Return the commands that need a window."""
    return [
        *_list_view_commands(canvas, chart, actions),
        *_list_file_commands(actions),
        *_list_help_commands(actions),
    ]


def _list_view_commands(canvas: ViewerCanvas, chart: Chart, actions: ViewerWindowActions) -> list[Command]:
    zoom_in = partial(actions.zoom, ZOOM_STEP)
    zoom_out = partial(actions.zoom, 1 / ZOOM_STEP)
    pan_left = partial(canvas.pan, PAN_STEP_PX, 0)
    pan_right = partial(canvas.pan, -PAN_STEP_PX, 0)
    pan_up = partial(canvas.pan, 0, PAN_STEP_PX)
    pan_down = partial(canvas.pan, 0, -PAN_STEP_PX)
    return [
        Command("fit", "Show the whole map", "View", canvas.fit, ("f",)),
        Command("zoom:in", "Zoom in", "View", zoom_in, ("ctrl+=", "ctrl++"), repeats=True),
        Command("zoom:out", "Zoom out", "View", zoom_out, ("ctrl+-",), repeats=True),
        Command("pan:left", "Pan left", "View", pan_left, ("ctrl+left",), repeats=True),
        Command("pan:right", "Pan right", "View", pan_right, ("ctrl+right",), repeats=True),
        Command("pan:up", "Pan up", "View", pan_up, ("ctrl+up",), repeats=True),
        Command("pan:down", "Pan down", "View", pan_down, ("ctrl+down",), repeats=True),
        Command("plot", "Plot mean distance or mean time", "View", chart.switch_quantity, ("y",)),
        Command("tab", "Next page of the panel", "View", actions.show_next_tab, ("ctrl+tab",)),
        Command("fullscreen", "Full screen", "View", actions.toggle_fullscreen, ("f11",)),
    ]


def _list_file_commands(actions: ViewerWindowActions) -> list[Command]:
    return [
        Command("screenshot", "Screenshot", "File", actions.save_screenshot, ("f12",)),
        Command("video", "Start or stop a video", "File", actions.toggle_recording, ("f9",)),
        Command("save:run", "Save run", "File", actions.save_run, ("ctrl+e",)),
        Command("open:file", "Open a session or a map", "File", actions.open_file, ("ctrl+o",)),
    ]


def _list_help_commands(actions: ViewerWindowActions) -> list[Command]:
    return [
        Command("help", "Keys", "Help", actions.toggle_help, ("f1", "shift+/")),
        Command("palette", "Commands by name", "Help", actions.open_palette, ("ctrl+k", "/")),
        Command("tour", "The lesson, or just play", "Help", actions.toggle_lesson, ("f2",)),
        Command("quit", "Quit", "Help", actions.quit, ("ctrl+q",)),
        Command("branches", "List of branches", "Time", actions.list_branches, ("ctrl+b",)),
    ]
