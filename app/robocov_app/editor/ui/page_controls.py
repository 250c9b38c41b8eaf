"""State of the editor's window that the page of a phone needs, for its buttons and for scrolling."""

from collections.abc import Sequence

from robocov_app.editor.editor import Editor
from robocov_app.toolkit.window.layout import Box, Layout
from robocov_app.toolkit.window.page_view import WindowControls
from robocov_app.toolkit.window_part import WindowPart


def read_page_controls(
    editor: Editor, size: tuple[int, int], layout: Layout, parts: Sequence[WindowPart]
) -> WindowControls:
    """Return the state of the editor that the buttons of a phone's page show.

    Parameters
    ----------
    editor : Editor
        The editor.
    size : (width, height), px
        Size of the window.
    layout : Layout
        Layout of the window.
    parts : sequence of WindowPart
        Top bar, tool rail and panel.

    Returns
    -------
    WindowControls
    """
    return WindowControls(
        theme=editor.theme,
        is_compact=editor.is_compact,
        is_playing=False,
        can_undo=editor.document.history.can_undo,
        tool=editor.tool.name,
        lesson="",
        has_panel=editor.shows_panel,
        is_typing=_is_typing(editor, parts),
        scroll_box=_find_scroll_box(editor, size, layout),
        kind="editor",
        is_drawing=editor.tool.is_busy,
        can_delete=bool(editor.selection),
    )


def _is_typing(editor: Editor, parts: Sequence[WindowPart]) -> bool:
    """Return whether typed text goes to a text field of a part or of the open dialog."""
    pages = [part.ui for part in parts]
    dialogs = editor.dialogs
    if dialogs.ui is not None and dialogs.is_open:
        pages.append(dialogs.ui)
    return any(page.edit is not None for page in pages)


def _find_scroll_box(editor: Editor, size: tuple[int, int], layout: Layout) -> Box | None:
    """Return the part of the window that a vertical drag of a finger scrolls; None if there is none."""
    if editor.dialogs.is_open:
        return Box(0, 0, *size)
    if layout.has_panel:
        return layout.panel
    return None
