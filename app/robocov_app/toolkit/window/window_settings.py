"""Settings that every window saves and restores."""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

MIN_WIDTH_PX = 900
MAX_WIDTH_PX = 7680
MIN_HEIGHT_PX = 600
MAX_HEIGHT_PX = 4320


class WindowSettings(BaseModel):
    """Appearance of a window, and the files used last.

    Attributes
    ----------
    theme : {"light", "dark"}
        Colors.
    scale : float or None
        Scale of texts and widgets; None for one that suits the size of the window and the screen.
    width, height : int
        Size of the window, px.
    tab : str
        Name of the panel's open tab.
    recent : tuple of str
        Files used recently, newest first.
    """

    model_config = ConfigDict(extra="ignore", frozen=True)

    theme: Literal["light", "dark"] = "light"
    scale: float | None = Field(default=None, ge=0.5, le=4.0)
    width: int = Field(default=1280, ge=MIN_WIDTH_PX, le=MAX_WIDTH_PX)
    height: int = Field(default=720, ge=MIN_HEIGHT_PX, le=MAX_HEIGHT_PX)
    tab: str = ""
    recent: tuple[str, ...] = ()


def limit_window_size(size: tuple[int, int]) -> tuple[int, int]:
    """Return a window size clamped to what settings allow, px."""
    width = min(max(size[0], MIN_WIDTH_PX), MAX_WIDTH_PX)
    height = min(max(size[1], MIN_HEIGHT_PX), MAX_HEIGHT_PX)
    return width, height
