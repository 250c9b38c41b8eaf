"""The report: results as one page of HTML that needs nothing else, neither network nor other files."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import TYPE_CHECKING, Any

from robocov import __version__
from robocov.errors import ParameterError, counted
from robocov_app.report.choosing import MOST_RUNS, chosen
from robocov_app.report.dependence_plots import dependence_plots
from robocov_app.report.embedding import BUDGET, ReplayRun, has_path, lives
from robocov_app.report.facts import (
    facts,
    gaps,
    lede,
    pairs_words,
    run_facts,
    run_title,
    title_of,
    troubles,
    weighed_text,
)
from robocov_app.report.groups import comparisons, setting_label, settings, variants
from robocov_app.report.measure_plots import measure_plots
from robocov_app.report.pictures import map_picture, run_picture
from robocov_app.report.replay import MOST_PANES, asset, replay_css, replay_js, replay_part, script
from robocov_app.report.result_plots import MOST_PANELS, Curves, cost_plots, final_plots, paired_plot, styles
from robocov_app.report.tables import (
    controllers_table,
    failures_table,
    gains_table,
    pairs_table,
    runs_table,
    summary_tables,
)
from robocov_app.report.theme_css import theme_rules
from robocov_app.view.theme import theme_named

if TYPE_CHECKING:
    from jinja2 import Template

    from robocov_app.report.choosing import Choice
    from robocov_app.report.gathering import Result

MOST_MAPS = 12
"""Maps that are drawn."""


@dataclass(frozen=True)
class Report:
    """A page.

    Attributes
    ----------
    html : str
    shown : tuple of int
        For each result, how many runs can be watched.
    """

    html: str
    shown: tuple[int, ...]


def report(
    results: Sequence[Result],
    *,
    title: str | None = None,
    theme: str = "auto",
    tell: Callable[[int], None] = lambda done: None,
) -> Report:
    """Return results as a page; the same results give the same page.

    Parameters
    ----------
    results : sequence of Result
        One section each.
    title : str or None
        By default, what the result is called.
    theme : {"auto", "light", "dark"}
        "auto" follows the reader.
    tell : callable
        Called with the number of runs whose curves are read.

    Raises
    ------
    ParameterError
        When there are no results, or no such theme.
    InputError
        When a run cannot be read.
    """
    if not results:
        raise ParameterError("report: no results were given, but at least one was wanted")
    if theme != "auto":
        theme_named(theme)
    sections = []
    read = 0
    for number, result in enumerate(results, start=1):
        sections.append(_section(result, f"r{number}", BUDGET // len(results), partial(_told, tell, read)))
        read += len(result.fine)
    default = sections[0]["title"] if len(results) == 1 else f"{len(results)} results"
    code = script(replay_js() + asset("report.js") + "startReport(startReplays());")
    html = _template().render(
        title=title or default,
        sections=sections,
        single=len(results) == 1,
        version=__version__,
        style=theme_rules(":root", theme) + replay_css() + asset("report.css"),
        script=code,
        digest=base64.b64encode(hashlib.sha256(code.encode()).digest()).decode(),
        marks=MARKS,
    )
    return Report(html, tuple(section["shown"] for section in sections))


MARKS = {
    "o": "M0-5a5 5 0 1 0 .01 0z",
    "s": "M-4.6-4.6h9.2v9.2h-9.2z",
    "^": "M0-5.6 5.6 4.4H-5.6z",
    "v": "M0 5.6 5.6-4.4H-5.6z",
    "D": "M0-6 6 0 0 6-6 0z",
    "P": "M-2-6h4v4h4v4h-4v4h-4v-4h-4v-4h4z",
}
"""The marks of curves as SVG paths."""


def _told(tell: Callable[[int], None], before: int, done: int) -> None:
    tell(before + done)


def _section(result: Result, key: str, budget: int, tell: Callable[[int], None]) -> dict[str, Any]:
    """Return all that the page says of a result."""
    looks = styles(result)
    choice = chosen(result, MOST_RUNS, MOST_PANES)
    pairs = comparisons(result)
    curves = Curves(result, tell)
    costs = list(cost_plots(result, curves, f"{key}c"))
    maps = list(result.maps.values())
    several = len(settings(result)) > 1
    replayed = _replayed(result, choice)
    return {
        "key": key,
        "title": title_of(result),
        "lede": lede(result, pairs),
        "gaps": gaps(result),
        "troubles": troubles(result),
        "facts": facts(result),
        "maps": [map_picture(environment) for environment in maps[:MOST_MAPS]],
        "map_names": list(result.maps)[:MOST_MAPS],
        "more_maps": len(maps) - MOST_MAPS,
        "controllers": controllers_table(result, looks),
        "gains": gains_table(result, looks),
        "summaries": summary_tables(result, looks),
        "runs": runs_table(result, looks),
        "costs": costs,
        "costs_words": _costs_words(result, costs),
        "measures": measure_plots(result, replayed, choice.entries, f"{key}m"),
        "finals": list(final_plots(result, f"{key}f")),
        "pairs": pairs_table(pairs, looks) if pairs else None,
        "pairs_plot": paired_plot(pairs, f"{key}p"),
        "pairs_words": pairs_words(result, pairs),
        "dependences": list(dependence_plots(result, f"{key}d")),
        "failures": failures_table(result, looks),
        "several": several,
        "choice": choice.words if len(replayed) > 1 else "",
        "sparse": any(not has_path(run.record) for run in replayed),
        "changing": any(
            failed is not None
            for run in replayed
            if run.record.conditions is not None
            for _, failed in lives(run.record)
        ),
        "thumbnails": [
            {
                "title": run.title,
                "label": run.title.partition(" · ")[0],
                "rest": run.title.partition(" · ")[2],
                "picture": run_picture(run.record, run.history, hidden=True),
                "facts": run.facts,
                "final": f"{entry.final:.3f} m" if entry.final == entry.final else "",
                "where": setting_label(result, entry.setting),
                "style": looks[entry.controller],
            }
            for run, entry in zip(replayed, choice.entries, strict=True)
        ],
        "replay": replay_part(replayed, looks, choice.panes, budget) if replayed else "",
        "shown": len(replayed),
    }


def _replayed(result: Result, choice: Choice) -> list[ReplayRun]:
    """Return the chosen runs with their records."""
    labels = {entry: group.label for group in variants(result) for entry in group.entries}
    return [
        ReplayRun(
            result.record(entry),
            result.history(entry),
            run_title(result, entry, labels[entry]),
            run_facts(result, entry),
        )
        for entry in choice.entries
    ]


def _costs_words(result: Result, costs: Sequence[Any]) -> str:
    """Return what the curves are."""
    count = len(result.fine)
    words = "The mean distance to the nearest robot: how far it really has to travel, around obstacles."
    if weighed_text(result):
        words += " On maps with a density φ each place counts in the mean, and in all costs, by its φ."
    if count > 1 and any(len(group.entries) > 1 for group in variants(result)):
        words += " Lines are medians over runs, bands reach from the first quartile to the third."
    if len(costs) > 1:
        words += " All together: as a part of the distance at the start, the same for all controllers."
    every = len(settings(result))
    if every > MOST_PANELS:
        words += f" There are {counted(every, 'combination')} of map and team, too many for a panel each."
    return words


@cache
def _template() -> Template:
    from jinja2 import DictLoader, Environment, StrictUndefined

    source = {"report.html": asset("report.html.jinja")}
    environment = Environment(
        loader=DictLoader(source),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("report.html")
