"""Controls of the editor's window on the page of a phone: their state, and where a drag scrolls."""

from collections.abc import Sequence

from robocov_app.editor.canvas.canvas import measure_legend_height
from robocov_app.editor.editor import Editor
from robocov_app.toolkit.window.layout import Box, Layout, find_scroll_box
from robocov_app.toolkit.window.page_view import WindowControls
from robocov_app.toolkit.window_part import WindowPart


def read_window_controls(
    editor: Editor,
    size: tuple[int, int],
    layout: Layout,
    parts: Sequence[WindowPart],
    *,
    is_covered: bool,
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
    is_covered : bool
        Whether a dialog or the help page covers the map.

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
        is_typing=editor.dialogs.is_typing or any(part.is_typing for part in parts),
        scroll_box=find_scroll_box(size, layout, is_covered=is_covered),
        kind="editor",
        is_drawing=editor.tool.is_busy,
        can_delete=bool(editor.selection),
        is_covered=is_covered,
        map_box=_find_map_box(editor, layout),
    )


def _find_map_box(editor: Editor, layout: Layout) -> Box:
    """Return the part of the arena below the legend."""
    left, top, width, height = layout.arena
    legend_height = min(measure_legend_height(editor, layout.scale), height)
    return Box(left, top + legend_height, width, height - legend_height)
