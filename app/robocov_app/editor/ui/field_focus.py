"""Putting the text cursor into a field of the panel, for commands such as renaming."""

from collections.abc import Callable

from robocov_app.editor.editor import Editor
from robocov_app.editor.model import require
from robocov_app.editor.ui.panel import EditorPanel, find_object_kind


class FieldFocus:
    """Puts the text cursor into fields of the panel.

    Parameters
    ----------
    editor : Editor
        The editor.
    panel : EditorPanel
        The panel.
    arrange : callable
        Lays out the window again once the panel is shown.
    """

    def __init__(self, editor: Editor, panel: EditorPanel, arrange: Callable[[], None]) -> None:
        self._editor = editor
        self._panel = panel
        self._arrange = arrange

    def edit_name(self) -> None:
        """Put the text cursor into the name of the selected object or, if there is none, of the map."""
        if len(self._editor.selection.owners) == 1:
            self._edit_field("object", "name")
        else:
            self._edit_field("map", "title")

    def edit_width(self) -> None:
        """Put the text cursor into the field for the width of the selected wall."""
        require(find_object_kind(self._editor) == "wall", "select one wall first")
        self._edit_field("object", "width")

    def _edit_field(self, tab: str, field: str) -> None:
        """Put the text cursor into a field of a page of the panel."""
        self._editor.shows_panel = True
        self._arrange()
        self._panel.show_tab(tab)
        self._panel.ui.run(None, None)
        self._panel.ui.set_focus(field)
