"""A panel of widgets with pages: builds them when something else is wanted, and keeps them up to date."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from robocov_app.viewer.pages import GAP, MARGIN
from robocov_app.viewer.widgets import Widgets

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    import pygame

    from robocov_app.render.theme import Theme
    from robocov_app.viewer.actions import Action
    from robocov_app.viewer.layout import Box, Layout


class Changing(Protocol):
    """What a panel shows.

    Attributes
    ----------
    version : int
        Grows whenever the panel has to look again at what there is.
    """

    version: int


class Paged:
    """Widgets at the right of a window, some always in sight, the rest on pages.

    A panel says in `wanted` on what it depends which widgets there are, makes them in `build`, and in
    `sync` lets them say what is so.

    Parameters
    ----------
    desk : Changing
    actions : iterable of Action
    do : callable
        Does an action by its name.

    Attributes
    ----------
    tab : str
        The page that is open.
    body : Box
        Where the page is, in the window.
    covered : bool
        Something else is drawn in its place: it takes no events.
    widgets : Widgets or None
        None while the panel is hidden.
    """

    tabs: tuple[str, ...] = ()
    tab_widths: tuple[int, ...] = ()

    def __init__(self, desk: Changing, actions: Iterable[Action], do: Callable[[str], None]) -> None:
        self._shown, self._do = desk, do
        self.tab = self.tabs[0]
        self.body: Box = (0, 0, 0, 0)
        self.covered = False
        self.widgets: Widgets | None = None
        self._box: Box = (0, 0, 0, 0)
        self._theme: Theme | None = None
        self._actions = {action.name: action for action in actions}
        self._structure: object = None
        self._version = -1

    # what a panel is

    def wanted(self) -> object:
        """Return all on which it depends what widgets there are."""
        return self.tab

    def build(self, widgets: Widgets) -> None:
        """Make the widgets."""

    def sync(self, widgets: Widgets) -> None:
        """Let the widgets say what is so."""

    # what all panels do

    def arrange(self, layout: Layout, theme: Theme) -> None:
        """Build what another layout and theme need."""
        widgets, self._box, self._theme = self.widgets, layout.panel, theme
        self._structure = None
        if not layout.panel[2]:
            self.stop_typing()
            self.widgets = None
            return
        if widgets is not None and widgets.theme is theme and widgets.scale == layout.scale:
            widgets.resize(layout.size, layout.panel)
        else:
            self.stop_typing()
            self.widgets = Widgets(layout.size, layout.panel, theme, layout.scale, self._actions, self._do)
        self._refresh()

    def show_tab(self, name: str) -> None:
        """Turn to a page."""
        if name in self.tabs:
            self.tab = name
            self._shown.version += 1

    def update(self, seconds: float) -> None:
        """Let the widgets live, and say what is so."""
        if self.widgets is None:
            return
        if self.covered:
            if self.widgets.typed_into is not None or self.widgets.open_menu is not None:
                self.widgets.let_go()
                self.widgets.manager.update(seconds)
            return
        ended = self.widgets.ended()
        if ended or self._version != self._shown.version or self._structure != self.wanted():
            self._refresh()
        self.widgets.manager.update(seconds)

    def fill(self, screen: pygame.Surface) -> None:
        """Draw what is behind the widgets."""
        if self._theme is not None:
            screen.fill(self._theme.panel, self._box)

    def draw(self, screen: pygame.Surface) -> None:
        """Draw the widgets."""
        if self.widgets is not None:
            self.widgets.manager.draw_ui(screen)

    @property
    def busy(self) -> bool:
        """Whether it must keep up with every frame: somebody uses it, or something is different."""
        widgets = self.widgets
        used = widgets is not None and (self.typing or self.unfolded or widgets.held)
        return used or self._version != self._shown.version

    @property
    def typing(self) -> bool:
        """Whether keys go into a field."""
        return self.widgets is not None and self.widgets.typed_into is not None

    def stop_typing(self) -> None:
        """Take the keys away from all fields, and close menus."""
        if self.widgets is not None and (self.typing or self.unfolded):
            self.widgets.let_go()
            self.widgets.ended()
            self._shown.version += 1

    @property
    def unfolded(self) -> bool:
        """Whether a menu is open, which may hang over other things."""
        return self.widgets is not None and not self.covered and self.widgets.open_menu is not None

    def take(self, event: pygame.event.Event) -> bool:
        """Give an event to the widgets; return whether one of them took it."""
        return self.widgets is not None and not self.covered and self.widgets.take(event)

    def _refresh(self) -> None:
        assert self.widgets is not None
        wanted = self.wanted()
        if wanted != self._structure:
            self._structure = wanted
            self.build(self.widgets)
        self.sync(self.widgets)
        self._version = self._shown.version

    def _tabs(self, widgets: Widgets) -> None:
        """Make the buttons that turn to the pages."""
        x = float(MARGIN)
        for name, width in zip(self.tabs, self.tab_widths, strict=True):

            def turn(name: str = name) -> None:
                self.show_tab(name)

            rect = widgets.rect(x, 0, width, 26)
            widgets.button(name.capitalize(), rect, turn, name=f"tab:{name}", style="#small")
            x += width + GAP

    def _place_body(self, widgets: Widgets, y: float) -> None:
        """Take note that the page begins at this height, at scale 1."""
        left, _, width, height = widgets.place
        top = round(y * widgets.scale)
        self.body = (left, top, width, max(height - top, 0))

    def _mark_tabs(self, widgets: Widgets) -> None:
        for name in self.tabs:
            widgets.mark(f"tab:{name}", name == self.tab, ("#chosen_tab", "#small"))
