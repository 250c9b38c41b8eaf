"""Metrics of recorded runs.

- `cost_history`: the coverage cost over a run
- `settling`: whether a team is at rest, and when it came to rest
- `motion`: path lengths and stuck robots
- `clearance`: distances to walls and other robots, and contacts
- `summary`: the summary of a run in ``run.json``
- `advice`: signs that the parameters of a run are unsuitable
- `run_metrics`: areas, energy and connectivity over time
- `communication`: the messages that robots send
- `connectivity`, `visible_area`: the communication graph, and the area that a team sees
- `results`: the results of a sweep, read from its folder
"""

from robocov.metrics.clearance import (
    MAX_CONTACT_GAP_M,
    compute_clearances,
    count_contacts,
    measure_robot_gaps,
)
from robocov.metrics.cost_history import (
    MAX_RATE_WITH_MOVING_OBSTACLES_HZ,
    CostHistory,
    compute_cost_history,
    compute_mean_over_run,
    select_sampled_steps,
)
from robocov.metrics.motion import compute_path_lengths, count_stuck_robots
from robocov.metrics.settling import (
    SETTLED_DISTANCE_M,
    SETTLED_WINDOW_S,
    find_settling_time,
    is_team_at_rest,
)
from robocov.metrics.summary import compute_relative_excess, summarize

__all__ = [
    "MAX_CONTACT_GAP_M",
    "MAX_RATE_WITH_MOVING_OBSTACLES_HZ",
    "SETTLED_DISTANCE_M",
    "SETTLED_WINDOW_S",
    "CostHistory",
    "compute_clearances",
    "compute_cost_history",
    "compute_mean_over_run",
    "compute_path_lengths",
    "compute_relative_excess",
    "count_contacts",
    "count_stuck_robots",
    "find_settling_time",
    "is_team_at_rest",
    "measure_robot_gaps",
    "select_sampled_steps",
    "summarize",
]
