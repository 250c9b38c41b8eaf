"""Opening the window: with a display or without, from the command line's options."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from robocov.defaults import DEFAULT_LATTICE
from robocov_app.render.picture import standard_layers
from robocov_app.storage.autosave import find_draft_folder
from robocov_app.storage.settings import (
    find_settings_file,
    load_settings,
    merge_changed_settings,
    save_settings,
)
from robocov_app.terminal.output import echo
from robocov_app.toolkit.display import fit_to_screen, get_screen_scale, open_display
from robocov_app.toolkit.faults import FaultLog
from robocov_app.toolkit.layout import SMALLEST
from robocov_app.viewer.costs import Costs
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.clock import FRAME_BUDGET_S
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.workspace import find_recoverable_drafts
from robocov_app.viewer.window import Window

NO_DISPLAY = (
    "no display: the window needs one (over ssh, try ssh -X); --out DIR with --frames N "
    "(of a saved run, with --video) renders without, and robocov run needs none"
)
HEADLESS_FPS = 30  # frames per second of what is rendered without a display


class Settings(BaseModel):
    """Appearance of the window, not what happens in it, kept in the user's folder for settings."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    theme: Literal["light", "dark"] = "light"
    scale: float | None = Field(default=None, ge=0.5, le=4.0)
    width: int = Field(default=1280, ge=900, le=7680)
    height: int = Field(default=720, ge=600, le=4320)
    shown: tuple[str, ...] | None = None
    tab: str = "parameters"
    fade: bool = False
    suggests: bool = True
    recent: tuple[str, ...] = ()


@dataclass
class Launcher:
    """Launch settings of a window."""

    session: Session
    map_name: str
    folder: Path  # where things are saved
    theme: str | None = None  # this and the next two: None for what was used last
    size: tuple[int, int] | None = None
    scale: float | None = None
    also: frozenset[str] = frozenset()  # names of layers
    without: frozenset[str] = frozenset()
    headless: bool = False  # draw without a display, in steps of 1 / `HEADLESS_FPS`, whatever that takes
    served: bool = False  # draw without a display, but live; no settings are kept, drafts below `folder`
    laws: tuple[str, ...] = ()  # names of controllers to choose from beside the built-in ones
    lattice: int = DEFAULT_LATTICE
    file: Path | None = None
    offers_lesson: bool = False
    _usual: set[str] = field(default_factory=set, init=False)  # layers that are shown without these options

    @contextmanager
    def window(self) -> Iterator[Window]:
        """Give the window, with settings from before, which are kept; InputError when there is no display."""
        keeper = None
        try:
            with open_display(headless=self._alone, missing_message=NO_DISPLAY):
                file = None if self._alone else find_settings_file()
                settings, trouble = load_settings(Settings, file)
                window = self._opened(settings)
                window.viewer.say(trouble)
                if found := find_recoverable_drafts(self._drafts):
                    window.offer_recovery(found)
                elif self.offers_lesson and file is not None and not file.exists():
                    window.offer_lesson()
                keeper, begun = window.keeper, self._settings_of(window, settings)
                try:
                    yield window
                    ended = self._settings_of(window, settings)
                    save_settings(merge_changed_settings(settings, begun, ended), file)
                finally:
                    window.viewer.workspace.close()
                    window.viewer.costs.close()
        finally:
            if keeper is not None:  # the window is gone; what is still being saved is waited for
                keeper.finish()
                for words, bad in keeper.poll():
                    if bad:
                        echo(f"robocov: {words}", to_stderr=True)

    @property
    def _alone(self) -> bool:
        return self.headless or self.served

    @property
    def _drafts(self) -> Path | None:
        """The folder for drafts; None if none are kept."""
        if self.headless:
            return None
        return find_draft_folder(self.folder if self.served else None)

    def _opened(self, settings: Settings) -> Window:
        self._usual = {layer.name for layer in standard_layers() if layer.default}
        if settings.shown is not None:
            self._usual = {layer.name for layer in standard_layers()} & set(settings.shown)
        shown = (self._usual | self.also) - self.without
        scale = self.scale or settings.scale or (1.0 if self._alone else get_screen_scale())
        size = self.size or (settings.width, settings.height)
        if self.size is None and self.scale is not None:  # text of that size needs a window of that size
            size = max(size[0], round(SMALLEST[0] * scale)), max(size[1], round(SMALLEST[1] * scale))
        if self.size is None and not self._alone:
            size = fit_to_screen(size)
        if not self.headless:
            self.session.playback.clock.budget = FRAME_BUDGET_S
        costs = Costs(self.lattice, direct=self.headless)
        try:
            viewer = Presenter(
                self.session,
                costs,
                shown,
                self.folder,
                map_name=self.map_name,
                laws=self.laws,
                kept_in=self._drafts,
                file=self.file,
            )
            viewer.theme = self.theme or settings.theme
            viewer.fade, viewer.suggests, viewer.recent = settings.fade, settings.suggests, [*settings.recent]
            window = Window(viewer, size, scale, patient=self.headless)
            window.faults = FaultLog(self._drafts)
            window.contains_faults = not self.headless
        except BaseException:
            costs.close()
            raise
        if self.scale is not None and window.layout.scale < self.scale:
            wide, high = (round(each * self.scale) for each in SMALLEST)
            needs = f"scale {self.scale:g} needs a window of {wide} × {high}"
            viewer.say(f"{needs}: {window.layout.scale:g} it is")
        window.panel.show_tab(settings.tab)
        return window

    def _settings_of(self, window: Window, before: Settings) -> Settings:
        viewer, (width, height) = window.viewer, window.windowed or window.screen.get_size()
        look = {name: getattr(viewer, name) for name in ("theme", "fade", "suggests")}
        shown = viewer.shown - (self.also - self._usual) | (self.without & self._usual)
        kept = {"recent": tuple(viewer.recent), "shown": tuple(sorted(shown)), "tab": window.panel.tab}
        size = {"width": min(max(width, 900), 7680), "height": min(max(height, 600), 4320)}
        return before.model_copy(update=look | kept | size)
