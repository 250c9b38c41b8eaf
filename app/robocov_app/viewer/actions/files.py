"""Actions on files: maps, sessions and drafts of the viewer."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from robocov.environment import Environment
from robocov.errors import InputError, MapError, StartError, format_count
from robocov.mapfile import list_bundled_maps, load_map, save_map
from robocov_app.storage.autosave import Draft
from robocov_app.storage.regular_files import require_regular_file
from robocov_app.terminal.output import clean_file_stem, find_free_path
from robocov_app.viewer.key_hints import (
    explain_download,
    explain_kept_session,
    explain_lesson_start,
    explain_pause,
)
from robocov_app.viewer.model import ViewerModel
from robocov_app.viewer.session.files.drafts import describe_draft, find_recoverable_drafts
from robocov_app.viewer.session.files.session_file import SUFFIX, load_session, save_session
from robocov_app.viewer.session.files.workspace import SessionWorkspace, recover_draft
from robocov_app.viewer.session.session import Session

MAX_RECENT_FILES = 9


class FileActions:
    """Actions that open and save maps and sessions.

    Parameters
    ----------
    viewer : ViewerModel
        The viewer.
    folder : Path
        Folder in which files are saved.
    map_name : str
        Bundled name or path of the open map.
    draft_folder : Path or None
        Folder for drafts of unsaved work; None to keep no drafts.
    file : Path or None
        File of the open session.

    Attributes
    ----------
    folder : Path
        Folder in which files are saved.
    draft_folder : Path or None
        Folder for drafts of unsaved work; None to keep no drafts.
    recent : list of str
        Paths of the sessions used recently, newest first.
    workspace : SessionWorkspace
        File and drafts of the open session.
    before_opening : callable
        Called before a session or a map is opened from a file; it ends a lesson.
    """

    def __init__(
        self,
        viewer: ViewerModel,
        folder: Path,
        *,
        map_name: str = "",
        draft_folder: Path | None = None,
        file: Path | None = None,
    ) -> None:
        """Start with the open session of the viewer."""
        self.folder = folder
        self.draft_folder = draft_folder
        self.recent: list[str] = []
        self.workspace = SessionWorkspace(viewer.session, draft_folder, file)
        self.before_opening: Callable[[], object] = lambda: None
        self._viewer = viewer
        self._map_names = {viewer.session.displayed.environment.name: map_name}

    @property
    def map_name(self) -> str:
        """Bundled name or path of the displayed map, which undo and redo may change."""
        name = self._viewer.session.displayed.environment.name
        return self._map_names.get(name, name)

    @map_name.setter
    def map_name(self, name: str) -> None:
        self._map_names[self._viewer.session.displayed.environment.name] = name

    @property
    def map_title(self) -> str:
        """Name of the displayed map for people: the name of its file, or of a bundled map, as in “Rooms”."""
        path = Path(self.map_name)
        if path.suffix:
            return path.name
        return self._viewer.session.displayed.environment.name

    @property
    def title(self) -> str:
        """Title of the window: the file of the session, or the map while it has none, and the program.

        A dot marks a file that lacks the latest edits.
        """
        file = self.workspace.path
        name = self.map_title if file is None else file.name
        if not name:
            return "robocov"
        if file is not None and self.workspace.has_unsaved_edits:
            name = f"● {name}"
        return f"{name} • robocov"

    @property
    def view(self) -> dict[str, object]:
        """Window settings that are saved in a session file."""
        view = self._viewer.view
        return {"shown": sorted(view.layers), "theme": view.theme, "map": self.map_name}

    def list_maps(self) -> list[str]:
        """Return the names of the maps to choose from: the bundled ones, and the open one."""
        own = [self.map_name] if self.map_name else []
        return list(dict.fromkeys([*list_bundled_maps(), *own]))

    def open_map(self, name: str) -> None:
        """Restart on another map.

        Raises
        ------
        MapError
            If it cannot be read.
        StartError
            If it has no space for the team.
        """
        self._restart_on_map(load_map(name), name)

    def _restart_on_map(self, environment: Environment, name: str) -> None:
        """Restart on a map with the given bundled name or path."""
        self._viewer.session.restart(environment=environment)
        self.map_name = name

    def open_next_map(self, steps: int) -> None:
        """Restart on the next map that the team can use (`steps` 1), or on the previous one (-1)."""
        names = self.list_maps()
        index = names.index(self.map_name) if self.map_name in names else 0
        too_small: list[str] = []
        unreadable: list[str] = []
        unusable: list[str] = []
        for k in range(1, len(names) + 1):
            name = names[(index + steps * k) % len(names)]
            try:
                self.open_map(name)
            except MapError:
                unreadable.append(name)
            except StartError:
                too_small.append(name)
            except InputError:
                # For example, the controller does not accept the map.
                unusable.append(name)
            else:
                break
        robots = format_count(self._viewer.session.timeline.scenario.robots, "robot")
        self._report_skipped_maps(
            {
                f"no space for {robots}": too_small,
                "cannot be read": unreadable,
                "cannot be used": unusable,
            }
        )

    def _report_skipped_maps(self, names_by_reason: Mapping[str, Sequence[str]]) -> None:
        """Show a message with the names of the maps that could not be opened, if there are any."""
        texts = [f"{reason}: {', '.join(names)}" for reason, names in names_by_reason.items() if names]
        if texts:
            self._viewer.show_message("; ".join(texts))

    def save_map(self) -> None:
        """Save the map to a new file."""
        stem = clean_file_stem(Path(self.map_name).stem, "map")
        target = find_free_path(self.folder, stem, ".json")
        save_map(self._viewer.session.displayed.environment, target)
        self.map_name = str(target)
        self._viewer.show_message(self._describe_saved("map", target))

    def _describe_saved(self, kind: str, path: Path) -> str:
        """Return a message with the folder of a saved file; in a browser, on how to download the file."""
        message = f"{kind} saved: {path.absolute()}"
        if self._viewer.hidden_folder is None:
            return message
        return f"{message}. {explain_download(self._viewer.view)}"

    def list_sessions(self) -> list[str]:
        """Return the paths of the session files in the folder."""
        return sorted(str(path) for path in self.folder.glob(f"*{SUFFIX}"))

    def save_session(self, path: Path | None = None) -> None:
        """Save the session to a file, by default to its own or to a new one."""
        saved = self.workspace.save(self.folder, self.view, path)
        self._add_recent(saved)
        self._viewer.show_message(self._describe_saved("session", saved))

    def save_copy(self) -> Path:
        """Save a copy of the session to a new file, and return its path; the session keeps its own file.

        Raises
        ------
        ParameterError
            If the session cannot be recomputed from its edits.
        OutputError
            If the file cannot be written.
        """
        timeline = self._viewer.session.timeline
        timeline.require_reproducible()
        timeline.cache_present()
        if self.workspace.path is None:
            stem = clean_file_stem(self._viewer.session.displayed.environment.name.lower(), "session")
        else:
            stem = self.workspace.path.stem
        target = find_free_path(self.folder, f"{stem}-copy", SUFFIX)
        save_session(target, timeline.document, *timeline.destination, self.view)
        return target

    def open_file(self, path: Path) -> None:
        """Open a file that contains a session or a map.

        Raises
        ------
        InputError
            If it is neither, or cannot be read.
        """
        require_regular_file(path)
        if path.suffix == SUFFIX:
            self.open_session(path)
        elif path.suffix.lower() != ".json":
            raise InputError(
                f"{path}: expected a session ({SUFFIX}) or a map (.json). robocov edit imports other formats."
            )
        else:
            # A file that cannot be read must not end a lesson.
            environment = load_map(str(path))
            self.before_opening()
            self._restart_on_map(environment, str(path))
            self._viewer.show_message(f"map opened: {path}")

    def open_session(self, path: Path) -> None:
        """Open a session file in place of the current session.

        Raises
        ------
        MapError
            If the file cannot be read.
        """
        saved = load_session(path, self._viewer.controllers)
        seek_seconds = self._viewer.session.playback.seek_seconds
        workspace = SessionWorkspace(Session.open(saved, seek_seconds), self.draft_folder, path)
        keeps_draft = self._replace_workspace(workspace, saved.view)
        self._add_recent(path)
        hint = explain_pause(self._viewer.view)
        if saved.lesson is not None:
            hint = explain_lesson_start(self._viewer.view)
        message = f"session opened: {path}. {hint}"
        if keeps_draft:
            message += f" {explain_kept_session(self._viewer.view)}"
        self._viewer.show_message(message)

    def recover(self, draft: Draft | None = None) -> str:
        """Resume unsaved work of an earlier window, by default the newest; return a message."""
        if draft is None:
            drafts = find_recoverable_drafts(self.draft_folder)
            if not drafts:
                return "no unsaved work was found"
            draft = drafts[0]
        seek_seconds = self._viewer.session.playback.seek_seconds
        workspace, view = recover_draft(draft, self._viewer.controllers, self.draft_folder, seek_seconds)
        keeps_draft = self._replace_workspace(workspace, view)
        description = describe_draft(draft)
        recovered = f"recovered: {description[0].lower()}{description[1:]}"
        message = f"{recovered}. {explain_pause(self._viewer.view)}"
        if keeps_draft:
            message += f" {explain_kept_session(self._viewer.view)}"
        return message

    def attempt_recovery(self, draft: Draft) -> None:
        """Resume unsaved work, and show the message or the error."""
        self._viewer.attempt(lambda: self.recover(draft))

    def _add_recent(self, path: Path) -> None:
        name = str(path.absolute())
        others = [recent for recent in self.recent if recent != name]
        self.recent = [name, *others][:MAX_RECENT_FILES]

    def _replace_workspace(self, workspace: SessionWorkspace, view: Mapping[str, Any]) -> bool:
        """Show the session of another workspace, with the map name and the layers in `view`.

        Returns
        -------
        bool
            Whether the previous session can be recovered from a draft, because it has unsaved edits.
        """
        self.before_opening()
        self.workspace.save_draft(self.view, at_once=True)
        keeps_draft = self.workspace.close()
        self.workspace = workspace
        self._viewer.inspection.selected = None
        self._viewer.show_session(workspace.session)
        # While a seek is in progress, the session may still display another run, on another map. The name
        # belongs to the map on which the destination's run starts.
        timeline = workspace.session.timeline
        root = timeline.document.get_path(timeline.destination[0])[0]
        environment_name = root.require_scenario().environment.name
        self._map_names[environment_name] = str(view.get("map") or environment_name)
        layers = view.get("shown")
        if isinstance(layers, list):
            self._viewer.view.layers = set(map(str, layers))
        return keeps_draft
