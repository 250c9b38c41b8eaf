"""Layout of a page about the coverage cost: curves, maps, captions, color scale and footer."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist

from robocov_app.figures.curves import CurveMargins, TimeCurve, compute_right_margin
from robocov_app.figures.page import TEXT_SIZE_PT, TITLE_SIZE_PT, FigurePage, PageBox, PagePanel
from robocov_app.look.theme import Theme

DEFAULT_WIDTH_PX = 1500
MAX_HEIGHT_PX = 2600
MAX_MAP_HEIGHT_PX = 760
MAX_ASPECT_BESIDE = 1.9
"""Maximum width / height of a map to the right of the curves; a wider map is below them."""
CAPTION_TITLE_SIZE_PT = TEXT_SIZE_PT + 1.5
"""Text size of the title above a map."""
BAR_WIDTH_PX = 190
"""Width of the color scale at scale 1, px."""
BAR_INDENT_PX = 14
"""Space between the color scale and the right edge of the maps at scale 1, px."""
CURVE_MARGINS = CurveMargins(left=34, top=34, bottom=50, right=38)
_DEFAULT_SCALE = 1.3
_MAX_MAPS_FRACTION = 0.5
"""Maximum width of a map next to the curves, as a fraction of the width of the page."""
_MAX_MAPS_IN_ROW = 3
"""Maximum number of maps side by side; more maps form a grid."""
_GRID_ASPECT = 1.6
"""Approximate width / height of a grid of maps."""
_MIN_WIDTH_PX = 840.0
_MIN_HEIGHT_PX = 320.0
_MIN_HEIGHT_BESIDE_PX = 480
"""Minimum height of a page with a map next to the curves, px at scale 1."""
_MAX_CURVES_FRACTION = 0.4
"""Maximum height of curves above maps, as a fraction of the height of both."""
# Lengths at scale 1, px.
_HEAD_PX = 46
_CURVES_HEIGHT_PX = 290
_CAPTION_HEIGHT_PX = 50
_PANEL_GAP_PX = 16
_BAR_ROW_PX = 26
_BAR_ROW_BELOW_CURVES_PX = 24
_TITLE_GAP_PX = 24
"""Minimum space between the title and the label of the color scale in the same row."""
_LAST_TICK_SPACE_PX = 14
"""Space to the right of a time axis for half of its last tick label."""


@dataclass(frozen=True)
class CoverageContents:
    """Content of a page about the coverage cost.

    Attributes
    ----------
    title : str
    captions : list of (str, str)
        Title and facts above each map.
    aspect : float
        Width / height of a map.
    end_curves : sequence of TimeCurve
        Curves at the bottom of the page if there are curves next to a map; empty without curves.
    handles : list of matplotlib.artist.Artist
        Entries of the legend in the footer.
    """

    title: str
    captions: list[tuple[str, str]]
    aspect: float
    end_curves: Sequence[TimeCurve]
    handles: list[Artist]

    @property
    def map_count(self) -> int:
        """Number of maps."""
        return len(self.captions)

    @property
    def is_beside(self) -> bool:
        """Whether the only map is to the right of the curves."""
        return bool(self.end_curves) and self.map_count == 1 and self.aspect < MAX_ASPECT_BESIDE

    @property
    def is_below(self) -> bool:
        """Whether the maps are below the curves."""
        return bool(self.end_curves) and not self.is_beside


@dataclass(frozen=True)
class CoverageArrangement:
    """Positions of the contents of a page, px.

    Attributes
    ----------
    curves, maps : PageBox
        Areas of the curves, and of the maps with their captions.
    panels : list of PagePanel
        Panel of each map.
    bar_row : float
        Vertical middle of the color scale.
    bar_min_left : float
        Leftmost position of the color scale and its label.
    footer_left : float
        Leftmost position of the legend below the maps.
    is_below : bool
        Whether the maps are below the curves.
    """

    curves: PageBox
    maps: PageBox
    panels: list[PagePanel]
    bar_row: float
    bar_min_left: float
    footer_left: float
    is_below: bool


def create_coverage_page(
    contents: CoverageContents, theme: Theme, size: tuple[int, int] | None
) -> tuple[FigurePage, CoverageArrangement]:
    """Create a page, and arrange curves and maps on it.

    Parameters
    ----------
    contents : CoverageContents
    theme : Theme
    size : (width, height) or None, px
        Without a size, the page is as large as its maps need.

    Returns
    -------
    page : FigurePage
    arrangement : CoverageArrangement
    """
    if size is None:
        # A page of any height serves to measure texts; its final height is chosen below.
        page = FigurePage((DEFAULT_WIDTH_PX, 1000), theme, _DEFAULT_SCALE)
        page = FigurePage((_choose_width(page, contents), 1000), theme, _DEFAULT_SCALE)
    else:
        page = FigurePage(size, theme)
    curves_width = _compute_curves_width(page, contents, has_fixed_size=size is not None)
    footer_left = page.margin
    if contents.is_beside:
        footer_left = _find_curves_end(page, contents.end_curves, curves_width)
    footer_height = page.measure_footer(contents.handles, footer_left)
    page, arrangement = _arrange_page(page, contents, size, curves_width, footer_left, footer_height)
    # Below maps that are narrower than their area, the footer may need more space.
    bar_left = arrangement.panels[0].box.left
    final_footer_height = page.measure_footer(contents.handles, footer_left, bar_left)
    if final_footer_height > footer_height:
        return _arrange_page(page, contents, size, curves_width, footer_left, final_footer_height)
    return page, arrangement


def _choose_width(page: FigurePage, contents: CoverageContents) -> int:
    """Return the width that a page of a free size needs, px: less than the default for a few narrow maps."""
    count = contents.map_count
    if contents.end_curves or count > _MAX_MAPS_IN_ROW:
        return DEFAULT_WIDTH_PX
    slot_width = max(MAX_MAP_HEIGHT_PX * contents.aspect, _measure_captions(page, contents))
    maps_width = count * slot_width + (count - 1) * _PANEL_GAP_PX * page.scale
    return int(np.clip(maps_width + 2 * page.margin, _MIN_WIDTH_PX, DEFAULT_WIDTH_PX))


def _measure_captions(page: FigurePage, contents: CoverageContents) -> float:
    """Return the width of the widest line above a map, px."""
    widths = [0.0]
    for title, facts in contents.captions:
        widths.append(page.measure_text(title, points=CAPTION_TITLE_SIZE_PT, bold=True))
        widths.append(page.measure_text(facts))
    return max(widths)


def _compute_curves_width(page: FigurePage, contents: CoverageContents, *, has_fixed_size: bool) -> float:
    """Return the width to the left of a map that is next to the curves, px; 0 if there are none.

    The map gets at most half of the page, and less if it is tall.
    """
    if not contents.is_beside:
        return 0.0
    width, height = page.size
    max_map_height: float = MAX_MAP_HEIGHT_PX
    if has_fixed_size:
        max_map_height = height - (_HEAD_PX + _CAPTION_HEIGHT_PX) * page.scale
    bar_width = (BAR_WIDTH_PX + 2 * BAR_INDENT_PX) * page.scale
    needed = max(max_map_height * contents.aspect, _measure_captions(page, contents), bar_width)
    return width - min(needed + 2 * page.margin, _MAX_MAPS_FRACTION * width)


def _find_curves_end(page: FigurePage, curves: Sequence[TimeCurve], curves_width: float) -> float:
    """Return the left edge of the space to the right of the time axis of curves next to a map, px."""
    right = compute_right_margin(page, curves, CURVE_MARGINS, curves_width - page.margin)
    return curves_width - right + _LAST_TICK_SPACE_PX * page.scale


def _arrange_page(
    page: FigurePage,
    contents: CoverageContents,
    size: tuple[int, int] | None,
    curves_width: float,
    footer_left: float,
    footer_height: float,
) -> tuple[FigurePage, CoverageArrangement]:
    """Arrange the contents above a footer; without a size, on a new page of the height that they need."""
    if size is None:
        maps_width = page.size[0] - curves_width - 2 * page.margin
        height = _choose_height(page, contents, maps_width, footer_height)
        page = FigurePage((page.size[0], height), page.theme, _DEFAULT_SCALE)
    width, height = page.size
    scale = page.scale
    head = _HEAD_PX * scale
    maps_left = curves_width + page.margin
    maps_top = head
    curves = PageBox(page.margin, head, curves_width - page.margin, height - head)
    bar_row = _BAR_ROW_PX * scale
    bar_min_left = page.margin + page.measure_text(contents.title, points=TITLE_SIZE_PT, bold=True)
    bar_min_left += _TITLE_GAP_PX * scale
    if contents.is_below:
        curves_height = _CURVES_HEIGHT_PX * scale
        if size is not None:
            curves_height = min(curves_height, _MAX_CURVES_FRACTION * (height - head - footer_height))
        curves = PageBox(page.margin, head, width - 2 * page.margin, curves_height)
        maps_top = curves.bottom + head
        bar_row = curves.bottom + _BAR_ROW_BELOW_CURVES_PX * scale
        bar_min_left = page.margin
    maps_width = width - page.margin - maps_left
    maps = PageBox(maps_left, maps_top, maps_width, height - footer_height - maps_top)
    arrangement = CoverageArrangement(
        curves=curves,
        maps=maps,
        panels=_arrange_panels(page, maps, contents),
        bar_row=bar_row,
        bar_min_left=bar_min_left,
        footer_left=footer_left,
        is_below=contents.is_below,
    )
    return page, arrangement


def _choose_height(
    page: FigurePage, contents: CoverageContents, maps_width: float, footer_height: float
) -> int:
    """Return the height that a page of a free size needs for its maps, px."""
    scale = page.scale
    count = contents.map_count
    columns = count
    if count > _MAX_MAPS_IN_ROW:
        # With c columns and count / c rows, the aspect of the grid is c² aspect / count.
        columns = min(count, max(1, round(np.sqrt(count * _GRID_ASPECT / contents.aspect))))
    slot_width = (maps_width - (columns - 1) * _PANEL_GAP_PX * scale) / columns
    map_height = min(slot_width / contents.aspect, MAX_MAP_HEIGHT_PX)
    slot_height = map_height + (_CAPTION_HEIGHT_PX + _PANEL_GAP_PX) * scale
    rows = math.ceil(count / columns)
    maps_height = rows * slot_height - _PANEL_GAP_PX * scale
    head_height = _HEAD_PX * scale
    if contents.is_below:
        head_height = (2 * _HEAD_PX + _CURVES_HEIGHT_PX) * scale
    min_height = _MIN_HEIGHT_PX
    if count == 1 and contents.aspect < MAX_ASPECT_BESIDE:
        min_height = _MIN_HEIGHT_BESIDE_PX * scale
    return int(np.clip(head_height + maps_height + footer_height, min_height, MAX_HEIGHT_PX))


def _arrange_panels(page: FigurePage, area: PageBox, contents: CoverageContents) -> list[PagePanel]:
    """Arrange the maps in a grid, as large as possible, each with space for a caption above it.

    Parameters
    ----------
    page : FigurePage
    area : PageBox, px
    contents : CoverageContents

    Returns
    -------
    list of PagePanel
    """
    left, top, width, height = area
    count = contents.map_count
    caption_height = _CAPTION_HEIGHT_PX * page.scale
    gap = _PANEL_GAP_PX * page.scale
    panel_width = 0.0
    columns = 1
    for candidate in range(1, count + 1):
        rows = math.ceil(count / candidate)
        max_width = (width - (candidate - 1) * gap) / candidate
        max_height = (height - (rows - 1) * gap) / rows - caption_height
        # Keep a positive size on a page that is too low.
        candidate_width = min(max_width, max(max_height, 1.0) * contents.aspect)
        # Of equally large arrangements, take the one with more columns.
        if candidate_width >= panel_width:
            panel_width = candidate_width
            columns = candidate
    slot_width = (width - (columns - 1) * gap) / columns
    panel_height = panel_width / contents.aspect
    # A map is in the middle of its slot, or farther left if its caption needs the space.
    caption_space = max(slot_width - _measure_captions(page, contents), 0.0)
    indent = min((slot_width - panel_width) / 2, caption_space)
    panels = []
    for number in range(count):
        row, column = divmod(number, columns)
        x = left + column * (slot_width + gap) + indent
        y = top + row * (panel_height + caption_height + gap) + caption_height
        box = PageBox(x, y, panel_width, panel_height)
        panels.append(PagePanel(box, caption_width=slot_width - indent))
    return panels
