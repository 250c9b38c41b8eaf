"""Figures as PNG, SVG and PDF files. Equal plots give identical files."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from robocov.errors import OutputError, ParameterError, quote
from robocov.files.writing import replace_file, resolve_target
from robocov.text import escape_controls

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Dates and versions would make equal figures different.
_METADATA: dict[str, dict[str, str | None]] = {
    "png": {"Software": None},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
_FILE_STYLE: Any = {
    "savefig.bbox": None,
    "svg.hashsalt": "robocov",
    # Glyphs as outlines: an SVG does not embed its font, and a substitute has glyphs of other widths.
    "svg.fonttype": "path",
    # TrueType fonts: publishers reject Type 3 fonts, and TrueType texts can be searched and copied.
    "pdf.fonttype": 42,
}
_PLAIN_STYLE: Any = {
    "font.family": "DejaVu Sans",
    "text.usetex": False,
    "text.parse_math": False,
    "axes.unicode_minus": True,
}


@contextmanager
def plain_style() -> Iterator[None]:
    """Make matplotlib draw the same, regardless of the style that the user has set.

    A dollar sign does not start a formula, and characters that the font lacks cause no warning. The context
    manager can also be used as a decorator: ``@plain_style()``.

    Yields
    ------
    None

    See Also
    --------
    save_figure : Save a figure in this style.

    Examples
    --------
    >>> import matplotlib
    >>> with plain_style():
    ...     matplotlib.rcParams["font.family"]
    ['DejaVu Sans']
    """
    import matplotlib.style

    with matplotlib.style.context(["default", _PLAIN_STYLE]), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        yield


def render_png(figure: Figure) -> bytes:
    """Render a figure as PNG.

    Parameters
    ----------
    figure : matplotlib.figure.Figure

    Returns
    -------
    bytes

    See Also
    --------
    save_figure : Write a figure to a file.

    Examples
    --------
    >>> from robocov_app.figures.files import render_png
    >>> from matplotlib.figure import Figure
    >>> render_png(Figure())[1:4]
    b'PNG'
    """
    file = io.BytesIO()
    _write_figure(figure, file, "png")
    return file.getvalue()


def save_figure(figure: Figure, path: Path | str) -> None:
    """Save a figure to a file; an existing file is only replaced once the new one is complete.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    path : Path or str
        Its suffix decides the format: ``.png``, ``.svg`` or ``.pdf``.

    Raises
    ------
    OutputError
        If the file cannot be written.
    ParameterError
        If the suffix is none of these.

    See Also
    --------
    render_png : Render a figure as PNG, in memory.

    Examples
    --------
    >>> import tempfile
    >>> from robocov_app.figures.files import save_figure
    >>> import robocov as rc
    >>> record = rc.run("square", robots=2, duration=0.5)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_figure(record.plot().figure, f"{folder}/run.svg")
    """
    kind = get_figure_kind(Path(path))
    with replace_file(Path(path)) as temporary_path:
        _write_figure(figure, temporary_path, kind)


def _write_figure(figure: Figure, file: Path | IO[bytes], kind: str) -> None:
    """Write a figure to a path or a binary file, as ``png``, ``svg`` or ``pdf``, with controls escaped."""
    import matplotlib
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        text.set_text(escape_controls(text.get_text()))
    page: Any = {"dpi": figure.dpi, "facecolor": figure.get_facecolor()}
    with plain_style(), matplotlib.rc_context(_FILE_STYLE):
        figure.savefig(file, format=kind, metadata=_METADATA[kind], **page)
    if kind == "svg" and isinstance(file, Path):
        # Tick labels are only generated while saving, and may contain characters that XML does not allow.
        content = file.read_text("utf-8")
        escaped = escape_controls(content)
        if escaped != content:
            file.write_text(escaped, "utf-8", newline="\n")


def check_figure_path(path: Path) -> None:
    """Check that a figure can be saved, before any work is done.

    Parameters
    ----------
    path : Path

    Raises
    ------
    OutputError
        If the folder does not exist, or the path leads to something other than a file.
    ParameterError
        If the suffix is not that of a figure format.

    See Also
    --------
    save_figure : Save a figure.

    Examples
    --------
    >>> check_figure_path(Path("run.svg"))
    """
    get_figure_kind(path)
    if not resolve_target(path).parent.is_dir():
        raise OutputError(f"{path}: cannot be written: there is no folder {path.parent}")


def get_figure_kind(path: Path) -> str:
    """Return the figure format that the suffix of a path stands for.

    Parameters
    ----------
    path : Path

    Returns
    -------
    {"png", "svg", "pdf"}

    Raises
    ------
    ParameterError
        If the suffix is not that of a figure format.

    See Also
    --------
    check_figure_path : Check the folder as well.

    Examples
    --------
    >>> get_figure_kind(Path("cost.SVG"))
    'svg'
    """
    kind = path.suffix.lower().lstrip(".")
    if kind not in _METADATA:
        raise ParameterError(f"{path}: expected .png, .svg or .pdf, got suffix {quote(path.suffix)}")
    return kind
