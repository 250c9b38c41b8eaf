"""What the pages have in common: their figures as files, their templates and their style."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from robocov.errors import OutputError
from robocov_app.figures.files import save_figure
from robocov_app.replication.bars import interval_bar
from robocov_app.replication.tables import settled_text
from robocov_app.replication.verdicts import amount, described
from robocov_app.terminal.progress import progress

if TYPE_CHECKING:
    from collections.abc import Callable

    from markupsafe import Markup
    from matplotlib.figure import Figure

PAGE = "index.html"

BEYOND_PAGE = "beyond.html"

_ASSETS = Path(__file__).parent / "assets"

_SUFFIXES = (".png", ".svg", ".pdf")

_UNIT = re.compile(r"(?<=\d) (?=(?:%|m|s|m²|m³|N)(?![\w³²]))")


def _held_together(value: object) -> object:
    """Return a text in which no line breaks between a number and its unit."""
    if isinstance(value, str) and not hasattr(value, "__html__"):
        return _UNIT.sub("\N{NO-BREAK SPACE}", value)
    return value


Drawn: TypeAlias = "Mapping[str, tuple[Callable[[], Figure], str]]"
"""How every picture is drawn, and what it shows."""


@dataclass(frozen=True)
class Image:
    """A picture on the page.

    Attributes
    ----------
    name : str
        Of its files in ``figures/``, without suffix.
    width, height : int, px
    words : str
        What it shows.
    """

    name: str
    width: int
    height: int
    words: str


def save_drawn(folder: Path, light: Drawn, dark: Drawn, *, quiet: bool) -> dict[str, Image]:
    """Write figures to ``figures/``: PNG, SVG and PDF, and a PNG for dark pages.

    Parameters
    ----------
    folder : Path
    light, dark : dict of name to (how it is drawn, what it shows)
    quiet : bool
        Tell nothing.

    Raises
    ------
    OutputError
        When something cannot be written.
    """
    target = folder / "figures"
    try:
        target.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"{target}: cannot be used for results: {error.strerror or error}") from error
    found: dict[str, Image] = {}
    with progress("figures", len(light), quiet=quiet) as update:
        for number, (name, (draw, words)) in enumerate(light.items(), start=1):
            figure = draw()
            for suffix in _SUFFIXES:
                save_figure(figure, target / f"{name}{suffix}")
            save_figure(dark[name][0](), target / f"{name}-dark.png")
            found[name] = Image(name, round(figure.bbox.width), round(figure.bbox.height), words)
            update(number)
    return found


def rendered(template: str, context: Mapping[str, Any]) -> str:
    """Return a page of one of the templates."""
    import jinja2

    surroundings = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_ASSETS),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=_held_together,
    )
    surroundings.globals |= {
        "bar": interval_bar,
        "amount": amount,
        "described": described,
        "settled_text": settled_text,
    }
    return surroundings.get_template(template).render(context)


def style_sheet(more: str = "") -> Markup:
    """Return the style of the pages, with `more` after the colours."""
    from markupsafe import Markup

    from robocov_app.report.replay import asset
    from robocov_app.report.theme_css import theme_rules

    own = (_ASSETS / "paper.css").read_text(encoding="utf-8")
    return Markup(theme_rules(":root") + more + asset("report.css") + own)
