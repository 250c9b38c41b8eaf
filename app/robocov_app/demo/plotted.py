"""What the plot is of: the mean distance, or where robots are not equally fast the mean time."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from robocov.arrays import Array
    from robocov_app.demo.curves import Curve
    from robocov_app.demo.lane import Lane
    from robocov_app.demo.session import Session


class Plotted(NamedTuple):
    """What can be plotted.

    Attributes
    ----------
    name : str
    title, short : str
        As people call it.
    unit : str
    """

    name: str
    title: str
    short: str
    unit: str


DISTANCE = Plotted("distance", "Mean distance to the nearest robot", "mean distance", "m")
TIME = Plotted("time", "Mean time until the first robot is there", "mean time", "s")


def speeds_of(session: Session, lane: Lane) -> Array | None:
    """Return how fast each robot that is shown can go, (n,) m/s; None where all are equally fast.

    Robots that have failed are remembered: who is left may be equally fast, and the curve goes on.
    """
    there = session.circumstances(lane)
    if "max_speed" not in dict(there.limits.different):
        return None
    return there.limits.team(there.numbers).max_speed


def chosen(session: Session, wanted: Plotted) -> Plotted:
    """Return what is plotted: what is wanted, if there is a choice."""
    return wanted if any(len(lane.times) for lane in session.lanes) else DISTANCE


def curve_of(lane: Lane, what: Plotted) -> Curve:
    """Return a lane's curve of what is plotted."""
    return lane.times if what is TIME else lane.curve


def compared(session: Session, what: Plotted = DISTANCE) -> tuple[float, dict[int, float]]:
    """Return the newest time not after now for which the costs of all panes are known, and these by number.

    They come in one after the other; a pane without any yet is left out.
    """
    curves = {lane.number: curve_of(lane, what) for lane in session.lanes if len(curve_of(lane, what))}
    time = min([session.time, *(curve.last_time for curve in curves.values())])
    values = {number: curve.at(time) for number, curve in curves.items()}
    return time, {number: value for number, value in values.items() if np.isfinite(value)}
