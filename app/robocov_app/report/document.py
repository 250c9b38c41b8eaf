"""A report: results as a single HTML page that needs neither a network nor other files."""

import base64
import hashlib
import math
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
from robocov_app.report import facts, findings, replay
from robocov_app.report.analysis.comparisons import NEGLIGIBLE_DIFFERENCE, compare_groups
from robocov_app.report.analysis.groups import (
    choose_group_styles,
    label_runs,
    list_settings,
    list_variants,
)
from robocov_app.report.analysis.selection import MAX_SHOWN_RUNS, select_runs
from robocov_app.report.analysis.tuning import choose_compared_groups, choose_tuned_styles
from robocov_app.report.descriptions import list_lifetimes
from robocov_app.report.embedding import MAX_BYTES, ReplayRun
from robocov_app.report.pictures import draw_map, draw_run, has_path
from robocov_app.report.plots.costs import build_cost_plots, build_final_distance_plots
from robocov_app.report.plots.metrics import build_metric_plots
from robocov_app.report.plots.pairs import build_pair_plots
from robocov_app.report.plots.parameter_plots import build_parameter_plots
from robocov_app.report.plots.plot import MAX_PANELS, GroupStyles
from robocov_app.report.results.result import ReportedResult, ReportedRun
from robocov_app.report.tables.controllers import build_controllers_table, build_gain_sets_table
from robocov_app.report.tables.failures import build_failures_table
from robocov_app.report.tables.pairs import build_map_pairs_tables, build_pairs_table
from robocov_app.report.tables.summaries import build_runs_table, build_summary_tables
from robocov_app.report.theme_css import build_theme_rules

MAX_MAPS = 12
"""Maximum number of maps that are drawn."""
MAX_WORD_CHARS = 40
"""Longer words are shortened, with the whole word in a tooltip."""


class Report(NamedTuple):
    """A report that is ready to be written.

    Attributes
    ----------
    html : str
        The page.
    shown : tuple of int
        Number of runs of each result that can be replayed in the page.
    """

    html: str
    shown: tuple[int, ...]


def build_report(
    results: Sequence[ReportedResult], *, title: str | None = None, theme: str = "auto"
) -> Report:
    """Build a page with a section for each result.

    The same results always give the same page.

    Parameters
    ----------
    results : sequence of ReportedResult
    title : str, optional
        Title of the page. By default, that of the only result, or the number of results.
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
    default_title = f"{len(results)} results"
    if len(results) == 1:
        default_title = sections[0]["title"]
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


def _build_section(result: ReportedResult, key: str, max_bytes: int) -> dict[str, Any]:
    """Build the template variables of a result's section; all ids in the section start with `key`."""
    styles = choose_group_styles(result)
    selection = select_runs(result, MAX_SHOWN_RUNS, replay.MAX_PANES)
    runs = _build_replay_runs(result, selection.runs)
    thumbnails = [
        _build_thumbnail(replay_run, run, selection.roles.get(run, ""))
        for replay_run, run in zip(runs, selection.runs, strict=True)
    ]
    return {
        "key": key,
        "styles": styles,
        "title": facts.format_title(result),
        "maps": result.maps,
        "facts": facts.list_facts(result),
        "gain_meanings": facts.list_gain_meanings(result),
        "densities": facts.format_densities(result),
        "missing_runs": findings.describe_incomplete_runs(result),
        "problems": findings.list_problems(result),
        "settings": len(list_settings(result)),
        "controllers": build_controllers_table(result),
        "gain_sets": build_gain_sets_table(result),
        "summaries": build_summary_tables(result),
        "every_run": build_runs_table(result),
        "failures": build_failures_table(result),
        "costs": build_cost_plots(result, styles, f"{key}c"),
        "has_medians": any(len(group.runs) > 1 for group in list_variants(result)),
        "metrics": build_metric_plots(result, runs, styles, f"{key}m"),
        "finals": build_final_distance_plots(result, styles, f"{key}f"),
        **_build_comparison_variables(result, styles, key),
        "parameter_plots": build_parameter_plots(result, f"{key}d"),
        "selection_note": selection.note if len(runs) > 1 else "",
        "has_unknown_paths": any(not has_path(run.record) for run in runs),
        "has_moving_obstacles": any(run.record.environment.has_moving_obstacles for run in runs),
        "has_failed_robots": any(_has_failures(run) for run in runs),
        "thumbnails": thumbnails,
        "replay": replay.build_replay_element(runs, selection.panes, max_bytes) if runs else "",
        "shown": len(runs),
    }


def _build_comparison_variables(result: ReportedResult, styles: GroupStyles, key: str) -> dict[str, Any]:
    """Build the template variables about comparisons in pairs, and the findings, which quote them."""
    compared_groups, tuning_note = choose_compared_groups(result)
    pair_styles = {**styles, **choose_tuned_styles(result, compared_groups, styles)}
    comparisons = compare_groups(compared_groups)
    has_pairs = any(comparison.pair_count > 1 for comparison in comparisons)
    return {
        "findings": findings.list_findings(result, comparisons),
        "are_findings_in_pairs": result.kind == "sweep" and has_pairs,
        "comparisons": comparisons,
        "tuning_note": tuning_note,
        "pairs": build_pairs_table(comparisons),
        "pair_styles": pair_styles,
        "pair_plots": build_pair_plots(comparisons, pair_styles, f"{key}p"),
        "map_pairs": build_map_pairs_tables(comparisons),
    }


def _build_replay_runs(result: ReportedResult, runs: Sequence[ReportedRun]) -> list[ReplayRun]:
    """Read the records of runs, and combine them with titles and styles for the replay."""
    labels = label_runs(result)
    styles = choose_group_styles(result)
    replay_runs = []
    for run in runs:
        label = labels[run]
        replay_run = ReplayRun(
            record=result.read_record(run),
            history=result.read_history(run),
            title=facts.format_run_title(result, run, label),
            facts=facts.format_run_facts(result, run),
            label=label,
            style=styles[label],
        )
        replay_runs.append(replay_run)
    return replay_runs


def _has_failures(run: ReplayRun) -> bool:
    """Return whether any robot fails during a run."""
    if run.record.conditions is None:
        return False
    return any(failure is not None for _, failure in list_lifetimes(run.record))


def _build_thumbnail(replay_run: ReplayRun, run: ReportedRun, role: str) -> dict[str, Any]:
    """Build the template variables of a run's small picture; its caption starts with the role of the run."""
    final_distance = ""
    if not math.isnan(run.final_distance):
        final_distance = f"{run.final_distance:.3f} m"
    subtitle = replay_run.title.removeprefix(replay_run.label).removeprefix(" · ")
    return {
        "run": replay_run,
        "subtitle": " · ".join(text for text in (role, subtitle) if text),
        "picture": draw_run(replay_run.record, replay_run.history, is_hidden=True),
        "final": final_distance,
    }


@cache
def load_template(name: str) -> Template:
    """Load a template from the folder ``assets``, with the filters and global names that reports use."""
    environment = Environment(
        loader=FunctionLoader(replay.read_asset),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["short"] = _shorten_words
    environment.globals |= {
        "max_maps": MAX_MAPS,
        "max_panels": MAX_PANELS,
        "min_bootstrap_maps": MIN_BOOTSTRAP_MAPS,
        "negligible_difference": NEGLIGIBLE_DIFFERENCE,
        "draw_map": draw_map,
    }
    return environment.get_template(name)


def _shorten_words(text: str) -> Markup:
    """Convert text to HTML with long words shortened, so that no name makes a page wider than a phone."""
    html = Markup("")
    long_word = rf"\S{{{MAX_WORD_CHARS + 1},}}"
    # The group in the pattern makes `split` return the long words, too.
    for piece in re.split(f"({long_word})", text):
        if re.fullmatch(long_word, piece):
            short = shorten_word(piece, MAX_WORD_CHARS)
            html += Markup('<span class="cut" title="{}">{}</span>').format(piece, short)
        else:
            html += escape(piece)
    return html
