"""``robocov edit``: the map editor."""

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from robocov.errors import MapError, ParameterError
from robocov_app.commands.options import WindowOptions
from robocov_app.terminal.arguments import parse_window_size
from robocov_app.terminal.output import echo


@dataclass
class Arguments(WindowOptions):
    """The map editor: draw and change maps, see at once what is wrong with them, try them.

    Everything has a key: press F1. Nothing is lost: work that was not saved is offered at the next start.

    Example: robocov edit plan.json --background plan.png
    """

    map: Annotated[tyro.conf.Positional[str | None], tyro.conf.arg(metavar="[MAP]")] = None
    """A map JSON, new or not, a bundled map, of which a copy is opened, or a foreign file to import."""
    background: Path | None = None
    """A picture to put under the map, such as a scanned floor plan."""
    screenshot: Path | None = None
    """Save a picture of the window, drawn without a display, and end."""
    page: Literal["map", "object", "snap", "problems", "history"] = "map"
    """The panel's page in that picture."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.serve and self.screenshot is not None:
            raise ParameterError("--serve: cannot be combined with --screenshot")
        if self.screenshot is not None and self.screenshot.suffix.lower() != ".png":
            wanted = "expected a name ending in .png"
            raise ParameterError(f"--screenshot: {wanted}, got {str(self.screenshot)!r}")


def command(options: Arguments) -> int:
    from robocov.kernel_compilation import compile_in_background
    from robocov_app.toolkit.termination import ending_on_signals
    from robocov_app.web import prepare, serve_each

    prepare(options, options.folder)
    if options.each:
        return serve_each(command, options)
    headless = options.screenshot is not None
    with ExitStack() as stack:
        if not headless:
            stack.enter_context(ending_on_signals())
            stack.enter_context(compile_in_background())
        return _open_editor(options)


def _open_editor(options: Arguments) -> int:
    from robocov.mapfile import find_map_file, list_bundled_maps
    from robocov_app.editor.ui.launch import editor_window
    from robocov_app.web import show

    look: dict[str, Any] = {
        "theme": options.theme,
        "size": parse_window_size(options.size),
        "scale": options.scale,
    }
    look |= {"headless": options.screenshot is not None, "served": options.serve}
    path = None if options.map is None else Path(options.map)
    if options.map in list_bundled_maps() or (path is not None and not path.suffix):
        path = find_map_file(str(options.map))
    elif path is not None and path.suffix.lower() != ".json" and not path.is_file():
        raise MapError(f"{options.map}: there is no such file")
    with editor_window(path, options.folder, background=options.background, **look) as window:
        if options.screenshot is None:
            show(window, options, options.folder)
            return 0
        from robocov.files.writing import replace_file
        from robocov_app.runs.encoding import encode_png
        from robocov_app.viewer.film import pixels

        window.panel.show_tab(options.page)
        window.editor.message = ""
        for _ in range(3):
            window.frame(0.2)
        with replace_file(options.screenshot) as part:
            part.write_bytes(encode_png(pixels(window.screen)))
    echo(f"saved {options.screenshot}")
    return 0
