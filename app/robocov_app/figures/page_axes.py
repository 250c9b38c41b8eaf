"""Axes on a page; for them notebooks show the page that they are on.

It is imported when a page is made: it needs matplotlib.
"""

from __future__ import annotations

from typing import Any, cast

from matplotlib.axes import Axes
from matplotlib.figure import Figure


class PageAxes(Axes):
    """Axes of a page of `robocov_app.figures.page`.

    Without pyplot no notebook would show a figure; and what a cell ends with is the axes.
    """

    def _repr_png_(self) -> tuple[bytes, dict[str, Any]]:
        """Return the page as PNG, how wide it is to be shown, and its words for who cannot see it."""
        from robocov_app.figures.page import figure_png

        page = cast("Figure", self.figure)
        words = [text.get_text() for text in page.texts if text.get_text()]
        # a dot of the page at 100 dots an inch is a pixel of the screen
        return figure_png(page), {"width": round(page.bbox.width * 100 / page.dpi), "alt": "; ".join(words)}
