"""Tables of the page: what every law reached, and how far it stayed above the reference on every map."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robocov_app.figures.statistics import Interval, bootstrap
from robocov_app.replication.contenders import LABELS
from robocov_app.replication.verdicts import amount

if TYPE_CHECKING:
    from robocov.arrays import Array
    from robocov_app.replication.outcomes import Outcomes
    from robocov_app.replication.references import Reference

ORDER = ("rapf-shared", "rapf-best", "rapf-default", "lloyd", "rpf-shared", "rpf-best")
"""Laws from left to right."""


@dataclass(frozen=True)
class LawRow:
    """What one contender reached over all scenarios.

    Attributes
    ----------
    key, label : str
    runs : int
    gap : Interval
        Median of J/J_ref - 1.
    quartiles : (low, high)
        Of the same.
    touched, stuck : float
        Share of runs in which a robot touched something, and that end with a robot stuck; nan where a law
        has no goals.
    settled : float
        Share of runs that came to rest.
    settling : float, s
        Median time of those that did.
    """

    key: str
    label: str
    runs: int
    gap: Interval
    quartiles: tuple[float, float]
    touched: float
    stuck: float
    settled: float
    settling: float


@dataclass(frozen=True)
class MapRow:
    """One map: the reference, and how far every contender stayed above it.

    Attributes
    ----------
    map : str
    reference : float, m
        J_ref as a mean distance.
    agreement : float
        Share of the restarts that found it.
    gaps : dict of contender to float
        Medians of J/J_ref - 1.
    """

    map: str
    reference: float
    agreement: float
    gaps: Mapping[str, float]


def law_rows(
    outcomes: Outcomes, laws: Iterable[str] = ORDER, labels: Mapping[str, str] = LABELS
) -> list[LawRow]:
    """Return a row for each contender that has runs, with its label."""
    rows = []
    for law in laws:
        fine = outcomes.among(outcomes.together((law,), "gap"))
        if not fine.scenarios:
            continue
        gap, settled = fine.of(law, "gap"), fine.of(law, "settled")
        low, high = np.quantile(gap, [0.25, 0.75]).tolist()
        rows.append(
            LawRow(
                law,
                labels[law],
                len(gap),
                bootstrap(gap, clusters=fine.maps),
                (low, high),
                _share(fine.of(law, "contacts")),
                _share(fine.of(law, "stuck")),
                float(np.isfinite(settled).mean()),
                float(np.median(settled[np.isfinite(settled)])) if np.isfinite(settled).any() else np.nan,
            )
        )
    return rows


def map_rows(outcomes: Outcomes, references: Mapping[str, Reference]) -> list[MapRow]:
    """Return a row for each map of the outcomes."""
    rows = []
    for map_ in dict.fromkeys(outcomes.maps):
        if map_ not in references:
            continue
        here = outcomes.among(np.array([each == map_ for each in outcomes.maps], dtype=bool))
        gaps = {}
        for law in ORDER:
            gap = here.of(law, "gap")
            if np.isfinite(gap).any():
                gaps[law] = float(np.nanmedian(gap))
        rows.append(MapRow(map_, references[map_].mean_distance, references[map_].agreement, gaps))
    return rows


def settled_text(row: LawRow) -> str:
    """Return when a law's teams came to rest, in words."""
    if not np.isfinite(row.settling):
        return "never"
    return f"{row.settling:.0f} s ({amount(row.settled, '%')} of the runs)"


def _share(counts: Array) -> float:
    """Return the share of counts above zero among those that are there; nan where none is."""
    fine = counts[np.isfinite(counts)]
    return float((fine > 0).mean()) if len(fine) else float("nan")
