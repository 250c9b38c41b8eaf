"""Opens the start page with the settings of the last window, and prepares the viewer meanwhile."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Self

from robocov_app.storage.autosave import Draft, find_draft_folder
from robocov_app.storage.settings import find_settings_file, load_settings
from robocov_app.toolkit.window.display import choose_scale, fit_to_screen, open_display
from robocov_app.toolkit.window.layout import explain_reduced_scale
from robocov_app.toolkit.window.window_settings import WindowSettings
from robocov_app.viewer.messages import NO_DISPLAY
from robocov_app.viewer.session.files.drafts import find_recoverable_drafts
from robocov_app.viewer.start.cards import StartChoice
from robocov_app.viewer.start.page import StartPage, ThemeName
from robocov_app.viewer.start.preparation import Preparation


class StartLauncher:
    """Opens the start page, as a context: the display stays open for the window that follows.

    Parameters
    ----------
    theme : str or None
        ``light`` or ``dark``; None for that of the settings.
    size : tuple of int or None
        Width and height, px; None for those of the settings.
    scale : float or None
        Scale of texts; None for that of the settings, or one that suits the page.
    folder : Path
        Folder in which files are opened.

    Attributes
    ----------
    theme : str
        Theme of the page.
    has_new_theme : bool
        Whether the user has changed the theme.
    size : tuple of int
        Size of the page, px.

    Raises
    ------
    InputError
        If there is no display; on entering the context.
    """

    def __init__(
        self, theme: ThemeName | None, size: tuple[int, int] | None, scale: float | None, folder: Path
    ) -> None:
        self._settings, self._message = load_settings(WindowSettings, find_settings_file())
        self.theme: ThemeName = theme or self._settings.theme
        self.has_new_theme = False
        self.size = size or (self._settings.width, self._settings.height)
        self._requested_size = size
        self._requested_scale = scale
        self._folder = folder
        self._stack = ExitStack()
        self._preparation = Preparation()
        self._has_started = False

    def __enter__(self) -> Self:
        # The window disappears before the preparation is waited for.
        self._stack.callback(self._preparation.close)
        self._stack.enter_context(open_display(headless=False, missing_message=NO_DISPLAY))
        if self._requested_size is None:
            self.size = fit_to_screen(self.size)
        return self

    def __exit__(self, *exception: object) -> None:
        self._stack.close()

    def choose(self, message: str = "") -> StartChoice | None:
        """Show the page until the user has chosen something, and the viewer is ready to open it.

        The first time, the page offers to recover unsaved work.

        Parameters
        ----------
        message : str
            Why the previous choice could not be opened; empty at first.

        Returns
        -------
        StartChoice or None
            None if the user has closed the page.
        """
        drafts: tuple[Draft, ...] = ()
        if not self._has_started:
            drafts = find_recoverable_drafts(find_draft_folder())
        scale = choose_scale(self._requested_scale or self._settings.scale, has_display=True)
        page = StartPage(
            self.size,
            scale,
            theme_name=self.theme,
            recent=[Path(name) for name in self._settings.recent if Path(name).is_file()],
            folder=self._folder,
            drafts=drafts,
            can_open_viewer=lambda: self._preparation.is_ready,
        )
        reduced_scale = explain_reduced_scale(self._requested_scale, page.screen.get_size())
        page.model.show_message(message or self._message or reduced_scale, is_error=bool(message))
        if not self._has_started:
            # The page is visible by now; importing the viewer would have delayed it.
            self._has_started = True
            self._preparation.start()
        page.run()
        self.has_new_theme = self.has_new_theme or page.theme_name != self.theme
        self.theme = page.theme_name
        self.size = page.screen.get_size()
        if page.choice is not None:
            self._preparation.finish()
        return page.choice
