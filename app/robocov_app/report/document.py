"""Reports: results as one page of HTML that needs nothing else, neither network nor other files."""

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
from robocov_app.look.labels import shorten_word
from robocov_app.report import facts, plots, replay, tables
from robocov_app.report import groups as grouped
from robocov_app.report.descriptions import list_lifetimes
from robocov_app.report.embedding import MAX_BYTES, ReplayRun
from robocov_app.report.pictures import draw_map, draw_run, has_path
from robocov_app.report.results import Entry, Result
from robocov_app.report.theme_css import build_theme_rules

MAX_MAPS = 12
"""Maximum number of maps that are drawn."""
MAX_WORD_CHARS = 40
"""A longer word is shortened. The whole one is in a tooltip."""


class Report(NamedTuple):
    """A page, and for each result the number of its runs that can be replayed.

    Attributes
    ----------
    html : str
    shown : tuple of int
    """

    html: str
    shown: tuple[int, ...]


def build_report(results: Sequence[Result], *, title: str | None = None, theme: str = "auto") -> Report:
    """Build a page with a section for each result. The same results give the same page.

    Parameters
    ----------
    results : sequence of Result
    title : str, optional
        By default, what was run.
    theme : str
        Name of a theme, or "auto" to follow the reader's browser.

    Returns
    -------
    Report
    """
    max_bytes = MAX_BYTES // len(results)
    sections = [
        _build_section(result, f"r{number}", max_bytes) for number, result in enumerate(results, start=1)
    ]
    default_title = sections[0]["title"] if len(results) == 1 else f"{len(results)} results"
    definitions = replay.read_replay_js() + replay.read_asset("report.js")
    code = replay.wrap_script(f"{definitions}startReport(startReplays());")
    style = build_theme_rules(":root", theme) + replay.read_replay_css() + replay.read_asset("report.css")
    html = load_template("report.html.jinja").render(
        title=title or default_title,
        sections=sections,
        single=len(results) == 1,
        version=__version__,
        style=style,
        script=code,
        digest=base64.b64encode(hashlib.sha256(code.encode()).digest()).decode(),
        marks=MARKER_PATHS,
    )
    return Report(escape_controls(html), tuple(section["shown"] for section in sections))


def _build_section(result: Result, key: str, max_bytes: int) -> dict[str, Any]:
    """Build what the template shows of a result; `key` starts the ids of the section."""
    styles = grouped.styles(result)
    compared, chosen_gains = grouped.compared_groups(result)
    comparisons = grouped.comparisons(compared)
    choice = grouped.chosen(result, grouped.MOST_RUNS, replay.MAX_PANES)
    runs = _build_replay_runs(result, choice.entries)
    return {
        "key": key,
        "result": result,
        "looks": styles,
        "title": facts.title_of(result),
        "lede": facts.lede(result, comparisons),
        "gaps": facts.gaps(result),
        "settings": len(grouped.settings(result)),
        "failures": tables.failures_table(result),
        "summaries": tables.summary_tables(result),
        "costs": list(plots.cost_plots(result, styles, f"{key}c")),
        "medians": any(len(group.entries) > 1 for group in grouped.variants(result)),
        "measures": plots.measure_plots(result, runs, styles, f"{key}m"),
        "finals": list(plots.final_plots(result, styles, f"{key}f")),
        "in_pairs": result.kind == "sweep" and any(comparison.pairs > 1 for comparison in comparisons),
        "pairs": tables.pairs_table(comparisons) if comparisons else None,
        "pairs_plots": list(plots.paired_plots(comparisons, styles, f"{key}p")),
        "map_pairs": tables.map_pairs_tables(comparisons),
        "compared": comparisons,
        "chosen_gains": chosen_gains,
        "dependences": list(plots.dependence_plots(result, f"{key}d")),
        "choice": choice.words if len(runs) > 1 else "",
        "sparse": any(not has_path(run.record) for run in runs),
        "moving": any(run.record.environment.has_moving_obstacles for run in runs),
        "changing": any(_has_failures(run) for run in runs),
        "thumbnails": [_build_thumbnail(*run) for run in zip(runs, choice.entries, strict=True)],
        "replay": replay.build_replay_part(runs, choice.panes, max_bytes) if runs else "",
        "shown": len(runs),
    }


def _build_replay_runs(result: Result, entries: Sequence[Entry]) -> list[ReplayRun]:
    """Return runs of a result with their titles and styles."""
    labels = grouped.labels(result)
    styles = grouped.styles(result)
    runs = []
    for entry in entries:
        label = labels[entry]
        run = ReplayRun(
            record=result.record(entry),
            history=result.history(entry),
            title=facts.run_title(result, entry, label),
            facts=facts.run_facts(result, entry),
            label=label,
            style=styles[label],
        )
        runs.append(run)
    return runs


def _has_failures(run: ReplayRun) -> bool:
    """Return whether robots of a run fail."""
    if run.record.conditions is None:
        return False
    return any(failure is not None for _, failure in list_lifetimes(run.record))


def _build_thumbnail(run: ReplayRun, entry: Entry) -> dict[str, Any]:
    """Build what the template shows of a small picture of a run."""
    return {
        "run": run,
        "rest": run.title.removeprefix(run.label).removeprefix(" · "),
        "picture": draw_run(run.record, run.history, is_hidden=True),
        "final": f"{entry.final:.3f} m" if entry.final == entry.final else "",
    }


@cache
def load_template(name: str) -> Template:
    """Load a template from the folder ``assets`` with the filters and names that reports use."""
    environment = Environment(
        loader=FunctionLoader(replay.read_asset),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["short"] = _shorten_words
    environment.globals |= {
        "most_maps": MAX_MAPS,
        "most_panels": plots.MOST_PANELS,
        "few_maps": MIN_BOOTSTRAP_MAPS,
        "negligible": grouped.NEGLIGIBLE,
        "facts": facts,
        "tables": tables,
        "draw_map": draw_map,
    }
    return environment.get_template(name)


def _shorten_words(text: str) -> Markup:
    """Return a text as HTML whose long words are shortened: no name makes a page wider than a telephone."""
    html = Markup("")
    long_word = rf"\S{{{MAX_WORD_CHARS + 1},}}"
    for piece in re.split(f"({long_word})", text):
        if re.fullmatch(long_word, piece):
            short = shorten_word(piece, MAX_WORD_CHARS)
            html += Markup('<span class="cut" title="{}">{}</span>').format(piece, short)
        else:
            html += escape(piece)
    return html
