"""Everything that a key of the editor does; where the demo does the same thing, it is the same key."""

from __future__ import annotations

from robocov_app.editor.tools.toolbox import toolbox
from robocov_app.editor.ui.settings import SHOWN, SNAPS
from robocov_app.viewer.actions import Action

GROUPS = ("File", "Edit", "Arrange", "Combine", "Tools", "Vertices", "Snap", "View", "Robots", "Help")
"""Headings of the help, in their order."""

_TOOL_KEYS = {
    "select": "v",
    "polygon": "p",
    "rectangle": "r",
    "circle": "c",
    "wall": "w",
    "door": "k",
    "boundary": "b",
    "disc": "s",
    "places": "shift+s",
    "measure": "m",
    "density": "d",
    "path": "o",
    "picture": "i",
    "pan": "g",
}

_SHOWN_KEYS = {
    "grid": "alt+3",
    "names": "alt+2",
    "impassable": "alt+1",
    "problems": "alt+5",
    "robots": "a",
    "picture": "alt+6",
    "legend": "alt+7",
    "handles": "alt+4",
}

_OTHERS = (
    Action("new", "New map", "File", ("ctrl+n",)),
    Action("open", "Open a map", "File", ("ctrl+o",)),
    Action("recent", "Open a recent or bundled map", "File", ("ctrl+shift+o",)),
    Action("save", "Save", "File", ("ctrl+s",)),
    Action("save:as", "Save as", "File", ("ctrl+shift+s",)),
    Action("export", "Export to another format", "File", ("ctrl+e",)),
    Action("background", "Picture under the map", "File", ("ctrl+b",)),
    Action("background:none", "Take the picture under the map away", "File", ()),
    Action("reload", "Read the file again", "File", ("ctrl+r",)),
    Action("try", "Try it in the demo, and back", "File", ("f5",)),
    Action("screenshot", "Screenshot", "File", ("f12",)),
    Action("quit", "Quit", "File", ("ctrl+q",)),
    Action("undo", "Undo", "Edit", ("ctrl+z",)),
    Action("redo", "Redo", "Edit", ("ctrl+y", "ctrl+shift+z")),
    Action("cut", "Cut", "Edit", ("ctrl+x",)),
    Action("copy", "Copy", "Edit", ("ctrl+c",)),
    Action("paste", "Paste at the cursor", "Edit", ("ctrl+v",)),
    Action("paste:there", "Paste in the same place", "Edit", ("ctrl+shift+v",)),
    Action("duplicate", "Duplicate", "Edit", ("ctrl+d",)),
    Action("delete", "Delete", "Edit", ("delete", "x")),
    Action("select:all", "Select all", "Edit", ("ctrl+a",)),
    Action("select:next", "Select the next obstacle", "Edit", ("tab",)),
    Action("select:previous", "Select the previous obstacle", "Edit", ("shift+tab",)),
    Action("name", "Name what is selected", "Edit", ("f2",)),
    Action("left", "Nudge by the grid (all arrows)", "Edit", ("left",)),
    Action("right", "", "Edit", ("right",)),
    Action("up", "", "Edit", ("up",)),
    Action("down", "", "Edit", ("down",)),
    Action("left:far", "Nudge ten times as far (all arrows)", "Edit", ("shift+left",)),
    Action("right:far", "", "Edit", ("shift+right",)),
    Action("up:far", "", "Edit", ("shift+up",)),
    Action("down:far", "", "Edit", ("shift+down",)),
    Action("finish", "Finish what is being drawn", "Edit", ("return", "enter")),
    Action("back", "Take the last point back, or delete", "Edit", ("backspace",)),
    Action("cancel", "Give up; select nothing; close", "Edit", ("escape",)),
    Action("menu", "What can be done here (right click)", "Edit", ("menu", "shift+f10")),
    Action("rotate:left", "Turn by 90° to the left", "Arrange", ("q",)),
    Action("rotate:right", "Turn by 90° to the right", "Arrange", ("e",)),
    Action("mirror:x", "Mirror left and right", "Arrange", ("shift+h",)),
    Action("mirror:y", "Mirror up and down", "Arrange", ("shift+v",)),
    Action("align:left", "Align left sides", "Arrange", ("alt+left",)),
    Action("align:right", "Align right sides", "Arrange", ("alt+right",)),
    Action("align:top", "Align tops", "Arrange", ("alt+up",)),
    Action("align:bottom", "Align bottoms", "Arrange", ("alt+down",)),
    Action("align:centre", "Align middles across", "Arrange", ("alt+c",)),
    Action("align:middle", "Align middles in height", "Arrange", ("alt+m",)),
    Action("distribute:x", "Equal gaps across", "Arrange", ("alt+x",)),
    Action("distribute:y", "Equal gaps in height", "Arrange", ("alt+y",)),
    Action("raise", "To the top", "Arrange", ("page up",)),
    Action("lower", "To the bottom", "Arrange", ("page down",)),
    Action("group", "Group: a click selects all of it", "Arrange", ("ctrl+g",)),
    Action("ungroup", "Take out of its group", "Arrange", ("ctrl+shift+g",)),
    Action("lock", "Lock: the mouse takes it no more", "Arrange", ("ctrl+l",)),
    Action("hide", "Hide in the editor", "Arrange", ("ctrl+h",)),
    Action("release", "Unlock and show all", "Arrange", ("ctrl+shift+l",)),
    Action("unite", "Unite", "Combine", ("alt+u",)),
    Action("subtract", "Subtract the upper ones", "Combine", ("alt+s",)),
    Action("intersect", "Keep what they have in common", "Combine", ("alt+i",)),
    Action("divide", "Cut along each other", "Combine", ("alt+d",)),
    Action("clip", "Cut off outside the boundary", "Combine", ("alt+b",)),
    Action("join", "Join walls end to end", "Combine", ("alt+j",)),
    Action("polygons", "Turn into polygons", "Combine", ("alt+p",)),
    Action("boundary:of", "Make it the boundary", "Combine", ()),
    Action("repair", "Repair crossing outlines", "Combine", ("alt+r",)),
    Action("density:area", "Make it an area that counts more", "Combine", ()),
    Action("fill:unreachable", "Fill all that robots cannot reach", "Combine", ()),
    Action("bevel", "Cut corners off", "Vertices", ("shift+b",)),
    Action("round", "Round corners", "Vertices", ("shift+r",)),
    Action("split", "Cut a wall in two here", "Vertices", ("shift+c",)),
    Action("extend", "Go on with the wall from here", "Vertices", ("shift+w",)),
    Action("fill", "Fill the hole", "Vertices", ("shift+f",)),
    Action("simplify", "Leave needless vertices out", "Vertices", ("shift+p",)),
    Action("straighten", "Make edges straight that nearly are", "Vertices", ("shift+l",)),
    Action("path:repeat", "Obstacle goes in a loop, or back and forth", "Vertices", ("shift+o",)),
    Action("path:none", "Take an obstacle's path away", "Vertices", ("alt+o",)),
    Action("wider", "Wider walls", "Vertices", ("]",)),
    Action("narrower", "Narrower walls", "Vertices", ("[",)),
    Action("grid:finer", "Finer grid", "Snap", ("-",)),
    Action("grid:coarser", "Coarser grid", "Snap", ("=", "+")),
    Action("snap:all", "Snap to everything, or to nothing", "Snap", ("0",)),
    Action("fit", "Show the whole map", "View", ("f",)),
    Action("fit:selection", "Show what is selected", "View", ("z",)),
    Action("zoom:in", "Zoom in", "View", ("ctrl+=", "ctrl++")),
    Action("zoom:out", "Zoom out", "View", ("ctrl+-",)),
    Action("pan:left", "Pan (all arrows)", "View", ("ctrl+left",)),
    Action("pan:right", "", "View", ("ctrl+right",)),
    Action("pan:up", "", "View", ("ctrl+up",)),
    Action("pan:down", "", "View", ("ctrl+down",)),
    Action("pan:hold", "Pan while it is held down", "View", ("space",)),
    Action("theme", "Light or dark", "View", ("t",)),
    Action("panel", "Hide or show the panel", "View", ("h",)),
    Action("tab", "Next page of the panel", "View", ("ctrl+tab",)),
    Action("fullscreen", "Full screen", "View", ("f11",)),
    Action("path:play", "Let obstacles move, or stand again", "View", ("l",)),
    Action("problem:next", "Go to the next problem", "View", ("f8", "n")),
    Action("problem:fix", "Mend the problem that is shown", "View", ("shift+f8",)),
    Action("start:uniform", "A start anywhere in the free space", "Robots", ("shift+u",)),
    Action("start:next", "Next start of the map", "Robots", ("shift+n",)),
    Action("start:default", "Make it the default start", "Robots", ("shift+d",)),
    Action("more", "One robot more", "Robots", ("shift+=", "shift++")),
    Action("fewer", "One robot fewer", "Robots", ("shift+-",)),
    Action("help", "Keys", "Help", ("f1", "shift+/")),
    Action("palette", "Commands by name", "Help", ("ctrl+k", "/")),
)

REPEATING = frozenset(
    {
        *("undo", "redo", "paste", "duplicate", "select:next", "select:previous", "back"),
        *("left", "right", "up", "down", "left:far", "right:far", "up:far", "down:far"),
        *("wider", "narrower", "grid:finer", "grid:coarser", "more", "fewer", "problem:next"),
        *("zoom:in", "zoom:out", "pan:left", "pan:right", "pan:up", "pan:down"),
        *("rotate:left", "rotate:right"),
    }
)
"""What is done again and again while its key is held down."""


def tool_actions() -> list[Action]:
    """Return one action for each tool."""
    return [
        Action(f"tool:{tool.name}", f"{tool.title}: {tool.hint}", "Tools", (_TOOL_KEYS[tool.name],))
        for tool in toolbox().values()
    ]


def switches() -> list[Action]:
    """Return one action for each thing that can be snapped to, or shown."""
    snaps = [
        Action(f"snap:{name}", f"Snap to {title.lower()}", "Snap", (str(k),))
        for k, (name, (title, _)) in enumerate(SNAPS.items(), 1)
    ]
    return [
        *snaps,
        *(Action(f"show:{name}", title, "View", (_SHOWN_KEYS[name],)) for name, title in SHOWN.items()),
    ]


def all_actions() -> list[Action]:
    """Return every action."""
    return [*_OTHERS, *tool_actions(), *switches()]


def told_actions() -> list[Action]:
    """Return those that are listed by name."""
    return [action for action in all_actions() if action.title]
