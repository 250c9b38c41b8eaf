"""What is said of runs in numbers: of one run, of its moments, of all runs of a sweep."""

from __future__ import annotations

from robocov.metrics.summary import (
    MOVING_RATE,
    SETTLED_DISTANCE,
    SETTLED_WINDOW,
    STUCK_AWAY,
    STUCK_DISTANCE,
    STUCK_WINDOW,
    TOUCHING,
    CostHistory,
    clearances,
    contacts,
    cost_history,
    mean_over_run,
    path_lengths,
    sample_moments,
    settled_at,
    stuck_robots,
    summarise,
)

__all__ = [
    "MOVING_RATE",
    "SETTLED_DISTANCE",
    "SETTLED_WINDOW",
    "STUCK_AWAY",
    "STUCK_DISTANCE",
    "STUCK_WINDOW",
    "TOUCHING",
    "CostHistory",
    "clearances",
    "contacts",
    "cost_history",
    "mean_over_run",
    "path_lengths",
    "sample_moments",
    "settled_at",
    "stuck_robots",
    "summarise",
]
