"""What the editor remembers from one time to the next, beside what the demo does."""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from robocov.robots import DEFAULT_RADIUS
from robocov_app.editor.tools.snapping import Kind

FILE = "editor.json"

SNAPS: dict[str, tuple[str, frozenset[Kind]]] = {
    "grid": ("Grid", frozenset({"grid"})),
    "vertices": ("Vertices", frozenset({"vertex", "middle", "centre", "crossing"})),
    "edges": ("Edges", frozenset({"edge"})),
    "angles": ("Angles", frozenset({"angle"})),
    "alignment": ("Alignment", frozenset({"aligned"})),
}
"""What can be snapped to, as people choose it: title, and the kinds of `Snapping`."""

SHOWN: dict[str, str] = {
    "grid": "Grid",
    "names": "Names",
    "impassable": "Too narrow",
    "problems": "Problems",
    "robots": "Robots at start",
    "picture": "Picture",
    "legend": "Legend",
    "handles": "Handles",
}
"""What can be shown, or not, with its title."""

# settings that are as an attribute of the editor, with its name
ATTRIBUTES = {
    "grid": "grid",
    "angle": "snap_angle",
    "radius": "radius",
    "robots": "robots",
    "wall": "wall_width",
}

MOST_RECENT = 10


class EditorSettings(BaseModel):
    """How the editor looks and snaps, and which maps were open."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    theme: Literal["light", "dark"] = "light"
    scale: float | None = Field(default=None, ge=0.5, le=4.0)
    width: int = Field(default=1280, ge=900, le=7680)
    height: int = Field(default=720, ge=600, le=4320)
    tab: str = "map"
    grid: float = Field(default=0.1, ge=0.001, le=100.0)
    angle: float = Field(default=15.0, gt=0.0, le=90.0)
    snaps: tuple[str, ...] = tuple(SNAPS)
    shown: tuple[str, ...] = tuple(name for name in SHOWN if name != "robots")
    radius: float = Field(default=DEFAULT_RADIUS, ge=0.001, le=10.0)
    robots: int = Field(default=6, ge=1, le=1000)
    wall: float = Field(default=0.1, ge=0.001, le=100.0)
    recent: tuple[str, ...] = ()
