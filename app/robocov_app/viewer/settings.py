"""Persistent settings of the window, in the user's folder for settings."""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class Settings(BaseModel):
    """Appearance of the window, not what happens in it."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    theme: Literal["light", "dark"] = "light"
    scale: float | None = Field(default=None, ge=0.5, le=4.0)
    width: int = Field(default=1280, ge=900, le=7680)
    height: int = Field(default=720, ge=600, le=4320)
    shown: tuple[str, ...] | None = None
    tab: str = "parameters"
    fade: bool = False
    suggests: bool = True
    recent: tuple[str, ...] = ()
