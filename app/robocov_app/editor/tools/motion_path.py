"""The tool for paths of moving obstacles: waypoints are clicked or dragged, and speeds are typed."""

from typing import NamedTuple

from robocov.environment import ObstaclePath, Point
from robocov_app.editor.edits import paths
from robocov_app.editor.model.geometry import format_bearing
from robocov_app.editor.model.hit_test import find_obstacles
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.tools.context import EditorContext
from robocov_app.editor.tools.tool import EditorPointerEvent, EditorTool
from robocov_app.editor.tools.tool_overlay import EditorToolOverlay
from robocov_app.toolkit.tools.tool import CursorShape

WAYPOINT_REACH_FRACTION = 0.75  # of the pointer's reach: waypoints are picked within this distance
LEG_REACH_FRACTION = 0.5  # of the pointer's reach: a click this close to a leg inserts a waypoint
HOVER_REACH_PX = 8.0  # at scale 1: this close to a waypoint, the cursor shows that it can be dragged


class _SelectedPath(NamedTuple):
    """The single selected obstacle and its path; None if there is none."""

    key: int | None = None
    path: ObstaclePath | None = None


class MotionPathTool(EditorTool):
    """Gives the selected obstacle a path, and edits it.

    Attributes
    ----------
    speed : float
        Speed along new paths, m/s.
    chosen : int or None
        Index of the chosen waypoint, which Backspace removes.
    """

    name = "path"
    title = "Path"
    key = "o"
    hint = "click an obstacle, then where it goes; drag waypoints, Backspace removes one; type its speed"

    def __init__(self) -> None:
        super().__init__()
        self.speed = paths.DEFAULT_SPEED_M_S
        self.chosen: int | None = None
        self._dragged: int | None = None  # index of the dragged waypoint
        self._selected = _SelectedPath()  # as of the latest event

    @property
    def is_busy(self) -> bool:
        """Whether an obstacle is selected."""
        return self._selected.key is not None

    @property
    def origin(self) -> Point | None:
        """Last waypoint, m; None without a path."""
        path = self._selected.path
        if path is None:
            return None
        return path.points[-1]

    def press(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Start to drag a waypoint, select an obstacle, or add a waypoint to the selected one."""
        key, path = _find_selected_path(context)
        self.change = None
        self._dragged = None
        if path is not None:
            self._dragged = paths.find_waypoint(
                path, event.unsnapped_point, WAYPOINT_REACH_FRACTION * event.reach
            )
        if self._dragged is not None:
            self.chosen = self._dragged
            return
        obstacles = find_obstacles(context.sketch, event.unsnapped_point, 0.0)
        if obstacles and key not in obstacles:
            self.chosen = None
            context.select(Selection.of(obstacles[0]))
        elif key is None:
            self.chosen = None
            context.show_message("click the obstacle that is to move first")
        elif path is None and key in obstacles:
            context.show_message("now click where it goes")
        else:
            self._add_waypoint(context, event, key, path)
        self._selected = _find_selected_path(context)

    def _add_waypoint(
        self, context: EditorContext, event: EditorPointerEvent, key: int, path: ObstaclePath | None
    ) -> None:
        """Insert a waypoint into the leg under the pointer, or else append it; choose and drag it."""
        inserted: int | None = None  # index of the waypoint in a leg; None if it is appended
        index = 1  # in a new path, whose first waypoint is the obstacle
        if path is not None:
            inserted = paths.find_leg(path, event.unsnapped_point, LEG_REACH_FRACTION * event.reach)
            index = len(path.points) if inserted is None else inserted
        point = event.point
        if inserted is None:
            point = event.constrain(self.origin)
        context.apply(paths.add_waypoint(context.sketch, key, point, inserted, self.speed))
        self.chosen = index
        self._dragged = index

    def double_click(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Finish the path."""
        self.finish(context)

    def move(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Drag a waypoint."""
        self.cursor = event.point
        self._selected = _find_selected_path(context)
        key, path = self._selected
        dragged = self._dragged
        if key is None or dragged is None:
            return
        if path is None or dragged >= len(path.points):
            self._dragged = None
        elif self.change is not None or event.has_moved_from(path.points[dragged]):
            origin = path.points[dragged - 1] if dragged else None
            position = event.constrain(origin)
            self.change = paths.move_waypoint(context.sketch, key, dragged, position)

    def release(self, context: EditorContext, event: EditorPointerEvent, *, is_click: bool) -> None:
        """Apply the drag of a waypoint."""
        change = self.change
        self._dragged = None
        self.change = None
        if change is not None and not is_click:
            context.apply(change)
        self._selected = _find_selected_path(context)

    def finish(self, context: EditorContext) -> None:
        """Clear the selection, so that another obstacle can be chosen."""
        if _find_selected_path(context).key is not None:
            context.select(Selection())
        self.cancel(context)

    def remove_last(self, context: EditorContext) -> bool:
        """Remove the chosen waypoint, or else the last one; return whether there was one."""
        key, path = _find_selected_path(context)
        if key is None or path is None:
            return False
        last = len(path.points) - 1
        chosen = last
        if self.chosen is not None:
            chosen = min(self.chosen, last)
        context.apply(paths.remove_waypoint(context.sketch, key, chosen))
        self.chosen = None
        if len(path.points) > 2:
            self.chosen = max(chosen - 1, 0)
        self._selected = _find_selected_path(context)
        return True

    def cancel(self, context: EditorContext) -> bool:
        """Cancel the drag; return whether there was one."""
        was_dragging = self._dragged is not None
        self._selected = _SelectedPath()
        self._dragged = None
        self.change = None
        self.chosen = None
        return was_dragging

    def enter_text(self, context: EditorContext, text: str) -> None:
        """Set the speed of the selected path and of new paths."""
        speed = paths.parse_speed(text)
        key, path = _find_selected_path(context)
        if key is not None and path is not None:
            context.apply(paths.set_speed(context.sketch, Selection.of(key), speed))
        self.speed = speed

    def build_overlay(self, context: EditorContext) -> EditorToolOverlay:
        """Return the waypoints with the speed and length of the path."""
        pending = self.pending
        key, path = _find_selected_path(context)
        if key is None:
            return EditorToolOverlay(pending=pending)
        if pending is not None:
            path = pending.get_item(key).shape.path
        if path is None:
            return EditorToolOverlay(pending=pending, label=f"where it goes, {self.speed:g} m/s")
        label = paths.describe_path(path)
        if self._dragged:
            leg = format_bearing(path.points[self._dragged - 1], path.points[self._dragged])
            label = f"{leg}; {label}"
        return EditorToolOverlay(pending=pending, label=label, markers=path.points, chosen=self.chosen)

    def choose_cursor(self, context: EditorContext) -> CursorShape:
        """Return the shape of the cursor."""
        if self._dragged is not None:
            return "move"
        path = _find_selected_path(context).path
        if path is None or paths.find_waypoint(path, self.cursor, HOVER_REACH_PX * context.pixel) is None:
            return "cross"
        return "move"


def _find_selected_path(context: EditorContext) -> _SelectedPath:
    """Return the selected obstacle with its path, if exactly one obstacle is selected and nothing else."""
    selection = context.selection.restrict_to(context.sketch)
    if len(selection.items) != 1 or selection.starts or selection.boundary:
        return _SelectedPath()
    (key,) = selection.items
    return _SelectedPath(key, context.sketch.get_item(key).shape.path)
