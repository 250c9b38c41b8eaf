"""Ratings of results on each track, over the runs that all of them have."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robocov.arrays import Array
from robocov_app.benchmark import suite
from robocov_app.figures.statistics import Interval, bootstrap, median_time

NOTHING = "–"


@dataclass(frozen=True)
class Rating:
    """One entry on one track: its runs among those that all entries of the track have."""

    label: str
    track: str
    rows: Sequence[Mapping[str, Any]]  # those that did not fail
    failed: int

    def values(self, figure: str) -> Array:
        return np.array([row[figure] for row in self.rows if row[figure] is not None], dtype=float)

    def median(self, figure: str) -> float:
        values = self.values(figure)
        return float(np.median(values)) if len(values) else float("nan")

    @property
    def gap(self) -> Interval:
        maps = [row["map"] for row in self.rows if row["gap"] is not None]
        return bootstrap(self.values("gap"), "median", maps) if maps else Interval(np.nan, np.nan, np.nan)

    def at_rest(self) -> tuple[float, float | None]:
        """Return the share of runs at rest at the end, and the Kaplan-Meier median of the time to rest, s."""
        rest = self.values("settled_at_s").tolist()
        censored = [suite.TRACKS[self.track].duration] * (len(self.rows) - len(rest))
        median = median_time(rest, censored) if rest else np.inf
        return len(rest) / len(self.rows), median if np.isfinite(median) else None

    def rate(self, figure: str) -> float:
        """Return the median of a figure for a simulated second of one robot."""
        track = suite.TRACKS[self.track]
        return self.median(figure) / (track.robots * track.duration)


def ratings_of(results: Sequence[Mapping[str, Any]]) -> dict[str, list[Rating]]:
    """Return the ratings by track: of each track over the runs that every result has that has the track."""
    found: dict[str, list[Rating]] = {}
    for track in suite.TRACKS:
        tables = ([row for row in each["rows"] if row["track"] == track] for each in results)
        own = [{(row["map"], row["seed"]): row for row in rows} for rows in tables]
        for label, rows in zip(labels_of(results), own, strict=True):
            some = [row for key, row in rows.items() if all(key in other for other in own if other)]
            fine = [row for row in some if "error" not in row]
            if some:
                found.setdefault(track, []).append(Rating(label, track, fine, len(some) - len(fine)))
    return found


def labels_of(results: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return what each result is called: its controller, the gains that were set, a number for twins."""
    labels: list[str] = []
    for entry in (result["entry"] for result in results):
        changed = ", ".join(f"{name} {value}" for name, value in entry["set"].items())
        label = f"{entry['label']} ({changed})" if changed else str(entry["label"])
        twins = sum(each == label or each.startswith(f"{label} #") for each in labels)
        labels.append(f"{label} #{twins + 1}" if twins else label)
    return labels


def number(value: float | None, form: str = ".3g") -> str:
    return NOTHING if value is None or not np.isfinite(value) else f"{value:{form}}"


HEAD = (  # columns of a track's table; `NOTES` say what they are
    *("Controller", "Knows", "Runs", "Gap, %", "95 %", "Mean", "Worst", "To 5 %, s", "∫J / J_ref, s"),
    *("Path, m", "Work, J", "Contacts", "At rest", "Rest, s", "B/s", "µs/s"),
)
_SHORT = ("Runs", "Gap, %", "95 %", "Worst", "To 5 %, s", "Path, m", "Contacts", "At rest", "B/s", "µs/s")
NOTES = (
    "Gap: J / J_ref − 1 at the end, the median over runs with its 95 % interval (bootstrap that draws whole "
    "maps), mean and worst; J_ref is the best placement known, no proven optimum, so gaps may be too small; "
    "in brackets the median above certified lower bounds, where all are known. "
    "To 5 %: from when on J stays within 5 % of its own end. ∫J / J_ref: the integral of J over the run by "
    "the reference. Path: mean path length of a robot.",
    "Medians over runs, but: contacts are the runs in which a robot touched a wall or another one; at rest "
    "is the share of runs in which no robot gets 5 cm in any 4 s at the end; rest is the Kaplan-Meier median "
    "of when that began, with runs that did not rest as censored. B/s: bytes a robot sends per second, "
    "heard or not: 20 for a position, 5 for each changed cell of a shared map. µs/s: processor time of "
    "the law for a robot and second; it is of the machine that ran it.",
)


def rating_row(rating: Rating, knows: str) -> tuple[str, ...]:
    """Return the cells of one entry's row under `HEAD`."""
    gap, gaps = rating.gap, rating.values("gap")
    runs = str(len(rating.rows)) + (f" (+{rating.failed} failed)" if rating.failed else "")
    if len(gaps) < len(rating.rows):
        runs += f", {len(rating.rows) - len(gaps)} without gap"
    bounds, (share, rest) = rating.values("gap_to_bound"), rating.at_rest()
    surely = f" (≤ {100.0 * float(np.median(bounds)):.1f})" if len(bounds) == len(gaps) > 0 else ""
    integrals = [
        row["mean_distance_over_run_m"] / (row["mean_distance_m"] / (1.0 + row["gap"]))
        for row in rating.rows
        if row["gap"] is not None
    ]
    duration = suite.TRACKS[rating.track].duration
    integral = float(np.median(integrals)) * duration if integrals else None
    touched = sum(row["contacts"] > 0 for row in rating.rows)
    return (
        *(rating.label, knows, runs, number(100.0 * gap.estimate, ".1f") + surely),
        NOTHING if np.isnan(gap.low) else f"{100.0 * gap.low:.1f} to {100.0 * gap.high:.1f}",
        *(number(100.0 * float(of(gaps)) if len(gaps) else None, ".1f") for of in (np.mean, np.max)),
        *(number(rating.median("near_final_s"), ".0f"), number(integral, ".0f")),
        *(number(rating.median("path_length_m"), ".1f"), number(rating.median("work_J"), ".0f")),
        *(f"{touched} of {len(rating.rows)}", f"{share:.0%}", number(rest, ".0f")),
        *(number(rating.rate("told_bytes"), ".0f"), number(1e6 * rating.rate("deciding_s"), ".0f")),
    )


def family_rows(ratings: Sequence[Rating]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return head and rows of the median gaps, in percent, of each entry by families of maps."""
    families = list(dict.fromkeys(suite.FAMILY_OF[row["map"]] for rating in ratings for row in rating.rows))
    rows = []
    for rating in ratings:
        parts = [[row for row in rating.rows if suite.FAMILY_OF[row["map"]] == family] for family in families]
        gaps = (replace(rating, rows=part).median("gap") for part in parts)
        rows.append((rating.label, *(number(100.0 * gap, ".1f") for gap in gaps)))
    return ("Controller", *families), rows


def summary_rows(result: Mapping[str, Any]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    rows = []
    for track, ratings in ratings_of([result]).items():
        cells = dict(zip(HEAD, rating_row(ratings[0], ""), strict=True))
        rows.append((track, *(cells[name] for name in _SHORT)))
    return ("Track", *_SHORT), rows
