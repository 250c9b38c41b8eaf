"""Rows of cells that are laid out from top to bottom in a box of the window."""

from pygame import Rect

_ROW_HEIGHT_PX = 26.0
_GAP_PX = 6.0


class RowLayout:
    """Assigns positions to widgets: each takes the next cell of the current row.

    When a row is full, another one with the same cells starts below it. Lengths are in pixels at scale 1,
    relative to the box; rectangles are in pixels of the window.

    Attributes
    ----------
    box : pygame.Rect
        Part of the window in which rows are laid out, px.
    scale : float
        Pixels per unit of length.
    x, y : float
        Position of the upper left corner of the next row in the box.
    width : float
        Width of the rows.
    clip : pygame.Rect
        Part of the window in which widgets are visible, px.
    """

    def __init__(self, scale: float) -> None:
        self.box = Rect(0, 0, 1, 1)
        self.scale = scale
        self.restart()

    def restart(self) -> None:
        """Start at the top of the box again."""
        self.x = 0.0
        self.y = 0.0
        self.width = self.box.width / self.scale
        self.clip = self.box
        self._cells: list[tuple[float, float]] = []
        self._next_cell = 0
        self._row_height = _ROW_HEIGHT_PX
        self._space_below = _GAP_PX

    def px(self, length: float) -> int:
        """Return a length in whole pixels of the window."""
        return round(length * self.scale)

    def inset(self, left: float, top: float, right: float = 0.0) -> None:
        """Leave margins at the sides, and above the next row."""
        self.end_row()
        self.x += left
        self.y += top
        self.width -= left + right

    def row(
        self, *widths: float, height: float = _ROW_HEIGHT_PX, gap: float = _GAP_PX, below: float = _GAP_PX
    ) -> None:
        """Start rows of cells with these widths.

        Parameters
        ----------
        *widths : float
            Widths of the cells. Cells of width 0 share the remaining width. By default there is one cell.
        height : float
            Height of a row.
        gap : float
            Space between cells.
        below : float
            Space below a row.
        """
        self.end_row()
        widths = widths or (0.0,)
        free_width = self.width - sum(widths) - gap * (len(widths) - 1)
        share = free_width / max(widths.count(0), 1)
        self._cells = []
        x = self.x
        for width in widths:
            self._cells.append((x, width or share))
            x += (width or share) + gap
        self._row_height = height
        self._space_below = below

    def end_row(self) -> None:
        """Move below the current row, unless none of its cells has been used."""
        if self._next_cell:
            self.y += self._row_height + self._space_below
        self._next_cell = 0

    def clear_cells(self) -> None:
        """Forget the widths of the cells, so that the next row has a single one."""
        self._cells = []

    def space(self, height: float) -> None:
        """Leave space above the next row."""
        self.end_row()
        self.y += height

    def cell(self) -> Rect:
        """Take the next cell, and return its position in the window, px."""
        if not self._cells:
            self.row()
        if self._next_cell == len(self._cells):
            self.end_row()
        x, width = self._cells[self._next_cell]
        self._next_cell += 1
        left = self.box.left + self.px(x)
        top = self.box.top + self.px(self.y)
        return Rect(left, top, self.px(width), self.px(self._row_height))

    @property
    def rest(self) -> Rect:
        """Part of the box below the last complete row, in pixels of the window."""
        left = self.box.left + self.px(self.x)
        top = self.box.top + self.px(self.y)
        return Rect(left, top, self.px(self.width), max(self.box.bottom - top, 0))
