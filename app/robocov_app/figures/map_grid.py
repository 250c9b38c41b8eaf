"""A grid of equal maps on a page, each with a caption above it, and a legend below all of them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.artist import Artist

from robocov_app.figures.page import HEADING_SIZE_PT, FigurePage, PageBox, PagePanel

SPACE_WITHOUT_HEADING_PX = 8
"""Space above the captions of a page without a heading, at scale 1, px."""
PAGE_WIDTH_PX = 1600
PAGE_SCALE = 1.5
"""Width of a page, and its scale of texts and lines, if its size is not given."""
_MIN_PAGE_HEIGHT_PX = 320
_PANEL_GAP_PX = 14
"""Space below each panel at scale 1, px."""


@dataclass(frozen=True)
class MapGrid:
    """Arrangement of equal maps in rows and columns, px.

    Attributes
    ----------
    count : int
        Number of maps.
    columns : int
    aspect : float
        Width of a map divided by its height.
    caption_width, caption_height : float
        Width of the widest caption, and height of the captions.
    top : float
        Space above all captions, for the heading.
    """

    count: int
    columns: int
    aspect: float
    caption_width: float
    caption_height: float
    top: float

    def compute_page_height(self, page: FigurePage, handles: Sequence[Artist], max_height: int) -> int:
        """Return the height at which the maps fill the width of a page, as far as limits permit, px."""
        rows = math.ceil(self.count / self.columns)
        map_width = compute_column_width(page, self.columns)
        row_height = self.caption_height + map_width / self.aspect + _PANEL_GAP_PX * page.scale
        height = self.top + rows * row_height + page.measure_footer(handles)
        return int(min(max(height, _MIN_PAGE_HEIGHT_PX), max_height))

    def arrange(self, page: FigurePage, handles: Sequence[Artist]) -> list[PagePanel]:
        """Return the panels of the maps on a page, with space for a legend and a scale bar below them."""
        panels = self._arrange_above(page, page.measure_footer(handles))
        # Below maps that are narrower than the page, the footer may need more space.
        footer_height = page.measure_footer(handles, bar_left=panels[0].box.left)
        return self._arrange_above(page, footer_height)

    def _arrange_above(self, page: FigurePage, footer_height: float) -> list[PagePanel]:
        """Return the panels of the maps above a footer of a given height, px."""
        return page.arrange_panels(
            self.count,
            self.columns,
            aspect=self.aspect,
            caption_width=self.caption_width,
            caption_height=self.caption_height,
            top=self.top,
            bottom=footer_height,
        )


def compute_column_width(page: FigurePage, columns: int) -> float:
    """Return the width of each of several columns of a page, without the margins between them, px."""
    return (page.size[0] - page.margin) / columns - page.margin


def write_heading(page: FigurePage, text: str, first_box: PageBox, rise: float) -> None:
    """Write a heading `rise` pixels above the first map; an empty heading is left out."""
    if text:
        row = first_box.top - rise
        page.write(text, first_box.left, row, points=HEADING_SIZE_PT, bold=True, max_width=page.content_width)
