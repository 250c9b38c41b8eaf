"""Switching a window between the editor and play mode, and back with the changes made in the viewer."""

from __future__ import annotations

from collections.abc import Callable

import pygame

from robocov_app.editor.editor import Editor
from robocov_app.editor.ui.play_mode.map_changes import build_play_change
from robocov_app.editor.ui.play_mode.window import PlayWindow, open_play_window
from robocov_app.toolkit.window.command_window import CommandWindow
from robocov_app.toolkit.window.display import prefers_reduced_motion
from robocov_app.toolkit.window.page_view import PageAppearance


class PlayMode:
    """Shows the viewer in the window of the editor, and returns to the editor.

    Parameters
    ----------
    editor : Editor
        The editor.
    host : CommandWindow
        The window of the editor, which the viewer temporarily replaces.
    arrange : callable
        Lays out the window of the editor again; its size and theme may have changed in play mode.
    waits_for_workers : bool
        Whether to wait for computations instead of running them in the background.

    Attributes
    ----------
    window : PlayWindow or None
        The viewer; None while the map is being edited.
    """

    def __init__(
        self, editor: Editor, host: CommandWindow, arrange: Callable[[], None], *, waits_for_workers: bool
    ) -> None:
        self.window: PlayWindow | None = None
        self._editor = editor
        self._host = host
        self._arrange = arrange
        self._waits_for_workers = waits_for_workers
        self._is_motion_reduced = prefers_reduced_motion()

    def start(self) -> None:
        """Open the map in the viewer, in the same window.

        Raises
        ------
        MapError
            If the map breaks a rule.
        """
        editor = self._editor
        host = self._host
        if editor.toolbox.selector.is_busy:
            # A drag is canceled, but an unfinished drawing is kept.
            editor.toolbox.selector.cancel(editor)
        window = open_play_window(editor, host.display, host.scale, waits_for_workers=self._waits_for_workers)
        view = window.viewer.view
        view.is_motion_reduced = self._is_motion_reduced
        view.is_compact = editor.is_compact
        if editor.is_compact:
            # On a phone, the map needs the space; the page has a button for the panel.
            view.has_panel = False
        window.cursor = host.cursor
        window.model.hidden_folder = host.model.hidden_folder
        self.window = window
        host.replacement = window

    def set_appearance(self, appearance: PageAppearance) -> None:
        """Adopt the appearance that suits the browser page; reduced motion also for later starts."""
        self._is_motion_reduced = appearance.is_motion_reduced
        if self.window is not None:
            self.window.set_appearance(appearance)

    def update(self, seconds: float) -> None:
        """Advance the viewer by a time, s; return to the editor once the user has left the viewer."""
        window = self.window
        if window is None:
            return
        window.frame_rate = self._host.frame_rate
        if not window.returns_to_editor and not window.closed:
            window.update(seconds)
        if window.returns_to_editor or window.closed:
            self._end(window)
        else:
            window.save_draft()

    def _end(self, window: PlayWindow) -> None:
        """Return to the editor, or quit if the window was closed."""
        host = self._host
        window.close()
        window.run_saver.finish()
        self.window = None
        host.replacement = None
        self._adopt_changes(window)
        # If the key is still held down, its repetitions must not start play mode again.
        if pygame.key.get_pressed()[pygame.K_F5]:
            host.commands.reset_keys(pygame.K_F5)
        else:
            host.commands.reset_keys()
        self._arrange()
        self._editor.revision += 1
        if window.returns_to_editor:
            host.draw()
        else:
            host.run_command("quit")

    def _adopt_changes(self, window: PlayWindow) -> None:
        """Apply the theme of the viewer, and its changes of obstacles unless it has opened another map."""
        editor = self._editor
        viewer = window.viewer
        editor.theme = viewer.view.theme
        environment = viewer.session.displayed.environment
        change = build_play_change(editor.sketch, viewer.files.edited_map, environment)
        if change is not None and not viewer.files.has_left_edited_map:
            editor.apply(change)
        editor.document.update_draft()

    def close(self) -> None:
        """Save a draft of the map, and end the viewer if it is open."""
        if self.window is not None:
            self.window.save_draft(force=True)
            self.window.close()
