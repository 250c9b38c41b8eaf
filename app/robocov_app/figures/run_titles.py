"""Titles of runs in figures: the controller, with the gains that differ from their defaults."""

from robocov.controllers import get_gains
from robocov.controllers.gains import Value, format_value
from robocov.controllers.registry import CONTROLLERS
from robocov.record import Record

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
