"""Grids of several panels on a page."""

import math


def choose_column_count(
    count: int,
    aspect: float,
    size: tuple[float, float],
    *,
    row_margin: float = 0.0,
    column_margin: float = 0.0,
) -> int:
    """Choose the number of columns of a grid of panels such that the panels are as large as possible.

    Parameters
    ----------
    count : int
        Number of panels, at least 1.
    aspect : float
        Width of a panel divided by its height.
    size : (float, float), px
        Width and height of the page.
    row_margin, column_margin : float, px
        Space that each row and each column needs in addition to its panels.

    Returns
    -------
    int

    Examples
    --------
    >>> choose_column_count(3, 1.4, (1920, 1080)), choose_column_count(3, 4.0, (1920, 1080))
    (3, 1)
    """

    def rate(columns: int) -> tuple[float, int]:
        """Return a rating of a number of columns: the panel width, then, among equal ones, the columns."""
        rows = math.ceil(count / columns)
        panel_width = size[0] / columns - column_margin
        panel_height = size[1] / rows - row_margin
        width = min(panel_width, panel_height * aspect)
        # Empty places in the last row count as panels of width 0, because they look as if one were missing.
        mean_width = width * count / (rows * columns)
        return round(mean_width, 6), columns

    return max(range(1, count + 1), key=rate)
