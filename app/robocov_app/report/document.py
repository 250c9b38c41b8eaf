"""The report: results as one page of HTML that needs nothing else, neither network nor other files."""

import base64
import hashlib
import re
from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

from jinja2 import Environment, FunctionLoader, StrictUndefined, Template
from markupsafe import Markup, escape

from robocov import __version__
from robocov.text import escape_controls
from robocov_app.figures.statistics import MIN_BOOTSTRAP_MAPS
from robocov_app.look.curve_styles import MARKER_PATHS
from robocov_app.report import facts, plots, replay, tables
from robocov_app.report import groups as grouped
from robocov_app.report.pictures import has_path, lives, map_picture, run_picture
from robocov_app.report.replay import MOST_PANES, ReplayRun
from robocov_app.report.results import Result
from robocov_app.report.theme_css import theme_rules

MOST_MAPS = 12  # maps that are drawn
MOST_LETTERS = 40  # a longer word is cut, and stands whole in a tooltip


class Report(NamedTuple):
    """A page, and for each result how many of its runs can be watched."""

    html: str
    shown: tuple[int, ...]


def report(results: Sequence[Result], *, title: str | None = None, theme: str = "auto") -> Report:
    """Return results as a page, a section each; theme "auto" follows the reader. Same results, same page."""
    budget = replay.BUDGET // len(results)
    sections = [_section(result, f"r{number}", budget) for number, result in enumerate(results, start=1)]
    default = sections[0]["title"] if len(results) == 1 else f"{len(results)} results"
    code = replay.script(replay.replay_js() + replay.asset("report.js") + "startReport(startReplays());")
    html = template("report.html.jinja").render(
        title=title or default,
        sections=sections,
        single=len(results) == 1,
        version=__version__,
        style=theme_rules(":root", theme) + replay.replay_css() + replay.asset("report.css"),
        script=code,
        digest=base64.b64encode(hashlib.sha256(code.encode()).digest()).decode(),
        marks=MARKER_PATHS,
    )
    return Report(escape_controls(html), tuple(section["shown"] for section in sections))


def _section(result: Result, key: str, budget: int) -> dict[str, Any]:
    looks = grouped.styles(result)
    choice = grouped.chosen(result, grouped.MOST_RUNS, MOST_PANES)
    compared, chosen_gains = grouped.compared_groups(result)
    pairs = grouped.comparisons(compared)
    labels = grouped.labels(result)
    replayed = [
        ReplayRun(
            result.record(entry),
            result.history(entry),
            facts.run_title(result, entry, labels[entry]),
            facts.run_facts(result, entry),
            label=labels[entry],
            style=looks[labels[entry]],
        )
        for entry in choice.entries
    ]
    changing = [run.record for run in replayed if run.record.conditions is not None]
    return {
        "key": key,
        "result": result,
        "looks": looks,
        "title": facts.title_of(result),
        "lede": facts.lede(result, pairs),
        "in_pairs": result.kind == "sweep" and any(each.pairs > 1 for each in pairs),
        "gaps": facts.gaps(result),
        "summaries": tables.summary_tables(result),
        "costs": list(plots.cost_plots(result, looks, f"{key}c")),
        "medians": any(len(group.entries) > 1 for group in grouped.variants(result)),
        "measures": plots.measure_plots(result, replayed, looks, f"{key}m"),
        "finals": list(plots.final_plots(result, looks, f"{key}f")),
        "pairs": tables.pairs_table(pairs) if pairs else None,
        "pairs_plots": list(plots.paired_plots(pairs, looks, f"{key}p")),
        "map_pairs": tables.map_pairs_tables(pairs),
        "compared": pairs,
        "chosen_gains": chosen_gains,
        "dependences": list(plots.dependence_plots(result, f"{key}d")),
        "failures": tables.failures_table(result),
        "settings": len(grouped.settings(result)),
        "choice": choice.words if len(replayed) > 1 else "",
        "sparse": any(not has_path(run.record) for run in replayed),
        "moving": any(run.record.environment.has_moving_obstacles for run in replayed),
        "changing": any(failed is not None for record in changing for _, failed in lives(record)),
        "thumbnails": [
            {
                "run": run,
                "rest": run.title.removeprefix(run.label).removeprefix(" · "),
                "picture": run_picture(run.record, run.history, hidden=True),
                "final": f"{entry.final:.3f} m" if entry.final == entry.final else "",
            }
            for run, entry in zip(replayed, choice.entries, strict=True)
        ],
        "replay": replay.replay_part(replayed, choice.panes, budget) if replayed else "",
        "shown": len(replayed),
    }


@cache
def template(name: str) -> Template:
    loader = FunctionLoader(replay.asset)
    tight: Any = {"trim_blocks": True, "lstrip_blocks": True}
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, **tight)
    environment.filters["short"] = _shortened
    limits = {
        "most_maps": MOST_MAPS,
        "most_panels": plots.MOST_PANELS,
        "few_maps": MIN_BOOTSTRAP_MAPS,
    }
    environment.globals |= {**limits, "negligible": grouped.NEGLIGIBLE}
    environment.globals |= {"facts": facts, "tables": tables, "map_picture": map_picture}
    return environment.get_template(name)


def _shortened(text: str) -> Markup:
    """Return a text as HTML whose overlong words are cut: no name makes a page wider than a telephone."""

    def cut(word: str) -> Markup:
        short = f"{word[: MOST_LETTERS - 13]}…{word[-12:]}"
        return Markup('<span class="cut" title="{}">{}</span>').format(word, short)

    parts = re.split(rf"(\S{{{MOST_LETTERS + 1},}})", text)
    return Markup("").join(cut(part) if k % 2 else escape(part) for k, part in enumerate(parts))
