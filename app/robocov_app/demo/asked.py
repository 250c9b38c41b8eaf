"""The robot that is asked: what the inspector says of it at the moment that is shown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocov_app.demo.inspector import Report, explain
from robocov_app.demo.lane import with_failed

if TYPE_CHECKING:
    from robocov_app.demo.desk import Desk


def report_on(desk: Desk, number: int) -> Report:
    """Return what the inspector says of a robot of the chosen pane."""
    session, lane = desk.session, desk.lane
    circumstances = session.circumstances(lane)
    if number in circumstances.failed:
        x, y = circumstances.failed[number]
        verdict = f"failed: it stands at ({x:.2f}, {y:.2f}) m, and the others see it as an obstacle"
        return Report(f"Robot {number}", verdict, ())
    return explain(
        session.snapshot(lane),
        circumstances.team,
        with_failed(circumstances),
        circumstances.numbers.index(number),
        names=circumstances.numbers,
        recent=session.recent(lane, number),
    )
