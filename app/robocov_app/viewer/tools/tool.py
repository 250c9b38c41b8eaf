"""Base class of the viewer's tools, their events and overlays, and changes of the map; lengths in meters."""

from dataclasses import dataclass

from robocov.environment import Environment, Obstacle, Point
from robocov_app.toolkit.tools.tool import PointerEvent, Tool, ToolOverlay
from robocov_app.viewer.session.editing import map_edits
from robocov_app.viewer.session.editing.passages import describe_passage_changes
from robocov_app.viewer.session.session import Session


@dataclass(frozen=True)
class ViewerPointerEvent(PointerEvent):
    """Position of the pointer in a pane.

    Attributes
    ----------
    point, unsnapped_point, reach, shift, alt, ctrl
        See `PointerEvent`.
    robot : int or None
        Number of the robot under the pointer.
    is_right : bool
        Whether the right button is pressed instead of the left one.
    """

    robot: int | None = None
    is_right: bool = False


@dataclass(frozen=True)
class ViewerToolOverlay(ToolOverlay):
    """The overlay of a tool of the viewer in a pane.

    Attributes
    ----------
    line, is_closed, label
        See `ToolOverlay`.
    obstacles : tuple of Obstacle
        Preview of the obstacles that are being drawn, moved or changed.
    has_marks : bool
        Whether the points of the line are marked.
    hovered : Obstacle or None
        The obstacle under the pointer, which gets a thin outline.
    selected : tuple of Obstacle
        The selected obstacles, which get thick outlines.
    handles : tuple of Point
        Handles of the selected obstacle, m.
    box : tuple of Point or None
        Two opposite corners of the box in which obstacles are selected, m.
    """

    obstacles: tuple[Obstacle, ...] = ()
    has_marks: bool = True
    hovered: Obstacle | None = None
    selected: tuple[Obstacle, ...] = ()
    handles: tuple[Point, ...] = ()
    box: tuple[Point, Point] | None = None


class ViewerTool(Tool[Session, ViewerPointerEvent]):
    """Base class of the viewer's tools, which does nothing itself.

    Attributes
    ----------
    touch_hint : str
        The hint on a phone, which has no keys and no mouse; empty if it is the same.
    takes_robots : bool
        Whether a press acts on the robot under the cursor.
    uses_right_button : bool
        Whether the right button works like the left one, instead of panning.
    uses_wheel : bool
        Whether the wheel changes the size of the tool, instead of zooming.
    is_resizable : bool
        Whether the tool has a size that `resize` changes.
    is_painting : bool
        Whether the tool is painting the density right now.
    """

    touch_hint = ""
    takes_robots = False
    uses_right_button = False
    uses_wheel = False
    is_resizable = False
    is_painting = False

    def build_overlay(self, session: Session) -> ViewerToolOverlay:
        """Return the overlay that the tool shows on the map."""
        return ViewerToolOverlay()

    def resize(self, session: Session, factor: float) -> str:
        """Multiply the size of the tool by a factor; return a message."""
        return ""


def change_map(session: Session, environment: Environment, description: str) -> str:
    """Replace the map of a session.

    Parameters
    ----------
    session : Session
        The session.
    environment : Environment
        The new map.
    description : str
        Description of the change, for the list of changes.

    Returns
    -------
    str
        Message with the description, the number of pushed robots, covered starts and blocked passages.

    Raises
    ------
    StartError
        If there is no space left for a robot.
    MapError
        If the new map is invalid.
    """
    before = session.displayed.environment
    setup = session.displayed.get_setup(session.timeline.panes[0])
    min_radius = float(setup.team.radius.min())
    pushed = session.edit_map(environment, description)
    parts = [description]
    if pushed:
        parts.append(f"{_count(pushed, 'robot')} pushed out of the way")
    covered = sorted(set(before.starts) - set(environment.starts))
    if covered:
        noun = "start" if len(covered) == 1 else "starts"
        parts.append(f"it covers the {noun} {', '.join(covered)}")
    positions = session.displayed.get_positions(session.timeline.panes[0])
    passages = describe_passage_changes(before, environment, min_radius, positions)
    if passages:
        parts.append(passages)
    return "; ".join(parts)


def add_obstacle(session: Session, obstacle: Obstacle, name: str) -> str:
    """Add an obstacle that was drawn with the tool `name` to the map; return the message."""
    environment = map_edits.add_obstacle(session.displayed.environment, obstacle)
    return change_map(session, environment, f"{name} drawn")


def delete_obstacle(session: Session, index: int) -> str:
    """Delete the obstacle with an index from the map; return the message."""
    obstacle = session.displayed.environment.obstacles[index]
    environment = map_edits.replace_obstacles(session.displayed.environment, index, 1)
    return change_map(session, environment, f"{map_edits.describe_obstacle(obstacle)} deleted")


def _count(number: int, noun: str) -> str:
    if number == 1:
        return f"{number} {noun}"
    return f"{number} {noun}s"
