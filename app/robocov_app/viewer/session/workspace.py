"""Saved and autosaved state of the open session: no work is lost."""

from collections.abc import Collection, Mapping
from pathlib import Path
from time import monotonic
from typing import Any

from robocov_app.terminal.output import free_name
from robocov_app.toolkit import autosave
from robocov_app.viewer.session.file import SUFFIX, load_session, save_session, session_json, session_of
from robocov_app.viewer.session.session import Session

KIND = "robocov-session-draft"

_PAUSE = 0.9  # seconds between two copies of a session that goes on


class Workspace:
    """The file of the session that is open. `path`: its file; None if it never had one."""

    def __init__(
        self, session: Session, folder: Path | None, path: Path | None = None, resumed: Path | None = None
    ) -> None:
        self.session, self.path = session, path
        self._saved = -1 if resumed is not None else session.revision
        self._kept: tuple[int, int] | None = None
        self._when = -_PAUSE
        self._autosaver = autosave.Autosaver(folder, KIND, path, resumed)

    @property
    def unsaved(self) -> bool:
        return self.session.revision != self._saved

    def keep(self, view: Mapping[str, Any]) -> None:
        """Keep a copy aside where something has happened since the last; to be called in every frame."""
        state = self.session.revision, self.session.step_now
        if not self.unsaved or state == self._kept or monotonic() - self._when < _PAUSE:
            return
        if not self.session.can_be_made_again:
            return
        self._kept, self._when = state, monotonic()
        self.session.stow()
        content = session_json(self.session.document, self.session.head, self.session.step_now, view)
        self._autosaver.keep(lambda: {"session": content})

    def save(self, folder: Path, view: Mapping[str, Any], path: Path | None = None) -> Path:
        """Write the session to a file, by default its own or a new one; raises as `require_document`."""
        session = self.session
        session.require_document()
        session.stow()
        target = path or self.path or free_name(folder, session.environment.name.lower() or "session", SUFFIX)
        save_session(target, session.document, session.head, session.step_now, view)
        self.path, self._saved = target, session.revision
        self._autosaver.settle(target)
        return target

    def close(self) -> None:
        self._autosaver.close(discard=not self.unsaved)


def opened(
    path: Path, controllers: Collection[str], folder: Path | None
) -> tuple[Workspace, Mapping[str, Any]]:
    """Return a session from its file, and what is shown of it; MapError, InputError as `load_session`."""
    saved = load_session(path, controllers)
    return Workspace(Session.opened(saved), folder, path), saved.view


def recoverable(folder: Path | None) -> tuple[autosave.Record, ...]:
    return autosave.recoverable(folder, KIND, lambda record: record if "session" in record.content else None)


def offer(work: autosave.Record) -> str:
    where = "never saved" if work.path is None else f"not saved to {work.path.name}"
    count = len(work.content["session"]["touches"]) - 1
    return f"a session of {work.when:%H:%M}, {count} {'touch' if count == 1 else 'touches'}, {where}"


def recovered(
    work: autosave.Record, controllers: Collection[str], folder: Path | None
) -> tuple[Workspace, Mapping[str, Any]]:
    saved = session_of(work.content["session"], str(work.folder), controllers)
    return Workspace(Session.opened(saved), folder, work.path, work.folder), saved.view
