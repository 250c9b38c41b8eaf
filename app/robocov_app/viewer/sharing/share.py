"""Actions of the share menu: they copy the run as text or as a link, and save a copy of the session."""

import shlex
from collections.abc import Callable
from dataclasses import replace

from robocov.errors import ParameterError, format_count
from robocov.mapfile import save_map
from robocov_app.terminal.output import clean_file_stem, find_free_path
from robocov_app.toolkit.window.clipboard import Clipboard
from robocov_app.toolkit.window.window import Remote
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.files.run_saver import list_user_controllers
from robocov_app.viewer.sharing.command_text import build_command, build_session_command, can_be_command
from robocov_app.viewer.sharing.python_text import build_python
from robocov_app.viewer.sharing.shared_run import SharedRun, describe_run


class ShareActions:
    """Actions that share the session of the window.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    get_remote : callable
        Returns the `Remote` that shows the window; None if it is on the screen.

    Attributes
    ----------
    clipboard : Clipboard
        Where texts are copied to.
    """

    def __init__(self, viewer: Presenter, get_remote: Callable[[], Remote | None]) -> None:
        self.clipboard = Clipboard()
        self._viewer = viewer
        self._get_remote = get_remote

    def copy_command(self) -> str:
        """Copy the command that simulates the run; return a message.

        A run that options cannot describe is saved in a session file, which the command runs.
        """
        run, note = self._describe_run()
        if can_be_command(run):
            self.clipboard.put(build_command(run))
            return f"Command copied{note}. Paste it into a terminal."
        path = self._viewer.files.save_copy()
        user_controllers = list_user_controllers(self._viewer.session.timeline.document)
        self.clipboard.put(build_session_command(path, user_controllers))
        return f"Command copied. It runs {path}, because options cannot describe this session."

    def copy_python(self) -> str:
        """Copy the Python script that simulates the run; return a message."""
        run, note = self._describe_run()
        self.clipboard.put(build_python(run))
        if run.later_edits:
            edits = format_count(len(run.later_edits), "later edit")
            return f"Python script copied{note}, without {edits}. A copy of the session has them."
        return f"Python script copied{note}. Paste it into a file or a notebook."

    def save_copy(self) -> str:
        """Save a copy of the session, which a browser downloads; return a message."""
        path = self._viewer.files.save_copy()
        remote = self._get_remote()
        if remote is None:
            # The command has a line of its own, so that it can be told from the sentence.
            return f"Copy saved. To open it, run:\nrobocov demo {shlex.quote(str(path.absolute()))}"
        remote.offer_file(path.name)
        return f"Copy saved: {path.name}. It is in your downloads."

    def copy_link(self) -> str:
        """Copy the link with which others open this window; return a message.

        Raises
        ------
        ParameterError
            If the window is not served.
        """
        remote = self._get_remote()
        if remote is None:
            raise ParameterError("this window has no link; robocov demo --serve opens one that has")
        self.clipboard.put(remote.share_link.address)
        if remote.share_link.is_local:
            return (
                "Link copied, but it opens on this computer only. "
                "To share it in your network, start robocov with --serve --host 0.0.0.0."
            )
        if remote.share_link.opens_own_window:
            return "Link copied. Whoever opens it gets a window of their own."
        return "Link copied. Whoever opens it watches this window, and can ask for control."

    @property
    def has_link(self) -> bool:
        """Whether others can open this window by a link."""
        return self._get_remote() is not None

    def _describe_run(self) -> tuple[SharedRun, str]:
        """Describe the run; if its map was edited, save the map, and return a note on that."""
        files = self._viewer.files
        run = describe_run(self._viewer.session.timeline, files.map_name)
        if not run.has_own_map:
            return run, ""
        stem = clean_file_stem(run.scenario.environment.name.lower(), "map")
        path = find_free_path(files.folder, stem, ".json")
        save_map(run.scenario.environment, path)
        return replace(run, map_name=str(path)), f" with the map {path}"
