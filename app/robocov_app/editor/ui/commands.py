"""All commands of the editor, grouped by the headings of the help.

Commands are run by keys, menus, buttons and the command palette.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from robocov_app.editor.canvas.canvas import EditorCanvas
from robocov_app.editor.editor import Editor
from robocov_app.editor.edits import boolean, create, fixes, paths, properties, transform, vertices
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.settings import LAYERS
from robocov_app.editor.tools.snap_switches import SNAPS
from robocov_app.editor.ui import actions
from robocov_app.editor.ui.actions import FAR_STEPS, Edit
from robocov_app.editor.ui.file_commands import IMAGE_SUFFIXES, OPEN_SUFFIXES, FileCommands
from robocov_app.toolkit.commands.command import Command, CommandGroup
from robocov_app.toolkit.tools.viewport import PAN_STEP_PX, ZOOM_STEP
from robocov_app.toolkit.window.command_window import Action, WindowActions

ArrowAction = Callable[[int, int], object]

GROUPS = ("File", "Edit", "Arrange", "Combine", "Tools", "Vertices", "Snap", "View", "Robots", "Help")
"""Headings of the help, in order."""

PALETTE_HINT = "Type a command, or  rotate 30 · grid 0.25 · width 0.2 · size 3 x 2 · robots 8"
WALL_WIDTH_STEP = 1.25
SIMPLIFY_TOLERANCE_M = 0.02
_ARROWS = {"left": (-1, 0), "right": (1, 0), "up": (0, 1), "down": (0, -1)}


@dataclass(frozen=True)
class EditorWindowActions(WindowActions):
    """Actions of the window that are run by commands.

    Attributes
    ----------
    show_next_tab, toggle_fullscreen, save_screenshot, toggle_help, open_palette
        See `WindowActions`.
    start_play_mode : callable
        Opens the map in the viewer.
    edit_name : callable
        Puts the text cursor into the field for the name.
    edit_width : callable
        Puts the text cursor into the field for the width of a wall.
    open_menu : callable
        Opens the context menu.
    hold_pan : callable
        Makes the left button pan while the key is held down.
    """

    start_play_mode: Action
    edit_name: Action
    edit_width: Action
    open_menu: Action
    hold_pan: Action


class EditorCommandGroup(CommandGroup):
    """Commands of the editor under one heading of the help.

    Parameters
    ----------
    heading : str
        One of `GROUPS`.
    editor : Editor
        The editor.
    """

    def __init__(self, heading: str, editor: Editor) -> None:
        super().__init__(heading)
        self.editor = editor

    def add_edit(
        self, name: str, title: str, edit: Edit, *keys: str, value: object = None, repeats: bool = False
    ) -> None:
        """Add a command that applies an edit to the selected objects, with a value unless it is None."""
        editor = self.editor

        def apply() -> None:
            selection = actions.require_selection(editor)
            if value is None:
                editor.apply(edit(editor.sketch, selection))
            else:
                editor.apply(edit(editor.sketch, selection, value))

        self.add(name, title, apply, *keys, repeats=repeats)

    def add_arrows(self, name: str, title: str, action: ArrowAction, keys: str) -> None:
        """Add a command for each arrow key; only the first one has a title, for all of them in the help."""
        for direction, (x, y) in _ARROWS.items():
            key = keys.format(direction)
            self.add(name.format(direction), title, partial(action, x, y), key, repeats=True)
            title = ""


def list_commands(
    editor: Editor, canvas: EditorCanvas, file_commands: FileCommands, window: EditorWindowActions
) -> list[Command]:
    """Return all commands that do not take a typed value.

    Parameters
    ----------
    editor : Editor
        The editor.
    canvas : EditorCanvas
        The view of the map.
    file_commands : FileCommands
        Commands on files.
    window : EditorWindowActions
        Actions of the window.
    """
    groups = (
        _build_file_group(editor, file_commands, window),
        _build_edit_group(editor, window),
        _build_arrange_group(editor),
        _build_combine_group(editor),
        _build_vertex_group(editor, window),
        _build_grid_group(editor),
        _build_view_group(editor, canvas, window),
        _build_robot_group(editor),
        _build_help_group(editor, window),
        _build_tool_group(editor),
        _build_snap_group(editor),
        _build_layer_group(editor),
    )
    return [command for group in groups for command in group.commands]


def _build_file_group(
    editor: Editor, file_commands: FileCommands, window: EditorWindowActions
) -> EditorCommandGroup:
    """Build the group of commands on files, on the background image, and on the whole window."""
    ask_map = partial(file_commands.ask_path, "Open a map", file_commands.open, OPEN_SUFFIXES)
    ask_background = partial(
        file_commands.ask_path, "Background image", file_commands.open_background, IMAGE_SUFFIXES
    )

    def remove_background() -> None:
        editor.apply(properties.set_background(editor.sketch, None))

    group = EditorCommandGroup("File", editor)
    group.add("new", "New map", file_commands.new, "ctrl+n")
    group.add("open", "Open a map", ask_map, "ctrl+o")
    group.add("recent", "Recent and bundled maps", file_commands.ask_recent, "ctrl+shift+o")
    group.add("save", "Save", file_commands.save, "ctrl+s")
    group.add("save:as", "Save as", file_commands.ask_name, "ctrl+shift+s")
    group.add("export", "Export to another format", file_commands.ask_export, "ctrl+e")
    group.add("background", "Background image", ask_background, "ctrl+b")
    group.add("background:none", "Remove the background image", remove_background)
    group.add("reload", "Reload the file", file_commands.reload, "ctrl+r")
    group.add("try", "Try the map in the viewer", window.start_play_mode, "f5")
    group.add("screenshot", "Screenshot", window.save_screenshot, "f12")
    group.add("quit", "Quit", file_commands.quit, "ctrl+q")
    return group


def _build_edit_group(editor: Editor, window: EditorWindowActions) -> EditorCommandGroup:
    """Build the group of commands to undo, copy, select, move and delete, and to control a drawing."""

    def select_all() -> None:
        editor.select(Selection.select_all(editor.sketch))

    def paste_at_cursor() -> None:
        actions.paste(editor, editor.cursor)

    def finish() -> None:
        editor.tool.finish(editor)

    group = EditorCommandGroup("Edit", editor)
    group.add("undo", "Undo", partial(editor.undo_steps, 1), "ctrl+z", repeats=True)
    group.add("redo", "Redo", partial(editor.undo_steps, -1), "ctrl+y", "ctrl+shift+z", repeats=True)
    group.add("cut", "Cut", partial(actions.cut, editor), "ctrl+x")
    group.add("copy", "Copy", partial(actions.copy, editor), "ctrl+c")
    group.add("paste", "Paste at the cursor", paste_at_cursor, "ctrl+v", repeats=True)
    paste_in_place = partial(actions.paste, editor, None)
    group.add("paste:there", "Paste in the same place", paste_in_place, "ctrl+shift+v")
    group.add("duplicate", "Duplicate", partial(actions.duplicate, editor), "ctrl+d", repeats=True)
    group.add("delete", "Delete", partial(actions.delete, editor), "delete", "x")
    group.add("select:all", "Select all", select_all, "ctrl+a")
    select_next = partial(actions.select_next, editor, 1)
    select_previous = partial(actions.select_next, editor, -1)
    group.add("select:next", "Select the next object", select_next, "tab", repeats=True)
    group.add("select:previous", "Select the previous object", select_previous, "shift+tab", repeats=True)
    group.add("name", "Name the selection", window.edit_name, "f2")
    nudge = partial(actions.nudge, editor, 1)
    nudge_far = partial(actions.nudge, editor, FAR_STEPS)
    group.add_arrows("{}", "Nudge (all arrows)", nudge, "{}")
    group.add_arrows("{}:far", "Nudge ten times as far", nudge_far, "shift+{}")
    group.add("finish", "Finish drawing", finish, "return", "enter")
    remove_last = partial(actions.remove_last, editor)
    group.add("back", "Remove point, or delete", remove_last, "backspace", repeats=True)
    group.add("cancel", "Cancel; select nothing; close", partial(actions.cancel, editor), "escape")
    group.add("menu", "Context menu (right click)", window.open_menu, "menu", "shift+f10")
    return group


def _build_arrange_group(editor: Editor) -> EditorCommandGroup:
    """Build the group of commands to rotate, mirror, align, restack, group, lock and hide objects."""

    def unlock_and_show_all() -> None:
        editor.apply(properties.unlock_and_show_all(editor.sketch))

    group = EditorCommandGroup("Arrange", editor)
    rotate = transform.rotate
    group.add_edit("rotate:left", "Rotate left by 90°", rotate, "q", value=90.0, repeats=True)
    group.add_edit("rotate:right", "Rotate right by 90°", rotate, "e", value=-90.0, repeats=True)
    group.add(
        "level",
        "Level: rotate the map so that the measured line is horizontal or vertical",
        partial(actions.level, editor),
    )
    group.add_edit("mirror:x", "Mirror left and right", transform.mirror, "shift+h", value="x")
    group.add_edit("mirror:y", "Mirror up and down", transform.mirror, "shift+v", value="y")
    group.add("align:left", "Align left sides", partial(actions.align, editor, "left"), "alt+left")
    group.add("align:right", "Align right sides", partial(actions.align, editor, "right"), "alt+right")
    group.add("align:top", "Align tops", partial(actions.align, editor, "top"), "alt+up")
    group.add("align:bottom", "Align bottoms", partial(actions.align, editor, "bottom"), "alt+down")
    group.add("align:center", "Align centers horizontally", partial(actions.align, editor, "center"), "alt+c")
    group.add("align:middle", "Align centers vertically", partial(actions.align, editor, "middle"), "alt+m")
    group.add_edit("distribute:x", "Equal horizontal spacing", transform.distribute, "alt+x", value="x")
    group.add_edit("distribute:y", "Equal vertical spacing", transform.distribute, "alt+y", value="y")
    group.add_edit("raise", "To the top", properties.restack, "page up", value="top")
    group.add_edit("lower", "To the bottom", properties.restack, "page down", value="bottom")
    group.add_edit("group", "Group: a click selects all of it", properties.group, "ctrl+g")
    group.add_edit("ungroup", "Remove from its group", properties.ungroup, "ctrl+shift+g")
    group.add_edit("lock", "Lock: the mouse does not select it", properties.lock, "ctrl+l")
    group.add_edit("hide", "Hide in the editor", properties.hide, "ctrl+h")
    group.add("release", "Unlock and show all", unlock_and_show_all, "ctrl+shift+l")
    return group


def _build_combine_group(editor: Editor) -> EditorCommandGroup:
    """Build the group of commands that combine obstacles, or convert them to something else."""

    def clip() -> None:
        selection = editor.selection.without_vertices()
        editor.apply(boolean.clip_to_boundary(editor.sketch, selection))

    def fill_unreachable() -> None:
        editor.apply(fixes.fill_unreachable(editor.sketch, editor.radius))

    group = EditorCommandGroup("Combine", editor)
    group.add_edit("unite", "Unite", boolean.unite, "alt+u")
    group.add_edit("subtract", "Subtract the upper ones", boolean.subtract, "alt+s")
    group.add_edit("intersect", "Keep their common area", boolean.intersect, "alt+i")
    group.add_edit("divide", "Divide", boolean.divide, "alt+d")
    group.add("clip", "Clip to the boundary", clip, "alt+b")
    group.add_edit("join", "Join walls end to end", vertices.join_walls, "alt+j")
    group.add_edit("polygons", "Convert to polygons", properties.convert_to_polygons, "alt+p")
    group.add_edit("boundary:of", "Make it the boundary", properties.convert_to_boundary)
    group.add_edit("repair", "Repair crossing outlines", boolean.repair_outlines, "alt+r")
    group.add("density:area", "Make it an area of the density", partial(actions.convert_to_areas, editor))
    group.add("fill:unreachable", "Fill unreachable areas", fill_unreachable)
    return group


def _build_vertex_group(editor: Editor, window: EditorWindowActions) -> EditorCommandGroup:
    """Build the group of commands that edit vertices, walls, outlines and the paths of obstacles."""
    bevel = partial(actions.trim_corners, editor, vertices.bevel_corners)
    round_corners = partial(actions.trim_corners, editor, vertices.round_corners)
    widen = partial(actions.scale_wall_width, editor, WALL_WIDTH_STEP)
    narrow = partial(actions.scale_wall_width, editor, 1.0 / WALL_WIDTH_STEP)
    group = EditorCommandGroup("Vertices", editor)
    group.add("bevel", "Cut corners off", bevel, "shift+b")
    group.add("round", "Round corners", round_corners, "shift+r")
    group.add("split", "Cut a wall in two here", partial(actions.split_wall, editor), "shift+c")
    group.add("extend", "Extend wall to the cursor", partial(actions.extend_wall, editor), "shift+w")
    group.add("fill", "Fill the hole", partial(actions.fill_hole, editor), "shift+f")
    group.add_edit(
        "simplify", "Remove redundant vertices", vertices.simplify, "shift+p", value=SIMPLIFY_TOLERANCE_M
    )
    group.add_edit(
        "straighten",
        "Straighten edges: those that are nearly level or upright",
        vertices.straighten,
        "shift+l",
    )
    group.add_edit(
        "path:repeat", "Close or open the path: a loop, or back and forth", paths.toggle_repeat, "shift+o"
    )
    group.add_edit("path:none", "Remove an obstacle's path", paths.remove_path, "alt+o")
    group.add("wider", "Wider walls", widen, "]", repeats=True)
    group.add("narrower", "Narrower walls", narrow, "[", repeats=True)
    group.add("wall:width", "Width of the wall…", window.edit_width)
    return group


def _build_grid_group(editor: Editor) -> EditorCommandGroup:
    group = EditorCommandGroup("Snap", editor)
    group.add("grid:finer", "Finer grid", editor.refine_grid, "-", repeats=True)
    group.add("grid:coarser", "Coarser grid", editor.coarsen_grid, "=", "+", repeats=True)
    group.add("snap:all", "Snap to all or nothing", editor.toggle_all_snaps, "0")
    return group


def _build_view_group(
    editor: Editor, canvas: EditorCanvas, window: EditorWindowActions
) -> EditorCommandGroup:
    """Build the group of commands for the view, the window and the display of problems."""

    def fit_selection() -> None:
        canvas.fit(editor.selection)

    def pan(x: int, y: int) -> None:
        canvas.pan(-PAN_STEP_PX * x, PAN_STEP_PX * y)

    group = EditorCommandGroup("View", editor)
    group.add("fit", "Show the whole map", canvas.fit, "f")
    group.add("fit:selection", "Show the selection", fit_selection, "z")
    group.add("zoom:in", "Zoom in", partial(canvas.zoom, ZOOM_STEP), "ctrl+=", "ctrl++", repeats=True)
    group.add("zoom:out", "Zoom out", partial(canvas.zoom, 1 / ZOOM_STEP), "ctrl+-", repeats=True)
    group.add_arrows("pan:{}", "Pan (all arrows)", pan, "ctrl+{}")
    group.add("pan:hold", "Hold to pan", window.hold_pan, "space")
    group.add("theme", "Light or dark", editor.switch_theme, "t")
    group.add("panel", "Hide or show the settings", editor.toggle_panel, "h")
    group.add("tab", "Next page of the panel", window.show_next_tab, "ctrl+tab")
    group.add("fullscreen", "Full screen", window.toggle_fullscreen, "f11")
    group.add(
        "path:play",
        "Start or stop motions: of obstacles with a path",
        partial(actions.toggle_motion, editor),
        "l",
    )
    show_next_problem = partial(actions.show_next_problem, editor)
    group.add("problem:next", "Go to the next problem", show_next_problem, "f8", "n", repeats=True)
    fix_problem = partial(actions.fix_problem, editor)
    group.add("problem:fix", "Fix the shown problem", fix_problem, "shift+f8")
    return group


def _build_robot_group(editor: Editor) -> EditorCommandGroup:
    """Build the group of commands on starts and the team."""

    def add_uniform_start() -> None:
        editor.apply(create.add_uniform_start(editor.sketch))

    group = EditorCommandGroup("Robots", editor)
    group.add("start:uniform", "Start anywhere: in the whole free space", add_uniform_start, "shift+u")
    group.add("start:next", "Select the next start", partial(actions.select_next_start, editor), "shift+n")
    make_default = partial(actions.make_default_start, editor)
    group.add("start:default", "Set as default start", make_default, "shift+d")
    group.add("more", "Add a robot", partial(editor.add_robots, 1), "shift+=", "shift++", repeats=True)
    group.add("fewer", "Remove a robot", partial(editor.add_robots, -1), "shift+-", repeats=True)
    return group


def _build_help_group(editor: Editor, window: EditorWindowActions) -> EditorCommandGroup:
    group = EditorCommandGroup("Help", editor)
    group.add("help", "Keys", window.toggle_help, "f1", "shift+/")
    group.add("palette", "Commands by name", window.open_palette, "ctrl+k", "/")
    return group


def _build_tool_group(editor: Editor) -> EditorCommandGroup:
    group = EditorCommandGroup("Tools", editor)
    for tool in editor.toolbox.by_name.values():
        choose = partial(editor.choose_tool, tool.name)
        group.add(f"tool:{tool.name}", f"{tool.title}: {tool.hint}", choose, tool.key)
    return group


def _build_snap_group(editor: Editor) -> EditorCommandGroup:
    group = EditorCommandGroup("Snap", editor)
    for number, (name, mode) in enumerate(SNAPS.items(), 1):
        toggle = partial(editor.toggle_snap, name)
        group.add(f"snap:{name}", f"Snap to {mode.title.lower()}", toggle, str(number))
    return group


def _build_layer_group(editor: Editor) -> EditorCommandGroup:
    group = EditorCommandGroup("View", editor)
    for name, layer in LAYERS.items():
        group.add(f"show:{name}", layer.title, partial(editor.toggle_layer, name), layer.key)
    return group
