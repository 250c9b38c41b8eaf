"""Titles of runs in figures, and the facts below them: cost, time and number of robots."""

from collections.abc import Sequence

from robocov.controllers import get_gains
from robocov.controllers.gains import Value, format_value
from robocov.controllers.registry import CONTROLLERS
from robocov.errors import format_count
from robocov.record import Record
from robocov_app.render.density_text import format_cost, get_cost_name

_MAX_GAINS = 3
"""Maximum number of gains in a title."""


def build_run_title(record: Record) -> str:
    """Build the title of a run, such as "RAPF, k_rep = 2".

    Parameters
    ----------
    record : Record

    Returns
    -------
    str
        Label of the controller, and the first `_MAX_GAINS` gains that differ from their defaults. Gains of
        controllers outside robocov are left out, because their defaults are unknown without running them.
    """
    gains = [f"{name} = {format_value(value)}" for name, value in find_changed_gains(record).items()]
    if len(gains) > _MAX_GAINS:
        gains = [*gains[:_MAX_GAINS], "…"]
    return ", ".join([record.label, *gains])


def find_changed_gains(record: Record) -> dict[str, Value]:
    """Return the gains of a run that differ from the defaults of its controller.

    Examples
    --------
    >>> import robocov as rc
    >>> record = rc.run("square", rc.Rapf(k_rep=2.0), duration=0.1)
    >>> find_changed_gains(record)
    {'k_rep': 2.0}
    """
    declared_gains = get_gains(CONTROLLERS.get(record.controller))
    changed = {}
    for name, value in record.gains.items():
        declared = declared_gains.get(name)
        if declared is not None and value != declared.default:
            changed[name] = value
    return changed


def join_facts(facts: Sequence[str]) -> str:
    """Join facts to one line; empty facts are left out."""
    return "  ·  ".join(fact for fact in facts if fact)


def format_run_cost(record: Record, mean_distance: float | None, mean_time: float | None) -> str:
    """Return the cost of the final positions as text; an empty text if it is unknown."""
    if mean_distance is None:
        return ""
    return format_cost(get_cost_name(record.environment), mean_distance, mean_time)


def format_end_time(record: Record) -> str:
    """Return the time at the end of a run as text."""
    return f"t = {record.time[-1]:.1f} s"


def format_robot_count(record: Record) -> str:
    """Return the number of robots of a run as text."""
    return format_count(len(record.team), "robot")
