"""Opening the viewer's window, with or without a display, and saving its settings."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from robocov.defaults import DEFAULT_LATTICE
from robocov_app.render.layer_catalog import build_standard_layers
from robocov_app.storage.autosave import Draft, find_draft_folder
from robocov_app.storage.settings import (
    find_settings_file,
    load_settings,
    save_changed_settings,
)
from robocov_app.terminal.output import echo
from robocov_app.toolkit.window.display import (
    choose_scale,
    fit_to_screen,
    open_display,
    prefers_reduced_motion,
)
from robocov_app.toolkit.window.exceptions import ExceptionLog
from robocov_app.toolkit.window.layout import MIN_SIZE_PX, explain_reduced_scale
from robocov_app.toolkit.window.window_settings import WindowSettings, limit_window_size
from robocov_app.viewer.costs.costs import Costs
from robocov_app.viewer.messages import NO_DISPLAY
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.recovery import offer_recovery
from robocov_app.viewer.session.clock import FRAME_BUDGET_S
from robocov_app.viewer.session.files.drafts import find_recoverable_drafts
from robocov_app.viewer.session.files.run_saver import RunSaver
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.window.dialogs import build_lesson_offer
from robocov_app.viewer.window.window import ViewerWindow

HEADLESS_FPS = 30  # frames per second of simulated real time without a display


class ViewerSettings(WindowSettings):
    """Appearance of the viewer, saved in the user's settings folder.

    Attributes
    ----------
    theme, scale, width, height, tab, recent
        See `WindowSettings`. Recent files are sessions.
    shown : tuple of str or None
        Names of the visible layers; None for the default ones.
    fade : bool
        Whether trajectories show only the last seconds.
    suggests : bool
        Whether the window suggests what to try.
    motion : bool
        Whether the camera glides when the zoom changes.
    """

    tab: str = "parameters"
    shown: tuple[str, ...] | None = None
    fade: bool = False
    suggests: bool = True
    motion: bool = True


@dataclass
class ViewerLauncher:
    """Opens a window on a session.

    Attributes
    ----------
    session : Session
        The session.
    map_name : str
        Bundled name or path of the session's map.
    folder : Path
        Folder in which files are saved.
    theme : str or None
        ``light`` or ``dark``; None for that of the settings.
    size : tuple of int or None
        Width and height, px; None for those of the settings.
    scale : float or None
        Scale of texts and widgets; None for that of the settings, or one that suits the window.
    shown_layers : frozenset of str
        Layers that are visible in addition to those of the settings.
    hidden_layers : frozenset of str
        Layers that are hidden.
    headless : bool
        Whether to draw without a display; each frame then advances time by 1 / `HEADLESS_FPS`, however long
        it takes.
    served : bool
        Whether to draw for a browser: without a display, but in real time. No settings are saved; drafts are
        in `folder`.
    controllers : tuple of str
        Names of controllers to offer in addition to the built-in ones.
    lattice : int
        Number of sites along the longer side of the map, for the cost.
    file : Path or None
        File of the session.
    offers_lesson : bool
        Whether to offer the lesson when the window is opened for the first time.
    offers_recovery : bool
        Whether to offer to recover unsaved work; the start page has offered it already.
    """

    session: Session
    map_name: str
    folder: Path
    theme: str | None = None
    size: tuple[int, int] | None = None
    scale: float | None = None
    shown_layers: frozenset[str] = frozenset()
    hidden_layers: frozenset[str] = frozenset()
    headless: bool = False
    served: bool = False
    controllers: tuple[str, ...] = ()
    lattice: int = DEFAULT_LATTICE
    file: Path | None = None
    offers_lesson: bool = False
    offers_recovery: bool = True

    @contextmanager
    def window(self) -> Iterator[ViewerWindow]:
        """Open the window with its settings, and at the end save those that were changed.

        Raises
        ------
        InputError
            If there is no display.
        """
        saver: RunSaver | None = None
        try:
            with open_display(headless=self._needs_no_display, missing_message=NO_DISPLAY):
                file = None if self._needs_no_display else find_settings_file()
                settings, message = load_settings(ViewerSettings, file)
                window = self._open_window(settings)
                saver = window.run_saver
                window.viewer.show_message(message)
                self._offer_help(window, file)
                try:
                    with save_changed_settings(settings, file, partial(self._collect_settings, window)):
                        yield window
                finally:
                    window.viewer.files.workspace.close()
                    window.viewer.costs.close()
        finally:
            if saver is not None:
                _wait_for_runs(saver)

    @property
    def _needs_no_display(self) -> bool:
        return self.headless or self.served

    @property
    def _draft_folder(self) -> Path | None:
        """Folder for drafts; None if no drafts are saved."""
        if self.headless:
            return None
        return find_draft_folder(self.folder if self.served else None)

    def _offer_help(self, window: ViewerWindow, settings_file: Path | None) -> None:
        """Offer to recover unsaved work; otherwise, offer the lesson to users who open their first window.

        The session waits while the dialog is open.
        """
        drafts: tuple[Draft, ...] = ()
        if self.offers_recovery:
            drafts = find_recoverable_drafts(self._draft_folder)
        if drafts:
            offer_recovery(window.dialogs, drafts, window.viewer.files.attempt_recovery)
        elif self.offers_lesson and settings_file is not None and not settings_file.exists():
            window.dialogs.ask(build_lesson_offer(window.lesson.toggle))

    def _open_window(self, settings: ViewerSettings) -> ViewerWindow:
        """Open the window with the settings; warn if it is too small for the requested scale."""
        scale = choose_scale(self.scale or settings.scale, has_display=not self._needs_no_display)
        size = self._choose_size(settings)
        if not self.headless:
            self.session.playback.clock.budget = FRAME_BUDGET_S
        costs = Costs(self.lattice, direct=self.headless)
        try:
            viewer = self._build_presenter(costs, settings)
            window = ViewerWindow(viewer, size, scale, is_unattended=self.headless)
            window.guard.log = ExceptionLog(self._draft_folder)
            window.guard.is_enabled = not self.headless
        except BaseException:
            costs.close()
            raise
        if not self.served:  # In a browser, the page chooses the scale.
            self._report_scale(window)
        window.panel.show_tab(settings.tab)
        return window

    def _report_scale(self, window: ViewerWindow) -> None:
        """Report if the window is too small for the requested scale; a dialog may cover its message."""
        message = explain_reduced_scale(self.scale, window.screen.get_size())
        if not message:
            return
        echo(f"robocov: {message}", to_stderr=True)
        if not self.headless:
            window.viewer.show_message(message)

    def _build_presenter(self, costs: Costs, settings: ViewerSettings) -> Presenter:
        """Build the state of the window from the settings and the options that override them."""
        layers = (_list_usual_layers(settings) | self.shown_layers) - self.hidden_layers
        viewer = Presenter(
            self.session,
            costs,
            layers,
            self.folder,
            self.map_name,
            controllers=self.controllers,
            draft_folder=self._draft_folder,
            file=self.file,
        )
        viewer.view.theme = self.theme or settings.theme
        viewer.view.fades_trajectories = settings.fade
        viewer.view.has_suggestions = settings.suggests
        viewer.view.has_motion = settings.motion
        viewer.view.is_motion_reduced = prefers_reduced_motion()
        viewer.files.recent = list(settings.recent)
        return viewer

    def _choose_size(self, settings: ViewerSettings) -> tuple[int, int]:
        """Return the width and height of the window, px: as requested, or from the settings."""
        if self.size is not None:
            return self.size
        width = settings.width
        height = settings.height
        if self.scale is not None:
            # In a smaller window, the requested scale would have to be reduced.
            min_width, min_height = MIN_SIZE_PX
            width = max(width, round(min_width * self.scale))
            height = max(height, round(min_height * self.scale))
        if self._needs_no_display:
            return (width, height)
        return fit_to_screen((width, height))

    def _collect_settings(self, window: ViewerWindow, previous: ViewerSettings) -> ViewerSettings:
        """Return the current settings of a window.

        Layers that options showed or hid stay as in the previous settings.
        """
        viewer = window.viewer
        view = viewer.view
        usual = _list_usual_layers(previous)
        layers = set(view.layers)
        layers -= self.shown_layers - usual
        layers |= self.hidden_layers & usual
        width, height = limit_window_size(window.display.windowed_size or window.screen.get_size())
        changes = {
            "theme": view.theme,
            "fade": view.fades_trajectories,
            "suggests": view.has_suggestions,
            "motion": view.has_motion,
            "recent": tuple(viewer.files.recent),
            "shown": tuple(sorted(layers)),
            "tab": window.panel.tab,
            "width": width,
            "height": height,
        }
        return previous.model_copy(update=changes)


def _list_usual_layers(settings: ViewerSettings) -> set[str]:
    """Return the visible layers of the settings, or by default those that are visible initially."""
    layers = build_standard_layers()
    if settings.shown is None:
        return {layer.name for layer in layers if layer.is_default}
    return {layer.name for layer in layers} & set(settings.shown)


def _wait_for_runs(saver: RunSaver) -> None:
    """After the window has closed, wait until all runs are saved; print errors."""
    saver.finish()
    for message, is_error in saver.poll():
        if is_error:
            echo(f"robocov: {message}", to_stderr=True)
