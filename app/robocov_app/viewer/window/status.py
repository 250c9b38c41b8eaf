"""The status line (time, cost, speed, point under the cursor), and suggestions on what to try next."""

import shapely

from robocov.environment import Point
from robocov.kernel_compilation import is_compiling_in_background
from robocov_app.viewer.costs.costs import KnownCost
from robocov_app.viewer.model import ViewerModel
from robocov_app.viewer.session.clock import format_speed
from robocov_app.viewer.session.pane import Pane

HINT = "Space: pause · F1: keys"

MAX_SUGGESTIONS = 3
_MAX_COST_LAG_S = 0.05  # if the displayed cost is older than this, its time is shown, too
MIN_UNCOVERED_AREA_M2 = 0.05
"""Area above which a part of the map counts as cut off: the smallest that is not displayed as 0.0 m²."""
_MAX_SITE_DISTANCE = 1.5  # in lattice spacings: a point farther than this from all sites is not free

_SUGGESTIONS = {
    "obstacle": ("draw a wall in a doorway", "W"),
    "hand": ("drag a robot", ""),
    "failure": ("let one fail", "D"),
    "pane": ("compare controllers", "K"),
    "law": ("change the controller", "O"),
    "density": ("paint where it matters", "G"),
    "robot": ("let one more join", "A"),
}
"""Suggestions to the user, by the kind of edit that they lead to, each with its key."""


def list_facts(
    viewer: ViewerModel, frame_rate: float, step_rate: float, video_duration: float | None
) -> list[str]:
    """Return the texts of the status line, most important first.

    Parameters
    ----------
    viewer : ViewerModel
        The viewer.
    frame_rate, step_rate : float
        Frames and simulated steps per second.
    video_duration : float or None
        Duration of the video being recorded, s; None if no video is being recorded.
    """
    session = viewer.session
    time = session.displayed.time
    paused = "" if session.playback.is_playing else "Paused · "
    facts = [f"{paused}t = {time:.2f} s"]
    known_cost = viewer.costs.known.get(viewer.pane.number)
    if known_cost is not None:
        cost_facts = _list_cost_facts(known_cost, time)
        if len(session.timeline.panes) > 1:
            cost_facts[0] = f"{session.displayed.get_setup(viewer.pane).controller.label}: {cost_facts[0]}"
        facts += cost_facts
    if video_duration is not None:
        facts.append(f"● video {video_duration:.0f} s")
    facts.append(_describe_speed(viewer, step_rate))
    facts.append(describe_cursor(viewer))
    if session.playback.is_playing:
        facts.append(f"{step_rate:.0f} steps/s")
    facts.append(f"{frame_rate:.0f} fps")
    return [fact for fact in facts if fact]


def describe_cut_off(viewer: ViewerModel, pane: Pane) -> str:
    """Describe the area that a pane's mean distance omits, since no robot can reach it; empty if negligible.

    The mean distance decreases when robots are locked out of a room, which is no improvement.
    """
    known_cost = viewer.costs.known.get(pane.number)
    if known_cost is None or known_cost.result.uncovered_area <= MIN_UNCOVERED_AREA_M2:
        return ""
    return f"without {known_cost.result.uncovered_area:.1f} m² cut off"


def _list_cost_facts(known_cost: KnownCost, time: float) -> list[str]:
    age = f" (at {known_cost.time:.1f} s)" if abs(known_cost.time - time) > _MAX_COST_LAG_S else ""
    facts = [f"cost {known_cost.result.value:.2f} m³{age}"]
    if known_cost.result.uncovered_area > MIN_UNCOVERED_AREA_M2:
        facts.append(f"cut off {known_cost.result.uncovered_area:.1f} m²")
    return facts


def _describe_speed(viewer: ViewerModel, step_rate: float) -> str:
    session = viewer.session
    speed = format_speed(session.playback.clock.speed)
    playback = session.playback
    # An open dialog suspends playback; the last measured rate would be out of date.
    if playback.is_playing and playback.clock.is_behind and not playback.is_suspended:
        actual = step_rate * session.timeline.scenario.dt
        cause = " while compiling" if is_compiling_in_background() else ""
        return f"{speed} (running at {actual:.1f}×{cause})"
    return speed


def describe_cursor(viewer: ViewerModel) -> str:
    """Describe the point under the cursor and its distance to the nearest robot; empty if there is none."""
    cursor = viewer.inspection.cursor
    if cursor is None:
        return ""
    panes = viewer.session.timeline.panes
    pane = panes[min(viewer.inspection.cursor_pane, len(panes) - 1)]
    position = f"({cursor[0]:.2f}, {cursor[1]:.2f}) m"
    known_cost = viewer.costs.known.get(pane.number)
    if known_cost is None:
        return position
    return f"{position}, {_describe_point(viewer, pane, known_cost, cursor)}"


def _describe_point(viewer: ViewerModel, pane: Pane, known_cost: KnownCost, point: Point) -> str:
    """Describe the distance of a point to the robot that covers it, or why no robot does."""
    result = known_cost.result
    squares = (result.points[:, 0] - point[0]) ** 2 + (result.points[:, 1] - point[1]) ** 2
    site = int(squares.argmin())
    if squares[site] > (_MAX_SITE_DISTANCE * known_cost.get_lattice().spacing) ** 2:
        setup = viewer.session.displayed.get_setup(pane)
        is_in_map = setup.environment.boundary_polygon.intersects(shapely.Point(point))
        if is_in_map:
            return "inside an obstacle"
        return "outside the map"
    row = int(result.owners[site])
    numbers = viewer.session.displayed.get_setup(pane).numbers
    if not 0 <= row < len(numbers):
        return "out of reach of all robots"
    distance = float(result.distances[site])
    return f"{distance:.2f} m from robot {numbers[row]}"


def suggest_actions(viewer: ViewerModel) -> str:
    """Suggest what to try once the team has settled; empty before that, or if everything has been tried."""
    timeline = viewer.session.timeline
    has_settled = timeline.is_settled or viewer.settled_change is timeline.head
    if not viewer.view.has_suggestions or not has_settled:
        return ""
    if not timeline.is_live or timeline.run.drag is not None:
        return ""
    tried = {node.kind for node in timeline.document.nodes}
    if len(timeline.panes) > 1:
        tried.add("pane")
    suggestions: list[str] = []
    for kind, (text, key) in _SUGGESTIONS.items():
        if kind not in tried:
            has_key = bool(key) and not viewer.view.is_compact
            suggestions.append(f"{text} ({key})" if has_key else text)
    if not suggestions:
        return ""
    return f"The team has settled. Try:\n{' · '.join(suggestions[:MAX_SUGGESTIONS])}"
