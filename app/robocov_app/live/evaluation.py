"""The answer to a question about the cost: the same beside the window and in its own process."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from robocov.errors import InputError, RobocovError

if TYPE_CHECKING:
    from robocov.arrays import Array
    from robocov.cost import CoverageCost, CoverageResult, MomentaryCost
    from robocov_app.live.messages import Question


@dataclass(frozen=True, eq=False)
class Evaluation:
    """The cost of positions on the map as it is at their time.

    Attributes
    ----------
    cost : CoverageCost
        Of that map.
    result : CoverageResult
        With a row for every robot.
    path : (w, 2) m or None
        See `Answer`, as for
    travel_time : float, s, or None
    """

    cost: CoverageCost
    result: CoverageResult
    path: Array | None
    travel_time: float | None


def evaluated(momentary: MomentaryCost, question: Question) -> Evaluation:
    """Return the answer to a question.

    Raises
    ------
    InputError
        When a robot is in an obstacle that stands, or each one is below an obstacle that moves.
    """
    time, positions = question.time, question.positions
    result = momentary.of_all(time, positions)
    if result is None:
        raise InputError("positions: none is free, but at least one robot was wanted")
    cost, travel_time = momentary.at(time), None
    if question.speeds is not None:
        first = momentary(time, positions, speeds=question.speeds)
        travel_time = None if first is None else first.mean_time
    return Evaluation(cost, result, _path(momentary, question), travel_time)


def _path(momentary: MomentaryCost, question: Question) -> Array | None:
    """Return the path that a question asks for, None where its point is not free."""
    if question.point is None:
        return None
    positions = question.positions[momentary.counted(question.time, question.positions)]
    try:
        return momentary.at(question.time).path(positions, question.point)
    except RobocovError:
        return None
