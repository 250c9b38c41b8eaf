"""`robocov edit`: the map editor."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from robocov.errors import MapError, ParameterError
from robocov_app.commands.options import WindowOptions
from robocov_app.terminal.arguments import parse_window_size
from robocov_app.terminal.output import echo

if TYPE_CHECKING:
    from robocov_app.editor.ui.window import EditorWindow

_SCREENSHOT_FRAMES = 3
"""Number of frames until the layout of a window has settled."""
_SCREENSHOT_FRAME_S = 0.2
"""Duration of each of these frames."""


@dataclass
class Arguments(WindowOptions):
    """Open the map editor: draw and change maps, see problems at once, try maps with robots.

    All commands have keys: press F1. Unsaved work is offered at the next start.

    Example: robocov edit plan.json --background plan.png
    """

    map: Annotated[tyro.conf.Positional[str | None], tyro.conf.arg(metavar="[MAP]")] = None
    """A new or existing map file, a bundled map to open as a copy, or a file of another program to import."""
    background: Path | None = None
    """Background image to trace, such as a scanned floor plan."""
    screenshot: Path | None = None
    """PNG file for a screenshot of the window, drawn without a display; then exit."""
    page: Literal["map", "object", "snap", "problems", "history"] = "map"
    """Page of the panel in the screenshot."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.screenshot is None:
            return
        if self.serve:
            raise ParameterError("--serve: cannot be combined with --screenshot")
        if self.screenshot.suffix.lower() != ".png":
            expected = "expected a name ending in .png"
            raise ParameterError(f"--screenshot: {expected}, got {str(self.screenshot)!r}")


def command(options: Arguments) -> int:
    """Run `robocov edit`, and return its exit status."""
    from robocov.kernel_compilation import compile_in_background
    from robocov_app.toolkit.window.termination import ending_on_signals
    from robocov_app.web import prepare, serve_each

    prepare(options, options.folder)
    if options.each:
        return serve_each(command, options)
    with ExitStack() as stack:
        if options.screenshot is None:
            stack.enter_context(ending_on_signals())
            stack.enter_context(compile_in_background())
        open_editor(options)
    return 0


def open_editor(options: Arguments) -> None:
    """Show the editor until it is closed, or save a screenshot of it."""
    from robocov_app.editor.ui.launch import EditorLauncher
    from robocov_app.web import show

    launcher = EditorLauncher(
        _find_path(options.map),
        options.folder,
        background=options.background,
        theme=options.theme,
        size=parse_window_size(options.size),
        scale=options.scale,
        headless=options.screenshot is not None,
        served=options.serve,
    )
    with launcher.window() as window:
        if options.screenshot is None:
            show(window, options, options.folder)
        else:
            _save_screenshot(window, options.screenshot, options.page)
    if options.screenshot is not None:
        echo(f"saved {options.screenshot}")


def _find_path(name: str | None) -> Path | None:
    """Return the path of a map file, a bundled map or a foreign file; None for a new map.

    Raises
    ------
    MapError
        If a foreign file does not exist; a map file need not exist yet.
    """
    from robocov.mapfile import find_map_file, list_bundled_maps

    if name is None:
        return None
    path = Path(name)
    if name in list_bundled_maps() or not path.suffix:
        return find_map_file(name)
    if path.suffix.lower() != ".json" and not path.is_file():
        raise MapError(f"{name}: no such file")
    return path


def _save_screenshot(window: EditorWindow, path: Path, page: str) -> None:
    """Draw the window with the given page of its panel, and save it as PNG."""
    from robocov.files.writing import replace_file
    from robocov_app.runs.encoding import encode_png
    from robocov_app.viewer.window.screen_video import copy_pixels

    window.panel.show_tab(page)
    window.editor.message = ""
    for _ in range(_SCREENSHOT_FRAMES):
        window.run_frame(_SCREENSHOT_FRAME_S)
    with replace_file(path) as temporary:
        temporary.write_bytes(encode_png(copy_pixels(window.screen)))
