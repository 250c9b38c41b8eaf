"""Layout of the start page: boxes of the cards, the thumbnails, the recent sessions and the buttons."""

from dataclasses import dataclass

from pygame import Rect

CARD_COLUMNS = 3
CARD_ROWS = 2

# Lengths in pixels at scale 1.
RECENT_ROW_PX = 40
_MARGIN_PX = 28
_HEADER_PX = 62
_GAP_PX = 14
_RECENT_WIDTH_PX = 176
_MAP_SIZE_PX = (92, 86)
_MAP_GAP_PX = 8
_HEADING_PX = 22
_BUTTON_HEIGHT_PX = 30
_ARROW_WIDTH_PX = 26
_TITLE_TOP_PX = 18
_BUTTON_TOP_PX = 16
_BUTTON_GAP_PX = 8
_BUTTON_WIDTHS_PX = (56, 62, 108)  # from right to left: help, theme, open
_ROW_PADDING_PX = 8  # between the left edge of a recent session and its text
_MAX_CARD_ASPECT = 1.5
"""Width of a card divided by its height, at most; wider windows leave a margin."""


@dataclass(frozen=True)
class StartLayout:
    """Boxes of the start page, px.

    Attributes
    ----------
    scale : float
        Scale of texts and lengths.
    title, maps_title : (x, y)
        Upper left corners of texts.
    cards : tuple of Rect
    maps : tuple of Rect
        As many thumbnails as fit.
    recent : Rect
        The list of recent sessions; its width is 0 if there are none.
    open_button, theme_button, help_button, back_button, forward_button : Rect
    """

    scale: float
    title: tuple[int, int]
    maps_title: tuple[int, int]
    cards: tuple[Rect, ...]
    maps: tuple[Rect, ...]
    recent: Rect
    open_button: Rect
    theme_button: Rect
    help_button: Rect
    back_button: Rect
    forward_button: Rect

    def get_recent_row(self, row: int) -> Rect:
        """Return the box of a recent session."""
        height = round(RECENT_ROW_PX * self.scale)
        top = self.recent.top + round(_HEADING_PX * self.scale) + row * height
        return Rect(self.recent.left - round(_ROW_PADDING_PX * self.scale), top, self.recent.width, height)


def build_start_layout(size: tuple[int, int], scale: float, map_count: int, has_recent: bool) -> StartLayout:
    """Lay out the start page.

    Parameters
    ----------
    size : (width, height), px
    scale : float
        Scale of texts and lengths.
    map_count : int
        Number of maps.
    has_recent : bool
        Whether there are recent sessions.

    Returns
    -------
    StartLayout
    """

    def px(length: float) -> int:
        return round(length * scale)

    width, height = size
    maps_height = px(_HEADING_PX + _MAP_SIZE_PX[1])
    cards_height = height - px(_HEADER_PX + _GAP_PX + _MARGIN_PX) - maps_height
    recent_width = px(_RECENT_WIDTH_PX) if has_recent else 0
    recent_gap = px(2 * _GAP_PX) if has_recent else 0
    card_height = (cards_height - (CARD_ROWS - 1) * px(_GAP_PX)) // CARD_ROWS
    max_cards_width = CARD_COLUMNS * round(_MAX_CARD_ASPECT * card_height) + (CARD_COLUMNS - 1) * px(_GAP_PX)
    free_width = width - 2 * px(_MARGIN_PX) - recent_width - recent_gap
    cards_width = min(free_width, max_cards_width)
    content_width = cards_width + recent_gap + recent_width
    left = (width - content_width) // 2
    right = left + content_width
    cards = _place_cards(Rect(left, px(_HEADER_PX), cards_width, cards_height), px(_GAP_PX))
    maps_top = px(_HEADER_PX) + cards_height + px(_GAP_PX)
    maps, arrows = _place_maps(left, right, maps_top + px(_HEADING_PX), scale, map_count)
    buttons = _place_buttons(right, scale)
    recent = Rect(left + cards_width + recent_gap, px(_HEADER_PX), recent_width, cards_height)
    return StartLayout(
        scale=scale,
        title=(left, px(_TITLE_TOP_PX)),
        maps_title=(left, maps_top),
        cards=cards,
        maps=maps,
        recent=recent,
        open_button=buttons[0],
        theme_button=buttons[1],
        help_button=buttons[2],
        back_button=arrows[0],
        forward_button=arrows[1],
    )


def _place_cards(box: Rect, gap: int) -> tuple[Rect, ...]:
    """Return the boxes of the cards in a grid."""
    width = (box.width - (CARD_COLUMNS - 1) * gap) // CARD_COLUMNS
    height = (box.height - (CARD_ROWS - 1) * gap) // CARD_ROWS
    cards: list[Rect] = []
    for row in range(CARD_ROWS):
        for column in range(CARD_COLUMNS):
            x = box.left + column * (width + gap)
            y = box.top + row * (height + gap)
            cards.append(Rect(x, y, width, height))
    return tuple(cards)


def _place_maps(
    left: int, right: int, top: int, scale: float, count: int
) -> tuple[tuple[Rect, ...], tuple[Rect, Rect]]:
    """Return the boxes of the thumbnails that fit, and those of the arrows that show others."""
    width = round(_MAP_SIZE_PX[0] * scale)
    height = round(_MAP_SIZE_PX[1] * scale)
    gap = round(_MAP_GAP_PX * scale)
    arrow = round(_ARROW_WIDTH_PX * scale)
    free = right - left
    fitting = (free + gap) // (width + gap)
    arrows = (Rect(left, top, 0, 0), Rect(right, top, 0, 0))
    if fitting < count:
        fitting = max((free - 2 * (arrow + gap) + gap) // (width + gap), 1)
        arrows = (Rect(left, top, arrow, height), Rect(right - arrow, top, arrow, height))
        left += arrow + gap
        free -= 2 * (arrow + gap)
        # The thumbnails fill the whole width.
        width = (free - (fitting - 1) * gap) // fitting
    visible_count = min(fitting, count)
    return tuple(Rect(left + k * (width + gap), top, width, height) for k in range(visible_count)), arrows


def _place_buttons(right: int, scale: float) -> tuple[Rect, ...]:
    """Return the boxes of the buttons in the header, from left to right."""
    gap = round(_BUTTON_GAP_PX * scale)
    top = round(_BUTTON_TOP_PX * scale)
    height = round(_BUTTON_HEIGHT_PX * scale)
    buttons: list[Rect] = []
    for width_px in _BUTTON_WIDTHS_PX:
        width = round(width_px * scale)
        box = Rect(right - width, top, width, height)
        buttons.append(box)
        right = box.left - gap
    help_button, theme_button, open_button = buttons
    return open_button, theme_button, help_button
