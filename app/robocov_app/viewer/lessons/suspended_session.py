"""The session from before a lesson: it is set aside, and restored at the end of the lesson."""

from robocov_app.viewer.presenter import Presenter


class SuspendedSession:
    """The session from before a lesson, and the state of the viewer at that time.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    """

    def __init__(self, viewer: Presenter) -> None:
        """Save a draft of unsaved edits, and remember the state of the viewer."""
        viewer.files.workspace.save_draft(viewer.files.view, at_once=True)
        self._viewer = viewer
        self._workspace = viewer.files.workspace
        self._map_name = viewer.files.map_name
        self._layers = set(viewer.view.layers)
        self._tool = viewer.tool
        self._active_pane = viewer.inspection.active_pane
        self._selected = viewer.inspection.selected

    @property
    def has_work(self) -> bool:
        """Whether the user has done anything in the session."""
        timeline = self._workspace.session.timeline
        return timeline.end_time > 0.0 or timeline.document.revision > 0

    def restore(self) -> None:
        """Show the session again, as it was."""
        viewer = self._viewer
        viewer.files.workspace = self._workspace
        viewer.view.layers = self._layers
        viewer.toolbox.current = self._tool
        viewer.inspection.active_pane = self._active_pane
        viewer.show_session(self._workspace.session)
        # The name is stored for the displayed map, so the session must be shown first.
        viewer.files.map_name = self._map_name
        viewer.inspection.selected = self._selected
