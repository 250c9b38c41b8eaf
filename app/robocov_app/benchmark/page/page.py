"""The page that compares results of the benchmark: tables and plots for each track."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from robocov import __version__
from robocov.errors import ParameterError, format_count
from robocov.text import escape_controls
from robocov_app.benchmark import ratings, suite
from robocov_app.benchmark.page.anomalies import find_anomalies
from robocov_app.benchmark.page.pareto_plots import PlottedEntry, build_plots
from robocov_app.benchmark.rated_controller import RatedController
from robocov_app.benchmark.ratings import Rating
from robocov_app.benchmark.results import describe_method, get_results_version, shares_maps_by_messages
from robocov_app.look.curve_styles import MARKER_PATHS, CurveStyle, choose_curve_styles
from robocov_app.report import replay
from robocov_app.report.document import load_template
from robocov_app.report.tables.table import PageTable
from robocov_app.report.theme_css import build_theme_rules
from robocov_app.sweep.worker import list_result_versions

YARDSTICKS = ("rapf", "atlas", "oracle")
"""Controllers with which incomplete entries are compared, over the runs of each entry."""
_WHOLE_MAP = "whole map"
"""Information of the controllers that do not compete."""
MAX_PLOTTED_ENTRIES = 10
"""Maximum number of entries in a plot, apart from the bundled ones; those with the highest scores."""


class _Entries(NamedTuple):
    """Properties of the controllers on the page, by label."""

    styles: Mapping[str, CurveStyle]
    information: Mapping[str, str]
    bundled: Collection[str]
    """Labels of the bundled results."""
    yardsticks: Sequence[str]
    """Labels of the entries of `YARDSTICKS`."""


def build_page(results: Sequence[Mapping[str, Any]], title: str) -> str:
    """Build the page that compares results, with a section for each track.

    Complete entries are ranked by their scores. Each entry is rated over its own runs, so that the rating of
    an entry does not depend on other entries. Bundled results keep their labels and colors, and other entries
    are compared with these, whatever controller another result claims to be from.

    Parameters
    ----------
    results : sequence of Mapping
        As returned by `robocov_app.benchmark.results.read_result`, or by
        `robocov_app.benchmark.results.load_bundled_results`.
    title : str
        Title of the page.

    Returns
    -------
    str
        The page as HTML. Equal results give identical pages.

    Raises
    ------
    ParameterError
        If the results contain no runs of the suite.
    """
    results = sorted(results, key=lambda result: not result["is_bundled"])
    labels = ratings.label_results(results)
    styles = choose_curve_styles([result["entry"]["controller"] for result in results])
    information = [result["entry"]["information"] for result in results]
    entries = _Entries(
        styles=dict(zip(labels, styles, strict=True)),
        information=dict(zip(labels, information, strict=True)),
        bundled={label for result, label in zip(results, labels, strict=True) if result["is_bundled"]},
        yardsticks=_find_yardsticks(results, labels),
    )
    tracks = {
        name: sorted(track_ratings, key=_build_sort_key)
        for name, track_ratings in ratings.build_ratings(results).items()
    }
    if not tracks:
        raise ParameterError("DIR: the results contain no run of the suite, so there is nothing to compare")
    labeled_results = sorted(
        zip(labels, results, strict=True), key=lambda labeled_result: labeled_result[0].casefold()
    )
    page = load_template("benchmark.html.jinja").render(
        title=title,
        suite=suite.VERSION,
        version=__version__,
        style=build_theme_rules(":root") + replay.read_asset("report.css"),
        marks=MARKER_PATHS,
        styles=entries.styles,
        overviews=_build_overviews(labels, tracks, entries),
        other_versions=_list_other_versions(results, labels),
        file_mark="" if all(result["is_bundled"] for result in results) else ratings.FILE_MARK,
        has_bundled=bool(entries.bundled),
        anomalies=_build_anomaly_table(labeled_results, _find_default_rapf(results)),
        tracks=[_build_section(name, track_ratings, entries) for name, track_ratings in tracks.items()],
        notes=[*ratings.NOTES, *_describe_entries_without_messages(results, labels)],
        corrections=ratings.CORRECTIONS,
        method=describe_method(),
        entries=_build_entries_table(labeled_results),
    )
    return escape_controls(page)


def _list_other_versions(results: Sequence[Mapping[str, Any]], labels: Sequence[str]) -> list[str]:
    """Return the labels of the results that were made with another version, and cannot be compared."""
    current_version = get_results_version(list_result_versions())
    others = []
    for result, label in zip(results, labels, strict=True):
        version = get_results_version(result["versions"])
        if version is not None and version != current_version:
            others.append(label)
    return others


def _find_yardsticks(results: Sequence[Mapping[str, Any]], labels: Sequence[str]) -> list[str]:
    """Return the labels of the results of yardsticks with default gains."""
    yardsticks = []
    for result, label in zip(results, labels, strict=True):
        if _is_default_result(result, results) and result["entry"]["controller"] in YARDSTICKS:
            yardsticks.append(label)
    return yardsticks


def _is_default_result(result: Mapping[str, Any], results: Sequence[Mapping[str, Any]]) -> bool:
    """Return whether a result is that of a built-in controller with default gains.

    If there are bundled results, only these count, because a file can contain any name of a controller.
    """
    if any(other["is_bundled"] for other in results) and not result["is_bundled"]:
        return False
    return not result["entry"]["set"] and not result["entry"]["source_sha256"]


def _build_sort_key(rating: Rating) -> tuple[bool, float]:
    """Return a sort key that puts complete ratings first, then higher scores."""
    return not rating.is_complete, -rating.score


def _build_overviews(
    labels: Sequence[str], tracks: Mapping[str, Sequence[Rating]], entries: _Entries
) -> list[tuple[str, str, PageTable]]:
    """Build the identifier, heading and table of each ranking for which there are runs.

    If none of the tracks belongs to a ranking, a single table compares the results on these tracks.
    """
    overviews = []
    for ranking, heading in suite.RANKINGS.items():
        ranked_tracks = {name: tracks[name] for name in suite.RANKED_TRACKS[ranking] if name in tracks}
        if ranked_tracks:
            overview = _build_overview(labels, ranked_tracks, entries)
            overviews.append((f"overview-{ranking}", heading, overview))
    if not overviews:
        overviews.append(("overview-other", "Overview", _build_overview(labels, tracks, entries)))
    return overviews


def _build_overview(
    labels: Sequence[str], tracks: Mapping[str, Sequence[Rating]], entries: _Entries
) -> PageTable:
    """Build the table of scores and gaps on some tracks.

    Entries that have all runs of all these tracks come first, ranked by mean score. The other entries have no
    rank and follow in alphabetical order. Notes list the entries without any runs, and those that have the
    smallest gap on a track but no rank.
    """
    by_label: dict[str, dict[str, Rating]] = {label: {} for label in labels}
    for name, track_ratings in tracks.items():
        for rating in track_ratings:
            by_label[rating.label][name] = rating
    mean_scores = _compute_mean_scores(by_label, tracks)
    scores = {label: mean_score.score for label, mean_score in mean_scores.items()}
    ranked = sorted(scores, key=lambda label: -scores[label])
    not_ranked = [label for label in labels if label not in scores and by_label[label]]
    not_ranked.sort(key=str.casefold)
    # Results from files change no rank of bundled ones.
    compared_scores = [scores[label] for label in ranked if label in entries.bundled] or list(scores.values())
    rows = []
    for label in [*ranked, *not_ranked]:
        rank = score = ratings.NO_VALUE
        if label in scores:
            rank = str(_compute_rank(scores[label], compared_scores))
            score = _format_mean_score(mean_scores[label])
        cells = _build_overview_cells(by_label[label], tracks)
        rows.append((label, entries.information[label], rank, score, *cells))
    headings = [suite.format_heading(name) for name in tracks]
    head = ("Controller", "Knows", "Rank", "Score, %", "Runs", "Runs with contacts", "Settled", *headings)
    notes = _list_overview_notes(by_label, scores, tracks, entries)
    caption = "Scores, and median gaps on each track, %"
    return PageTable(caption, head, rows, text_columns=frozenset({1}), notes=tuple(notes))


def _list_overview_notes(
    by_label: Mapping[str, Mapping[str, Rating]],
    ranked: Collection[str],
    tracks: Iterable[str],
    entries: _Entries,
) -> list[str]:
    """Return the notes on entries that have the smallest gap on a track but no rank, or no runs at all."""
    notes = []
    competing = {
        label: label_ratings
        for label, label_ratings in by_label.items()
        if entries.information[label] != _WHOLE_MAP and (label in entries.bundled or not entries.bundled)
    }
    # Files hide no bundled result, because they may contain anything.
    kind = "built-in controllers" if entries.bundled else "controllers"
    leaders = _find_unranked_leaders(competing, ranked, tracks)
    if leaders:
        notes.append(
            f"The best ranked controller is not the best on every track. Of the {kind} that do not know the "
            "whole map, these have the smallest gap on a track, but lack runs on others and have no rank: "
            f"{'; '.join(leaders)}."
        )
    missing = [label for label, label_ratings in by_label.items() if not label_ratings]
    if missing:
        notes.append(f"Without runs on these tracks: {'; '.join(sorted(missing, key=str.casefold))}.")
    return notes


def _format_mean_score(mean_score: ratings.MeanScore) -> str:
    """Format a score in percent, with half the width of its interval if it has one."""
    score = f"{100.0 * mean_score.score:.1f}"
    if np.isnan(mean_score.margin):
        return score
    return f"{score} ± {100.0 * mean_score.margin:.1f}"


def _compute_rank(score: float, scores: Iterable[float]) -> int:
    """Return the rank of a score among others. Equal scores have the same rank."""
    return 1 + sum(other > score for other in scores)


def _find_unranked_leaders(
    by_label: Mapping[str, Mapping[str, Rating]], ranked: Collection[str], tracks: Iterable[str]
) -> list[str]:
    """Return the label and the tracks of each entry that has the smallest gap on a track, but no rank."""
    led_tracks: dict[str, list[str]] = {}
    for track in tracks:
        gaps = {
            label: label_ratings[track].gap.estimate
            for label, label_ratings in by_label.items()
            if track in label_ratings and label_ratings[track].is_complete
        }
        if not gaps:
            continue
        leader = min(gaps, key=lambda label: gaps[label])
        if leader not in ranked:
            led_tracks.setdefault(leader, []).append(suite.format_heading(track))
    return [f"{label} ({', '.join(names)})" for label, names in led_tracks.items()]


def _compute_mean_scores(
    by_label: Mapping[str, Mapping[str, Rating]], tracks: Collection[str]
) -> dict[str, ratings.MeanScore]:
    """Return the mean score of each entry that has all runs of all tracks, by its label."""
    scores = {}
    for label, label_ratings in by_label.items():
        is_complete = all(rating.is_complete for rating in label_ratings.values())
        if is_complete and label_ratings.keys() == set(tracks):
            scores[label] = ratings.compute_mean_score(label_ratings.values())
    return scores


def _build_overview_cells(
    label_ratings: Mapping[str, Rating], tracks: Mapping[str, Sequence[Rating]]
) -> list[str]:
    """Return the cells for runs, contacts and settled runs, and for the gap on each complete track."""
    rows = [row for rating in label_ratings.values() for row in rating.rows]
    run_count = sum(rating.run_count for rating in label_ratings.values())
    suite_run_count = sum(len(ratings.list_run_keys(name)) for name in tracks)
    contacts = sum(row["contacts"] > 0 for row in rows)
    at_rest = sum(row["settled_at_s"] is not None for row in rows)
    run_text = ratings.format_run_count(run_count, suite_run_count, run_count - len(rows))
    cells = [_break_lines(run_text)]
    cells.append(f"{contacts / len(rows):.0%}" if rows else ratings.NO_VALUE)
    cells.append(f"{at_rest / run_count:.0%}" if run_count else ratings.NO_VALUE)
    for name in tracks:
        rating = label_ratings.get(name)
        gap = np.nan
        if rating is not None and rating.is_complete:
            gap = rating.gap.estimate
        cells.append(ratings.format_gap(gap))
    return cells


def _build_section(name: str, track_ratings: Sequence[Rating], entries: _Entries) -> dict[str, Any]:
    """Return the template variables for the section of a track."""
    ranked = [rating for rating in track_ratings if rating.is_complete]
    plotted = _select_entries_to_plot(ranked, entries)
    family_head, family_rows = ratings.build_family_rows(ranked)
    return {
        "name": name,
        "title": suite.format_heading(name),
        "summary": _summarize_track(name),
        "table": _build_rating_table("Ratings", ranked, entries),
        "families": PageTable("Median gap by families of maps, %", family_head, family_rows),
        "incomplete": _build_incomplete_tables(track_ratings, entries),
        "plots": build_plots(name, plotted),
        "omitted_from_plots": len(ranked) - len(plotted),
    }


def _summarize_track(name: str) -> str:
    """Return sentences about the conditions of a track, and the numbers of its runs and maps."""
    track = suite.TRACKS[name]
    run_count = len(ratings.list_run_keys(name))
    runs = f"{format_count(run_count, 'run')} on {format_count(len(track.maps), 'map')}"
    team = f"{format_count(track.robots, 'robot')}, {track.duration:g} s"
    return f"{track.summary.capitalize()}; {team}. {runs}, the same for all ranked entries."


def _build_incomplete_tables(track_ratings: Sequence[Rating], entries: _Entries) -> list[PageTable]:
    """Build a table for each entry that lacks runs.

    For comparison, it also contains the ratings of the yardsticks over the runs of the entry.
    """
    yardsticks = [rating for rating in track_ratings if rating.label in entries.yardsticks]
    tables = []
    for rating in track_ratings:
        if rating.is_complete:
            continue
        compared = [yardstick.select_runs(rating.run_keys) for yardstick in yardsticks]
        caption = f"{rating.label}, incomplete and not ranked"
        if compared:
            caption += ", and others over the same runs"
        tables.append(_build_rating_table(caption, [rating, *compared], entries))
    return tables


def _build_rating_table(caption: str, track_ratings: Sequence[Rating], entries: _Entries) -> PageTable:
    """Build the table of ratings on a track."""
    rows = []
    for rating in track_ratings:
        cells = ratings.build_rating_cells(rating, entries.information[rating.label])
        cells["Runs"] = _break_lines(cells["Runs"])
        rows.append(tuple(cells[column] for column in ratings.HEAD))
    return PageTable(caption, ratings.HEAD, rows, text_columns=frozenset({1}))


def _break_lines(text: str) -> str:
    """Return a text with a new line after each comma, so that a column of a wide table stays narrow."""
    return text.replace(", ", ",\n")


def _select_entries_to_plot(track_ratings: Sequence[Rating], entries: _Entries) -> list[PlottedEntry]:
    """Return the bundled entries, and the best of the others, in the order of their scores."""
    others = [rating.label for rating in track_ratings if rating.label not in entries.bundled]
    omitted = set(others[MAX_PLOTTED_ENTRIES:])
    return [
        PlottedEntry(
            rating,
            entries.styles[rating.label],
            is_rival=entries.information[rating.label] != _WHOLE_MAP,
            is_bundled=rating.label in entries.bundled,
        )
        for rating in track_ratings
        if rating.label not in omitted
    ]


def _describe_entries_without_messages(
    results: Sequence[Mapping[str, Any]], labels: Sequence[str]
) -> list[str]:
    """Return a note on the entries that were made before robots shared maps by messages, if there are any."""
    pairs = zip(results, labels, strict=True)
    old_entries = [label for result, label in pairs if not shares_maps_by_messages(result)]
    if not old_entries:
        return []
    return [
        f"{', '.join(old_entries)}: made with an earlier version, in which robots read the current maps "
        "of all robots in communication range, without messages. Loss, latency, message rate and "
        "bandwidth had no effect on shared maps. B/s is an estimate: 20 bytes for a position, 5 for each "
        "changed cell of a map, 28 for each reported position of another robot (number, position, time)."
    ]


def _build_entries_table(labeled_results: Iterable[tuple[str, Mapping[str, Any]]]) -> PageTable:
    """Build the table of the entries with their names, source hashes, gains and versions."""
    rows = []
    for label, result in labeled_results:
        entry = result["entry"]
        gains = ", ".join(f"{name} {value}" for name, value in entry["gains"].items())
        source = "installed package"
        if entry["source_sha256"]:
            source = f"source {entry['source_sha256'][:12]}"
        elif RatedController(entry["controller"], {}).is_built_in:
            source = "built in"
        origin = "robocov"
        if not result["is_bundled"]:
            # A file can contain any name and any hash.
            source = f"according to the file: {source}"
            origin = "a file, not verified here"
        versions = ", ".join(f"{name} {version}" for name, version in result["versions"].items())
        rows.append((label, entry["controller"], source, origin, gains or ratings.NO_VALUE, versions))
    head = ("Controller", "Name", "Code", "Result from", "Gains", "Versions")
    return PageTable("Entries", head, rows, text_columns=frozenset({1, 2, 3, 4, 5}))


def _build_anomaly_table(
    labeled_results: Iterable[tuple[str, Mapping[str, Any]]], rapf: Mapping[str, Any]
) -> PageTable:
    """Build the table of suspicious runs, with the number of runs for each reason.

    Parameters
    ----------
    labeled_results : iterable of (str, Mapping)
        Labels of the entries, and their results.
    rapf : Mapping
        The result of RAPF with default gains, with which the others are compared.

    Returns
    -------
    PageTable
        The table.
    """
    rows = []
    for label, result in labeled_results:
        runs_by_reason: dict[str, list[str]] = {}
        for anomaly in find_anomalies(result, rapf):
            run = f"{anomaly.track}, {anomaly.map}, seed {anomaly.seed}"
            runs_by_reason.setdefault(anomaly.reason, []).append(run)
        for reason, runs in runs_by_reason.items():
            rows.append((label, str(len(runs)), reason, runs[0]))
    head = ("Controller", "Runs", "Reason", "First run")
    return PageTable("Suspicious runs by controller and reason", head, rows, text_columns=frozenset({2, 3}))


def _find_default_rapf(results: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """Return the result of RAPF with default gains; without one, a result without rows."""
    for result in results:
        if _is_default_result(result, results) and result["entry"]["controller"] == "rapf":
            return result
    return {"rows": []}
