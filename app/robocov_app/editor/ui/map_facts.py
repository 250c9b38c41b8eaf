"""Facts about the map, for the panel and the status bar."""

from typing import NamedTuple

from robocov.errors import format_count
from robocov_app.editor.editor import Editor
from robocov_app.editor.edits import density
from robocov_app.editor.model.geometry import format_compared_lengths, format_point
from robocov_app.editor.model.measurement import Measurement, compute_shown_width, is_too_narrow
from robocov_app.editor.model.sketch import Item, Sketch
from robocov_app.editor.team import Team

UNKNOWN = "…"


class Fact(NamedTuple):
    """A fact about the map.

    Attributes
    ----------
    label : str
        Name of the fact.
    text : str
        Value of the fact; "…" if the map has not been measured yet.
    tip : str
        Tooltip.
    """

    label: str
    text: str
    tip: str


def list_map_facts(editor: Editor) -> list[Fact]:
    """Return the facts for the map page of the panel."""
    sketch = editor.sketch
    measurement = editor.measurement
    return [
        Fact("Size", _describe_size(sketch), "Width and height of the boundary"),
        Fact("Free", _describe_free_area(measurement), "Area inside the boundary that no obstacle covers"),
        Fact(
            "Parts",
            _describe_parts(measurement),
            "Connected parts of the free space and, if different, parts in which a robot can move",
        ),
        Fact("Passage", _describe_gap(measurement), "The narrowest passage, and a robot's diameter"),
        Fact("Content", _describe_content(sketch, measurement), "Obstacles and their vertices"),
        Fact(
            "Density",
            density.describe_density(sketch.density),
            "Weight of each position: drawn with the tool Density; typed commands: floor 0.5, density none",
        ),
    ]


def _describe_size(sketch: Sketch) -> str:
    if not sketch.boundary:
        return "no boundary yet: B draws one"
    xs, ys = zip(*sketch.boundary, strict=True)
    return f"{max(xs) - min(xs):.2f} x {max(ys) - min(ys):.2f} m"


def _describe_free_area(measurement: Measurement | None) -> str:
    if measurement is None:
        return UNKNOWN
    return f"{measurement.free_area:.2f} m²"


def _describe_parts(measurement: Measurement | None) -> str:
    if measurement is None:
        return UNKNOWN
    parts = len(measurement.components)
    reachable = len(measurement.reached)
    if parts == reachable:
        return f"{parts}"
    return f"{parts}; {reachable} for a robot"


def _describe_gap(measurement: Measurement | None) -> str:
    if measurement is None:
        return UNKNOWN
    gap = measurement.gap
    if gap is None:
        return "none"
    shown_width = compute_shown_width(gap, measurement.radius)
    width, diameter = format_compared_lengths(shown_width, 2 * measurement.radius)
    sign = "<" if is_too_narrow(gap, measurement.radius) else "≥"
    return f"{width} {sign} {diameter}"


def _describe_content(sketch: Sketch, measurement: Measurement | None) -> str:
    if measurement is None:
        return UNKNOWN
    return f"{format_count(len(sketch.obstacles), 'obstacle')}, {measurement.vertices} vertices"


def list_status(editor: Editor, frame_rate: float, team: Team | None) -> list[str]:
    """Return the texts of the status bar.

    Parameters
    ----------
    editor : Editor
        The editor.
    frame_rate : float
        Frames per second.
    team : Team or None
        The team that is shown at a start.
    """
    texts: list[str] = []
    if editor.cursor is not None:
        texts.append(format_point(editor.cursor))
    is_selecting = editor.tool is editor.toolbox.selector
    if is_selecting:
        item = _find_hovered_item(editor)
        if item is not None and item.note:
            texts.append(f"{item.shape.name or 'note'}: {item.note}")
    else:
        texts.append(f"{editor.tool.title}: {editor.tool.hint}")
    if is_selecting and editor.selection:
        texts.append(editor.selection.describe(editor.sketch))
    if team is not None and "robots" in editor.shown:
        texts.append(_describe_team(team))
    if is_selecting and not editor.selection:
        texts.append(editor.tool.hint)
    texts.append(_describe_snapping(editor))
    if editor.measurement_worker.is_busy:
        texts.append("measuring …")
    texts.append(f"{frame_rate:.0f} fps")
    return texts


def _find_hovered_item(editor: Editor) -> Item | None:
    owner = editor.toolbox.selector.hovered
    if isinstance(owner, int) and owner in editor.sketch.index_by_key:
        return editor.sketch.get_item(owner)
    return None


def _describe_team(team: Team) -> str:
    robots = format_count(len(team.positions), "robot")
    return team.message or f"{robots} at {team.start or 'anywhere'}"


def _describe_snapping(editor: Editor) -> str:
    if not editor.snaps:
        return "no snapping"
    if "grid" not in editor.snaps:
        return "grid off"
    return f"grid {editor.grid:g} m"
