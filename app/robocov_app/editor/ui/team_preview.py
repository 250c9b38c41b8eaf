"""The team at a start, shown on the map while it is edited."""

from robocov_app.editor.canvas.canvas import EditorCanvas
from robocov_app.editor.editor import Editor
from robocov_app.editor.team import TeamRequest, TeamSampler


class TeamPreview:
    """Shows the team at a start on the canvas, sampled in a thread.

    Parameters
    ----------
    editor : Editor
        The editor.
    canvas : EditorCanvas
        The view of the map.
    """

    def __init__(self, editor: Editor, canvas: EditorCanvas) -> None:
        self._editor = editor
        self._canvas = canvas
        self._sampler = TeamSampler()

    def update(self) -> None:
        """Show the team for the current map and start once it is sampled, or why its robots do not fit."""
        editor = self._editor
        if "robots" not in editor.shown:
            return
        request = TeamRequest(editor.sketch, editor.start_name, editor.robots, editor.seed, editor.radius)
        team = self._sampler.poll(request)
        if team is not None:
            self._canvas.team = team
            editor.show_message(team.message, is_error=True)

    def close(self) -> None:
        """End the thread."""
        self._sampler.close()
