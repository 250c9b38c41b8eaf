"""The part of the editor that tools can access: the open map, its selection and the snap settings."""

from collections.abc import Hashable

from robocov.environment import Point, Ring
from robocov_app.editor.model.document import Document
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Owner, Sketch
from robocov_app.editor.tools.handles import Handle, list_handles, list_vertex_owners
from robocov_app.editor.tools.snap_switches import SNAPS
from robocov_app.editor.tools.snap_targets import Dragged, Snapper
from robocov_app.render.surface_cache import LatestValue
from robocov_app.toolkit.tools.snapping import Snap, SnapSettings, snap_point
from robocov_app.toolkit.window.window_model import WindowModel

SNAP_REACH_FRACTION = 0.6  # of the pointer's reach; smaller, so that distant lines do not win over the grid


class EditorContext(WindowModel):
    """The part of the editor that tools can access: the open map, its selection and the snap settings.

    Parameters
    ----------
    document : Document
        The open map.

    Attributes
    ----------
    snaps : set of str
        Names of the snap modes that are on; see `SNAPS`.
    grid : float
        Spacing of the grid, m.
    snap_angle : float
        Lines snap to multiples of this angle, degrees.
    wall_width : float
        Width of new walls, m.
    pixel : float
        Side length of a pixel at scale 1, m.
    """

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self.snaps = set(SNAPS)
        self.grid = 0.1
        self.snap_angle = 15.0
        self.wall_width = 0.1
        self.pixel = 0.01
        self.snapper = Snapper()
        self._handles: LatestValue[tuple[Handle, ...]] = LatestValue()

    @property
    def sketch(self) -> Sketch:
        """The current state of the map."""
        return self.document.history.sketch

    @property
    def selection(self) -> Selection:
        """The selected objects and vertices."""
        return self.document.history.selection

    @property
    def vertex_owners(self) -> tuple[Owner, ...]:
        """Objects whose vertices are shown."""
        return list_vertex_owners(self.selection)

    @property
    def handles(self) -> tuple[Handle, ...]:
        """Handles of the selection."""
        sketch = self.sketch
        selection = self.selection
        pixel = self.pixel
        return self._handles.get_or_compute(
            sketch, (selection, pixel), lambda: list_handles(sketch, selection, pixel)
        )

    def build_snap_settings(self, reach: float) -> SnapSettings:
        """Build the snap settings for a pointer with a given reach, m."""
        kinds = frozenset(kind for name in self.snaps for kind in SNAPS[name].kinds)
        return SnapSettings(SNAP_REACH_FRACTION * reach, self.grid, self.snap_angle, kinds)

    def snap(
        self,
        unsnapped: Point,
        reach: float,
        origin: Point | None = None,
        extra_points: Ring = (),
        ignored: Dragged = (),
    ) -> Snap:
        """Snap a position of the pointer to the map.

        Parameters
        ----------
        unsnapped : Point
            Position of the pointer, m.
        reach : float
            Distance within which the pointer picks objects, m.
        origin : Point, optional
            Point at which angles are measured, m.
        extra_points : sequence of Point
            Additional points to snap to, m.
        ignored : iterable of Owner or Vertex
            Objects and vertices to ignore, because they are being dragged.

        Returns
        -------
        Snap
            The snapped point, or the unsnapped one while the targets of a large map are being computed.
        """
        targets = self.snapper.find_targets(self.sketch, ignored, extra_points)
        if targets is None:
            return Snap(unsnapped)
        return snap_point(unsnapped, targets, self.build_snap_settings(reach), origin)

    def apply(self, change: Change, *, drag: Hashable | None = None) -> None:
        """Apply a change; consecutive changes of the same `drag` are undone together."""
        if self.document.history.apply(change, drag=drag):
            self.show_message(change.description)
        self._handle_change()

    def _handle_change(self) -> None:
        self.revision += 1

    def select(self, selection: Selection) -> None:
        """Replace the selection."""
        if selection != self.selection:
            self.document.history.selection = selection
            # Not `_handle_change`: the map is the same, so the draft and the measurement stay.
            self.revision += 1
