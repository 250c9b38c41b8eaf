"""Everything that a key does: the window, its help, its tool tips and its palette go by this list."""

from __future__ import annotations

from dataclasses import dataclass

from robocov_app.viewer.tools import toolbox

KEY_REPEAT = (350, 40)
"""Milliseconds after which a key that is held down is pressed again, the first time and from then on."""


@dataclass(frozen=True)
class Action:
    """Something that a key does.

    Attributes
    ----------
    name : str
        ``kind`` or ``kind:what``.
    title : str
    group : str
        Under which heading the help shows it.
    keys : tuple of str
        As ``ctrl+shift+z``; the last part is what pygame calls the key.
    """

    name: str
    title: str
    group: str
    keys: tuple[str, ...]


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

_OTHERS = (
    Action("pause", "Play or pause", "Run", ("space",)),
    Action("step", "Single step", "Run", (".",)),
    Action("restart", "Restart", "Run", ("r",)),
    Action("settle", "Play until settled, then stop", "Run", ("s",)),
    Action("slower", "Slower", "Run", ("-",)),
    Action("faster", "Faster", "Run", ("=", "+")),
    Action("seed", "Other starting positions (next seed)", "Run", ("n",)),
    Action("start", "Next start of the map", "Run", ("shift+n",)),
    Action("more", "One robot more, from the start", "Run", ("shift+=", "shift++")),
    Action("fewer", "One robot fewer, from the start", "Run", ("shift+-",)),
    Action("map:next", "Next map", "Run", ("page down",)),
    Action("map:previous", "Previous map", "Run", ("page up",)),
    Action("back", "Back by a moment", "Time", ("left",)),
    Action("forward", "On by a moment", "Time", ("right",)),
    Action("back:second", "Back by a second", "Time", ("shift+left",)),
    Action("forward:second", "On by a second", "Time", ("shift+right",)),
    Action("first", "To the beginning", "Time", ("home",)),
    Action("live", "To the present", "Time", ("end",)),
    Action("branch", "Go on from the moment that is shown", "Time", ("b",)),
    Action("law", "Next controller in this pane", "Compare", ("o",)),
    Action("pane:add", "Compare with one more controller", "Compare", ("k",)),
    Action("pane:remove", "Remove this pane", "Compare", ("shift+k",)),
    Action("pane:next", "Next pane", "Compare", ("`",)),
    Action("undo", "Undo", "Touch", ("ctrl+z",)),
    Action("redo", "Redo", "Touch", ("ctrl+y", "ctrl+shift+z")),
    Action("robot:next", "Ask the next robot", "Touch", ("tab",)),
    Action("robot:previous", "Ask the previous robot", "Touch", ("shift+tab",)),
    Action("robot:fail", "Let the robot that is asked fail, or revive it", "Touch", ("shift+d",)),
    Action("robot:remove", "Take the robot that is asked out", "Touch", ("delete",)),
    Action("finish", "Finish what is being drawn", "Touch", ("return", "enter")),
    Action("cancel", "Give up; close", "Touch", ("escape",)),
    Action("wider", "Wider walls; a larger brush", "Touch", ("]",)),
    Action("narrower", "Narrower walls; a smaller brush", "Touch", ("[",)),
    Action("fit", "Show the whole map", "View", ("f",)),
    Action("zoom:in", "Zoom in", "View", ("ctrl+=", "ctrl++")),
    Action("zoom:out", "Zoom out", "View", ("ctrl+-",)),
    Action("pan:left", "Pan left", "View", ("ctrl+left",)),
    Action("pan:right", "Pan right", "View", ("ctrl+right",)),
    Action("pan:up", "Pan up", "View", ("ctrl+up",)),
    Action("pan:down", "Pan down", "View", ("ctrl+down",)),
    Action("theme", "Light or dark", "View", ("t",)),
    Action("plot", "Plot mean distance or mean time", "View", ("y",)),
    Action("fade", "Trajectories fade", "View", ("shift+t",)),
    Action("panel", "Hide or show the panel", "View", ("h",)),
    Action("tab", "Next page of the panel", "View", ("ctrl+tab",)),
    Action("fullscreen", "Full screen", "View", ("f11",)),
    Action("screenshot", "Screenshot", "Keep", ("f12",)),
    Action("film", "Record a film, or end it", "Keep", ("f9",)),
    Action("save:run", "Save the run", "Keep", ("ctrl+e",)),
    Action("save:session", "Save the session", "Keep", ("ctrl+s",)),
    Action("recover", "Recover a session", "Keep", ("ctrl+shift+o",)),
    Action("branch:previous", "Branch before", "Time", ("alt+left",)),
    Action("branch:next", "Next branch", "Time", ("alt+right",)),
    Action("save:map", "Save the map", "Keep", ("ctrl+shift+s",)),
    Action("help", "Keys", "Help", ("f1", "shift+/")),
    Action("palette", "Commands by name", "Help", ("ctrl+k", "/")),
    Action("tour", "The lesson, or just play", "Help", ("f2",)),
    Action("quit", "Quit", "Help", ("ctrl+q",)),
)


REPEATING = frozenset(
    {
        *("step", "slower", "faster", "more", "fewer", "undo", "redo", "wider", "narrower"),
        *("back", "forward", "back:second", "forward:second", "robot:next", "robot:previous"),
        *("zoom:in", "zoom:out", "pan:left", "pan:right", "pan:up", "pan:down"),
    }
)
"""What is done again and again while its key is held down."""


def layer_actions(titles: dict[str, str]) -> list[Action]:
    """Return one action for each layer, given the layers' titles by name."""
    keys = dict(_LAYER_KEYS)
    names = [name for name in keys if name in titles]
    names += [name for name in titles if name not in keys]
    return [
        Action(f"layer:{name}", titles[name], "Show", (keys[name],) if name in keys else ()) for name in names
    ]


def tool_actions() -> list[Action]:
    """Return one action for each tool."""
    return [
        Action(f"tool:{tool.name}", f"{tool.title}: {tool.hint}", "Tools", (_TOOL_KEYS[tool.name],))
        for tool in toolbox().values()
    ]


def all_actions(titles: dict[str, str]) -> list[Action]:
    """Return every action, given the layers' titles by name."""
    return [*_OTHERS, *tool_actions(), *layer_actions(titles)]


def key_words(key: str) -> str:
    """Return a key as people write it.

    >>> [key_words(key) for key in ("ctrl+shift+z", "page down", "f1", "space", "`", "left")]
    ['Ctrl Shift Z', 'Page down', 'F1', 'Space', '`', '←']
    """
    arrows = {"left": "←", "right": "→", "up": "↑", "down": "↓", "return": "Enter"}
    parts = [*key[:-1].split("+")[:-1], "+"] if key.endswith("++") or key == "+" else key.split("+")
    return " ".join(arrows.get(part, part[:1].upper() + part[1:]) for part in parts)


def matching(actions: list[Action], typed: str) -> list[Action]:
    """Return the actions whose titles hold all words typed, those that begin with them first.

    >>> [a.name for a in matching(list(_OTHERS), "single")]
    ['step']
    """
    words = typed.lower().split()
    found = [action for action in actions if all(word in action.title.lower() for word in words)]
    return sorted(found, key=lambda action: not action.title.lower().startswith(typed.lower().strip()))
