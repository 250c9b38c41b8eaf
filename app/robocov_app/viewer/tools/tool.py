"""Base class of the tools, their previews, and changes of the map. Lengths in meters."""

from dataclasses import dataclass

from robocov.environment import Environment, Obstacle, Point
from robocov_app.viewer.session import map_edits
from robocov_app.viewer.session.passages import describe_passage_changes
from robocov_app.viewer.session.session import Session


@dataclass(frozen=True)
class Preview:
    """Preview of a tool's next action.

    Attributes
    ----------
    line : tuple of Point
        Points of a line, m; the label is next to the last one.
    is_closed : bool
        Whether the line returns to its first point.
    obstacle : Obstacle or None
        Obstacle that would be drawn or moved.
    label : str
        Text next to the last point.
    has_marks : bool
        Whether each point of the line has a mark.
    """

    line: tuple[Point, ...] = ()
    is_closed: bool = False
    obstacle: Obstacle | None = None
    label: str = ""
    has_marks: bool = True


class Tool:
    """A tool that does nothing: base class of the others. Strings that methods return are shown as messages.

    Attributes
    ----------
    name : str
        Unique name, as in the command ``tool:name``.
    title : str
        Name in the window.
    button_text : str
        Text of its button, if the title is too long; empty for the title.
    key : str
        Key that chooses the tool.
    hint : str
        How to use it.
    takes_robots : bool
        Whether a press acts on the robot under the cursor.
    ends_on_double_click : bool
        Whether a double click completes the drawing.
    uses_right_button : bool
        Whether the right button works like the left one, instead of panning.
    uses_wheel : bool
        Whether the wheel changes its size, instead of zooming.
    is_resizable : bool
        Whether `resize` has a meaning.
    is_painting : bool
        Whether the density is being changed right now.
    """

    name = ""
    title = ""
    button_text = ""
    key = ""
    hint = ""
    takes_robots = False
    ends_on_double_click = False
    uses_right_button = False
    uses_wheel = False
    is_resizable = False
    is_painting = False

    def choose_button(self, *, is_right: bool) -> None:
        """Take note of the button that is about to be pressed."""

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        """Handle a press of the button.

        Parameters
        ----------
        session : Session
            The session to act on.
        point : Point
            Position of the cursor, m.
        reach : float
            Width of a finger on the map, m: closer objects count as hit.
        number : int or None
            Number of the robot under the cursor.

        Returns
        -------
        str or None
            Message to show.
        """
        return None

    def move(self, session: Session, point: Point) -> None:
        """Handle a move of the cursor, whether a button is held down or not."""

    def release(self, session: Session, point: Point) -> str | None:
        """Handle the release of the button."""
        return None

    def finish(self, session: Session) -> str | None:
        """Complete the drawing: Enter, a double click or a right click."""
        return None

    def cancel(self, session: Session) -> bool:
        """Give up the action, and return whether there was one."""
        return False

    def build_preview(self, session: Session) -> Preview | None:
        """Return the preview of the next action, if there is one."""
        return None

    def resize(self, session: Session, factor: float) -> str:
        """Multiply the size of the tool by a factor."""
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
        Message: the description, robots that were pushed aside, starts that are covered, blocked passages.

    Raises
    ------
    StartError
        If there is no space left for a robot.
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
    """Add an obstacle that was drawn with a tool; return the message."""
    environment = map_edits.add_obstacle(session.displayed.environment, obstacle)
    return change_map(session, environment, f"{name} drawn")


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
