"""Text in DejaVu Sans, which matplotlib ships, since minimal Linux systems have no fonts."""

import importlib.util
from functools import lru_cache
from pathlib import Path

import pygame

from robocov.text import escape_controls
from robocov_app.look.colors import Color
from robocov_app.look.labels import shorten_text
from robocov_app.render.surface_cache import cache_surfaces

_CACHE_BYTES = 8_000_000


@lru_cache(maxsize=2)
def find_font_file(*, bold: bool = False) -> Path | None:
    """Return the path of the font in the installation of matplotlib; None if there is none.

    The package is only located, not imported, because importing it takes long.
    """
    matplotlib = importlib.util.find_spec("matplotlib")
    if matplotlib is None:
        return None
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    for folder in matplotlib.submodule_search_locations or []:
        path = Path(folder) / "mpl-data" / "fonts" / "ttf" / name
        if path.is_file():
            return path
    return None


@lru_cache(maxsize=64)
def _open_font(size: int, *, bold: bool) -> pygame.font.Font:
    return pygame.font.Font(find_font_file(bold=bold), size)


def _get_font(size: int, *, bold: bool) -> pygame.font.Font:
    """Return the font of a size, px; open it again if pygame's font module was shut down since."""
    try:
        _open_font(size, bold=bold).get_height()
    except pygame.error:
        pygame.font.init()
        _open_font.cache_clear()
    return _open_font(size, bold=bold)


@cache_surfaces(_CACHE_BYTES)
def render_text(text: str, size: int, color: Color, *, bold: bool = False) -> pygame.Surface:
    """Render one line of text on a transparent surface.

    Parameters
    ----------
    text : str
        Control characters are escaped.
    size : int, px
    color : Color
    bold : bool

    Returns
    -------
    pygame.Surface
        The surface is cached, so callers must not draw on it.
    """
    return _get_font(size, bold=bold).render(escape_controls(text, single_line=True), True, color)


def measure_text(text: str, size: int, *, bold: bool = False) -> int:
    """Return the width of one line of text of a size, px."""
    return _get_font(size, bold=bold).size(escape_controls(text, single_line=True))[0]


def shorten_to_width(text: str, size: int, width: float, *, bold: bool = False) -> str:
    """Shorten a text, which is written at a size in px, to a width in px; an ellipsis replaces its end."""
    return shorten_text(text, lambda candidate: measure_text(candidate, size, bold=bold), width)
