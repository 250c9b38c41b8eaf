"""The status line: time, cost, speed, the place under the cursor; and what can be tried next."""

from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.clock import format_speed

HINT = "Space pause · F1 keys"
_SLOW = 30.0  # frames per second
_OFFERED = (  # kinds of touches of the document, and the words for each
    ("obstacle", "draw a wall in a doorway (W)"),
    ("hand", "drag a robot"),
    ("failure", "let one fail (D)"),
    ("pane", "compare controllers (K)"),
    ("law", "change the controller (O)"),
    ("density", "paint where it matters (G)"),
    ("robot", "let one more join (A)"),
)


def facts(viewer: Presenter, frames: float, steps: float, filmed: float | None) -> list[str]:
    """Return what the line says, the most important first; `frames` and `steps` a second, `filmed` s."""
    session, known = viewer.session, viewer.costs.known.get(viewer.pane.number)
    said = [f"{'' if session.playback.is_playing else 'paused · '}t = {session.displayed.time:.2f} s"]
    if known is not None:
        when = f" (at {known.time:.1f} s)" if abs(known.time - session.displayed.time) > 0.05 else ""
        said.append(f"J = {known.result.value:.2f} m³{when}")
        if known.result.uncovered_area > 1e-9:
            said.append(f"cut off {known.result.uncovered_area:.1f} m²")
    if filmed is not None:
        said.append(f"● film {filmed:.0f} s")
    speed, rate = format_speed(session.playback.clock.speed), f"{frames:.0f} fps"
    if session.playback.is_playing and session.playback.clock.is_behind:
        speed += f", really {steps * session.timeline.scenario.dt:.1f}×"
    rest = [cursor_words(viewer), speed, f"{steps:.0f} steps/s"]
    said += [rate, *rest] if frames < _SLOW else [*rest, rate]  # the first thing to know if it is low
    return [each for each in said if each]


def cursor_words(viewer: Presenter) -> str:
    if viewer.cursor is None:
        return ""
    x, y = viewer.cursor
    words = f"({x:.2f}, {y:.2f}) m"
    pane = viewer.session.timeline.panes[min(viewer.cursor_pane, len(viewer.session.timeline.panes) - 1)]
    known = viewer.costs.known.get(pane.number)
    if known is None:
        return words
    result = known.result
    square = (result.points[:, 0] - x) ** 2 + (result.points[:, 1] - y) ** 2
    site = int(square.argmin())
    if square[site] > (1.5 * known.lattice().spacing) ** 2:
        return f"{words}: not free"
    owner, numbers = int(result.owner[site]), viewer.session.displayed.get_setup(pane).numbers
    if not 0 <= owner < len(numbers):
        return f"{words}: no robot can come"
    distance = float(result.distances[site])
    share = distance / result.mean_distance if result.mean_distance > 0 else 0.0
    return f"{words}: {distance:.2f} m to robot {numbers[owner]}, {share:.1f} × the mean"


def suggestion(viewer: Presenter) -> str:
    session = viewer.session
    rested = session.timeline.is_settled or viewer.rested is session.timeline.head
    if not (viewer.suggests and rested and session.timeline.is_live) or session.timeline.drag is not None:
        return ""
    tried = {node.kind for node in session.timeline.document.nodes} | (
        {"pane"} if session.timeline.panes[1:] else set()
    )
    new = [words for kind, words in _OFFERED if kind not in tried][:3]
    return f"The team has settled. Try:\n{' · '.join(new)}" if new else ""
