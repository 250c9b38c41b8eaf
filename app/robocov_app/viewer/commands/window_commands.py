"""Commands of the viewer that need its window: camera, screenshots, videos, help."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from robocov_app.toolkit.commands.command import Command, CommandGroup
from robocov_app.toolkit.tools.viewport import PAN_STEP_PX, ZOOM_STEP
from robocov_app.toolkit.window.command_window import Action, WindowActions
from robocov_app.viewer.canvas.canvas import ViewerCanvas
from robocov_app.viewer.chart.chart import Chart
from robocov_app.viewer.sharing.share import ShareActions


@dataclass(frozen=True)
class ViewerWindowActions(WindowActions):
    """Functions of the viewer's window that are called by commands.

    Attributes
    ----------
    show_next_tab, toggle_fullscreen, save_screenshot, toggle_help, open_palette
        See `WindowActions`.
    zoom : callable
        Zooms by a given factor.
    toggle_recording : callable
        Starts or stops a video.
    describe_recording : callable
        Returns what `toggle_recording` does now.
    save_run : callable
        Saves the run in a new folder.
    open_file : callable
        Opens the dialog that opens a session or a map.
    list_branches : callable
        Opens the dialog that lists and enters branches.
    compare : callable
        Opens the dialog that adds a controller to the comparison.
    toggle_layer_menu : callable
        Opens or closes the menu of all layers.
    open_preset_menu : callable
        Opens the menu of the presets of layers.
    focus_next, focus_previous : callable
        Give the keyboard focus to the next or the previous control.
    open_share_menu : callable
        Opens the menu of what can be shared.
    toggle_lesson : callable
        Starts the lesson, leaves it, or returns to it.
    quit : callable
        Closes the window.
    """

    zoom: Callable[[float], None]
    toggle_recording: Action
    describe_recording: Callable[[], str]
    save_run: Action
    open_file: Action
    list_branches: Action
    compare: Action
    toggle_layer_menu: Action
    open_preset_menu: Action
    focus_next: Action
    focus_previous: Action
    open_share_menu: Action
    toggle_lesson: Action
    quit: Action


def list_window_commands(
    canvas: ViewerCanvas, chart: Chart, share: ShareActions, actions: ViewerWindowActions
) -> list[Command]:
    """Return the commands that need a window."""
    return [
        *_list_view_commands(canvas, chart, actions),
        *_list_file_commands(actions),
        *_list_share_commands(share, actions),
        *_list_compare_commands(actions),
        *_list_help_commands(actions),
    ]


def _list_view_commands(canvas: ViewerCanvas, chart: Chart, actions: ViewerWindowActions) -> list[Command]:
    """Return the commands that move the camera or change the content of the window."""
    zoom_in = partial(actions.zoom, ZOOM_STEP)
    zoom_out = partial(actions.zoom, 1 / ZOOM_STEP)
    pan_left = partial(canvas.camera.pan, PAN_STEP_PX, 0)
    pan_right = partial(canvas.camera.pan, -PAN_STEP_PX, 0)
    pan_up = partial(canvas.camera.pan, 0, PAN_STEP_PX)
    pan_down = partial(canvas.camera.pan, 0, -PAN_STEP_PX)
    group = CommandGroup("View")
    group.add("fit", "Show the whole map", canvas.camera.show_whole_map, "f")
    group.add("zoom:in", "Zoom in", zoom_in, "ctrl+=", "ctrl++", repeats=True)
    group.add("zoom:out", "Zoom out", zoom_out, "ctrl+-", repeats=True)
    group.add("pan:left", "Pan left", pan_left, "ctrl+left", repeats=True)
    group.add("pan:right", "Pan right", pan_right, "ctrl+right", repeats=True)
    group.add("pan:up", "Pan up", pan_up, "ctrl+up", repeats=True)
    group.add("pan:down", "Pan down", pan_down, "ctrl+down", repeats=True)
    group.add("plot", "Plot distance or travel time", chart.switch_quantity, "y")
    group.add("layers", "Menu of layers and presets", actions.toggle_layer_menu, "l")
    group.add("presets", "Presets of layers", actions.open_preset_menu, "ctrl+l")
    group.add("tab", "Next page of the panel", actions.show_next_tab, "ctrl+tab")
    group.add("focus:next", "Next control: Enter or Space uses it", actions.focus_next, "tab", repeats=True)
    group.add("focus:previous", "Previous control", actions.focus_previous, "shift+tab", repeats=True)
    group.add("fullscreen", "Full screen", actions.toggle_fullscreen, "f11")
    return group.commands


def _list_file_commands(actions: ViewerWindowActions) -> list[Command]:
    group = CommandGroup("File")
    group.add("screenshot", "Screenshot", actions.save_screenshot, "f12")
    group.add(
        "video",
        "Start or stop a video",
        actions.toggle_recording,
        "f9",
        build_current_title=actions.describe_recording,
    )
    group.add("save:run", "Save run", actions.save_run, "ctrl+e")
    group.add("open:file", "Open a session or a map", actions.open_file, "ctrl+o")
    return group.commands


def _list_share_commands(share: ShareActions, actions: ViewerWindowActions) -> list[Command]:
    """Return the commands of the share menu, and the one that opens it."""
    group = CommandGroup("File")
    group.add("share", "Share", actions.open_share_menu, "ctrl+shift+e")
    group.add("share:command", "Copy as command", share.copy_command)
    group.add("share:python", "Copy as Python", share.copy_python)
    group.add("share:copy", "Save a copy to send", share.save_copy)
    group.add("share:link", "Copy link", share.copy_link)
    return group.commands


def _list_compare_commands(actions: ViewerWindowActions) -> list[Command]:
    group = CommandGroup("Compare")
    group.add("pane:add", "Compare controllers: all start at 0 s", actions.compare, "k")
    return group.commands


def _list_help_commands(actions: ViewerWindowActions) -> list[Command]:
    help_group = CommandGroup("Help")
    help_group.add("help", "Keys", actions.toggle_help, "f1", "shift+/")
    help_group.add("palette", "Commands by name", actions.open_palette, "ctrl+k", "/")
    help_group.add("tour", "Show or leave the lesson", actions.toggle_lesson, "f2")
    help_group.add("quit", "Quit", actions.quit, "ctrl+q")
    time_group = CommandGroup("Time")
    time_group.add("branches", "List of branches", actions.list_branches, "ctrl+b")
    return [*help_group.commands, *time_group.commands]
