"""Texts: headings, labels and paragraphs."""

from robocov_app.look.colors import Color
from robocov_app.render.fonts import measure_text
from robocov_app.toolkit.overlay import wrap_text
from robocov_app.toolkit.widgets.appearance import SMALL_TEXT_PX, TEXT_PX, draw_text, get_text_size
from robocov_app.toolkit.widgets.page import Page, Widget
from robocov_app.toolkit.widgets.tool_tip import TipDrawing

_NOTE_GAP_PX = 6.0  # at scale 1


def show_header(page: Page, text: str) -> None:
    """Show a heading in a row of its own."""
    page.row(height=18, below=2)
    show_label(page, text, style="header")
    page.row()


def show_label(
    page: Page,
    text: str,
    *,
    key: str = "",
    style: str = "",
    tip: str = "",
    align: str = "left",
    note: str = "",
    drawing: TipDrawing | None = None,
) -> None:
    """Show a line of text in the next cell.

    Parameters
    ----------
    page : Page
    text : str
    key : str, optional
        By default the text.
    style : str
        "header" (small, bold, gray), "unit" (small, gray), "bold", or empty for normal text.
    tip : str
        Tooltip.
    align : str
        "left", "center" or "right".
    note : str
        Small gray text after a text at the left, shown if there is space for it.
    drawing : TipDrawing, optional
        Drawing in the tooltip.
    """
    rect = page.cell()
    page.add_widget(Widget("label", key or text, rect, text, tip=tip, drawing=drawing))
    is_small = style in ("header", "unit")
    color = page.theme.ink
    if is_small:
        color = page.theme.faint
    size = get_text_size(small=is_small)
    is_bold = style in ("header", "bold")
    draw_text(page, text, rect, color, size, bold=is_bold, align=align)
    if note:
        note_rect = rect.copy()
        note_rect.left += measure_text(text, page.px(size), bold=is_bold) + page.px(_NOTE_GAP_PX)
        note_rect.width = rect.right - note_rect.left
        if measure_text(note, page.px(SMALL_TEXT_PX)) <= note_rect.width:
            draw_text(page, note, note_rect, page.theme.faint, SMALL_TEXT_PX)


def show_paragraph(
    page: Page,
    text: str,
    *,
    size: float = TEXT_PX,
    color: Color | None = None,
    bold: bool = False,
    indent: float = 0.0,
) -> None:
    """Show text that is wrapped to the width of the page, over several rows if necessary.

    Parameters
    ----------
    page : Page
    text : str
    size : float
        Height of the text at scale 1, px.
    color : color, optional
    bold : bool
    indent : float
        Additional margin on the left at scale 1, px.
    """
    widths = (indent, 0.0) if indent else (0.0,)
    page.row(*widths, height=size + 4, gap=0, below=1)
    for line in wrap_text(text, page.px(size), page.px(page.width - indent), bold=bold):
        if indent:
            page.cell()
        draw_text(page, line, page.cell(), color or page.theme.ink, size, bold=bold)
    page.row()
