"""The file and the drafts of the open session, which protect against loss of work."""

from collections.abc import Collection, Mapping
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np

from robocov_app.storage import autosave
from robocov_app.terminal.output import clean_file_stem, find_free_path
from robocov_app.viewer.session.files.drafts import DRAFT_KIND
from robocov_app.viewer.session.files.session_file import (
    SUFFIX,
    build_session_content,
    parse_session,
    save_session,
)
from robocov_app.viewer.session.session import Session

DRAFT_PAUSE_S = 0.9
"""Minimum time between two drafts."""
_NEVER_SAVED = -1


class SessionWorkspace:
    """The file and the drafts of the open session.

    Parameters
    ----------
    session : Session
        The session.
    folder : Path or None
        Folder for drafts; None to save no drafts.
    path : Path or None
        File of the session; None if it never had one.
    resumed : Path or None
        Folder of the draft from which the session was recovered.

    Attributes
    ----------
    session : Session
        The session.
    path : Path or None
        File of the session; None if it never had one.
    """

    def __init__(
        self, session: Session, folder: Path | None, path: Path | None = None, resumed: Path | None = None
    ) -> None:
        self.session = session
        self.path = path
        self._saved_revision = session.timeline.document.revision if resumed is None else _NEVER_SAVED
        self._drafted_state = (_NEVER_SAVED, _NEVER_SAVED, _NEVER_SAVED)  # revision, node and step
        self._draft_time = -DRAFT_PAUSE_S
        self._autosaver = autosave.Autosaver(folder, DRAFT_KIND, path, resumed)

    @property
    def has_unsaved_edits(self) -> bool:
        """Whether there are edits that are not saved in the file."""
        return self.session.timeline.document.revision != self._saved_revision

    def save_draft(self, view: Mapping[str, Any], *, at_once: bool = False) -> None:
        """Save a draft if there are unsaved edits that the last draft lacks.

        Parameters
        ----------
        view : mapping
            Displayed layers and theme.
        at_once : bool
            Whether to save the draft even if the last one is recent.
        """
        timeline = self.session.timeline
        head, step = timeline.destination
        # An undo changes neither the revision nor, if nothing was simulated since the edit, the step.
        state = (timeline.document.revision, head.number, step)
        is_needed = self.has_unsaved_edits and state != self._drafted_state and timeline.is_reproducible
        is_recent = monotonic() - self._draft_time < DRAFT_PAUSE_S
        if not is_needed or (is_recent and not at_once):
            return
        self._drafted_state = state
        self._draft_time = monotonic()
        timeline.cache_present()
        content = build_session_content(timeline.document, head, step, view)
        self._autosaver.save_draft(lambda: {"session": content})

    def save(self, folder: Path, view: Mapping[str, Any], path: Path | None = None) -> Path:
        """Save the session.

        Parameters
        ----------
        folder : Path
            Folder for a new file, if the session has none.
        view : mapping
            Displayed layers and theme.
        path : Path or None
            The file; by default the session's own, or a new one.

        Returns
        -------
        Path
            The file to which the session was saved.

        Raises
        ------
        ParameterError
            If the session cannot be recomputed from its edits.
        OutputError
            If the file cannot be written.
        """
        timeline = self.session.timeline
        timeline.require_reproducible()
        timeline.cache_present()
        target = path or self.path
        if target is None:
            stem = clean_file_stem(self.session.displayed.environment.name.lower(), "session")
            target = find_free_path(folder, stem, SUFFIX)
        save_session(target, timeline.document, *timeline.destination, view)
        self.path = target
        self._saved_revision = timeline.document.revision
        self._autosaver.mark_saved(target)
        return target

    def ignore_edits(self) -> None:
        """Treat all edits so far as if they were saved, such as those that a lesson asks for."""
        self._saved_revision = self.session.timeline.document.revision

    def close(self) -> bool:
        """Stop saving drafts.

        Returns
        -------
        bool
            Whether a draft can be recovered, because there are unsaved edits.
        """
        return self._autosaver.close(discard=not self.has_unsaved_edits)


def recover_draft(
    draft: autosave.Draft, controllers: Collection[str], folder: Path | None, seconds: float = np.inf
) -> tuple[SessionWorkspace, Mapping[str, Any]]:
    """Open the session of a draft.

    Parameters
    ----------
    draft : Draft
        The draft.
    controllers : collection of str
        Controllers in users' files that may be loaded, as the user has named them.
    folder : Path or None
        Folder for drafts.
    seconds : float, s
        Maximum time for recomputing the session; see `Session.open`.

    Returns
    -------
    workspace : SessionWorkspace
    view : mapping
        Displayed layers and theme.
    """
    saved = parse_session(draft.content["session"], str(draft.folder), controllers)
    workspace = SessionWorkspace(Session.open(saved, seconds), folder, draft.path, draft.folder)
    return workspace, saved.view
