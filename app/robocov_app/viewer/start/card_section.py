"""The cards of the start page: examples that move, with a title and a text."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from pygame import Rect

from robocov_app.look.colors import mix
from robocov_app.render.fonts import measure_text, render_text, shorten_to_width
from robocov_app.toolkit.overlay import draw_rounded_box, get_accent_ink, wrap_text
from robocov_app.viewer.start.cards import START_CARDS, StartCard, StartChoice
from robocov_app.viewer.start.drawing import StartDrawing
from robocov_app.viewer.start.items import StartItem
from robocov_app.viewer.start.layout import StartLayout
from robocov_app.viewer.start.previews import PreviewStore, draw_run, fit_outline
from robocov_app.viewer.start.sketch import draw_sketch

# Lengths in pixels at scale 1.
_TITLE_PX = 14
_SMALL_TITLE_PX = 12
_TITLE_LINE_PX = 24
_TEXT_PX = 12
_TEXT_LINE_PX = 16
_TEXT_MARGIN_PX = 6
_LABEL_PX = 11
_LABEL_LINE_PX = 18
_BADGE_PX = 18
_PADDING_PX = 10
_GAP_PX = 8
_LABEL_GAP_PX = 3  # between a map and the label below it
_BADGE_RADIUS_PX = 5

_MAX_TEXT_LINES = 2


class CardSection:
    """The cards; each card opens an example.

    Parameters
    ----------
    previews : PreviewStore
        The recorded runs.
    choose : callable
        Called with the choice of a card.
    """

    def __init__(self, previews: PreviewStore, choose: Callable[[StartChoice], None]) -> None:
        self._previews = previews
        self._choose = choose

    def list_items(self, layout: StartLayout) -> list[StartItem]:
        """Return the cards."""
        items: list[StartItem] = []
        for number, (card, box) in enumerate(zip(START_CARDS, layout.cards, strict=True), 1):
            action = partial(self._choose, card.choice)
            draw = partial(self._draw_card, number, card, box)
            items.append(StartItem(f"card:{number}", box, action, draw))
        return items

    def _draw_card(
        self, number: int, card: StartCard, box: Rect, drawing: StartDrawing, is_focused: bool
    ) -> None:
        """Draw an example: its preview above its title and text."""
        theme = drawing.theme
        drawing.draw_frame(box, is_focused=is_focused)
        padding = drawing.px(_PADDING_PX)
        text_height = drawing.px(_TITLE_LINE_PX + _MAX_TEXT_LINES * _TEXT_LINE_PX + _TEXT_MARGIN_PX)
        inner = box.inflate(-2 * padding, -2 * padding)
        picture = Rect(inner.left, inner.top, inner.width, inner.height - text_height)
        if len(card.previews) > 1:
            # Several runs fill the whole width, so the badge would cover the first one.
            badge_width = drawing.px(_BADGE_PX + _GAP_PX)
            picture = Rect(
                picture.left + badge_width, picture.top, picture.width - badge_width, picture.height
            )
        self._draw_preview(card, picture, drawing)
        _draw_badge(number, inner, drawing, is_focused=is_focused)
        y = picture.bottom + drawing.px(_GAP_PX)
        size = _choose_title_size(card.choice.title, inner.width, drawing.scale)
        title = shorten_to_width(card.choice.title, drawing.px(size), inner.width, bold=True)
        drawing.write(title, (inner.left, y), size, theme.ink, bold=True)
        color = mix(theme.background, theme.ink, 0.72)
        lines = wrap_text(card.text, drawing.px(_TEXT_PX), inner.width)[:_MAX_TEXT_LINES]
        for k, line in enumerate(lines):
            y_line = y + (_TITLE_LINE_PX + _TEXT_LINE_PX * k) * drawing.scale
            drawing.write(line, (inner.left, y_line), _TEXT_PX, color)

    def _draw_preview(self, card: StartCard, box: Rect, drawing: StartDrawing) -> None:
        """Draw the recorded runs of a card side by side, or the drawing of a map."""
        theme = drawing.theme
        scale = drawing.scale
        seconds = drawing.seconds
        if not card.previews:
            draw_sketch(drawing.screen, box, theme, scale, seconds=seconds)
            return
        gap = drawing.px(_GAP_PX)
        label_height = drawing.px(_LABEL_LINE_PX) if card.labels else 0
        width = (box.width - gap * (len(card.previews) - 1)) // len(card.previews)
        for k, name in enumerate(card.previews):
            part = Rect(box.left + k * (width + gap), box.top, width, box.height - label_height)
            run = self._previews.runs[name]
            draw_run(drawing.screen, run, part, theme, scale, seconds=seconds, outside=theme.background)
            if card.labels:
                label = render_text(card.labels[k], drawing.px(_LABEL_PX), theme.ink)
                bottom = fit_outline(run.outline, part).bottom + drawing.px(_LABEL_GAP_PX)
                drawing.screen.blit(label, label.get_rect(midtop=(part.centerx, bottom)))


def _choose_title_size(title: str, width: float, scale: float) -> float:
    """Return the size of a title at scale 1, px: smaller if it would not fit into a width."""
    if measure_text(title, round(_TITLE_PX * scale), bold=True) <= width:
        return _TITLE_PX
    return _SMALL_TITLE_PX


def _draw_badge(number: int, box: Rect, drawing: StartDrawing, *, is_focused: bool) -> None:
    """Draw the key of a card in the upper left corner of a box."""
    theme = drawing.theme
    badge = Rect(box.left, box.top, drawing.px(_BADGE_PX), drawing.px(_BADGE_PX))
    fill = theme.accent if is_focused else mix(theme.background, theme.ink, 0.1)
    color = get_accent_ink(theme) if is_focused else theme.ink
    draw_rounded_box(drawing.screen, badge, fill, edge=fill, radius=drawing.px(_BADGE_RADIUS_PX))
    digit = render_text(str(number), drawing.px(_LABEL_PX), color, bold=True)
    drawing.screen.blit(digit, digit.get_rect(center=badge.center))
