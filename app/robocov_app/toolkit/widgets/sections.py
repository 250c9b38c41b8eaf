"""Sections of a page that can be collapsed."""

from robocov_app.toolkit.widgets.appearance import SMALL_TEXT_PX, draw_box, draw_focus_ring, draw_text, shade
from robocov_app.toolkit.widgets.page import Page, Widget

_HOVERED_SHADE = 0.06
"""Fraction of the color of text behind a title under the mouse."""


def show_section(page: Page, title: str, *, key: str = "", starts_open: bool = True) -> bool:
    """Show the title of a section; a click on it hides or shows the content.

    Parameters
    ----------
    page : Page
    title : str
    key : str, optional
        By default the title.
    starts_open : bool
        Whether it is open until the first click.

    Returns
    -------
    bool
        Whether the section is open, so that the caller shows its content.
    """
    key = f"section:{key or title}"
    page.row(height=20, below=4)
    rect = page.cell()
    widget = Widget("section", key, rect, title)
    if page.add_clickable(widget):
        page.toggled_sections ^= {key}  # Add the key, or remove it if it is there.
        page.needs_redraw = True
    is_toggled = key in page.toggled_sections
    is_open = starts_open is not is_toggled
    widget.value = is_open
    if page.is_hovered(rect):
        draw_box(page, rect, shade(page, _HOVERED_SHADE))
    symbol = "▸"
    if is_open:
        symbol = "▾"
    draw_text(page, f"{symbol} {title}", rect, page.theme.faint, SMALL_TEXT_PX, bold=True)
    draw_focus_ring(page, rect, key)
    page.row()
    return is_open
