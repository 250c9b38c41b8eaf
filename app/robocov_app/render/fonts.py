"""Text: DejaVu Sans, which comes with matplotlib (a bare Linux has no fonts), and rendered labels."""

import importlib.util
from functools import lru_cache
from pathlib import Path

import pygame

from robocov.text import escape_controls
from robocov_app.look.colors import Color
from robocov_app.look.labels import shorten_text
from robocov_app.render.surface_cache import kept


@lru_cache(maxsize=2)
def font_path(bold: bool = False) -> Path | None:
    """Return the font's file; matplotlib, which has it, is located, not imported: that takes long."""
    spec = importlib.util.find_spec("matplotlib")
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    for folder in (spec.submodule_search_locations or []) if spec else []:
        path = Path(folder) / "mpl-data" / "fonts" / "ttf" / name
        if path.is_file():
            return path
    return None


@lru_cache(maxsize=64)
def _font(size: int, bold: bool) -> pygame.font.Font:
    return pygame.font.Font(font_path(bold), size)


@kept(8_000_000)
def label(text: str, size: int, color: Color, bold: bool = False) -> pygame.Surface:
    """Return a line of text as a picture, `size` px high; kept, rendering costs more than blitting."""
    return _living(size, bold).render(escape_controls(text, single_line=True), True, color)


def _living(size: int, bold: bool) -> pygame.font.Font:
    """Return the font; a new one where the font module was shut down in between: its fonts are dead."""
    try:
        _font(size, bold).get_height()
    except pygame.error:
        pygame.font.init()
        _font.cache_clear()
    return _font(size, bold)


def text_width(text: str, size: int, bold: bool = False) -> int:
    return _living(size, bold).size(escape_controls(text, single_line=True))[0]


def shortened(text: str, size: int, width: float, bold: bool = False) -> str:
    """Return a text, shortened to a width, px."""
    return shorten_text(text, lambda candidate: text_width(candidate, size, bold), width)
