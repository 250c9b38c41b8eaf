"""The layer bar: chips over the canvas that explain the visible layers, and show or hide them at a click."""

from collections.abc import Callable, Sequence
from functools import cache

import pygame
from pygame import Rect, Surface

from robocov_app.look.theme import LIGHT, Theme
from robocov_app.render.canvas import Canvas
from robocov_app.render.layers.layer import Layer
from robocov_app.render.scene import Scene
from robocov_app.toolkit.commands.command import CommandTable, abbreviate_shift
from robocov_app.toolkit.keyboard_focus import BasicFocusGroup
from robocov_app.toolkit.overlay import create_flat_canvas, draw_card
from robocov_app.toolkit.tools.pointer import Pixel
from robocov_app.toolkit.widgets.appearance import draw_ring
from robocov_app.toolkit.widgets.tool_tip import TipSide, ToolTip, draw_tool_tip
from robocov_app.toolkit.window.layout import Box, Layout
from robocov_app.viewer.canvas.chip_fitting import fit_chips
from robocov_app.viewer.canvas.layer_chips import (
    CHIP_HEIGHT_PX,
    Chip,
    build_layer_entries,
    draw_chip,
    draw_menu_row,
    measure_chip,
)
from robocov_app.viewer.layer_presets import LAYER_GROUPS, LAYER_PRESETS, find_preset
from robocov_app.viewer.view import ViewState

BAR_HEIGHT_PX = 30.0
"""Height of the strip above the map that the bar takes, at scale 1; it never depends on the layers."""
MENU_COMMAND = "layers"
"""Command that opens and closes the menu of all layers."""
PRESETS_COMMAND = "presets"
"""Command that opens the menu of the presets."""

# Lengths in pixels at scale 1.
_MARGIN_PX = 8.0
_CHIP_GAP_PX = 4.0
_PRESETS_GAP_PX = 8.0
"""Space between the presets and the layers in the menu."""
_FOCUS_MARGIN_PX = 3.0  # between a chip and the ring around it
_MENU_COLUMN_PX = 192.0
_MIN_MENU_COLUMN_PX = 158.0
_MIN_COLUMN_WITH_KEYS_PX = 184.0
_MENU_PADDING_PX = 10.0
_MENU_ROW_PX = 21.0
_MENU_HEADER_PX = 22.0
_MENU_HEADER_TEXT_PX = 11.0
_GROUP_GAP_PX = 6.0


class LayerBar(BasicFocusGroup):
    """Draws the chips and the menu of layers, and turns clicks on them into commands.

    Parameters
    ----------
    view : ViewState
        Visible layers.
    commands : CommandTable
        Commands of the window, for tooltips and keys.
    run_command : callable
        Runs a command by its name.

    Attributes
    ----------
    is_open : bool
        Whether the menu with all layers is shown.
    chips : list of (Chip, Rect)
        Chips of the bar that were drawn last, with their boxes.
    rows : list of (Chip, Rect)
        Presets and layers of the open menu, with their boxes.
    menu_box : Rect
        Box of the menu when it was drawn last, px.
    max_menu_width : float or None
        Maximum width of the menu at scale 1, px; None if it may be as wide as the arena.
    has_presets : bool
        Whether the bar has chips of the presets, which are also in the menu.
    """

    def __init__(self, view: ViewState, commands: CommandTable, run_command: Callable[[str], object]) -> None:
        super().__init__()
        self.is_open = False
        self.chips: list[tuple[Chip, Rect]] = []
        self.rows: list[tuple[Chip, Rect]] = []
        self._view = view
        self._commands = commands
        self._run_command = run_command
        self.menu_box = Rect(0, 0, 0, 0)
        self.max_menu_width: float | None = None
        self.has_presets = True
        self._hovered = ""
        self._offered: set[str] = set()  # layers with a chip: visible now, or hidden one by one
        self._visible: set[str] = set()  # layers that were visible when the bar was drawn last
        self._preset: object = None
        self._tool_tip = ToolTip()
        self._theme = LIGHT
        self._scale = 1.0

    def toggle_menu(self) -> None:
        """Open or close the menu of all layers."""
        self.is_open = not self.is_open

    def find_preset_position(self) -> tuple[int, int]:
        """Return where the menu of the presets opens, px: below the last chip."""
        boxes = [box for _, box in self.chips]
        if not boxes:
            return 0, 0
        return boxes[-1].left, boxes[-1].bottom

    # Keyboard focus

    def list_focusable_keys(self) -> list[str]:
        """Return the chips that can have the focus, in the order of Tab."""
        return [_get_id(chip) for chip, _ in [*self.chips, *self.rows]]

    def activate(self, key: str) -> bool:
        """Run the command of the chip with the focus; return whether there is one."""
        for chip, _ in [*self.chips, *self.rows]:
            if _get_id(chip) == key:
                self._run_command(chip.command)
                return True
        return False

    # Events

    def press(self, pixel: Pixel) -> bool:
        """Handle a press of the left button; return whether it was on the bar or its menu.

        A press elsewhere closes the menu, and still acts on the map.
        """
        self._tool_tip.dismiss()
        self.focus = None
        chip = self._find_chip(pixel)
        if chip is not None:
            self._run_command(chip.command)
            return True
        if self.is_over(pixel):
            return True
        self.is_open = False
        return False

    def hover(self, pixel: Pixel | None) -> None:
        """Record the position of the mouse; None if it has left the window."""
        chip = None if pixel is None else self._find_chip(pixel)
        self._hovered = "" if chip is None else _get_id(chip)
        self._tool_tip.set_hovered(self._hovered)

    def is_over(self, pixel: Pixel) -> bool:
        """Return whether a pixel is on a chip or on the open menu."""
        is_on_menu = self.is_open and self.menu_box.collidepoint(pixel)
        return is_on_menu or self._find_chip(pixel) is not None

    def _find_chip(self, pixel: Pixel) -> Chip | None:
        rows = self.rows if self.is_open else []
        if self.is_open and self.menu_box.collidepoint(pixel):
            chips = rows
        else:
            chips = self.chips
        for chip, box in chips:
            if box.collidepoint(pixel):
                return chip
        return None

    @property
    def frame_key(self) -> object:
        """Values that the frame depends on, besides the layers and the scenes."""
        return self.is_open, self.focus, self._hovered, bool(self._hovered) and self._tool_tip.is_due

    # Drawing

    def draw(
        self, screen: Surface, layout: Layout, theme: Theme, layers: Sequence[Layer], scenes: Sequence[Scene]
    ) -> None:
        """Draw the bar at the top of the arena, and the open menu below it.

        Parameters
        ----------
        screen : pygame.Surface
        layout : Layout
        theme : Theme
        layers : sequence of Layer
            All layers of the panes.
        scenes : sequence of Scene
            The drawn scene of each pane.
        """
        self._theme = theme
        self._scale = layout.scale
        canvas = create_flat_canvas(screen, theme, layout.scale)
        self.chips = self._arrange_bar(canvas, layout.arena, layers, scenes)
        for chip, box in self.chips:
            draw_chip(canvas, chip, box, is_hovered=_get_id(chip) == self._hovered)
        self.rows = []
        if self.is_open:
            self._draw_menu(canvas, layout.arena, layers, scenes)
        self._draw_focus(screen)

    def _arrange_bar(
        self, canvas: Canvas, arena: Box, layers: Sequence[Layer], scenes: Sequence[Scene]
    ) -> list[tuple[Chip, Rect]]:
        """Choose the chips that fit into the bar, and place them."""
        menu = Chip("menu", MENU_COMMAND, label="Layers", is_on=self.is_open)
        left, top, width, _ = arena
        margin = round(_MARGIN_PX * canvas.scale)
        gap = round(_CHIP_GAP_PX * canvas.scale)
        height = round(CHIP_HEIGHT_PX * canvas.scale)
        y = top + round(0.5 * (BAR_HEIGHT_PX - CHIP_HEIGHT_PX) * canvas.scale)
        chips = []
        presets: list[Chip] = []
        if "legend" in self._view.layers:
            chips = self._list_layer_chips(layers, scenes)
            if self.has_presets:
                presets = self._list_preset_chips()

        @cache
        def measure(chip: Chip) -> int:
            return measure_chip(canvas, chip) + gap

        def fits(some_chips: Sequence[Chip]) -> bool:
            return sum(measure(chip) for chip in [menu, *some_chips]) <= width - 2 * margin + gap

        # Few maps have a density, so that the user may not know its shading.
        standard_commands = {
            f"layer:{layer.name}" for layer in layers if layer.is_default and layer.name != "density"
        }
        more = Chip("more", PRESETS_COMMAND, label="…")
        fitted = fit_chips(chips, presets, more, standard_commands, fits)
        placed = []
        x = left + margin
        for chip in [menu, *fitted.layers]:
            placed.append((chip, Rect(x, y, measure(chip) - gap, height)))
            x += measure(chip)
        x = left + width - margin - sum(measure(chip) for chip in fitted.presets) + gap
        for chip in fitted.presets:
            placed.append((chip, Rect(x, y, measure(chip) - gap, height)))
            x += measure(chip)
        return placed

    def _list_layer_chips(self, layers: Sequence[Layer], scenes: Sequence[Scene]) -> list[Chip]:
        """Return a chip for each layer with a symbol that is visible, or was hidden by itself."""
        self._update_offered_layers()
        visible = self._view.layers
        by_name = {layer.name: layer for layer in layers}
        chips = []
        for name in [name for group in LAYER_GROUPS.values() for name in group]:
            if name not in self._offered or name not in by_name:
                continue
            entries = build_layer_entries(by_name[name], scenes)
            if entries:
                chips.append(Chip("layer", f"layer:{name}", entries, is_on=name in visible))
        return chips

    def _update_offered_layers(self) -> None:
        """Add the visible layers to the offered ones; start over if several layers have changed at once."""
        visible = self._view.layers
        preset = find_preset(visible)
        is_new_preset = preset is not None and preset is not self._preset
        # A click changes one layer; presets and lessons change several, and hide what was there before.
        has_many_changes = len(visible ^ self._visible) > 1
        if is_new_preset or has_many_changes:
            self._offered = set()
        self._preset = preset
        self._visible = set(visible)
        self._offered |= visible

    def _list_preset_chips(self) -> list[Chip]:
        current = find_preset(self._view.layers)
        return [
            Chip("preset", f"preset:{preset.name}", label=preset.title, is_on=preset is current)
            for preset in LAYER_PRESETS
        ]

    def _draw_menu(
        self, canvas: Canvas, arena: Box, layers: Sequence[Layer], scenes: Sequence[Scene]
    ) -> None:
        """Draw the menu: the presets, and all layers in groups."""
        by_name = {layer.name: layer for layer in layers}
        scale = canvas.scale
        left, top, width, _ = arena
        if self.max_menu_width is not None:
            width = min(width, round(self.max_menu_width * scale))
        padding = round(_MENU_PADDING_PX * scale)
        menu_width = width - 2 * padding - 2 * round(_MARGIN_PX * scale)
        max_columns = max(int(menu_width / (_MIN_MENU_COLUMN_PX * scale)), 1)
        groups = {
            title: [by_name[name] for name in names if name in by_name]
            for title, names in LAYER_GROUPS.items()
        }
        columns = _divide_into_columns(groups, max_columns)
        column_width = int(min(menu_width / len(columns), _MENU_COLUMN_PX * scale))
        heights = [sum(_measure_group(groups[title]) for title in column) for column in columns]
        presets_height = (CHIP_HEIGHT_PX + _PRESETS_GAP_PX) * scale
        box = Rect(
            left + round(_MARGIN_PX * scale),
            top + round(BAR_HEIGHT_PX * scale),
            len(columns) * column_width + 2 * padding,
            round(presets_height + max(heights) * scale) + 2 * padding,
        )
        self.menu_box = box
        draw_card(canvas.surface, box, canvas.theme, scale)
        self._draw_presets(canvas, box.left + padding, box.top + padding)
        for index, column in enumerate(columns):
            x = box.left + padding + index * column_width
            y = box.top + padding + presets_height
            for title in column:
                y = self._draw_group(canvas, Rect(x, round(y), column_width, 0), title, groups[title], scenes)

    def _draw_presets(self, canvas: Canvas, x: int, y: int) -> None:
        for chip in self._list_preset_chips():
            chip_box = Rect(x, y, measure_chip(canvas, chip), round(CHIP_HEIGHT_PX * canvas.scale))
            draw_chip(canvas, chip, chip_box, is_hovered=_get_id(chip) == self._hovered)
            self.rows.append((chip, chip_box))
            x = chip_box.right + round(_CHIP_GAP_PX * canvas.scale)

    def _draw_group(
        self,
        canvas: Canvas,
        column: Rect,
        title: str,
        layers: Sequence[Layer],
        scenes: Sequence[Scene],
    ) -> float:
        """Draw a heading and the layers of a group below the top of a column; return the end, px."""
        scale = canvas.scale
        x = column.left
        y = float(column.top)
        has_keys = column.width >= _MIN_COLUMN_WITH_KEYS_PX * scale
        row_height = _MENU_ROW_PX * scale
        middle = y + 0.5 * _MENU_HEADER_PX * scale
        heading_x = x + 5 * scale
        canvas.draw_text(
            title, (heading_x, middle), size=_MENU_HEADER_TEXT_PX, color=canvas.theme.faint, bold=True
        )
        y += _MENU_HEADER_PX * scale
        for layer in layers:
            is_on = layer.name in self._view.layers
            entries = build_layer_entries(layer, scenes)
            chip = Chip("row", f"layer:{layer.name}", entries, layer.title, is_on)
            box = Rect(x, round(y), column.width - round(4 * scale), round(row_height))
            key_text = ""
            if has_keys:
                key_text = abbreviate_shift(self._commands[chip.command].key_text)
            is_hovered = _get_id(chip) == self._hovered
            draw_menu_row(canvas, chip, box, title=layer.title, key_text=key_text, is_hovered=is_hovered)
            self.rows.append((chip, box))
            y += row_height
        return y + _GROUP_GAP_PX * scale

    def _draw_focus(self, screen: Surface) -> None:
        """Draw a ring around the chip with the focus; without such a chip, the bar has no focus."""
        for chip, box in [*self.chips, *self.rows]:
            if _get_id(chip) == self.focus:
                margin = round(2 * _FOCUS_MARGIN_PX * self._scale)
                draw_ring(screen, box.inflate(margin, margin), self._theme, self._scale)
                return
        self.focus = None

    def draw_tool_tip(self, screen: Surface) -> None:
        """Draw the tooltip of the chip under the mouse once it is due, also over the tool rail next to it."""
        if not self._hovered or not self._tool_tip.is_due or not pygame.display.get_init():
            return
        for chip, box in [*self.chips, *self.rows]:
            if _get_id(chip) != self._hovered:
                continue
            tip = _describe_chip(chip, self._commands[chip.command].tip)
            side: TipSide = "below"
            page = box
            if (chip, box) in self.rows:
                # Below its row, the tooltip would cover the next one.
                side = "right"
                page = self.menu_box
            draw_tool_tip(screen, tip, self._theme, self._scale, widget=box, page=page, side=side)
            return


def _get_id(chip: Chip) -> str:
    return f"{chip.kind} {chip.command}"


def _describe_chip(chip: Chip, tip: str) -> str:
    """Return the tooltip of a chip: the effect of a click, and the key."""
    if chip.kind in ("layer", "row"):
        verb = "Hide" if chip.is_on else "Show"
        return f"{verb}: {tip}"
    return tip


def _divide_into_columns(groups: dict[str, list[Layer]], max_columns: int) -> list[list[str]]:
    """Distribute groups over columns, in order, so that the columns have about the same height."""
    count = min(max_columns, len(groups))
    columns: list[list[str]] = [[] for _ in range(count)]
    for title in groups:
        shortest = min(
            range(count), key=lambda column: sum(_measure_group(groups[name]) for name in columns[column])
        )
        columns[shortest].append(title)
    return columns


def _measure_group(layers: Sequence[Layer]) -> float:
    """Return the height of a group in the menu, px at scale 1."""
    return _MENU_HEADER_PX + _MENU_ROW_PX * len(layers) + _GROUP_GAP_PX
