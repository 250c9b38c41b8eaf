"""What the figures show here, in words with numbers that are computed from the runs they show."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from robocov.voronoi import partition
from robocov_app.replication.claims import FIRST_MINUTE
from robocov_app.replication.placements import matched_distance
from robocov_app.replication.reading import mean_until
from robocov_app.replication.verdicts import amount

if TYPE_CHECKING:
    from robocov.metrics import CostHistory
    from robocov.record import Record
    from robocov_app.replication.figures import Shown

ARRIVED = 0.05
"""A cost has arrived when it stays within 5 % of its last value."""


def seen(number: int, runs: Mapping[str, Shown], first: Record) -> str:
    """Return what one of the figures 1 to 8 shows here.

    Parameters
    ----------
    number : int
    runs : dict of name to Shown
        As for `robocov_app.replication.figures.draw_figure`.
    first : Record
        Whose first moment is figure 1.
    """
    if number == 1:
        return _partition(first)
    if number in (2, 4, 6):
        case = {2: "convex", 4: "a", 6: "b"}[number]
        return _ends(*_pair(runs, case))
    if number == 8:
        return _ends(*_pair(runs, "other")) + " " + _moved(runs)
    return _motion(*_pair(runs, {3: "convex", 5: "a", 7: "b"}[number]))


def arrival(history: CostHistory) -> float:
    """Return from when on a cost stays within 5 % of its last value, s."""
    cost = history.mean_distance
    away = np.flatnonzero(np.abs(cost - cost[-1]) > ARRIVED * cost[-1])
    return float(history.time[away[-1] + 1]) if len(away) else float(history.time[0])


def _pair(runs: Mapping[str, Shown], case: str) -> tuple[Shown, Shown]:
    return runs[f"{case}/rapf"], runs[f"{case}/{'lloyd' if case == 'convex' else 'rpf'}"]


def _partition(first: Record) -> str:
    places = first.positions[0]
    centres = partition(places, first.environment.region).centroid
    away = np.hypot(*(centres - places).T)
    return (
        f"The robots stand anywhere in “{first.environment.name}”, on average "
        f"{amount(float(away.mean()), 'm')} from the centres of mass of their cells."
    )


def _ends(ours: Shown, other: Shown) -> str:
    mine, theirs = (float(each.history.mean_distance[-1]) for each in (ours, other))
    return (
        f"On “{ours.record.environment.name}” RAPF ends with a mean distance of {mine:.3f} m, "
        f"{other.record.label} with {theirs:.3f} m: {_compared(mine, theirs)}."
    )


def _motion(ours: Shown, other: Shown) -> str:
    early = [mean_until(each.history, FIRST_MINUTE) for each in (ours, other)]
    shared = min(len(ours.history.time), len(other.history.time))
    below = ours.history.mean_distance[1:shared] < other.history.mean_distance[1:shared]
    return (
        f"Averaged over the first {FIRST_MINUTE:g} s RAPF has {early[0]:.3f} m, {other.record.label} "
        f"{early[1]:.3f} m: {_compared(*early)}. RAPF's is the lower one "
        f"{amount(float(below.mean()), '%')} of the time. RAPF stays within 5 % of its last value from "
        f"{arrival(ours.history):.0f} s on, {other.record.label} from {arrival(other.history):.0f} s on."
    )


def _moved(runs: Mapping[str, Shown]) -> str:
    apart = [
        matched_distance(runs[f"b/{law}"].record.positions[-1], runs[f"other/{law}"].record.positions[-1])
        for law in ("rapf", "rpf")
    ]
    return (
        f"Between the ends of figure 6 and these, robots are {amount(apart[0], 'm')} apart with RAPF and "
        f"{amount(apart[1], 'm')} with RPF (matched with the least sum of distances)."
    )


def _compared(mine: float, theirs: float) -> str:
    change = mine / theirs - 1.0
    if abs(change) < 0.0005:
        return "the same"
    return f"{amount(abs(change), '%')} {'less' if change < 0 else 'more'}"
