"""Drafts of the edited map in play mode."""

from time import monotonic

from robocov.environment import Environment
from robocov_app.editor.model.document import Document
from robocov_app.editor.ui.play_mode.map_changes import build_play_change

DRAFT_PAUSE_S = 1.0  # minimum time between two drafts of a map in play mode


class PlayDrafts:
    """Saves drafts of the edited map with the changes made in the viewer, at most once a second.

    Parameters
    ----------
    document : Document
        Document of the edited map.
    edited_map : Environment
        The map as it was in the editor.
    """

    def __init__(self, document: Document, edited_map: Environment) -> None:
        self._document = document
        self._edited_map = edited_map
        self._drafted = edited_map
        self._due = 0.0

    def save(self, environment: Environment, *, force: bool) -> None:
        """Save a draft if the map has changed; with `force`, even soon after the previous one."""
        now = monotonic()
        if environment is self._drafted or (now < self._due and not force):
            return
        self._drafted = environment
        self._due = now + DRAFT_PAUSE_S
        change = build_play_change(self._document.history.sketch, self._edited_map, environment)
        if change is None:
            self._document.update_draft()
        else:
            self._document.save_draft(change.sketch)
