"""The tool rail: a column of icons to the left of the arena, one for each tool."""

from collections.abc import Callable
from typing import Any

from pygame import Rect, Surface

from robocov_app.look.theme import Theme
from robocov_app.toolkit.commands.command import SHIFT_SYMBOL, Command, CommandTable, abbreviate_shift
from robocov_app.toolkit.overlay import draw_edge
from robocov_app.toolkit.sentence_case import to_sentence_case
from robocov_app.toolkit.tools.tool import Tool, Toolbox
from robocov_app.toolkit.widgets.ui import Ui
from robocov_app.toolkit.window.layout import RAIL_WIDTH_PX, Box, Layout
from robocov_app.toolkit.window_part import CommandPart

VIEW_COMMANDS = {"fit": "Whole map", "zoom:in": "Zoom in", "zoom:out": "Zoom out"}
"""Commands of the camera; those that fit are shown below the tools."""

# Lengths in pixels at scale 1.
_MARGIN_PX = 4.0
_BUTTON_HEIGHT_PX = 36.0
_MIN_BUTTON_HEIGHT_PX = 28.0
"""Height to which buttons shrink so that those of the camera fit, too."""
_GAP_PX = 2.0
_GROUP_GAP_PX = 7.0
"""Space between groups, with a line in its middle."""
_GROUP_LINE_PX = 26.0
"""Length of this line."""
_COUNT_TOLERANCE = 1e-6


class ToolRail(CommandPart):
    """Buttons that choose a tool, and buttons for the camera below them.

    Parameters
    ----------
    toolbox : Toolbox
        The tools, and the one in use.
    commands : CommandTable
        The commands of the window; a tool is chosen by ``tool:name``.
    run_command : callable
        Runs the command with a given name.
    """

    # Tooltips next to the rail do not cover other tools.
    tip_side = "right"

    def __init__(
        self, toolbox: Toolbox[Any], commands: CommandTable, run_command: Callable[[str], object]
    ) -> None:
        super().__init__(commands, run_command)
        self._toolbox = toolbox
        self._has_labels = False

    def get_box(self, layout: Layout) -> Box:
        """Return the box of the rail."""
        return layout.rail

    def arrange(self, layout: Layout, theme: Theme) -> None:
        """Adopt a layout and a theme; on a narrow rail without names, tooltips appear at once."""
        super().arrange(layout, theme)
        self._has_labels = layout.rail.width > round(RAIL_WIDTH_PX * layout.scale)
        self.ui.tool_tip.is_immediate = not self._has_labels

    def draw(self, screen: Surface) -> None:
        """Draw the rail, with a line at its right edge."""
        box = self.ui.box
        self.ui.draw(screen)
        draw_edge(screen, Rect(box.right - 1, box.top, 1, box.height), self.ui.theme)
        self.ui.draw_overlays(screen)

    def update(self) -> None:
        """Request a redraw if another tool is in use."""
        self.request_redraw(self._toolbox.current.name)

    def show_content(self, ui: Ui) -> None:
        """Show a button for each tool, in groups, and below them those of the camera."""
        groups = self._toolbox.groups
        count = len(self._toolbox.by_name)
        ui.inset(_MARGIN_PX, _MARGIN_PX, _MARGIN_PX)
        height = ui.box.height / ui.scale - 2 * _MARGIN_PX
        tools_height = height - (len(groups) - 1) * _GROUP_GAP_PX
        pitch = _choose_pitch(count, tools_height)
        for number, group in enumerate(groups):
            if number:
                _show_line(ui)
            ui.row(height=pitch - _GAP_PX, below=_GAP_PX)
            for tool in group:
                is_selected = tool is self._toolbox.current
                tip = _build_tip(tool, self.commands[f"tool:{tool.name}"])
                self._show_button(ui, tool.name, tip, f"tool:{tool.name}", tool.title, selected=is_selected)
        # The tolerance keeps rounding errors from hiding a button that just fits.
        view_count = int((tools_height - count * pitch - _GROUP_GAP_PX) / pitch + _COUNT_TOLERANCE)
        if view_count < 1:
            return
        _show_line(ui)
        ui.row(height=pitch - _GAP_PX, below=_GAP_PX)
        for command, label in list(VIEW_COMMANDS.items())[:view_count]:
            self._show_button(ui, command, self.commands[command].tip, command, label)

    def _show_button(
        self, ui: Ui, icon: str, tip: str, command: str, title: str, *, selected: bool = False
    ) -> None:
        """Show a button with the key of its command."""
        shortcut = _abbreviate_key(self.commands[command].key_text)
        is_clicked = ui.icon_button(
            icon,
            title,
            key=command,
            tip=tip,
            selected=selected,
            shortcut=shortcut,
            has_label=self._has_labels,
        )
        if is_clicked:
            self._run_command(command)


def _choose_pitch(tool_count: int, height: float) -> float:
    """Return the height of a button with the gap below it, at which tools fit, and the camera if possible."""
    max_pitch = _BUTTON_HEIGHT_PX + _GAP_PX
    pitch_with_camera = (height - _GROUP_GAP_PX) / (tool_count + len(VIEW_COMMANDS))
    if pitch_with_camera >= _MIN_BUTTON_HEIGHT_PX + _GAP_PX:
        return min(max_pitch, pitch_with_camera)
    return min(max_pitch, (height + _GAP_PX) / tool_count)


def _build_tip(tool: Tool[Any, Any], command: Command) -> str:
    """Return the tooltip of a tool: its title with its key, and how it is used."""
    return f"{tool.title} ({command.key_text})\n{to_sentence_case(tool.hint)}"


def _show_line(ui: Ui) -> None:
    """Show a short line between two groups."""
    ui.row(height=_GROUP_GAP_PX, below=0)
    cell = ui.cell()
    if ui.surface is None:
        return
    line = Rect(0, 0, ui.px(_GROUP_LINE_PX), 1)
    line.center = cell.center
    draw_edge(ui.surface, line, ui.theme)


def _abbreviate_key(key_text: str) -> str:
    """Return a key that is short enough for the corner of a button; empty if it is too long.

    >>> _abbreviate_key("Shift+S")
    '⇧S'
    """
    short = abbreviate_shift(key_text)
    if len(short.lstrip(SHIFT_SYMBOL)) == 1:
        return short
    return ""
