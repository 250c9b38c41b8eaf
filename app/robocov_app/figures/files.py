"""Figures as files, PNG, SVG and PDF: the same plot gives the same bytes."""

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

# what would differ from one time, or one version of matplotlib, to the next is left out
_METADATA: dict[str, dict[str, str | None]] = {
    "png": {"Software": None},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}

_STYLE: Any = {
    "savefig.bbox": None,
    "svg.hashsalt": "robocov",
    # outlines: an SVG cannot hold a font, and others than ours would not fit their places
    "svg.fonttype": "path",
    # the whole letters as TrueType: publishers refuse Type 3, and the words can be searched and copied
    "pdf.fonttype": 42,
}


@contextmanager
def plain_style() -> Iterator[None]:
    """Let matplotlib draw alike whatever style is set; dollars are no formula, missing letters no warning."""
    import matplotlib.style

    style: Any = {"font.family": "DejaVu Sans", "text.usetex": False, "text.parse_math": False}
    style["axes.unicode_minus"] = True
    with matplotlib.style.context(["default", style]), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        yield


def figure_png(figure: Figure) -> bytes:
    file = io.BytesIO()
    _write(figure, file, "png")
    return file.getvalue()


def save_figure(figure: Figure, path: Path | str) -> None:
    """Write a figure as PNG, SVG or PDF, by the path's suffix, whole or not at all; without a date.

    Raises OutputError when the file cannot be written; ParameterError when the suffix is another.
    """
    kind = figure_kind(Path(path))
    with replace_file(Path(path)) as part:
        _write(figure, part, kind)


def _write(figure: Figure, file: Path | IO[bytes], kind: str) -> None:
    import matplotlib
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        text.set_text(escape_controls(text.get_text()))
    page: Any = {"dpi": figure.dpi, "facecolor": figure.get_facecolor()}
    with plain_style(), matplotlib.rc_context(_STYLE):
        figure.savefig(file, format=kind, metadata=_METADATA[kind], **page)
    if kind == "svg" and isinstance(file, Path):
        # labels of ticks, which are only known now, may hold characters that XML does not allow
        content = file.read_text("utf-8")
        safe = escape_controls(content)
        if safe != content:
            file.write_text(safe, "utf-8", newline="\n")


def check_figure_path(path: Path) -> None:
    """Raise OutputError or ParameterError, before any work is done, where no figure can be written."""
    figure_kind(path)
    if not resolve_target(path).parent.is_dir():
        raise OutputError(f"{path}: cannot be written: there is no folder {path.parent}")


def figure_kind(path: Path) -> str:
    """Return ``png``, ``svg`` or ``pdf``, by a path's suffix; raises ParameterError when that is another."""
    kind = path.suffix.lower().lstrip(".")
    if kind not in _METADATA:
        raise ParameterError(f"{path}: expected .png, .svg or .pdf, got suffix {quote(path.suffix)}")
    return kind
