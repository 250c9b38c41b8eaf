"""The report: results as one page of HTML that needs nothing else, neither network nor other files."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

from robocov import __version__
from robocov.errors import ParameterError, counted
from robocov_app.figures.styles import MARKS
from robocov_app.render.theme import theme_named
from robocov_app.report.embedding import BUDGET, ReplayRun, has_path, lives
from robocov_app.report.facts import (
    facts,
    gaps,
    lede,
    meanings,
    run_facts,
    run_title,
    title_of,
    troubles,
    weighed_text,
)
from robocov_app.report.groups import (
    MOST_RUNS,
    chosen,
    compared_groups,
    comparisons,
    pairs_words,
    setting_label,
    settings,
    styles,
    variants,
)
from robocov_app.report.pictures import map_picture, run_picture
from robocov_app.report.plots import (
    MOST_PANELS,
    Curves,
    cost_plots,
    dependence_plots,
    final_plots,
    measure_plots,
    paired_plots,
)
from robocov_app.report.replay import MOST_PANES, asset, replay_css, replay_js, replay_part, script
from robocov_app.report.tables import (
    controllers_table,
    failures_table,
    gains_table,
    map_pairs_tables,
    pairs_table,
    runs_table,
    summary_tables,
)
from robocov_app.report.theme_css import theme_rules

if TYPE_CHECKING:
    from jinja2 import Template
    from markupsafe import Markup

    from robocov_app.report.groups import Choice
    from robocov_app.report.plots import Looks
    from robocov_app.report.results import Result

MOST_MAPS = 12  # maps that are drawn

LEDE_NOTE = (
    "By the mean distance to the nearest robot at the end, in pairs of runs from the same starts; "
    "ratios below 1 are in favour of the first, with 95 % intervals."
)

MOST_LETTERS = 40  # a longer word is cut, and stands whole in a tooltip


@dataclass(frozen=True)
class Report:
    """A page, and for each result how many of its runs can be watched."""

    html: str
    shown: tuple[int, ...]


def report(results: Sequence[Result], *, title: str | None = None, theme: str = "auto") -> Report:
    """Return results as a page, a section each; the same results give the same page.

    The theme is "auto", which follows the reader, "light" or "dark". Raises ParameterError when there are no
    results, or no such theme.
    """
    if not results:
        raise ParameterError("report: no results were given, but at least one was wanted")
    if theme != "auto":
        theme_named(theme)
    budget = BUDGET // len(results)
    sections = [_section(result, f"r{number}", budget) for number, result in enumerate(results, start=1)]
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


def _section(result: Result, key: str, budget: int) -> dict[str, Any]:
    """Return all that the page says of a result."""
    looks = styles(result)
    choice = chosen(result, MOST_RUNS, MOST_PANES)
    compared = compared_groups(result)
    pairs = comparisons(compared.groups)
    costs = list(cost_plots(result, Curves(result), looks, f"{key}c"))
    maps = list(result.maps.values())
    several = len(settings(result)) > 1
    replayed = _replayed(result, choice, looks)
    return {
        "key": key,
        "title": title_of(result),
        "lede": lede(result, pairs),
        "lede_note": LEDE_NOTE if result.kind == "sweep" and any(each.pairs > 1 for each in pairs) else "",
        "gaps": gaps(result),
        "troubles": troubles(result),
        "facts": facts(result),
        "maps": [map_picture(environment) for environment in maps[:MOST_MAPS]],
        "map_names": list(result.maps)[:MOST_MAPS],
        "more_maps": len(maps) - MOST_MAPS,
        "controllers": controllers_table(result, looks),
        "meanings": meanings(result),
        "gains": gains_table(result, looks),
        "summaries": summary_tables(result, looks),
        "runs": runs_table(result, looks),
        "costs": costs,
        "costs_words": _costs_words(result, costs),
        "measures": measure_plots(result, replayed, choice.entries, looks, f"{key}m"),
        "finals": list(final_plots(result, looks, f"{key}f")),
        "pairs": pairs_table(pairs, looks) if pairs else None,
        "pairs_plots": list(paired_plots(pairs, looks, f"{key}p")),
        "map_pairs": map_pairs_tables(pairs),
        "pairs_words": pairs_words(pairs, compared.words),
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
                "label": run.label,
                "rest": run.title.removeprefix(run.label).removeprefix(" · "),
                "picture": run_picture(run.record, run.history, hidden=True),
                "facts": run.facts,
                "final": f"{entry.final:.3f} m" if entry.final == entry.final else "",
                "where": setting_label(result, entry.setting),
                "style": run.style,
            }
            for run, entry in zip(replayed, choice.entries, strict=True)
        ],
        "replay": replay_part(replayed, choice.panes, budget) if replayed else "",
        "shown": len(replayed),
    }


def _replayed(result: Result, choice: Choice, looks: Looks) -> list[ReplayRun]:
    """Return the chosen runs with their records."""
    labels = {entry: group.label for group in variants(result) for entry in group.entries}
    return [
        ReplayRun(
            result.record(entry),
            result.history(entry),
            run_title(result, entry, labels[entry]),
            run_facts(result, entry),
            label=labels[entry],
            style=looks[labels[entry]],
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
    environment.filters["short"] = _shortened
    return environment.get_template("report.html")


def _shortened(text: str) -> Markup:
    """Return a text as HTML whose overlong words are cut: no name makes a page wider than a telephone."""
    from markupsafe import Markup, escape

    def cut(word: str) -> Markup:
        short = f"{word[: MOST_LETTERS - 13]}…{word[-12:]}"
        return Markup('<span class="cut" title="{}">{}</span>').format(word, short)

    parts = re.split(rf"(\S{{{MOST_LETTERS + 1},}})", text)
    return Markup("").join(cut(part) if k % 2 else escape(part) for k, part in enumerate(parts))
