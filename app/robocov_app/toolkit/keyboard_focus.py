"""The keyboard focus of a window: Tab visits the widgets of all its parts, one after the other."""

from collections.abc import Callable, Sequence
from typing import Protocol

from robocov_app.toolkit.window.input import ENTER_KEYS

_ACTIVATION_KEYS = (*ENTER_KEYS, "space")


class FocusGroup(Protocol):
    """A part of a window with widgets that can have the focus, such as a `Page`.

    Attributes
    ----------
    focus : str or None
        Key of the widget with the focus; None if no widget of this group has it.
    """

    focus: str | None

    def list_focusable_keys(self) -> list[str]:
        """Return the keys of the widgets that can have the focus, in the order of Tab."""

    def set_focus(self, key: str) -> None:
        """Give the focus to a widget."""

    def clear_focus(self) -> None:
        """Take the focus away from all widgets of the group."""


class BasicFocusGroup:
    """A group that is not a page of widgets: it stores the key with the focus, and Enter or Space uses it.

    Attributes
    ----------
    focus : str or None
        Key of the element with the focus; see `FocusGroup`.
    """

    def __init__(self) -> None:
        self.focus: str | None = None

    def set_focus(self, key: str) -> None:
        """Give the focus to an element."""
        self.focus = key

    def clear_focus(self) -> None:
        """Take the focus away."""
        self.focus = None

    def handle_key(self, name: str) -> bool:
        """Handle a key while an element has the focus; return whether it was used."""
        if self.focus is None:
            return False
        if name == "escape":
            self.focus = None
            return True
        return name in _ACTIVATION_KEYS and self.activate(self.focus)

    def activate(self, key: str) -> bool:
        """Use the element with the focus; return whether there was anything to do."""
        return False


class KeyboardFocus:
    """Moves the focus through the groups of a window.

    Parameters
    ----------
    list_groups : callable
        Returns the groups that are visible, in the order in which Tab visits them.
    """

    def __init__(self, list_groups: Callable[[], Sequence[FocusGroup]]) -> None:
        self._list_groups = list_groups

    @property
    def group(self) -> FocusGroup | None:
        """The group with the focus; None if no widget has it."""
        return next((group for group in self._list_groups() if group.focus is not None), None)

    def step(self, steps: int) -> None:
        """Give the focus to the widget that is `steps` after the current one; the ends are connected.

        Without a focus, it goes to the first widget, or to the last one if `steps` is negative.

        Parameters
        ----------
        steps : int
        """
        stops: list[tuple[FocusGroup, str]] = []
        current: int | None = None
        for group in self._list_groups():
            for key in group.list_focusable_keys():
                if group.focus == key:
                    current = len(stops)
                stops.append((group, key))
        if not stops:
            return
        if current is None:
            current = -1 if steps > 0 else 0
        target = current + steps
        self.leave()
        group, key = stops[target % len(stops)]
        group.set_focus(key)

    def leave(self) -> None:
        """Take the focus away from all widgets."""
        for group in self._list_groups():
            if group.focus is not None:
                group.clear_focus()
