"""Chips of layers: their contents, and how they are drawn."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import pygame
from pygame import Rect

from robocov_app.look.colors import Color, mix
from robocov_app.look.legend import CELL_CENTROID, GOAL, merge_legends
from robocov_app.render.canvas import Canvas, LegendEntry
from robocov_app.render.layers.layer import Layer
from robocov_app.render.scene import Scene
from robocov_app.toolkit.overlay import draw_rounded_box, get_accent_ink, get_field_color
from robocov_app.toolkit.sentence_case import to_sentence_case

ChipKind: TypeAlias = Literal["menu", "layer", "preset", "more", "row"]
"""The button of the menu, a layer in the bar, a preset, the button of the presets, or a layer in the menu."""

# Lengths in pixels at scale 1.
CHIP_HEIGHT_PX = 22.0
CHIP_TEXT_PX = 11.0
KEY_TEXT_PX = 9.5
CHIP_PADDING_PX = 7.0
SYMBOL_WIDTH_PX = 22.0
SYMBOL_GAP_PX = 5.0
ENTRY_GAP_PX = 8.0
CHECK_BOX_PX = 12.0
_RADIUS_PX = 11.0
_ROW_RADIUS_PX = 4.0
_ICON_WIDTH_PX = 16.0

_MARK_TEXTS = {CELL_CENTROID: "centroids", GOAL: "goals"}
"""Texts of the marks that the same layer draws, depending on the controller."""
_DIMMED_ALPHA = 150
"""Opacity, up to 255, of the veil over the symbols of hidden layers."""


@dataclass(frozen=True)
class Chip:
    """A small button that shows or hides something.

    Attributes
    ----------
    kind : ChipKind
    command : str
        Name of the command that a click runs.
    entries : tuple of LegendEntry
        Symbols with their texts; empty for chips with a label only.
    label : str
        Text of a chip without entries.
    is_on : bool
        Whether its layers are visible.
    has_text : bool
        Whether the texts of the entries are shown next to their symbols.
    """

    kind: ChipKind
    command: str
    entries: tuple[LegendEntry, ...] = ()
    label: str = ""
    is_on: bool = False
    has_text: bool = True

    @property
    def texts(self) -> list[str]:
        """The texts that are shown on the chip."""
        if not self.entries:
            return [self.label]
        if not self.has_text:
            return []
        return [entry.text for entry in self.entries]


def build_layer_entries(layer: Layer, scenes: Sequence[Scene]) -> tuple[LegendEntry, ...]:
    """Build the symbols of a layer with their texts, for all panes together.

    Parameters
    ----------
    layer : Layer
    scenes : sequence of Scene
        Scene of each pane.

    Returns
    -------
    tuple of LegendEntry
        Empty if no scene has anything to draw in this layer. A single symbol has the title of the layer, so
        that all chips name what they show and hide in the same way. Symbols with the same meaning share the
        text of the last one. If the controllers of some panes have no goals, the text says so.
    """
    legends = [layer.legend(scene) for scene in scenes if layer.can_draw(scene)]
    entries = merge_legends(legends, lambda entry: entry.key)
    texts = {entry.text for entry in entries}
    chip_entries = []
    for number, entry in enumerate(entries, 1):
        text = layer.title if len(texts) == 1 else entry.text
        text = _MARK_TEXTS.get(entry.text, text)
        text = to_sentence_case(text)
        if entry.text in {other.text for other in entries[number:]}:
            text = ""
        if entry is entries[-1]:
            text += _describe_exceptions(layer, scenes)
        chip_entries.append(LegendEntry(text, entry.draw, entry.style))
    return tuple(chip_entries)


def _describe_exceptions(layer: Layer, scenes: Sequence[Scene]) -> str:
    """Return which controllers have no goals, such as " (not RPF)"; empty if all have some."""
    if not layer.needs_goals:
        return ""
    labels = [scene.label for scene in scenes if not (layer.can_draw(scene) and layer.legend(scene))]
    if not labels:
        return ""
    return f" (not {', '.join(dict.fromkeys(labels))})"


def measure_chip(canvas: Canvas, chip: Chip) -> int:
    """Return the width of a chip in the bar, px."""
    width = 2 * CHIP_PADDING_PX
    if chip.kind == "menu":
        width += _ICON_WIDTH_PX + SYMBOL_GAP_PX
    width += len(chip.entries) * SYMBOL_WIDTH_PX
    width += max(len(chip.entries) - 1, 0) * ENTRY_GAP_PX
    if chip.has_text:
        width += len(chip.entries) * SYMBOL_GAP_PX
    text_width = sum(canvas.measure_text(text, CHIP_TEXT_PX) for text in chip.texts)
    return round(width * canvas.scale + text_width)


def draw_chip(canvas: Canvas, chip: Chip, box: Rect, *, is_hovered: bool) -> None:
    """Draw a chip of the bar or a preset."""
    theme = canvas.theme
    is_filled = chip.is_on and chip.kind != "layer"
    fill = _choose_fill(canvas, chip, is_hovered=is_hovered)
    edge = mix(theme.background, theme.ink, 0.28)
    if chip.is_on:
        edge = mix(theme.background, theme.accent, 0.75)
    radius = round(_RADIUS_PX * canvas.scale)
    draw_rounded_box(canvas.surface, box, fill, edge=edge, radius=radius, width=canvas.scale_width(1.0))
    ink = theme.ink if chip.is_on or chip.kind != "layer" else theme.faint
    if is_filled:
        ink = get_accent_ink(theme)
    x = box.left + CHIP_PADDING_PX * canvas.scale
    if chip.kind == "menu":
        _draw_stack(canvas, x, box.centery, ink)
        x += (_ICON_WIDTH_PX + SYMBOL_GAP_PX) * canvas.scale
    if not chip.entries:
        canvas.draw_text(chip.label, (x, box.centery), size=CHIP_TEXT_PX, color=ink)
    for entry in chip.entries:
        draw_symbol(canvas, entry, x, box.centery, fill, is_on=chip.is_on)
        x += SYMBOL_WIDTH_PX * canvas.scale
        if chip.has_text:
            x += SYMBOL_GAP_PX * canvas.scale
            x += canvas.draw_text(entry.text, (x, box.centery), size=CHIP_TEXT_PX, color=ink)
        x += ENTRY_GAP_PX * canvas.scale


def draw_menu_row(
    canvas: Canvas, chip: Chip, box: Rect, *, title: str, key_text: str, is_hovered: bool
) -> None:
    """Draw a layer in the menu: a check box, its symbol, its title and its key."""
    theme = canvas.theme
    fill = theme.panel
    if is_hovered:
        fill = mix(theme.panel, theme.accent, 0.16)
        radius = round(_ROW_RADIUS_PX * canvas.scale)
        draw_rounded_box(canvas.surface, box, fill, edge=fill, radius=radius)
    size = round(CHECK_BOX_PX * canvas.scale)
    check_box = Rect(box.left + round(5 * canvas.scale), box.centery - size // 2, size, size)
    _draw_check_box(canvas, check_box, is_on=chip.is_on)
    x = check_box.right + SYMBOL_GAP_PX * canvas.scale
    if chip.entries:
        draw_symbol(canvas, chip.entries[0], x, box.centery, fill, is_on=True)
    x += (SYMBOL_WIDTH_PX + SYMBOL_GAP_PX) * canvas.scale
    canvas.draw_text(title, (x, box.centery), size=CHIP_TEXT_PX)
    right = box.right - 6 * canvas.scale
    canvas.draw_text(key_text, (right, box.centery), size=KEY_TEXT_PX, color=theme.faint, anchor="right")


def draw_symbol(canvas: Canvas, entry: LegendEntry, x: float, y: float, fill: Color, *, is_on: bool) -> None:
    """Draw a symbol of the legend from its left end; the symbols of hidden layers are pale."""
    width = SYMBOL_WIDTH_PX * canvas.scale
    entry.draw(canvas, x + width / 2, y)
    if not is_on:
        height = round(0.8 * CHIP_HEIGHT_PX * canvas.scale)
        veil = pygame.Surface((round(width), height), pygame.SRCALPHA, 32)
        veil.fill((*fill, _DIMMED_ALPHA))
        canvas.surface.blit(veil, (round(x), round(y - height / 2)))


def _choose_fill(canvas: Canvas, chip: Chip, *, is_hovered: bool) -> Color:
    theme = canvas.theme
    if chip.is_on and chip.kind != "layer":
        return theme.accent
    fill = get_field_color(theme)
    if chip.is_on:
        fill = mix(fill, theme.accent, 0.10)
    if is_hovered:
        fill = mix(fill, theme.accent, 0.16)
    return fill


def _draw_check_box(canvas: Canvas, box: Rect, *, is_on: bool) -> None:
    """Draw a check box: empty, or filled with the accent color and a check mark."""
    theme = canvas.theme
    radius = round(3 * canvas.scale)
    if not is_on:
        edge = mix(theme.panel, theme.ink, 0.45)
        draw_rounded_box(canvas.surface, box, get_field_color(theme), edge=edge, radius=radius)
        return
    draw_rounded_box(canvas.surface, box, theme.accent, edge=theme.accent, radius=radius)
    corners = [(0.22, 0.52), (0.43, 0.72), (0.78, 0.28)]
    points = [(box.left + x * box.width, box.top + y * box.height) for x, y in corners]
    for start, end in itertools.pairwise(points):
        canvas.draw_line(start, end, get_accent_ink(theme), canvas.scale_width(1.6))


def _draw_stack(canvas: Canvas, x: float, y: float, color: Color) -> None:
    """Draw the icon of a stack of layers."""
    half_width = 0.5 * _ICON_WIDTH_PX * canvas.scale
    half_height = 3.2 * canvas.scale
    middle = x + half_width
    for offset in (3.0, -1.0):
        center = y + offset * canvas.scale
        points = [
            (middle - half_width, center),
            (middle, center + half_height),
            (middle + half_width, center),
        ]
        if offset < 0:
            points.append((middle, center - half_height))
        for start, end in itertools.pairwise(points):
            canvas.draw_line(start, end, color, canvas.scale_width(1.3))
        if offset < 0:
            canvas.draw_line(points[-1], points[0], color, canvas.scale_width(1.3))
