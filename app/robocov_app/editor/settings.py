"""Settings that the editor stores between sessions, and the layers that it can show."""

from typing import NamedTuple

from pydantic import Field

from robocov.defaults import DEFAULT_RADIUS_M
from robocov_app.editor.tools.snap_switches import SNAPS
from robocov_app.toolkit.window.window_settings import WindowSettings

SETTINGS_FILE = "editor.json"
MAX_RECENT = 10  # number of recent maps that are stored


class LayerSwitch(NamedTuple):
    """A layer of the sheet that can be shown or hidden.

    Attributes
    ----------
    title : str
        Label of the layer.
    key : str
        Key that shows or hides the layer.
    """

    title: str
    key: str


# Settings files contain these names; "picture" is the background image.
LAYERS = {
    "grid": LayerSwitch("Grid", "alt+3"),
    "names": LayerSwitch("Names", "alt+2"),
    "impassable": LayerSwitch("Too narrow", "alt+1"),
    "problems": LayerSwitch("Problems", "alt+5"),
    "robots": LayerSwitch("Robots at start", "a"),
    "picture": LayerSwitch("Image", "alt+6"),
    "legend": LayerSwitch("Legend", "alt+7"),
    "handles": LayerSwitch("Handles", "alt+4"),
}

SETTING_ATTRIBUTES = {
    "grid": "grid",
    "angle": "snap_angle",
    "radius": "radius",
    "robots": "robots",
    "wall": "wall_width",
}
"""Attribute of the editor that holds each setting."""


class EditorSettings(WindowSettings):
    """Appearance and snapping of the editor, and its recent maps.

    Attributes
    ----------
    theme, scale, width, height, tab, recent
        See `WindowSettings`. Recent files are maps.
    grid : float
        Spacing of the grid, m.
    angle : float
        Lines snap to multiples of this angle, degrees.
    snaps : tuple of str
        Snap modes that are on.
    shown : tuple of str
        Names of the visible layers.
    radius : float
        Radius of a robot, m.
    robots : int
        Number of robots in the team.
    wall : float
        Width of new walls, m.
    """

    tab: str = "map"
    grid: float = Field(default=0.1, ge=0.001, le=100.0)
    angle: float = Field(default=15.0, gt=0.0, le=90.0)
    snaps: tuple[str, ...] = tuple(SNAPS)
    shown: tuple[str, ...] = tuple(name for name in LAYERS if name != "robots")
    radius: float = Field(default=DEFAULT_RADIUS_M, ge=0.001, le=10.0)
    robots: int = Field(default=6, ge=1, le=1000)
    wall: float = Field(default=0.1, ge=0.001, le=100.0)
