"""Ratings of controllers on each track, each over the controller's own runs.

The rating of an entry does not depend on other entries. Adding an entry to a page does not change the numbers
of the others. Only complete entries are ranked.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from robocov.text import escape_controls
from robocov.typing import FloatArray
from robocov_app.benchmark import suite
from robocov_app.figures.statistics import Interval, bootstrap, estimate_median_time

NO_VALUE = "–"
"""Text of a cell whose value is unknown."""
_INFINITE_GAP = "∞"
"""Text of a cell with a gap that is infinite because runs failed."""
_MAX_FINITE_GAP = 1e30
"""Gap in place of an infinite one in resamples, because percentiles of infinite values are not defined. The
gaps of all runs are smaller than its square root."""
_NORMAL_QUANTILE = 1.96
"""Half the width of a 95% interval, in standard errors."""
_VARIANT_PREFIX = "dense-"
"""Beginning of the names of maps that are equal to others, apart from their density."""
MIN_INTERVAL_MAPS = 12
"""Minimum number of maps for an interval. With six maps, the interval of a median contains nearly all values,
and with twelve about half of them. Intervals of means would be too narrow with few maps."""
FILE_MARK = "*"
"""End of the labels of results that are not bundled: they are from files, whose content may be wrong."""
_MAX_LABEL_CHARS = 100
"""Maximum length of the label of an entry with its gains."""
CONTACT_FACTOR = 0.5
"""Factor for the score of a run in which a robot touched a wall or another robot."""
MOTION_FACTOR = 0.5
"""Factor for the score of a run in which the team has not come to rest by the end."""

HEAD = (
    "Controller",
    "Knows",
    "Score, %",
    "Runs",
    "Gap, %",
    "95%",
    "Mean",
    "Worst",
    "Within 5%, s",
    "∫J / J_ref, s",
    "Path, m",
    "Work, J",
    "Runs with contacts",
    "Settled",
    "Settled, s",
    "B/s",
    "µs/s",
)
"""Columns of the table of a track, which are explained in `NOTES`."""
_SUMMARY_COLUMNS = (
    "Score, %",
    "Runs",
    "Gap, %",
    "95%",
    "Worst",
    "Within 5%, s",
    "Path, m",
    "Runs with contacts",
    "Settled",
    "B/s",
    "µs/s",
)
NOTES = (
    "Score: the mean of J_ref / J over all runs. The value of a run is halved if a robot touched a wall or "
    "another robot, and halved again if the team had not settled by the end. A failed run counts 0, "
    "and so does a run that covers a different area from the reference. The score of an entry depends on no "
    "other entry. Only entries with all runs of a track are ranked on it.",
    "Gap: J / J_ref − 1 at the end. Columns give its median over runs, the 95% interval of the median "
    "(bootstrap over maps, for at least 12 maps), the mean and the worst. The gap of a run that failed, or "
    "that covers a different area from the reference, is infinite (∞). J_ref is that of the reference: "
    "the best known placement, not a proven optimum, so gaps may be too small. The number in brackets cannot "
    "be too small: it is the median gap to bound, J / J_bound − 1, where J_bound is a proven lower bound. It "
    "is given if all bounds are known. They are certified for J as it is computed, a sum over 128 x 128 "
    "sites, not for the integral that it approximates.",
    "Within 5%: the time from which J stays within 5% of its final value. ∫J / J_ref: the integral of J "
    "over the run, divided by J_ref. Path: mean path length of a robot. Both are medians over runs, and so "
    "are the other columns, with these exceptions. Failed runs count as infinite in all medians, so that no "
    "entry improves by failing. Runs with contacts: those runs among the finished ones in which a robot "
    "touched a wall or another robot. Settled: the fraction of runs at whose end no robot moves 5 cm or "
    "more within 4 s, and the Kaplan-Meier median of the time at which this begins; runs that fail or do "
    "not settle are censored. Plots leave out entries whose median gap is infinite.",
    "B/s: bytes that a robot sends per second, received or not: 20 for each position (number, position), "
    "and the sizes of the messages of its controller, in which robots share maps and reports about other "
    "robots. The controller itself declares these sizes. µs/s: processor time of the controller per robot "
    "and second of simulation time, as the entry reports it. It depends on the machine, cannot be verified, "
    "and has no influence on scores and ranks.",
)
CORRECTIONS = (
    "Results of early development versions cannot be compared with those of this version. Robots with shared "
    "maps read the maps of all robots in range, whether or not messages arrived, so results on the track "
    "Lossy were not valid. The cost included space behind gaps that are too narrow for a robot. Since then, "
    "faults of some controllers were fixed, and our own controllers explore less. The page “Submit to the "
    "benchmark” of the handbook lists all corrections, with figures before and after."
)
"""Summary of the section "Corrections" of the handbook."""


RunKey: TypeAlias = tuple[str, int]
"""Map and seed of a run of a track."""


@dataclass(frozen=True)
class Rating:
    """The rating of one controller on one track, over its runs on this track.

    Parameters
    ----------
    label : str
        Label of the controller.
    track : str
        Name of the track.
    rows : sequence of Mapping
        Rows of the runs that did not fail.
    failed_rows : sequence of Mapping
        Rows of the runs that failed.

    Attributes
    ----------
    is_complete : bool
        Whether the rating includes all runs of the track; only complete ratings are ranked.
    score : float
        Mean score of the runs; see `compute_score`.
    """

    label: str
    track: str
    rows: Sequence[Mapping[str, Any]]
    failed_rows: Sequence[Mapping[str, Any]] = ()

    def get_values(self, metric: str) -> FloatArray:
        """Return the values of a metric in the runs that have one, (m,)."""
        return np.array([row[metric] for row in self.rows if row[metric] is not None], dtype=float)

    def compute_median(self, metric: str) -> float:
        """Return the median of a metric over the runs; nan if no run has a value.

        Runs without a value, such as failed ones, count as infinite, so that no entry improves by failing or
        by leaving out values.
        """
        values = self.get_values(metric)
        if not len(values):
            return float("nan")
        return self.compute_median_over_runs(values)

    def compute_median_over_runs(self, values: Sequence[float] | FloatArray) -> float:
        """Return the median of the values over all runs; runs without a value count as infinite."""
        missing_count = self.run_count - len(values)
        return float(np.median([*values, *[np.inf] * missing_count]))

    @property
    def run_count(self) -> int:
        """Number of runs, including failed ones."""
        return len(self.rows) + len(self.failed_rows)

    @property
    def run_keys(self) -> list[RunKey]:
        """Map and seed of each run, including failed ones."""
        return [get_run_key(row) for row in (*self.rows, *self.failed_rows)]

    @property
    def gaps(self) -> FloatArray:
        """Gap of each run in `run_keys`; infinite if the run failed or covers a different area."""
        gaps = [np.inf if row["gap"] is None else row["gap"] for row in self.rows]
        return np.array([*gaps, *[np.inf] * len(self.failed_rows)])

    @property
    def is_complete(self) -> bool:
        """Whether the rating includes all runs of the track."""
        return self.run_count == len(list_run_keys(self.track))

    @property
    def run_scores(self) -> FloatArray:
        """Score of each run in `run_keys`; 0 if the run failed."""
        return np.array([*map(compute_score, self.rows), *[0.0] * len(self.failed_rows)])

    @property
    def score(self) -> float:
        """Mean score of the runs; failed runs count as 0."""
        return float(self.run_scores.sum()) / self.run_count

    @property
    def gap(self) -> Interval:
        """Median gap to the reference placement, with an interval if there are enough maps."""
        maps = [map_name for map_name, _ in self.run_keys]
        if len(set(maps)) < MIN_INTERVAL_MAPS:
            return Interval(float(np.median(self.gaps)), np.nan, np.nan)
        interval = bootstrap(np.minimum(self.gaps, _MAX_FINITE_GAP), "median", maps)
        return Interval(
            _restore_infinity(interval.estimate),
            _restore_infinity(interval.low),
            _restore_infinity(interval.high),
        )

    def select_runs(self, keys: Iterable[RunKey]) -> "Rating":
        """Return the rating over the runs with the given keys, including those that failed."""
        selected = set(keys)
        return replace(
            self,
            rows=[row for row in self.rows if get_run_key(row) in selected],
            failed_rows=[row for row in self.failed_rows if get_run_key(row) in selected],
        )

    def compute_rest(self) -> tuple[float, float | None]:
        """Compute the fraction of runs that came to rest, and the median time until rest.

        Returns
        -------
        fraction : float
            Fraction of the runs in which the team has settled.
        time : float or None
            Kaplan-Meier estimate of the median time to rest, s; None if most runs did not come to rest.
            Failed runs count as runs that did not come to rest.
        """
        rest_times = self.get_values("settled_at_s").tolist()
        fraction = len(rest_times) / max(1, self.run_count)
        if not rest_times:
            return fraction, None
        censored = [suite.TRACKS[self.track].duration] * (self.run_count - len(rest_times))
        median = estimate_median_time(rest_times, censored)
        return fraction, median if np.isfinite(median) else None

    def compute_rate(self, metric: str) -> float:
        """Return the median of a metric per robot and second of simulation time."""
        track = suite.TRACKS[self.track]
        return self.compute_median(metric) / (track.robots * track.duration)


def list_run_keys(track_name: str) -> list[RunKey]:
    """Return the map and seed of each run of a track."""
    track = suite.TRACKS[track_name]
    return list(product(track.maps, track.seeds))


def get_run_key(row: Mapping[str, Any]) -> RunKey:
    """Return the map and seed of a row."""
    return row["map"], row["seed"]


def compute_score(row: Mapping[str, Any]) -> float:
    """Compute the score of a run that did not fail.

    Parameters
    ----------
    row : Mapping
        Row of the run in a result.

    Returns
    -------
    float
        J_ref / J, halved if there was a contact, and halved again if the team has not come to rest; 0 if the
        gap is unknown.

    Examples
    --------
    >>> compute_score({"gap": 0.25, "contacts": 0, "settled_at_s": 20.0})
    0.8
    >>> compute_score({"gap": 0.25, "contacts": 3, "settled_at_s": None})
    0.2
    """
    if row["gap"] is None:
        return 0.0
    score = 1.0 / (1.0 + row["gap"])
    if row["contacts"]:
        score *= CONTACT_FACTOR
    if row["settled_at_s"] is None:
        score *= MOTION_FACTOR
    return float(score)


class MeanScore(NamedTuple):
    """Mean score of an entry on several tracks, each of which counts the same."""

    score: float
    margin: float
    """Half the width of the 95% interval over maps; nan for fewer than `MIN_INTERVAL_MAPS`."""


def _restore_infinity(gap: float) -> float:
    """Return infinity for a gap that stands for an infinite one, or is interpolated with one."""
    if gap > np.sqrt(_MAX_FINITE_GAP):
        return np.inf
    return gap


def compute_mean_score(track_ratings: Collection[Rating]) -> MeanScore:
    """Compute the mean score of an entry, and its 95% interval over maps.

    Parameters
    ----------
    track_ratings : collection of Rating
        Ratings of the entry on each track.

    Returns
    -------
    MeanScore

    Notes
    -----
    The runs on a map are correlated, even on different tracks. The interval therefore follows from the
    variance of the contributions of maps (Liang and Zeger, 1986), not of runs.
    """
    contributions: dict[str, float] = {}
    for rating in track_ratings:
        weight = 1.0 / (len(track_ratings) * rating.run_count)
        for (map_name, _), run_score in zip(rating.run_keys, rating.run_scores, strict=True):
            name = map_name.removeprefix(_VARIANT_PREFIX)
            contributions.setdefault(name, 0.0)
            contributions[name] += weight * (run_score - rating.score)
    score = float(np.mean([rating.score for rating in track_ratings]))
    map_count = len(contributions)
    if map_count < MIN_INTERVAL_MAPS:
        return MeanScore(score, np.nan)
    variance = sum(value**2 for value in contributions.values()) * map_count / (map_count - 1)
    return MeanScore(score, _NORMAL_QUANTILE * float(np.sqrt(variance)))


def build_ratings(results: Sequence[Mapping[str, Any]]) -> dict[str, list[Rating]]:
    """Build the ratings of all results by track.

    Each result is rated over its own runs. Rows that do not belong to the suite are ignored.

    Parameters
    ----------
    results : sequence of Mapping
        As returned by `robocov_app.benchmark.results.read_result`.

    Returns
    -------
    dict
        Ratings by track, in the order of the results.
    """
    labels = label_results(results)
    ratings: dict[str, list[Rating]] = {}
    for track in suite.TRACKS:
        keys = list_run_keys(track)
        for label, result in zip(labels, results, strict=True):
            table = {get_run_key(row): row for row in result["rows"] if row["track"] == track}
            runs = [table[key] for key in keys if key in table]
            if not runs:
                continue
            rows = [row for row in runs if "error" not in row]
            failed_rows = [row for row in runs if "error" in row]
            rating = Rating(label, track, rows, failed_rows)
            ratings.setdefault(track, []).append(rating)
    return ratings


def label_results(results: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return a unique label for each result.

    It consists of the label of the controller, gains that were set, a number if necessary, and `FILE_MARK` if
    the result is not bundled.

    Parameters
    ----------
    results : iterable of Mapping
        As returned by `robocov_app.benchmark.results.read_result`.

    Returns
    -------
    list of str
    """
    labels: list[str] = []
    for result in results:
        entry = result["entry"]
        name = " ".join(str(entry["label"]).split())
        if entry["set"]:
            gains = ", ".join(f"{gain} {value}" for gain, value in entry["set"].items())
            name = f"{name} ({gains})"
        name = shorten(escape_controls(name, single_line=True), _MAX_LABEL_CHARS)
        mark = "" if result.get("is_bundled") else FILE_MARK
        label = f"{name}{mark}"
        number = 1
        while label in labels:
            number += 1
            label = f"{name} #{number}{mark}"
        labels.append(label)
    return labels


def shorten(text: str, max_chars: int) -> str:
    """Shorten a text to a number of characters, the last of which is then an ellipsis."""
    return text if len(text) <= max_chars else f"{text[: max_chars - 1]}…"


def format_number(value: float | None, format_spec: str = ".3g") -> str:
    """Format a number; a dash stands for None and for values that are not finite."""
    if value is None or not np.isfinite(value):
        return NO_VALUE
    return f"{value:{format_spec}}"


def format_gap(gap: float) -> str:
    """Format a gap in percent; a dash stands for nan."""
    return _INFINITE_GAP if np.isposinf(gap) else format_number(100.0 * gap, ".1f")


def build_rating_cells(rating: Rating, information: str) -> dict[str, str]:
    """Build the row of a rating in the table of its track.

    Parameters
    ----------
    rating : Rating
        Rating of the controller on the track.
    information : str
        The information that the controller uses.

    Returns
    -------
    dict of str to str
        Cells by the columns in `HEAD`, in the same order.
    """
    gap = rating.gap
    fraction_at_rest, rest_time = rating.compute_rest()
    contacts = sum(row["contacts"] > 0 for row in rating.rows)
    interval = NO_VALUE if np.isnan(gap.low) else f"{format_gap(gap.low)}–{format_gap(gap.high)}"
    return {
        "Controller": rating.label,
        "Knows": information,
        "Score, %": format_number(100.0 * rating.score, ".1f"),
        "Runs": _format_runs(rating),
        "Gap, %": format_gap(gap.estimate) + _format_bound(rating),
        "95%": interval,
        "Mean": format_gap(float(np.mean(rating.gaps))),
        "Worst": format_gap(float(np.max(rating.gaps))),
        "Within 5%, s": format_number(rating.compute_median("near_final_s"), ".0f"),
        "∫J / J_ref, s": format_number(_compute_cost_integral(rating), ".0f"),
        "Path, m": format_number(rating.compute_median("path_length_m"), ".1f"),
        "Work, J": format_number(rating.compute_median("work_J"), ".0f"),
        "Runs with contacts": f"{contacts} of {len(rating.rows)}",
        "Settled": f"{fraction_at_rest:.0%}",
        "Settled, s": format_number(rest_time, ".0f"),
        "B/s": format_number(rating.compute_rate("sent_bytes"), ".0f"),
        "µs/s": format_number(1e6 * rating.compute_rate("deciding_s"), ".0f"),
    }


def format_run_count(count: int, total: int, failed: int) -> str:
    """Format the number of runs of an entry, with their total number if some are missing or failed."""
    text = str(count) if count == total else f"{count} of {total}"
    return f"{text}, {failed} failed" if failed else text


def _format_runs(rating: Rating) -> str:
    """Return the numbers of runs, failed runs and runs without a gap as text."""
    text = format_run_count(rating.run_count, len(list_run_keys(rating.track)), len(rating.failed_rows))
    missing_count = sum(row["gap"] is None for row in rating.rows)
    if missing_count:
        text += f", {missing_count} without gap"
    return text


def _format_bound(rating: Rating) -> str:
    """Return the median gap to the bound in brackets; empty unless all bounds are known."""
    gaps_to_bound = [row["gap_to_bound"] for row in rating.rows if row["gap"] is not None]
    if not gaps_to_bound or None in gaps_to_bound:
        return ""
    median = rating.compute_median_over_runs(gaps_to_bound)
    return f" (≤ {format_gap(median)})"


def _compute_cost_integral(rating: Rating) -> float | None:
    """Return the median of the integral of J / J_ref over a run, s; None if no run has this integral."""
    ratios = []
    for row in rating.rows:
        if row["gap"] is not None and row["mean_distance_over_run_m"] is not None:
            reference_cost = row["mean_distance_m"] / (1.0 + row["gap"])
            ratios.append(row["mean_distance_over_run_m"] / reference_cost)
    if not ratios:
        return None
    return rating.compute_median_over_runs(ratios) * suite.TRACKS[rating.track].duration


def build_family_rows(ratings: Sequence[Rating]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Build a table of the median gaps on each family of maps, in percent.

    Parameters
    ----------
    ratings : sequence of Rating
        Ratings of several controllers on one track.

    Returns
    -------
    header : tuple of str
        Column titles.
    rows : list of tuple of str
        One row for each rating.
    """
    run_keys = [key for rating in ratings for key in rating.run_keys]
    families = list(dict.fromkeys(suite.FAMILY_OF[map_name] for map_name, _ in run_keys))
    table = []
    for rating in ratings:
        cells = [rating.label]
        for family in families:
            keys = [key for key in rating.run_keys if suite.FAMILY_OF[key[0]] == family]
            gaps = rating.select_runs(keys).gaps
            cells.append(format_gap(float(np.median(gaps))) if keys else NO_VALUE)
        table.append(tuple(cells))
    return ("Controller", *families), table


def build_summary_table(result: Mapping[str, Any]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Build a short table of one result, with one row for each track.

    Parameters
    ----------
    result : Mapping
        As returned by `robocov_app.benchmark.results.read_result`.

    Returns
    -------
    header : tuple of str
        Column titles.
    rows : list of tuple of str
        One row for each track.
    """
    rows = []
    for track, ratings in build_ratings([result]).items():
        cells = build_rating_cells(ratings[0], information="")
        rows.append((track, *(cells[name] for name in _SUMMARY_COLUMNS)))
    return _drop_empty_columns(("Track", *_SUMMARY_COLUMNS), rows)


def _drop_empty_columns(
    header: tuple[str, ...], rows: Sequence[tuple[str, ...]]
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return a table without the columns that have no value in any row."""
    columns = [k for k in range(len(header)) if any(row[k] != NO_VALUE for row in rows)]
    short_header = tuple(header[k] for k in columns)
    return short_header, [tuple(row[k] for k in columns) for row in rows]
